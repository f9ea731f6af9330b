"""How well rules of detection do on motion that had no part in them: detections over false alarms."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from turing_learning.arrays import array
from turing_learning.config import ConfigurationError

from ._run import StoredRun, calibration_motion, run_classifiers
from ._simulated import COMPARISON, random_controllers, simulate_behaviors, stream
from ._votes import RULES, Detector, check_rule


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
    """Let detectors decide about individuals in motion (individuals, samples, T, D) that had no part in them."""
    found = []
    for name, detector in detectors.items():
        scores = [detector.mean_scores(motion) for motion in (genuine, abnormal)]
        false_alarms, detections = (float(np.mean(detector.called_abnormal(motion))) for motion in (genuine, abnormal))
        found.append(RuleComparison(name, detections, false_alarms, roc_curve(*scores)))
    return tuple(found)


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
    result, rules, false_alarms, seed, threads
        As for `Detector.from_run`; the rules are some of `RULES`.
    samples, behaviors
        Number of samples of each individual, and of abnormal behaviors, >= 1.
    """
    rules = tuple(rules)
    for rule in rules:
        check_rule(rule)
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
