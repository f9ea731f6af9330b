import numpy as np
import pytest

from turing_learning.config import ConfigurationError
from turing_learning.detection import RULES, Detector, compare_detectors, compare_rules


def test_detections_and_false_alarms_are_shares_of_individuals(speed_limits, motion_at):
    options = {"genuine": motion_at([[5, 5]] * 400), "abnormal": motion_at([[0, 0]])}
    detector = Detector.calibrate(speed_limits, [[3.0]], rule="fittest", **options)
    (found,) = compare_detectors(
        {"mine": detector},
        genuine=motion_at([[5, 5], [6, 6], [1, 1], [7, 7]]),
        abnormal=motion_at([[0, 0], [5, 5], [0, 5], [1, 0]]),
    )
    assert (found.name, found.detections, found.false_alarms) == ("mine", 0.75, 0.25)
    assert found.curve.area == pytest.approx(
        np.mean([(g > a) + (g == a) / 2 for g in (1, 1, 0, 1) for a in (0, 1, 0.5, 0)])
    )


def test_all_rules_are_compared_in_the_scenario_of_a_run(run):
    found = compare_rules(run, samples=3, behaviors=10, threads=1)
    assert tuple(each.name for each in found) == RULES
    found = found[RULES.index("discriminant")]
    assert found.curve.detections[-1] == 1.0
    assert found.detections > found.false_alarms


def test_the_comparison_is_the_same_for_any_number_of_threads(run):
    one, two = (compare_rules(run, rules=["discriminant"], samples=2, behaviors=8, threads=n)[0] for n in (1, 2))
    np.testing.assert_array_equal(one.curve.thresholds, two.curve.thresholds)
    assert (one.detections, one.false_alarms) == (two.detections, two.false_alarms)


def test_an_unknown_rule_is_not_compared(run):
    with pytest.raises(ConfigurationError, match=r"^`rule` must be one of the rules; got 'all'"):
        compare_rules(run, rules=["fittest", "all"])
