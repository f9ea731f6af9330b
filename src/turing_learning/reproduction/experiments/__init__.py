"""The experiments of the paper, in its order."""

from typing import Any

from turing_learning.config import merged

from .._experiment import Experiment
from .._verdicts import prose
from . import case_studies, classifiers, generality, laboratory, other_methods, sensors

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
    "sensors": sensors.conduct,
}


def _described(id: str) -> tuple[dict[str, Any], list[str]]:
    """Return what experiments.toml says of an experiment, and its deviations with the default preset."""
    about = dict(prose()["experiments"][id])
    beyond = about.pop("default_deviations", [])
    about |= {"id": id, "conduct": _IN_ORDER[id], "fast": merged(about["full"], about["fast"])}
    return about, beyond


def _with_defaults(id: str) -> Experiment:
    about, beyond = _described(id)
    about["deviations"] = beyond + about["deviations"]
    return Experiment(**about)


def _as_printed(id: str, changes: dict[str, Any]) -> Experiment:
    about, _ = _described(id)
    common = prose()["as_printed"]
    about["deviations"] = common["deviations"] + about["deviations"]
    about["full"] = merged(about["full"], common["sizes"] | changes)
    about["fast"] = merged(about["fast"], common["sizes"])
    return Experiment(as_printed=True, **about)


EXPERIMENTS = {id: _with_defaults(id) for id in _IN_ORDER}
"""Experiments by their sections."""

EXPERIMENTS_AS_PRINTED = {
    id: _as_printed(id, changes) for id, changes in prose()["as_printed"]["experiments"].items()
}
"""Those with the paper's algorithm as it is, in the paper's world."""
