"""Methods that score individuals: how each describes windows, and learns what is normal.

A method computes the features of each window of an individual, and learns a scorer from normal
individuals. Scorers say how much each window adds to the score of an individual; the mean over its
windows is the score.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from turing_learning.analysis.statistics import signal_statistics

from ._features import motion_statistics

COVARIANCE_SHRINKAGE = 0.1
"""Added to each variance, as a share of their mean: covariances are estimated from few individuals."""
WITHIN_WEIGHT = 0.3
"""Weight of the covariance of windows of one individual in Fisher's discriminant, in units of that of individuals."""
PLANTED_WEIGHT = 0.1
"""Weight of the mean square along the directions of planted individuals, in units of the squared distance."""
SMALLEST_SPREAD = 1e-3
"""Least standard deviation that a feature is divided by: an output that hardly changes would count for too much."""
TRAINING_WINDOWS = 2000
"""Windows that a support vector machine learns from, at most; its time grows with their square."""
TINY = 1e-12
"""Keeps divisors from being 0."""

CLASSIFIERS = "judged alike"
"""Name of the method on classifiers' outputs; the others are judged by the same rules, see `_alike`."""
MOTION = "motion statistics"
BASELINES = ("window statistics", "one-class SVM")

Windows = Sequence[np.ndarray]
"""The windows (W, T, D) of each individual of a recording, in order of time."""


class Features(NamedTuple):
    """An individual as a method describes it."""

    windows: np.ndarray  # (W, F), features of each window
    # (F,), median over the individuals of its recording
    usual: np.ndarray | float = 0.0


class PlantedChange(NamedTuple):
    """How planting changed the mean features of a normal individual."""

    group: int  # with which it is left out, see `NormalIndividuals`
    kind: str
    change: np.ndarray  # (F,)


class Scorer(Protocol):
    """How unlike normal ones an individual is."""

    def __call__(self, individual: Features, without: str = "") -> np.ndarray:
        """Return what each window (W,) adds; what was learned from one planted kind is left out."""


Learner = Callable[[Sequence[Features], bool, Sequence[PlantedChange]], Scorer]
"""From normal individuals, whether each is relative, and planted changes, to a scorer."""


@dataclass(frozen=True, eq=False)
class DistanceScorer:
    """The Mahalanobis distance from normal individuals, larger along directions of planted ones."""

    center: np.ndarray | float  # (F,), in units of `spread` as all below
    spread: np.ndarray  # (F,)
    inverse_covariance: np.ndarray  # (F, F)
    kinds: np.ndarray  # (N,), of planted individuals
    directions: np.ndarray  # (F, N), in which each kind differs from normal ones

    def __call__(self, individual: Features, without: str = "") -> np.ndarray:
        """Return for each window (W,) a number; their mean is the distance."""
        weights = self.inverse_covariance
        directions = self.directions[:, self.kinds != without]
        if directions.size:
            weight = PLANTED_WEIGHT / directions.shape[1]
            weights = weights + weight * (directions @ directions.T)
        deviations = (individual.windows - individual.usual) / self.spread - self.center
        mean = deviations.mean(axis=0)
        # The squared distance is the mean over windows of their deviations along the gradient
        gradient = weights @ mean
        distance = max(float(np.sqrt(mean @ gradient)), TINY)
        return np.asarray(deviations @ gradient / distance)


