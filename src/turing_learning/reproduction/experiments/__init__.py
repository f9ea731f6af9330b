"""The experiments of the paper, in its order, each a module with an `EXPERIMENT`, and what several of them share."""

from .._experiment import Experiment
from . import (
    baseline,
    behaviors,
    black_box,
    case_studies,
    classifier_accuracy,
    comparison,
    interaction,
    laboratory,
    morphology,
    separated,
    snapshots,
)

_IN_ORDER = (
    snapshots, case_studies, classifier_accuracy, baseline, comparison, morphology, black_box, separated, behaviors, laboratory,
    interaction,
)  # fmt: skip
EXPERIMENTS: dict[str, Experiment] = {
    module.EXPERIMENT.id: module.EXPERIMENT for module in _IN_ORDER
}  # by their sections
