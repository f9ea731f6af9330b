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


SCORES = st.lists(st.integers(0, 5), min_size=1, max_size=12)


@settings(max_examples=60, deadline=None)
@given(SCORES, SCORES)
def test_the_area_is_the_probability_that_one_scores_above_the_other_with_ties_counted_half(high, low):
    pairs = [(one > other) + (one == other) / 2 for one in high for other in low]
    assert area_under_curve(np.array(high), np.array(low)) == pytest.approx(np.mean(pairs))
