"""The experiments of the paper, in its order, and what several of them share."""

from .._experiment import Experiment
from . import case_studies, classifiers, generality, laboratory, other_methods

_IN_ORDER = (
    case_studies.SNAPSHOTS,
    case_studies.CASE_STUDIES,
    classifiers.ACCURACY,
    other_methods.BASELINE,
    other_methods.COMPARISON,
    generality.MORPHOLOGY,
    generality.BLACK_BOX,
    generality.SEPARATED,
    generality.BEHAVIORS,
    laboratory.LABORATORY_RUNS,
    classifiers.INTERACTION,
)
EXPERIMENTS: dict[str, Experiment] = {one.id: one for one in _IN_ORDER}
"""Experiments by their sections."""
