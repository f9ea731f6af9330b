"""Which model of the last generation is the best: observe all of them again, and let all its classifiers judge."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.analysis import absolute_error
from turing_learning.coevolution import Judgments, Samples, model_reward
from turing_learning.config import Configuration, classifier_of
from turing_learning.detection._simulated import keep_observed
from turing_learning.store import RunFolderError

from ._folder import CALIBRATION, RunFolder
from ._result import Result, named
from ._trials import read_trials

if TYPE_CHECKING:
    from turing_learning.robots import LaboratorySource

_LOGGER = logging.getLogger("turing_learning")
POST_EVALUATION = "post-evaluation-"
"""Begin of the names of the stages in which the last models are observed again; their number follows."""


@dataclass(frozen=True, eq=False)
class ModelEvaluation:
    """What the models of a run's last generation are worth when they are observed again.

    Attributes
    ----------
    repeats
        How often they are to be observed again.
    fitness : (observed, M)
        Of the M models, as in equation 1, each time that they have been observed again so far, at most `repeats` times.
    best_model
        Name -> parameter of the model of the highest mean fitness; None until all repeats are done.
    absolute_error
        Name -> its absolute error; None also where there is no truth.

    Source
    ------
    Paper, section 5.4.
    """

    repeats: int
    fitness: np.ndarray
    best_model: dict[str, float] | None
    absolute_error: dict[str, float] | None

    def __post_init__(self) -> None:
        if not isinstance(self.repeats, int) or self.fitness.ndim != 2:
            raise ValueError(
                f"`fitness` must be of shape (observed, M); got {self.fitness.shape}, {self.repeats!r} repeats."
            )

    @property
    def complete(self) -> bool:
        """Whether all repeats are done."""
        return len(self.fitness) == self.repeats


def read_post_evaluation(path: str | Path) -> ModelEvaluation | None:
    """Return what is known of a run's last models from observing them again; None if they have not been observed again yet."""
    file = RunFolder(path).post_evaluation_path
    if not file.exists():
        return None
    what, remedy = f"`run` must have a readable {file.name}; got {file}", "Restore the file, or remove it and resume."
    try:
        stored = dict(RunFolder(path).read(file.name))
        fitness = np.array(stored.pop("fitness"), dtype=np.float64)
        return ModelEvaluation(fitness=fitness, **stored)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise RunFolderError(f"{what}, which holds something else. {remedy}") from error


def post_evaluate(
    result: Result,
    folder: RunFolder,
    source: "LaboratorySource",
    repeats: int,
    should_stop: Callable[[], bool] | None = None,
) -> bool:
    """Observe the models of the last generation `repeats` times; write what they are worth, see `ModelEvaluation`.

    What is written already is not observed again, and what was observed more often is left out.

    Returns
    -------
    bool
        Whether anything has changed.

    Source
    ------
    Paper, section 5.4.
    """
    last = result.history.isel(generation=-1)
    models, classifiers = last["model"].to_numpy(), last["classifier"].to_numpy()
    stored = read_post_evaluation(folder.path)
    fitness = [] if stored is None else stored.fitness[:repeats].tolist()
    changed = stored is not None and stored.repeats != repeats
    if changed:
        _write(folder, _summary(result, models, fitness, repeats))
    while len(fitness) < repeats and not (should_stop is not None and should_stop()):
        samples = source.observe(models, f"{POST_EVALUATION}{len(fitness) + 1}")
        fitness.append(judged_again(folder.configuration(), classifiers, samples).tolist())
        _write(folder, _summary(result, models, fitness, repeats))
        changed = True
    return changed


def _write(folder: RunFolder, summary: dict[str, Any]) -> None:
    with folder.storage():
        folder.write(folder.post_evaluation_path.name, summary)


def judged_again(configuration: Configuration, classifiers: np.ndarray, samples: Samples) -> np.ndarray:
    """Return the fitness (M,) as in equation 1 that classifiers (N, Q) give the models of samples, one of each model."""
    classifier, genomes = classifier_of(configuration), np.asarray(classifiers, dtype=np.float64)
    judged = classifier.judge(genomes, samples.counterfeit[:, 0])[..., None]
    return model_reward(Judgments(classifier.judge(genomes, samples.genuine), judged))


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


def keep_observed_motion(result: Result, folder: RunFolder) -> None:
    """Write ``calibration.npz``, by which detectors are calibrated, once all last models have been observed again.

    Agents were learned from in the generations, and are held out in the post-evaluations.
    """
    again = read_post_evaluation(folder.path)
    if again is None or not again.complete:
        return
    try:
        learned, replicas, models = _motion(folder, [f"generation-{g:04d}" for g in range(result.generations)])
        held_out, _, _ = _motion(folder, [f"{POST_EVALUATION}{k + 1}" for k in range(again.repeats)])
    except RunFolderError as error:
        _LOGGER.warning("Nothing is kept to calibrate detectors with: %s", error)
        return
    estimate = np.array(list(result.estimate.values()))
    with folder.storage():
        kept = keep_observed(learned=learned, held_out=held_out, replicas=replicas, models=models, estimate=estimate)
        if kept is not None:
            folder.write(CALIBRATION, kept)
    if kept is None:
        _LOGGER.warning(
            "Nothing is kept to calibrate detectors with: too few samples, or all models are near the estimate."
        )


def _motion(folder: RunFolder, stages: Sequence[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return samples of agents (S, T, 2) and of replicas (M, T, 2), and their models (M, P), of all trials of some stages."""
    trials = [read_trials(folder.path, stage) for stage in stages]
    samples = [each.samples() for each in trials]
    return (
        np.concatenate([each.genuine for each in samples]),
        np.concatenate([each.counterfeit[:, 0] for each in samples]),
        np.concatenate([each.models.reshape(-1, each.models.shape[2]) for each in trials]),
    )
