"""The motion statistics of the detector as an estimator of scikit-learn."""

from typing import Any, Self

import numpy as np
from sklearn.base import BaseEstimator, OutlierMixin
from sklearn.utils.validation import check_array, check_is_fitted

from turing_learning.errors import number

from ._features import motion_statistics
from ._methods import Features, Scorer, learn_distance

SHORTEST_SERIES = 4
"""Steps to which shorter series are lengthened by their last value: their rhythm needs some."""
LIMIT_FOLDS = 5
"""Parts of the samples, each of which is scored by the others to set the limit."""
LARGEST_VALUE = 1e100
"""Values are cut there, whose squares are still numbers."""


class MotionOutlierDetector(OutlierMixin, BaseEstimator):  # type: ignore[misc] # scikit-learn has no types
    """Say which samples of motion are unlike the others, as `detect` does by motion statistics, without a run.

    It obeys the conventions of scikit-learn: `fit_predict`, pipelines and searches work. A sample is a series of T
    steps of D signals, such as those of a window or of an individual.

    Parameters
    ----------
    false_alarms
        Share of normal samples that may be called outliers, above 0 and at most 0.5. It is set by samples that were
        not learned from: each fifth is scored by the other four.

    Attributes
    ----------
    offset_
        Score below which a sample is an outlier.
    n_features_in_
        Time steps T of a sample.

    Examples
    --------
    >>> import numpy as np
    >>> normal = np.random.default_rng(1).normal(size=(200, 100, 2))
    >>> MotionOutlierDetector().fit(normal).predict(np.stack([normal[0], 5 * normal[1]]))
    array([ 1, -1])
    """

    def __init__(self, false_alarms: float = 0.05) -> None:
        self.false_alarms = false_alarms

    def fit(self, X: Any, y: Any = None) -> Self:
        """Learn from samples (n, T, D), or (n, T) of one signal, most of them normal; `y` is not used."""
        number("false_alarms", self.false_alarms, above=0, most=0.5)
        samples = self._checked(X, least_samples=2)
        self.n_features_in_ = samples.shape[1]
        self.signals_ = samples.shape[2]
        features = _features(samples)
        self._scorer = _learned(features)
        folds = min(LIMIT_FOLDS, len(features))
        fold = np.arange(len(features)) % folds
        apart = np.empty(len(features))
        for number_of_fold in range(folds):
            held_out = fold == number_of_fold
            apart[held_out] = _scores(_learned(features[~held_out]), features[held_out])
        self.offset_ = float(np.percentile(apart, 100 * self.false_alarms))
        return self

    def score_samples(self, X: Any) -> np.ndarray:
        """Return scores (n,) of samples (n, T, D): the lower, the more unlike those learned from."""
        check_is_fitted(self)
        samples = self._checked(X)
        if samples.shape[1] != self.n_features_in_ or samples.shape[2] != self.signals_:
            raise ValueError(
                f"X has {samples.shape[1]} features, but {type(self).__name__} is expecting {self.n_features_in_} "
                f"features as input; signals: {samples.shape[2]} and {self.signals_}"
            )
        return _scores(self._scorer, _features(samples))

    def decision_function(self, X: Any) -> np.ndarray:
        """Return scores (n,) of samples (n, T, D), below 0 for outliers."""
        return self.score_samples(X) - self.offset_

    def predict(self, X: Any) -> np.ndarray:
        """Return 1 for samples (n, T, D) that belong, -1 for outliers."""
        return np.where(self.decision_function(X) < 0, -1, 1)

    def _checked(self, X: Any, least_samples: int = 1) -> np.ndarray:
        checked = check_array(
            X, allow_nd=True, dtype=np.float64, ensure_min_samples=least_samples, estimator=self
        )
        if checked.ndim > 3:
            raise ValueError(
                f"Found array with dim {checked.ndim}, while dim 3 or 2 is required: (n, T, D) or (n, T)"
            )
        if checked.ndim == 2:
            return checked[..., None]
        return checked


def _learned(features: np.ndarray) -> Scorer:
    """Learn how normal samples differ, from their features (n, F)."""
    return learn_distance([Features(row[None]) for row in features], False)


def _scores(scorer: Scorer, features: np.ndarray) -> np.ndarray:
    """Return scores (n,) of samples by their features (n, F): the lower, the more unlike."""
    return -np.array([float(scorer(Features(row[None]))[0]) for row in features])


def _features(samples: np.ndarray) -> np.ndarray:
    """Return motion statistics (n, F) of samples (n, T, D)."""
    lacking = max(0, SHORTEST_SERIES - samples.shape[1])
    longer = np.pad(samples, ((0, 0), (0, lacking), (0, 0)), mode="edge")
    return motion_statistics(np.clip(longer, -LARGEST_VALUE, LARGEST_VALUE))
