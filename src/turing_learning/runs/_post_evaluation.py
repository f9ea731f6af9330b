"""Which model of the last generation is the best: observe all of them again, and let all its classifiers judge."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.analysis import absolute_error
from turing_learning.coevolution import Judgments, Samples, model_reward
from turing_learning.config import Configuration, classifier_of
from turing_learning.store import RunFolderError

from ._folder import RunFolder
from ._result import Result, named

if TYPE_CHECKING:
    from turing_learning.robots import LaboratorySource


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

    Raises
    ------
    ValueError
        If `repeats` or the shape of `fitness` is another.

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
    """Return what is known of a run's last models from observing them again; None if they have not been observed again yet.

    Raises
    ------
    RunFolderError
        If the file cannot be read.
    """
    file = RunFolder(Path(path)).post_evaluation_path
    if not file.exists():
        return None
    what, remedy = f"`run` must have a readable {file.name}; got {file}", "Restore the file, or remove it and resume."
    try:
        stored = dict(RunFolder(Path(path)).read(file.name))
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
