"""All experiments, in the order of the paper."""

from turing_learning.config import ConfigurationError

from ._experiment import Experiment
from .experiments import (
    baseline,
    behaviors,
    black_box,
    case_studies,
    classifier_accuracy,
    comparison,
    laboratory,
    morphology,
    separated,
    snapshots,
)

ALL = "all"

EXPERIMENTS: dict[str, Experiment] = {
    module.EXPERIMENT.id: module.EXPERIMENT
    for module in (
        snapshots,
        case_studies,
        classifier_accuracy,
        baseline,
        comparison,
        morphology,
        black_box,
        separated,
        behaviors,
        laboratory,
    )
}
"""The experiments by their ids, those of the paper's sections."""


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
