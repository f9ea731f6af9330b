"""Detections over false alarms."""

from dataclasses import dataclass

import numpy as np

from turing_learning.config import ConfigurationError


@dataclass(frozen=True, eq=False)
class RocCurve:
    """Receiver operating characteristic: what each threshold would give.

    Attributes
    ----------
    thresholds : (K,)
        Individuals with a score below it are called abnormal; ascending, the last one infinite.
    false_alarms : (K,)
        Share of genuine individuals that are called abnormal; from 0 to 1.
    detections : (K,)
        Share of abnormal individuals that are called abnormal; from 0 to 1.
    """

    thresholds: np.ndarray
    false_alarms: np.ndarray
    detections: np.ndarray

    @property
    def area(self) -> float:
        """Area under the curve: the probability that an abnormal individual scores below a genuine one, ties counted half."""
        return float(np.trapezoid(self.detections, self.false_alarms))


def roc_curve(genuine: np.ndarray, abnormal: np.ndarray) -> RocCurve:
    """Compute detections and false alarms at every threshold.

    Parameters
    ----------
    genuine, abnormal : (any,)
        Scores of genuine and of abnormal individuals; lower is more abnormal.

    Raises
    ------
    ConfigurationError
        If there are none of one kind, or a score is not finite.

    Source
    ------
    Fawcett, An introduction to ROC analysis (2006).
    """
    genuine, abnormal = _checked("genuine", genuine), _checked("abnormal", abnormal)
    thresholds = np.append(np.unique(np.concatenate((genuine, abnormal))), np.inf)
    return RocCurve(thresholds, _below(genuine, thresholds), _below(abnormal, thresholds))


def _checked(name: str, scores: np.ndarray) -> np.ndarray:
    scores = np.asarray(scores, dtype=np.float64)
    if scores.ndim != 1 or not scores.size or not np.isfinite(scores).all():
        raise ConfigurationError(f"`{name}` must be finite scores, at least one; got {scores.tolist()}.")
    return scores


def _below(scores: np.ndarray, thresholds: np.ndarray) -> np.ndarray:
    return np.searchsorted(np.sort(scores), thresholds, side="left") / len(scores)
