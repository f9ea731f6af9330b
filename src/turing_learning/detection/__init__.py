"""Classifiers as a product: how good they are over all behaviors, and which individuals of a swarm behave abnormally.

Post-evaluation, as in section 4.4 of the paper:

`grid_models`
    Models on a grid over the parameter space, 11^4 of them in the paper.
`post_evaluate`, `count_agents`, `PostEvaluation`
    Decision accuracy of any number of classifiers over many models; the same in parts.
`accuracy_over_generations`, `sampled_generations`, `GenerationAccuracies`
    Accuracy of the subjectively and of the objectively best classifier over the generations of a run.

Detection:

`Detector`, `Verdict`, `RULES`
    Classifiers with votes, which tell from motion which individuals behave abnormally.
`Motion`, `load_motion`, `holds_motion`, `cut_recordings`
    Motion samples of named individuals, from a file or from long recordings.
`RecordedMotion`, `recorded_motion`, `TimedVerdict`
    Windows of recorded motion as a run wants them, and what a detector says of them over time.
`keep_calibration`, `keep_observed`
    What a run on a custom system, or in a laboratory, keeps to calibrate detectors with.
`simulate_behaviors`, `random_controllers`, `plant_abnormal`
    Genuine and abnormal motion of a scenario (`SimulatedBehaviors`), to calibrate, to compare, and to show.
`run_classifiers`, `RunClassifiers`, `StoredRun`
    What a run has learned to see: the classifiers of its last generation, and the best of all its generations.
`compare_detectors`, `compare_rules`, `RuleComparison`
    Detection and false-alarm rates of several rules on held-out motion.
`roc_curve`, `RocCurve`
    Detections over false alarms at every threshold, and the area under the curve.

Motion has the shape (individuals, samples, T, D) throughout; a sample is what a classifier judges at once, T steps.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._compare import RuleComparison, compare_detectors, compare_rules
    from ._detector import RULES, Detector
    from ._generations import GenerationAccuracies, accuracy_over_generations, sampled_generations
    from ._kept import keep_observed
    from ._motion import Motion, cut_recordings, holds_motion, load_motion
    from ._own import keep_calibration
    from ._post_evaluation import PostEvaluation, count_agents, grid_models, post_evaluate
    from ._recorded import RecordedMotion, recorded_motion
    from ._roc import RocCurve, roc_curve
    from ._run import RunClassifiers, StoredRun, run_classifiers
    from ._scan import TimedVerdict
    from ._simulated import SimulatedBehaviors, plant_abnormal, random_controllers, simulate_behaviors
    from ._verdict import Verdict

__all__ = [
    "RULES",
    "Detector",
    "GenerationAccuracies",
    "Motion",
    "PostEvaluation",
    "RecordedMotion",
    "RocCurve",
    "RuleComparison",
    "RunClassifiers",
    "SimulatedBehaviors",
    "StoredRun",
    "TimedVerdict",
    "Verdict",
    "accuracy_over_generations",
    "compare_detectors",
    "compare_rules",
    "count_agents",
    "cut_recordings",
    "grid_models",
    "holds_motion",
    "keep_calibration",
    "keep_observed",
    "load_motion",
    "plant_abnormal",
    "post_evaluate",
    "random_controllers",
    "recorded_motion",
    "roc_curve",
    "run_classifiers",
    "sampled_generations",
    "simulate_behaviors",
]

_HOMES = {
    "_compare": ("RuleComparison", "compare_detectors", "compare_rules"),
    "_detector": ("RULES", "Detector"),
    "_generations": ("GenerationAccuracies", "accuracy_over_generations", "sampled_generations"),
    "_motion": ("Motion", "cut_recordings", "holds_motion", "load_motion"),
    "_post_evaluation": ("PostEvaluation", "count_agents", "grid_models", "post_evaluate"),
    "_kept": ("keep_observed",),
    "_own": ("keep_calibration",),
    "_recorded": ("RecordedMotion", "recorded_motion"),
    "_roc": ("RocCurve", "roc_curve"),
    "_run": ("RunClassifiers", "StoredRun", "run_classifiers"),
    "_scan": ("TimedVerdict",),
    "_simulated": ("SimulatedBehaviors", "plant_abnormal", "random_controllers", "simulate_behaviors"),
    "_verdict": ("Verdict",),
}
_LAZY = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import what needs the compiled kernels on first use."""
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_LAZY[name]}", __name__), name)


def __dir__() -> list[str]:
    """Names that come on first use, too."""
    return sorted({*globals(), *__all__})
