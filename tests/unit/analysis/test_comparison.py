import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from turing_learning.analysis import area_under_curve, compare

LOW, HIGH = np.arange(5.0), np.arange(10.0, 15.0)


def test_the_p_value_is_that_of_the_exact_two_sided_test():
    # of the 252 orders of 5 and 5 values, 2 are as extreme as full separation
    assert compare(LOW, [HIGH]).p_values == pytest.approx([2 / 252])


def test_the_level_is_divided_by_the_number_of_tests():
    alone, among_many = compare(LOW, [HIGH]), compare(LOW, [HIGH] + [LOW + 0.1] * 6)
    assert alone.significant.tolist() == [True]
    assert among_many.significant.tolist() == [False] * 7  # 2 / 252 is above 0.05 / 7
    assert among_many.without_difference == 7


def test_equal_samples_do_not_differ():
    assert compare(np.ones(4), [np.ones(4)]).without_difference == 1


def test_samples_may_differ_in_length():
    assert compare(LOW, [HIGH, HIGH[:3]]).p_values.shape == (2,)


@pytest.mark.parametrize(
    "low", [["0.1", "0.2", "0.3"], [None, 1.0, 2.0], [0.1, np.nan, 0.3], [[0.1, 0.2, 0.3]]]
)
def test_what_are_no_scores_are_not_taken_for_some(low):
    with pytest.raises(ValueError, match=r"^`(low|high)` must be "):
        area_under_curve([0.1, 0.2], low)
    with pytest.raises(ValueError, match=r"^`(low|high)` must be "):
        area_under_curve(low, [0.1, 0.2])


def test_scores_may_be_lists_and_series():
    pandas = pytest.importorskip("pandas")
    high, low, weights = [0.3, 0.9, 0.2], [0.5, 0.1, 0.4], [1.0, 3.0, 2.0]
    expected = area_under_curve(np.array(high), np.array(low), np.array(weights))
    assert area_under_curve(high, low, weights) == expected
    shuffled = {"index": [2, 0, 1]}  # a series counts by its places, not by its labels
    series = (pandas.Series(values, **shuffled) for values in (high, low, weights))
    assert area_under_curve(*series) == expected


SCORES = st.lists(st.integers(0, 5), min_size=1, max_size=12)


@settings(max_examples=60, deadline=None)
@given(SCORES, SCORES)
def test_the_area_is_the_probability_that_one_scores_above_the_other_with_ties_counted_half(
    high, low
):
    pairs = [(one > other) + (one == other) / 2 for one in high for other in low]
    assert area_under_curve(np.array(high), np.array(low)) == pytest.approx(np.mean(pairs))
