import numpy as np
import pytest

from turing_learning.detection._scan import Scan

RNG = np.random.default_rng(0)
SCAN = Scan(np.clip(RNG.normal(0.7, 0.1, 20_000), 0, 1))
TIMES = np.stack((np.arange(64), np.arange(64) + 1), axis=1).astype(float)


def plain_strength(scores):
    mean, spread = SCAN.genuine_scores.mean(), SCAN.genuine_scores.std()
    windows = len(scores)
    spans = [n for n in (1, 2, 4, 8, 16, 32) if n < windows] + [windows]
    return max((mean - scores[k : k + n].mean()) / spread * np.sqrt(n) for n in spans for k in range(windows - n + 1))


@pytest.mark.parametrize("windows", [1, 2, 3, 8, 21])
def test_strengths_are_those_of_the_plain_definition(windows):
    scores = RNG.uniform(size=(4, windows))
    np.testing.assert_allclose(SCAN.strengths(scores), [plain_strength(row) for row in scores])


@pytest.mark.parametrize("share", [0.01, 0.1])
def test_genuine_individuals_are_called_abnormal_as_often_as_stated(share):
    threshold = SCAN.threshold(64, share, 20_000)
    drawn = np.random.default_rng(9).choice(SCAN.genuine_scores, (4000, 64))
    # the standard deviation of the share is at most 0.005
    assert np.mean(SCAN.strengths(drawn) > threshold) == pytest.approx(share, abs=0.02 * np.sqrt(10 * share))


def test_a_spell_is_found_where_it_is():
    scores = RNG.choice(SCAN.genuine_scores, 64)
    scores[20:33] -= 0.3
    verdict = SCAN.verdict("Ada", TIMES, scores, SCAN.threshold(64, 0.01, 5000))
    assert verdict.abnormal
    assert len(verdict.spells) == 1
    begin, end = verdict.spells[0]
    assert (begin, end) == pytest.approx((20, 33), abs=1)
    assert verdict.flagged.sum() == end - begin


def test_two_spells_are_found_one_by_one():
    scores = RNG.choice(SCAN.genuine_scores, 64)
    scores[5:12] -= 0.5
    scores[40:50] -= 0.5
    verdict = SCAN.verdict("Ada", TIMES, scores, SCAN.threshold(64, 0.01, 5000))
    assert [round(begin) for begin, _ in verdict.spells] == pytest.approx([5, 40], abs=1)


def test_a_normal_individual_has_no_spells():
    verdict = SCAN.verdict("Bo", TIMES, np.full(64, 0.7), 4.0)
    assert not verdict.abnormal
    assert verdict.spells == ()
    assert not verdict.flagged.any()
