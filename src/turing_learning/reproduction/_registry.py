"""All experiments, in the order of the paper."""

from turing_learning.config import ConfigurationError

from . import (
    _baseline,
    _behaviors,
    _black_box,
    _case_studies,
    _classifier_accuracy,
    _comparison,
    _laboratory,
    _morphology,
    _separated,
    _snapshots,
)
from ._experiment import Experiment

ALL = "all"

EXPERIMENTS: dict[str, Experiment] = {
    module.EXPERIMENT.id: module.EXPERIMENT
    for module in (
        _snapshots,
        _case_studies,
        _classifier_accuracy,
        _baseline,
        _comparison,
        _morphology,
        _black_box,
        _separated,
        _behaviors,
        _laboratory,
    )
}
"""Id -> experiment."""


def experiments_named(name: str) -> tuple[Experiment, ...]:
    """Return the experiment of that id, or all.

    Raises
    ------
    ConfigurationError
        If there is none.
    """
    if name == ALL:
        return tuple(EXPERIMENTS.values())
    if name not in EXPERIMENTS:
        raise ConfigurationError(f"`experiment` must be one of {', '.join([*EXPERIMENTS, ALL])}; got {name!r}.")
    return (EXPERIMENTS[name],)
