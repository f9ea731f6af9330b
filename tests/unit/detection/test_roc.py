import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from turing_learning.config import ConfigurationError
from turing_learning.detection import roc_curve

SCORES = st.lists(st.integers(0, 5), min_size=1, max_size=12)


def test_a_curve_of_scores_that_are_apart_reaches_the_corner():
    curve = roc_curve(np.array([0.8, 0.9]), np.array([0.1, 0.2, 0.3]))
    assert curve.area == 1.0
    assert curve.detections[curve.false_alarms == 0].max() == 1.0


def test_the_curve_of_equal_scores_is_the_diagonal():
    curve = roc_curve(np.full(4, 0.5), np.full(3, 0.5))
    assert curve.false_alarms.tolist() == curve.detections.tolist() == [0.0, 1.0]
    assert curve.area == 0.5


def test_a_worked_example():
    curve = roc_curve(np.array([0.4, 0.8]), np.array([0.2, 0.6]))
    assert curve.thresholds.tolist() == [0.2, 0.4, 0.6, 0.8, np.inf]
    assert curve.false_alarms.tolist() == [0.0, 0.0, 0.5, 0.5, 1.0]
    assert curve.detections.tolist() == [0.0, 0.5, 0.5, 1.0, 1.0]
    assert curve.area == 0.75


@settings(max_examples=60, deadline=None)
@given(SCORES, SCORES)
def test_the_area_is_the_probability_that_an_abnormal_individual_scores_lower(genuine, abnormal):
    pairs = [(g > a) + (g == a) / 2 for g in genuine for a in abnormal]
    assert roc_curve(np.array(genuine), np.array(abnormal)).area == pytest.approx(np.mean(pairs))


@pytest.mark.parametrize(
    ("genuine", "abnormal", "name"),
    [([], [1.0], "genuine"), ([1.0], [np.nan], "abnormal"), ([[1.0]], [1.0], "genuine")],
)
def test_what_are_no_scores_is_refused(genuine, abnormal, name):
    with pytest.raises(ConfigurationError, match=rf"^`{name}` must be "):
        roc_curve(np.array(genuine), np.array(abnormal))
