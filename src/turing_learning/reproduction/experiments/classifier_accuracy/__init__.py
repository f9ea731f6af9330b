"""Section 4.4: the classifiers over the whole space of behaviors."""

from ._conduct import EXPERIMENT
from ._verdicts import BestAccuracies, accuracy_verdicts

__all__ = ["EXPERIMENT", "BestAccuracies", "accuracy_verdicts"]
