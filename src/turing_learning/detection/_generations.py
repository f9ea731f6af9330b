"""Decision accuracy over the generations of a run."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from turing_learning.coevolution import Classifier
from turing_learning.config import ConfigurationError, require_at_least
from turing_learning.swarm import Scenario

from ._post_evaluation import grid_models, post_evaluate


@dataclass(frozen=True, eq=False)
class GenerationAccuracies:
    """Decision accuracies of the classifiers of some generations.

    Attributes
    ----------
    generations : (G,)
        Numbers of the generations, from 0.
    accuracy : (G, N)
        Of every classifier.
    subjective : (G,)
        Of the classifier with the highest subjective fitness in its generation, the first of equals.
    """

    generations: np.ndarray
    accuracy: np.ndarray
    subjective: np.ndarray

    @property
    def objective(self) -> np.ndarray:
        """Highest accuracy of a single classifier in each generation (G,)."""
        return self.accuracy.max(axis=1)


def sampled_generations(generations: int, points: int = 16) -> np.ndarray:
    """Return generations that show a run on a nonlinear scale: the first, the last, and about even ratios between.

    Parameters
    ----------
    generations
        Number of generations of the run, >= 1.
    points
        Number of generations, >= 2; fewer where they would coincide.

    Returns
    -------
    (about points,)
        Ascending, from 0 to `generations` - 1.

    Raises
    ------
    ConfigurationError
        If a number breaks its rule.
    """
    require_at_least(1, generations=generations)
    require_at_least(2, points=points)
    if generations == 1:
        return np.zeros(1, dtype=np.int64)
    between = np.geomspace(1, generations - 1, points - 1)
    return np.unique(np.concatenate(([0], np.rint(between)))).astype(np.int64)


def accuracy_over_generations(
    classifier: Classifier,
    populations: Any,
    fitness: Any,
    scenario: Scenario,
    *,
    models: np.ndarray | None = None,
    generations: Sequence[int] | np.ndarray | None = None,
    trials: int = 10,
    seed: int = 0,
    threads: int | None = None,
) -> GenerationAccuracies:
    """Post-evaluate the classifiers of some generations of a run, all in the same trials.

    Parameters
    ----------
    classifier
        Judges.
    populations : (G, N, Q)
        All classifiers of all generations: ``result.history["classifier"]`` of a run with a full history.
    fitness : (G, N)
        Their subjective fitness: ``result.history["classifier_fitness"]``.
    models : (M, P)
        What replicas execute; None takes `grid_models`, 11 settings of each parameter.
    generations
        Which generations; None takes `sampled_generations`.
    trials, seed, threads
        As in `post_evaluate`.

    Raises
    ------
    ConfigurationError
        If a shape or number does not fit.

    Source
    ------
    Paper, section 4.4, figure 7.
    """
    total = len(populations)
    chosen = sampled_generations(total) if generations is None else np.asarray(generations, dtype=np.int64)
    if chosen.ndim != 1 or not chosen.size or not ((chosen >= 0) & (chosen < total)).all():
        raise ConfigurationError(f"`generations` must be numbers from 0 to {total - 1}; got {chosen.tolist()}.")
    genomes = np.stack([np.asarray(populations[int(g)]) for g in chosen])
    scores = np.stack([np.asarray(fitness[int(g)]) for g in chosen])
    if scores.shape != genomes.shape[:2]:
        raise ConfigurationError(
            f"`fitness` must have the shape (G, N), as populations; got {scores.shape} and {genomes.shape}."
        )
    models = grid_models(scenario) if models is None else models
    evaluation = post_evaluate(
        classifier, genomes.reshape(-1, genomes.shape[2]), scenario, models, trials=trials, seed=seed, threads=threads
    )
    accuracy = evaluation.accuracy.reshape(scores.shape)
    return GenerationAccuracies(chosen, accuracy, accuracy[np.arange(len(chosen)), scores.argmax(axis=1)])
