"""The metric-based baseline: one population of models, scored by their squared error against the agents."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from turing_learning.coevolution import Samples
from turing_learning.evolution import EvolutionStrategy, Seed, generation_rng
from turing_learning.purposes import LEAST_SQUARES_MODELS, LEAST_SQUARES_TRIALS
from turing_learning.swarm import MixedSwarm, Scenario

LATE = 0.3
"""Share of the generations, the last ones, that `Inferred.typical` is about."""


@dataclass(frozen=True, eq=False)
class Inferred:
    """What least squares has inferred.

    Attributes
    ----------
    best : (P,)
        The model of the last generation with the smallest error: the paper's rule. A model has one trial in a generation.
    typical : (P,)
        The median, over the last three tenths of the generations, of the median of all models.
    """

    best: np.ndarray
    typical: np.ndarray


@dataclass(frozen=True)
class LeastSquares:
    """Infer a scenario's controller by least squares, with the optimizer and the trials of Turing Learning.

    Speeds are divided by the robot's largest, as the classifiers' inputs are: then both wheels count the same. In cm/s and
    rad/s, the difference of the wheels would have a seventh of the weight of their sum.

    Parameters
    ----------
    scenario
        What is observed.
    generations
        Number of generations G, >= 1.
    parents, offspring
        Sizes of the evolution strategy.
    threads
        Number of threads; None takes every processor. It does not change the result.

    Source
    ------
    Paper, section 4.5.
    """

    scenario: Scenario
    generations: int = 1000
    parents: int = 50
    offspring: int = 50
    threads: int | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if self.generations < 1:
            raise ValueError(f"`generations` must be at least 1; got {self.generations}.")

    def infer(self, seed: Seed = 1, should_stop: Callable[[], bool] | None = None) -> Inferred | None:
        """Return the model of the last generation with the smallest error, and the typical model.

        Parameters
        ----------
        seed
            Seed of the evolution and of the trials.
        should_stop
            Asked before every generation.

        Returns
        -------
        Inferred or None
            None if it was stopped.
        """
        source = MixedSwarm(self.scenario, self.threads)
        optimizer = self._optimizer(seed)
        models, errors = np.empty((0, 0)), np.empty(0)
        medians = np.empty((self.generations, len(self.scenario.parameter_names)))
        for generation in range(self.generations):
            if should_stop is not None and should_stop():
                return None
            models = optimizer.ask()
            rng = generation_rng((LEAST_SQUARES_TRIALS, *_numbers(seed)), generation)
            errors = squared_errors(source.collect(models, rng), self.scenario.input_scale)
            optimizer.tell(-errors)
            medians[generation] = np.median(models, axis=0)
        late = medians[-max(1, round(LATE * self.generations)) :]
        return Inferred(models[int(np.argmin(errors))], np.median(late, axis=0))

    def _optimizer(self, seed: Seed) -> EvolutionStrategy:
        return EvolutionStrategy(
            len(self.scenario.parameter_names),
            parents=self.parents,
            offspring=self.offspring,
            seed=(LEAST_SQUARES_MODELS, *_numbers(seed)),
        )


def _numbers(seed: Seed) -> tuple[int, ...]:
    return tuple(seed) if isinstance(seed, Sequence) else (seed,)


def squared_errors(samples: Samples, scale: Sequence[float] | np.ndarray = (1.0,)) -> np.ndarray:
    """Compute the squared error of each model against the agents of its own trial.

    Parameters
    ----------
    samples
        Of a mixed swarm: genuine (n_a M, T, D), all models' first agents, then all second ones, and so on;
        counterfeit (M, C, T, D), averaged over C.
    scale : (D,) or (1,)
        What the signals are divided by, > 0.

    Returns
    -------
    (M,)
        Summed over agents, time steps and signals.

    Raises
    ------
    ValueError
        If there is not the same number of genuine samples for each model, or the scale does not fit.

    Source
    ------
    Paper, section 4.5, its metric-based method.
    """
    genuine, counterfeit = samples.genuine, samples.counterfeit
    models = len(counterfeit)
    if len(genuine) % models:
        raise ValueError(
            f"`samples` must hold as many genuine samples for each of the {models} models; got {len(genuine)} in all."
        )
    agents = genuine.reshape(-1, models, *genuine.shape[1:])
    differences = (agents[:, :, None] - counterfeit) / _checked_scale(scale, genuine.shape[-1])
    return np.square(differences).sum(axis=(0, 3, 4)).mean(axis=1)


def _checked_scale(scale: Sequence[float] | np.ndarray, signals: int) -> np.ndarray:
    array = np.asarray(scale, dtype=np.float64)
    if array.shape not in ((1,), (signals,)) or not (np.isfinite(array) & (array > 0)).all():
        raise ValueError(f"`scale` must be {signals} finite numbers above 0, or one; got {array.tolist()}.")
    return array
