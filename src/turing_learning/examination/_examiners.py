"""Examiners: what learns from labeled samples and scores others."""

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from scipy.linalg import eigh, solve
from scipy.spatial.distance import cdist
from threadpoolctl import threadpool_limits

PENALTIES = (0.01, 0.1, 1.0, 10.0)
"""Of ridge regression, in units of the mean variance of the samples along one direction."""

TREE_RANKS = 31
"""Ranks of a statistic that trees see: dividing its values anew for each tree would take most of the time."""

DECIMALS = 8
"""Of scores, whose scale is that of labels, from 0 to 1."""

TINY = 1e-9
"""Of a variance: what varies less is taken for constant."""


class Examiner(Protocol):
    """Tells genuine samples from others, after it has seen some of both."""

    @property
    def name(self) -> str:
        """What it is called in tables."""

    @property
    def sees(self) -> str:
        """What its samples are: "statistics", their "ranks", "convolutions" or "windows"."""

    def fit(self, samples: np.ndarray, labels: np.ndarray) -> None:
        """Learn from samples (K, ...) with labels (K,), True for genuine ones."""

    def score(self, samples: np.ndarray) -> np.ndarray:
        """Return scores (K,) of samples (K, ...); those above 0 are taken for genuine."""


@dataclass
class Trees:
    """Boosted trees, by scikit-learn."""

    name: str = "boosted trees on window statistics"
    sees: str = "ranks"
    rounds: int = 30  #: Trees; more gained nothing, see decision 0039
    _trees: Any = field(default=None, repr=False)

    def fit(self, samples: np.ndarray, labels: np.ndarray) -> None:
        """See `Examiner`."""
        from sklearn.ensemble import HistGradientBoostingClassifier

        self._trees = HistGradientBoostingClassifier(
            max_iter=self.rounds,
            learning_rate=0.2,
            max_leaf_nodes=8,
            max_bins=TREE_RANKS,
            min_samples_leaf=max(1, min(20, len(samples) // 10)),
            early_stopping=False,
            class_weight="balanced",
            random_state=0,
        )
        # trees of so few samples take longer with several threads, which wait for each other
        with threadpool_limits(1, user_api="openmp"):
            self._trees.fit(samples, labels)

    def score(self, samples: np.ndarray) -> np.ndarray:
        """See `Examiner`."""
        with threadpool_limits(1, user_api="openmp"):
            return np.asarray(self._trees.decision_function(samples))


@dataclass
class Ridge:
    """Ridge regression of the labels: a straight line between the kinds, by penalized least squares.

    It is a linear function of the labels. So one decomposition of the samples is enough for every labelling of theirs,
    and for every group that is left out: `cross_fitted` costs as much for hundreds of labellings as for a few.
    """

    name: str = "regression on window statistics"
    sees: str = "statistics"
    _seen: np.ndarray | None = field(default=None, repr=False)
    _weights: np.ndarray | None = field(default=None, repr=False)
    _middle: float = 0.0

    def fit(self, samples: np.ndarray, labels: np.ndarray) -> None:
        """See `Examiner`."""
        labels = np.asarray(labels, dtype=float)
        products = self._products(samples, samples)
        smoother = Smoother.of(products)
        chosen = smoother.cross_fitted(labels[:, None], np.arange(len(labels)))[1]
        kernel = _centered(products)
        penalty = PENALTIES[chosen[0]] * smoother.unit
        # the same regression in terms of products with the samples that were seen
        self._weights = solve(
            kernel + penalty * np.eye(len(kernel)), labels - labels.mean(), assume_a="pos"
        )
        self._weights -= self._weights.mean()
        self._seen = samples
        raw = products @ self._weights
        sides = raw[labels > 0.5].mean(), raw[labels < 0.5].mean()
        self._middle = float(sum(sides) / 2)

    def score(self, samples: np.ndarray) -> np.ndarray:
        """See `Examiner`."""
        assert self._seen is not None
        assert self._weights is not None
        return np.asarray(self._products(samples, self._seen) @ self._weights - self._middle)

    def cross_fitted(
        self, samples: np.ndarray, labels: np.ndarray, groups: np.ndarray
    ) -> np.ndarray:
        """Score each sample by what is learned without its group, for many labellings.

        Parameters
        ----------
        samples : (K, F)
            What the examiner sees.
        labels : (K, B)
            B labellings, 1 for genuine.
        groups : (K,)
            Numbers of the groups, from 0.

        Returns
        -------
        (K, B)
            Scores, for each labelling with the penalty whose scores of left-out groups differ most in units of their
            standard deviation. Only differences of scores have a meaning.
        """
        return Smoother.of(self._products(samples, samples)).cross_fitted(labels, groups)[0]

    def _products(self, samples: np.ndarray, references: np.ndarray) -> np.ndarray:
        """Return how alike samples are (K, L)."""
        return samples @ references.T


@dataclass
class Kernel(Ridge):
    """Ridge regression with a Gaussian kernel: a bent border between the kinds."""

    name: str = "kernel regression on window statistics"

    def _products(self, samples: np.ndarray, references: np.ndarray) -> np.ndarray:
        distances = cdist(samples, references, "sqeuclidean")
        # samples come standardized: the mean squared distance of two is twice the number of their features
        return np.asarray(np.exp(-distances / (2 * samples.shape[1])))


@dataclass(frozen=True, eq=False)
class Smoother:
    """The principal directions of samples, from which all ridge regressions on them follow."""

    vectors: np.ndarray  #: (K, K), in order of variance
    values: np.ndarray  #: (K,), variances in units of their mean
    unit: float  #: The mean variance

    @classmethod
    def of(cls, products: np.ndarray) -> "Smoother":
        """Decompose products (K, K) of samples."""
        centered = _centered(products)
        unit = max(float(np.trace(centered)) / len(centered), TINY)
        values, vectors = eigh(centered / unit)
        return cls(vectors, np.maximum(values, 0.0), unit)

    def cross_fitted(self, labels: np.ndarray, groups: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the scores of `Ridge.cross_fitted` (K, B), and which penalties they have (B,).

        The residuals of a left-out group are those of the whole regression, times the inverse of what is left of 1 by its
        part of the hat matrix. Source: Cook and Weisberg, Residuals and influence in regression (1982), section 2.2.
        """
        count = len(labels)
        total = labels.sum(axis=0)
        scores = np.empty_like(labels, dtype=float)
        separation = np.full(labels.shape[1], -np.inf)
        chosen = np.zeros(labels.shape[1], dtype=int)
        single = len(np.unique(groups)) == count
        members = []
        if not single:
            members = [np.flatnonzero(groups == group) for group in range(groups.max() + 1)]
        # One decomposition serves all penalties and all labellings
        for column, penalty in enumerate(PENALTIES):
            roots = self.vectors * np.sqrt(self.values / (self.values + penalty))
            residuals = labels - roots @ (roots.T @ labels) - total / count
            # A group of one sample needs no system of equations
            if single:
                leverage_left = 1 + TINY - (roots**2).sum(axis=1) - 1 / count
                predicted = (
                    labels - residuals / leverage_left[:, None] - (total - labels) / (count - 1)
                )
            else:
                predicted = np.empty_like(scores)
            for rows in members:
                leverage_left = (
                    (1 + TINY) * np.eye(len(rows)) - roots[rows] @ roots[rows].T - 1 / count
                )
                mean = (total - labels[rows].sum(axis=0)) / (count - len(rows))
                predicted[rows] = (
                    labels[rows] - solve(leverage_left, residuals[rows], assume_a="pos") - mean
                )
            # Each labelling chooses its own penalty, so that permuted ones choose as freely
            apart = _separation(predicted, labels)
            better = apart > separation
            separation[better] = apart[better]
            chosen[better] = column
            scores[:, better] = predicted[:, better]
        # of samples that are all the same, rounding alone would decide which score is higher
        return np.round(scores, DECIMALS), chosen


def _separation(scores: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Return the difference of the mean scores (K, B) of the two kinds in units of their standard deviation (B,)."""
    genuine, second = _moments(scores, labels), _moments(scores, 1 - labels)
    difference = genuine[0] - second[0]
    return np.asarray(difference / np.sqrt(np.maximum(genuine[1] + second[1], TINY**2)))


def _moments(scores: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    total = weights.sum(axis=0)
    mean = (weights * scores).sum(axis=0) / total
    return mean, (weights * (scores - mean) ** 2).sum(axis=0) / total


QUICK: tuple[Ridge, ...] = (
    Ridge(),
    Kernel(),
    Ridge("regression on random convolutions", "convolutions"),
)
"""Those that cost little, also under hundreds of permutations."""

PANEL: tuple[Examiner, ...] = (*QUICK, Trees())
"""Who judges in a test."""


def _centered(products: np.ndarray) -> np.ndarray:
    """Return products (K, K) of samples as those of samples whose mean is taken away."""
    centered = products - products.mean(axis=0)
    centered -= centered.mean(axis=1, keepdims=True)
    return centered
