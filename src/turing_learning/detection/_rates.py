"""How well a detector does on motion that had no part in it: detections over false alarms."""

from dataclasses import dataclass

import numpy as np

from turing_learning.arrays import array
from turing_learning.config import ConfigurationError


@dataclass(frozen=True, eq=False)
class RocCurve:
    """Receiver operating characteristic: what each threshold would give.

    Attributes
    ----------
    thresholds : (K,)
        Individuals with a score below it are called abnormal; ascending, the last one infinite.
    false_alarms, detections : (K,)
        Share of genuine, and of abnormal, individuals that are called abnormal; from 0 to 1.
    """

    thresholds: np.ndarray
    false_alarms: np.ndarray
    detections: np.ndarray

    @property
    def area(self) -> float:
        """Area under the curve: the probability that an abnormal individual scores below a genuine one, ties counted half."""
        return float(np.trapezoid(self.detections, self.false_alarms))


def roc_curve(genuine: np.ndarray, abnormal: np.ndarray) -> RocCurve:
    """Compute detections and false alarms at every threshold, from scores (any,); lower is more abnormal.

    Source: Fawcett, An introduction to ROC analysis (2006).
    """
    genuine = array("genuine", genuine, "n", error=ConfigurationError)
    abnormal = array("abnormal", abnormal, "n", error=ConfigurationError)
    thresholds = np.append(np.unique(np.concatenate((genuine, abnormal))), np.inf)
    shares = [np.searchsorted(np.sort(scores), thresholds) / len(scores) for scores in (genuine, abnormal)]
    return RocCurve(thresholds, *shares)
