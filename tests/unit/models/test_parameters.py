import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from turing_learning import Parameter


def test_the_initial_range_of_optimizers_is_that_of_the_parameter():
    values = Parameter(2, 10).to_units(np.array([-1.0, 0.0, 0.5, 1.0]))
    np.testing.assert_allclose(values, [2, 6, 8, 10])


def test_a_logarithmic_parameter_is_uniform_in_decades():
    values = Parameter(0.01, 100, scale="log").to_units(np.array([-1.0, -0.5, 0.0, 1.0]))
    np.testing.assert_allclose(values, [0.01, 0.1, 1, 100])


def test_beyond_a_bound_the_axis_is_folded_back():
    values = Parameter(0, 10).to_units(np.array([1.1, -1.1, 3.0, 5.2]))
    np.testing.assert_allclose(values, [9.5, 0.5, 0.0, 9.0])


@pytest.mark.parametrize(
    ("bounds", "numbers", "expected"),
    [
        ((0, None), [-1.0, 1.0, 9.0, -1.5], [0.0, 2.0, 10.0, 0.5]),
        ((None, 0), [1.0, -1.0, -9.0, 1.5], [0.0, -2.0, -10.0, -0.5]),
        ((None, None), [-1.0, 1.0, -70.0], [-1.0, 1.0, -70.0]),
    ],
)
def test_an_open_side_has_no_fold(bounds, numbers, expected):
    np.testing.assert_allclose(Parameter(*bounds).to_units(np.array(numbers)), expected)


@pytest.mark.parametrize(
    ("bounds", "expected"),
    [((None, None), (0.1, 10)), ((1, None), (1, 100)), ((None, 1), (0.01, 1))],
)
def test_an_open_logarithmic_range_is_two_decades_wide(bounds, expected):
    np.testing.assert_allclose(Parameter(*bounds, scale="log").initial, expected)


def test_the_first_models_may_be_drawn_from_a_part_of_the_range():
    values = Parameter(0, 100, initial=(10, 20)).to_units(np.array([-1.0, 1.0, -5.0]))
    np.testing.assert_allclose(values, [10, 20, 10])


@given(
    low=st.floats(-1e9, 1e9),
    width=st.floats(1e-3, 1e9),
    numbers=st.lists(st.floats(-1e12, 1e12), min_size=1),
)
def test_no_number_leaves_the_bounds(low, width, numbers):
    high = min(low + width, 1e9)
    if low < high:
        values = Parameter(low, high).to_units(np.array(numbers))
        assert ((values >= low) & (values <= high)).all()


@given(
    numbers=st.lists(st.floats(-1e12, 1e12), min_size=1),
    bounds=st.sampled_from([(None, None), (1e-9, None), (1, 2)]),
)
def test_a_logarithmic_parameter_is_finite_and_positive(numbers, bounds):
    values = Parameter(*bounds, scale="log").to_units(np.array(numbers))
    assert (np.isfinite(values) & (values > 0)).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((3, 2), "`low` must be below `high`; got 3.0 and 2.0."),
        ((0, 1, "cubic"), "`scale` must be \"linear\" or \"log\"; got 'cubic'."),
        ((0, 1, "log"), "`low` must be a number from 1e-09 to 1e+09 on a logarithmic scale, or None for an open side; got 0."),
        ((0, float("inf")), "`high` must be a number from -1e+09 to 1e+09, or None for an open side; got inf."),
        (("0", 1), "`low` must be a number from -1e+09 to 1e+09, or None for an open side; got '0'."),
        ((0, 1, "linear", "", (0.5, 2)), "`initial` must be two numbers from 0 to 1, the lower first; got (0.5, 2)."),
        ((0, 1, "linear", "", "ab"), "`initial` must be two numbers from 0 to 1, the lower first; got 'ab'."),
    ],
)  # fmt: skip
def test_what_breaks_a_rule_is_refused(arguments, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        Parameter(*arguments)


@pytest.mark.parametrize(
    "parameter", [Parameter(0, 20), Parameter(1e-3, 10, scale="log"), Parameter(None, None)]
)
def test_numbers_of_values_lead_back_to_the_values(parameter):
    numbers = np.array([-0.9, 0.0, 0.35])
    np.testing.assert_allclose(
        parameter.to_numbers(parameter.to_units(numbers)), numbers, atol=1e-12
    )
