"""The experiments of the paper, in its order."""

from turing_learning.config import merged

from .._experiment import Experiment
from .._verdicts import prose
from . import case_studies, classifiers, generality, laboratory, other_methods

_IN_ORDER = {
    "3.2": case_studies.conduct_snapshots,
    "4.3": case_studies.conduct_case_studies,
    "4.4": classifiers.conduct_accuracy,
    "4.5": other_methods.conduct_baseline,
    "4.5+": other_methods.conduct_comparison,
    "4.6.1": generality.conduct_morphology,
    "4.6.2": generality.conduct_black_box,
    "4.6.3": generality.conduct_separated,
    "4.6.4": generality.conduct_behaviors,
    "5": laboratory.conduct,
    "interaction": classifiers.conduct_interaction,
}


EXPERIMENTS: dict[str, Experiment] = {
    id: Experiment(
        id=id, conduct=_IN_ORDER[id], **about | {"fast": merged(about["full"], about["fast"])}
    )
    for id, about in ((id, prose()["experiments"][id]) for id in _IN_ORDER)
}
"""Experiments by their sections."""
