"""Which model of the last generation is the best: observe all of them again, and let all its classifiers judge."""

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.analysis import absolute_error
from turing_learning.coevolution import Judgments, Samples, model_reward
from turing_learning.config import Configuration, classifier_of

from .folder._files import write_json
from .folder._folder import RunFolder
from .results._result import Result, named

if TYPE_CHECKING:
    from turing_learning.robots import LaboratorySource


def post_evaluate(
    result: Result,
    folder: RunFolder,
    source: "LaboratorySource",
    repeats: int,
    should_stop: Callable[[], bool] | None = None,
) -> dict[str, Any]:
    """Observe the models of the last generation `repeats` times; write and return what they are worth.

    What is written already is not observed again.

    Returns
    -------
    dict
        What `post_evaluation.json` holds: "repeats" asked for, "fitness" (repeats, M) as in equation 1, and when all are
        done "best_model", by name, that of the highest mean fitness, and its "absolute_error".

    Source
    ------
    Paper, section 5.4.
    """
    last = result.history.isel(generation=-1)
    models, classifiers = last["model"].to_numpy(), last["classifier"].to_numpy()
    fitness = _stored_fitness(folder)
    while len(fitness) < repeats and not (should_stop is not None and should_stop()):
        samples = source.observe(models, f"post-evaluation-{len(fitness) + 1}")
        fitness.append(judged_again(folder.configuration(), classifiers, samples).tolist())
        with folder.storage():
            write_json(folder.post_evaluation_path, _summary(result, models, fitness, repeats))
    return _summary(result, models, fitness, repeats)


def judged_again(configuration: Configuration, classifiers: np.ndarray, samples: Samples) -> np.ndarray:
    """Return the fitness (M,) as in equation 1 that classifiers (N, Q) give the models of samples, one of each model."""
    classifier, genomes = classifier_of(configuration), np.asarray(classifiers, dtype=np.float64)
    judged = classifier.judge(genomes, samples.counterfeit[:, 0])[..., None]
    return model_reward(Judgments(classifier.judge(genomes, samples.genuine), judged))


def _stored_fitness(folder: RunFolder) -> list[list[float]]:
    if not folder.post_evaluation_path.exists():
        return []
    stored: list[list[float]] = json.loads(folder.post_evaluation_path.read_text(encoding="utf-8"))["fitness"]
    return stored


def _summary(result: Result, models: np.ndarray, fitness: list[list[float]], repeats: int) -> dict[str, Any]:
    summary: dict[str, Any] = {"repeats": repeats, "fitness": fitness}
    if len(fitness) < repeats:
        return summary | {"best_model": None, "absolute_error": None}
    best = models[int(np.argmax(np.mean(fitness, axis=0)))]
    names, truth = tuple(result.best_model), result.truth
    errors = None if truth is None else absolute_error(best, np.array([truth[name] for name in names]))
    return summary | {
        "best_model": named(names, best),
        "absolute_error": None if errors is None else named(names, errors),
    }
