"""How well rules of detection do on motion that had no part in them."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from ._detector import RULES, Detector, check_rules
from ._roc import RocCurve, roc_curve
from ._run import StoredRun, calibration_motion, run_classifiers
from ._simulated import COMPARISON, random_controllers, simulate_behaviors, stream


@dataclass(frozen=True, eq=False)
class RuleComparison:
    """How well a detector does.

    Attributes
    ----------
    name
        Of the detector.
    detections, false_alarms
        Share of the abnormal, and of the genuine individuals, that it calls abnormal.
    curve
        What other thresholds would give.
    """

    name: str
    detections: float
    false_alarms: float
    curve: RocCurve


def compare_detectors(
    detectors: Mapping[str, Detector], *, genuine: np.ndarray, abnormal: np.ndarray
) -> tuple[RuleComparison, ...]:
    """Let detectors decide about individuals.

    Parameters
    ----------
    detectors
        Name -> detector.
    genuine, abnormal : (individuals, samples, T, D)
        Motion that had no part in the detectors.

    Raises
    ------
    ConfigurationError
        If a shape does not fit a detector.
    """
    return tuple(_compared(name, detector, genuine, abnormal) for name, detector in detectors.items())


def _compared(name: str, detector: Detector, genuine: np.ndarray, abnormal: np.ndarray) -> RuleComparison:
    scores = [detector.mean_scores(motion) for motion in (genuine, abnormal)]
    false_alarms, detections = (float(np.mean(detector.called_abnormal(motion))) for motion in (genuine, abnormal))
    return RuleComparison(name, detections, false_alarms, roc_curve(*scores))


def compare_rules(
    result: StoredRun,
    *,
    rules: Iterable[str] = RULES,
    false_alarms: float = 0.01,
    samples: int = 10,
    behaviors: int = 200,
    seed: int = 0,
    threads: int | None = None,
) -> tuple[RuleComparison, ...]:
    """Compare rules of detection in the scenario of a run, on abnormal behaviors that none of them has seen.

    Detectors are calibrated as in `Detector.from_run`, on 100 random controllers; others are simulated for the comparison.

    Parameters
    ----------
    result
        A run that is stored in a folder with its full history.
    rules
        Some of `RULES`.
    false_alarms
        Share of genuine individuals that may be called abnormal, in (0, 1).
    samples
        Number of samples of each individual, >= 1.
    behaviors
        Number of abnormal behaviors, >= 1.
    seed
        Of what is simulated, >= 0.
    threads
        Number of threads of the simulation; None takes every processor.

    Raises
    ------
    ConfigurationError
        If something does not fit.
    """
    rules = check_rules(rules)
    run = run_classifiers(result)
    scenario = run.simulated_scenario()
    genuine, abnormal = calibration_motion(run, None, None, behaviors=100, trials=10, seed=seed, threads=threads)
    detectors = {
        rule: Detector.calibrate(
            run.classifier, run.voters(rule), genuine=genuine, abnormal=abnormal, rule=rule, false_alarms=false_alarms
        )
        for rule in rules
    }
    rng = stream(seed, COMPARISON)
    controllers = random_controllers(scenario, behaviors, rng)
    held_out = simulate_behaviors(scenario, controllers, trials=samples, rng=rng, threads=threads)
    return compare_detectors(detectors, genuine=held_out.genuine, abnormal=held_out.abnormal)