def learn_distance(
    normal: Sequence[Features],
    relative: bool,
    planted: Sequence[PlantedChange] = (),
    independent: int = 0,
) -> DistanceScorer:
    """Learn how normal individuals deviate from what is usual.

    Parameters
    ----------
    normal
        Normal individuals with windows.
    relative
        Whether the median of the fellows is usual; otherwise the mean of all normal individuals is.
    planted
        For each kind, the direction in which it differs most (Fisher's linear discriminant) is
        learned.
    independent
        Covariances of so many features, the last ones, with the others are taken as 0.
    """
    every_window = np.concatenate([individual.windows for individual in normal])
    spread = np.maximum(every_window.std(axis=0), SMALLEST_SPREAD)
    relative_means = [individual.windows.mean(axis=0) - individual.usual for individual in normal]
    means = np.stack(relative_means) / spread
    center: np.ndarray | float = 0.0
    if not relative:
        center = means.mean(axis=0)
    deviations = means - center
    covariance = deviations.T @ deviations / max(len(deviations) - 1, 1)
    if independent:
        covariance[:-independent, -independent:] = 0.0
        covariance[-independent:, :-independent] = 0.0
    ridge = max(COVARIANCE_SHRINKAGE * float(np.trace(covariance)) / len(covariance), TINY)
    covariance = covariance + ridge * np.eye(len(covariance))
    inverse = np.linalg.inv(covariance)
    # The mean squared distance of normal individuals is 1.
    squared_distances = np.einsum("nf,fg,ng->n", deviations, inverse, deviations)
    inverse /= max(float(squared_distances.mean()), TINY)
    changes_by_kind: dict[str, list[np.ndarray]] = {}
    for individual in planted:
        changes_by_kind.setdefault(individual.kind, []).append(individual.change / spread)
    directions = np.empty((len(inverse), 0))
    if changes_by_kind:
        centered = [individual.windows - individual.windows.mean(axis=0) for individual in normal]
        windows = np.concatenate(centered) / spread
        within = windows.T @ windows
        weight = WITHIN_WEIGHT * np.trace(covariance) / max(float(np.trace(within)), TINY)
        changes = [np.mean(changes_of_kind, axis=0) for changes_of_kind in changes_by_kind.values()]
        directions = np.linalg.solve(covariance + weight * within, np.stack(changes, axis=1))
        # The mean square of normal individuals along each direction is 1, too.
        lengths = np.sqrt(((deviations @ directions) ** 2).mean(axis=0))
        directions /= np.maximum(lengths, TINY)
    return DistanceScorer(center, spread, inverse, np.array(list(changes_by_kind)), directions)


def learn_one_class(
    normal: Sequence[Features], relative: bool, planted: Sequence[PlantedChange] = ()
) -> Scorer:
    """Learn by a one-class support vector machine, as scikit-learn has it."""
    from sklearn.svm import OneClassSVM

    windows = np.concatenate([individual.windows for individual in normal])
    center = windows.mean(axis=0)
    spread = np.maximum(windows.std(axis=0), 1e-9)
    order = np.random.default_rng(len(windows)).permutation(len(windows))
    machine = OneClassSVM(nu=0.1, gamma="scale")
    machine.fit((windows[order[:TRAINING_WINDOWS]] - center) / spread)

    def score(individual: Features, without: str = "") -> np.ndarray:
        return np.asarray(-machine.decision_function((individual.windows - center) / spread))

    return score


@dataclass(frozen=True, eq=False)
class Method:
    """A description of windows by features, and a way to learn what is normal."""

    name: str
    # From windows (K, T, D) to features (K, F)
    describe: Callable[[np.ndarray], np.ndarray]
    learn: Learner = learn_distance
    # Signals that are described
    columns: slice = field(default_factory=lambda: slice(None))
    learns_from_planted: bool = False

    def features(self, windows: Windows) -> list[np.ndarray]:
        """Return the features (W, F) of the windows of each individual."""
        described = self.describe(np.concatenate(windows)[..., self.columns])
        return split_by_individual(described, windows)


def split_by_individual(values: np.ndarray, windows: Windows) -> list[np.ndarray]:
    """Cut values of all windows, one individual after the other, into those of each."""
    return np.split(values, np.cumsum(list(map(len, windows)))[:-1])


WINDOW_STATISTICS = Method(BASELINES[0], signal_statistics)
ONE_CLASS = Method(BASELINES[1], signal_statistics, learn_one_class)
MOTION_STATISTICS = Method(MOTION, motion_statistics, learns_from_planted=True)
