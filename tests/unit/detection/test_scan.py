from statistics import NormalDist

import numpy as np
import pytest

from turing_learning.detection._chance import Scan

RNG = np.random.default_rng(0)
SCAN = Scan(np.clip(RNG.normal(0.7, 0.1, 2000), 0, 1))
THRESHOLD = SCAN.threshold(64, 0.01, 5000)
TIMES = np.stack((np.arange(64), np.arange(64) + 1), axis=1).astype(float)


def plain_evidence(genuine, score):
    below, equal = sum(genuine < score), sum(genuine == score)
    places = range(below, below + equal + 1)
    return np.mean([-NormalDist().inv_cdf((place + 0.5) / (len(genuine) + 1)) for place in places])


def plain_strength(genuine, scores):
    evidence = np.array([plain_evidence(genuine, score) for score in scores])
    windows = len(scores)
    spans = [n for n in (1, 2, 4, 8, 16, 32) if n < windows] + [windows]
    return max(
        evidence[k : k + n].mean() / np.sqrt(1 / n + 1 / len(genuine))
        for n in spans
        for k in range(windows - n + 1)
    )


@pytest.mark.parametrize("values", [3, 20, 10**6])
@pytest.mark.parametrize("windows", [1, 2, 3, 8, 21])
def test_strengths_are_those_of_the_plain_definition(windows, values):
    genuine, scores = (
        np.floor(RNG.uniform(size=shape) * values) / values for shape in (30, (4, windows))
    )
    np.testing.assert_allclose(
        Scan(genuine).strengths(scores), [plain_strength(genuine, row) for row in scores], atol=1e-8
    )


def test_only_the_order_of_scores_counts():
    genuine, scores = RNG.uniform(size=50), RNG.uniform(size=(4, 16))
    narrow = Scan(0.99 + genuine**3 / 100)
    np.testing.assert_array_equal(
        narrow.strengths(0.99 + scores**3 / 100), Scan(genuine).strengths(scores)
    )
    assert narrow.threshold(16, 0.01, 2000) == Scan(genuine).threshold(16, 0.01, 2000)


@pytest.mark.parametrize("known", [1, 7, 98])
def test_a_single_window_below_all_is_not_called_abnormal_if_that_happens_more_often_than_stated(
    known,
):
    scan = Scan(RNG.uniform(size=known))
    assert scan.strengths(np.array([-1.0])) <= scan.threshold(1, 0.5 / (known + 1), 20_000)


def test_a_single_window_below_all_is_called_abnormal_if_that_happens_less_often_than_stated():
    scan = Scan(RNG.uniform(size=199))
    assert scan.strengths(np.array([-1.0])) > scan.threshold(1, 0.01, 20_000)


def test_genuine_scores_that_are_all_equal_yield_a_threshold():
    scan = Scan(np.ones(100))
    assert scan.strengths(np.ones(64)) == 0
    once = np.where(np.arange(64) == 30, 0.9, 1.0)
    assert 0 < scan.strengths(once) < scan.threshold(64, 0.01, 5000)
    assert scan.strengths(np.full(64, 0.9)) > scan.threshold(64, 0.01, 5000)


def test_a_short_spell_is_found_in_a_long_recording():
    genuine = RNG.uniform(size=70)
    scores = RNG.uniform(size=2000)
    scores[900:930] /= 5
    scan = Scan(genuine)
    strength, threshold = scan.strengths(scores), scan.threshold(2000, 0.01, 2000)
    assert threshold < 6
    assert strength > threshold


@pytest.mark.parametrize("low", [[], [(20, 33)], [(5, 12), (40, 50)]])
def test_spells_are_found_one_by_one_where_they_are(low):
    scores = RNG.choice(SCAN.genuine_scores, 64)
    for begin, end in low:
        scores[begin:end] -= 0.5
    verdict = SCAN.verdict("Ada", TIMES, scores, THRESHOLD)
    assert verdict.abnormal == bool(low)
    np.testing.assert_allclose(
        np.reshape(verdict.spells, (-1, 2)), np.reshape(low, (-1, 2)), atol=1
    )
    assert verdict.flagged.sum() == sum(end - begin for begin, end in verdict.spells)
