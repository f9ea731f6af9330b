"""Rates of detection on recordings, over synthetic detectors; docs/decisions/0022 has more."""

import numpy as np
import pytest

from turing_learning.detection._alike import judge_alike
from turing_learning.detection._chance import Scan, p_values
from turing_learning.detection._methods import WINDOW_STATISTICS

DETECTORS, INDIVIDUALS = 500, 8
DRAWS = 10_000


def spread(rng, shape):
    return rng.beta(16, 4, shape)


def close_with_outliers(rng, shape):
    """Scores that lie close together, one of a hundred far below."""
    return np.where(rng.random(shape) < 0.01, 0.3, rng.normal(0.8, 0.01, shape))


def one_or_zero(rng, shape):
    return (rng.random(shape) > 0.12).astype(float)


def called_abnormal(known, windows, share, scores, lower=None):
    """Return the share (detectors,) of individuals that are called abnormal; `lower` makes the second half of their windows so."""
    rng = np.random.default_rng((known, windows))
    found, thresholds = [], {}
    for _ in range(DETECTORS):
        scan = Scan(scores(rng, known))
        equal = tuple(
            np.unique(scan.genuine_scores, return_counts=True)[1]
        )  # all that a threshold depends on
        if equal not in thresholds:
            thresholds[equal] = scan.threshold(windows, share, DRAWS)
        drawn = scores(rng, (INDIVIDUALS, windows))
        if lower is not None:
            drawn[:, windows // 2 :] -= lower
        found.append(np.mean(scan.strengths(drawn) > thresholds[equal]))
    return np.array(found)


@pytest.mark.parametrize("share", [0.01, 0.05])
@pytest.mark.parametrize(("known", "windows"), [(20, 10), (70, 10), (70, 74), (20, 300), (300, 74)])
def test_the_rate_of_false_alarms_is_the_stated_one(known, windows, share):
    found = called_abnormal(known, windows, share, spread)
    # individuals share their detector; 10,000 draws add the rest
    error = np.hypot(found.std() / np.sqrt(DETECTORS), np.sqrt(share / DRAWS))
    assert found.mean() == pytest.approx(share, abs=3.5 * error)
    assert error < 0.4 * share + 0.002


@pytest.mark.parametrize("share", [0.01, 0.05])
@pytest.mark.parametrize(("known", "windows"), [(70, 1), (300, 1), (70, 4), (70, 74)])
@pytest.mark.parametrize("scores", [close_with_outliers, one_or_zero])
def test_awkward_scores_raise_no_false_alarms(known, windows, share, scores):
    found = called_abnormal(known, windows, share, scores)
    assert found.mean() <= share + 3.5 * np.hypot(
        found.std() / np.sqrt(DETECTORS), np.sqrt(share / DRAWS)
    )


def test_an_outlier_among_the_genuine_scores_does_not_cost_the_power():
    # with means and standard deviations: 0 at a rate of 0, or a quarter of the normal ones called abnormal
    assert called_abnormal(70, 74, 0.01, close_with_outliers, lower=0.01).mean() > 0.6


def p_values_of_genuine(scores, known, samples):
    """Return p-values (detectors, individuals): of more individuals before fewer detectors, each of which costs time."""
    rng = np.random.default_rng((known, samples))
    shape = (2 * INDIVIDUALS, samples)
    return np.array(
        [p_values(scores(rng, known), scores(rng, shape)) for _ in range(DETECTORS // 4)]
    )


@pytest.mark.parametrize(("known", "samples"), [(100, 1), (20, 10), (50, 10), (20, 50)])
@pytest.mark.parametrize("scores", [spread, close_with_outliers, one_or_zero])
def test_no_more_genuine_individuals_have_a_small_p_value_than_stated(known, samples, scores):
    of_genuine = p_values_of_genuine(scores, known, samples)
    for share in (0.01, 0.05):
        found = (of_genuine <= share).mean(axis=1)
        assert found.mean() <= share + 3.5 * np.hypot(
            found.std() / np.sqrt(len(found)), np.sqrt(share / DRAWS)
        )


def test_an_individual_that_is_lower_throughout_has_a_small_p_value():
    rng = np.random.default_rng(4)
    found = [
        np.mean(p_values(rng.beta(16, 4, 50), rng.beta(16, 4, (INDIVIDUALS, 10)) - 0.1) <= 0.01)
        for _ in range(200)
    ]
    assert np.mean(found) > 0.7


@pytest.mark.parametrize("share", [0.05, 0.2])
def test_judged_alike_keeps_its_rate_where_individuals_differ_lastingly(share):
    rng, called = np.random.default_rng(31), []

    def group():
        return list(0.3 * rng.standard_normal((6, 1, 1, 2)) + rng.standard_normal((6, 10, 5, 2)))

    for _ in range(12):
        normal = [group() for _ in range(12)]
        for _ in range(3):
            found = judge_alike(
                [WINDOW_STATISTICS], group(), normal, names="abcdef", false_alarms=share
            )
            called.append([each.abnormal for each in found.individuals])
    # 216 individuals by 12 calibrations with 72 normal ones each: a standard error of sqrt(s (1 - s) (1 / 216 + 1 / 864)),
    # 0.017 and 0.030; three of them
    assert abs(np.mean(called) - share) < 3 * np.sqrt(share * (1 - share) * (1 / 216 + 1 / 864))
