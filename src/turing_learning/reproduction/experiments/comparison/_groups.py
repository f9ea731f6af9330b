"""What likelihood-free methods are given: the motion of groups of individuals, told in a few numbers."""

import warnings
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType

import numpy as np

from turing_learning.swarm import MixedSwarm, Scenario

LARGEST = 1.5
"""Wheel speeds of models lie between minus this and this: behind the largest of the agents, so that no truth is on the border."""
LEVELS = 20
"""Parts into which the cycles are cut, in the order of their turn rates."""
LAGS = (1, 10)
"""Lags of the autocorrelations (cycles)."""


@dataclass(frozen=True)
class Inferred:
    """What a method has inferred.

    Attributes
    ----------
    estimate : (P,)
        The parameters.
    low, high : (P,)
        Ends of the central 90 %; None where the method has no interval.
    """

    estimate: np.ndarray
    low: np.ndarray | None = None
    high: np.ndarray | None = None

    @classmethod
    def of_posterior(cls, draws: np.ndarray, weights: np.ndarray | None = None) -> "Inferred":
        """Return median and central 90 % of draws (N, P) from a posterior, with weights (N,)."""
        weights = np.ones(len(draws)) if weights is None else weights
        low, middle, high = np.quantile(draws, (0.05, 0.5, 0.95), axis=0, weights=weights, method="inverted_cdf")
        return cls(middle, low, high)


@dataclass(frozen=True)
class Groups:
    """Groups of trials of a mixed swarm; in the trials of a group, every replica executes the same model.

    Parameters
    ----------
    scenario
        What is observed.
    size
        Trials in a group, >= 1.
    """

    scenario: Scenario
    size: int = 10

    def __post_init__(self) -> None:
        if self.size < 1:
            raise ValueError(f"`size` must be at least 1; got {self.size}.")

    def draw(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return models (M, P) from the prior: uniform, between -1.5 and 1.5 of the largest wheel speed."""
        return rng.uniform(-LARGEST, LARGEST, (count, len(self.scenario.controller)))

    def observe(self, trials: int, rng: np.random.Generator) -> np.ndarray:
        """Return the motion of the agents (K, T, 2) in trials whose replicas execute models from the prior."""
        return self._swarm.collect(self.draw(trials, rng), rng).genuine

    def simulate(self, models: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the summaries (M, S) of a group of replicas of each model (M, P)."""
        motion = self._swarm.collect(np.repeat(models, self.size, axis=0), rng).counterfeit
        return summaries(motion.reshape(len(models), -1, *motion.shape[-2:]), self.scenario)

    @property
    def _swarm(self) -> MixedSwarm:
        return MixedSwarm(self.scenario, threads=1)


def wheel_speeds(motion: np.ndarray, scenario: Scenario) -> np.ndarray:
    """Compute wheel speeds from the motion of robots that nothing pushes.

    Parameters
    ----------
    motion : (..., 2)
        Linear speed (cm/s), measured along the chord of a cycle; angular speed (rad/s).
    scenario
        Whose robots.

    Returns
    -------
    (..., 2)
        Left and right, as fractions of the maximum.
    """
    linear, angular = motion[..., 0], motion[..., 1]
    chord_over_arc = np.sinc(angular * scenario.trial.control_interval_s / (2 * np.pi))
    forward = linear / np.where(np.abs(chord_over_arc) < 1e-3, 1.0, chord_over_arc)
    difference = angular * scenario.robot.wheel_distance_cm / 2
    return np.stack([forward - difference, forward + difference], axis=-1) / scenario.robot.maximum_speed_cm_s


def summaries(motion: np.ndarray, scenario: Scenario) -> np.ndarray:
    """Compute the summaries of groups of individuals.

    Of both wheels: mean, standard deviation, autocorrelations; their covariance; and their means in each twentieth of the
    group's cycles, in the order of the turn rate, which tells the sensor states of reactive behaviors apart.

    Parameters
    ----------
    motion : (..., C, T, 2)
        Linear and angular speed of C individuals; C T must be a multiple of 20, T > 10.
    scenario
        Whose robots.

    Returns
    -------
    (..., S)
    """
    wheels = wheel_speeds(motion, scenario)
    cycles = wheels.reshape(*wheels.shape[:-3], -1, 2)
    mean, variance = cycles.mean(axis=-2), cycles.var(axis=-2) + 1e-9
    centered = wheels - mean[..., None, None, :]
    correlations = [(centered[..., lag:, :] * centered[..., :-lag, :]).mean(axis=(-3, -2)) / variance for lag in LAGS]
    covariance = centered.prod(axis=-1).mean(axis=(-2, -1))
    order = np.argsort(cycles[..., 1] - cycles[..., 0], axis=-1)
    sorted_cycles = np.take_along_axis(cycles, order[..., None], axis=-2)
    levels = sorted_cycles.reshape(*cycles.shape[:-2], LEVELS, -1, 2).mean(axis=-2)
    flat = levels.reshape(*levels.shape[:-2], -1)
    return np.concatenate([mean, np.sqrt(variance), *correlations, covariance[..., None], flat], axis=-1)


def baseline(name: str) -> ModuleType:
    """Return a package of the extra `baselines`.

    Raises
    ------
    ImportError
        If it is not installed.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return import_module(name)
    except ImportError as error:
        package = name.partition(".")[0]
        raise ImportError(
            f"{package} must be installed for the comparison. Run: pip install 'turing-learning[baselines]'"
        ) from error
