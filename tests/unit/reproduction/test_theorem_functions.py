import numpy as np
import pytest

from turing_learning.reproduction._methods import (
    StatementCheck,
    check_statements,
    expected_squared_error,
    least_squares_optimum,
)


def test_the_expected_error_is_that_of_many_drawn_pairs():
    rng = np.random.default_rng(0)
    chances, outputs, model = (
        np.array([0.2, 0.5, 0.3]),
        np.array([1.0, -1.0, 0.5]),
        np.array([0.3, 0.1, -0.4]),
    )
    inputs = rng.choice(3, size=(2, 200_000), p=chances)
    squares = np.square(model[inputs[0]] - outputs[inputs[1]])
    # the standard error of the mean of 200,000 squares is about 0.0025; four of them
    assert expected_squared_error(model, [chances], outputs) == pytest.approx(
        squares.mean(), abs=4 * 0.0025
    )


def test_a_state_that_never_occurs_gets_the_mean():
    np.testing.assert_allclose(least_squares_optimum([[1.0, 0.0]], [0.4, 9.0]), [0.4, 0.4])


@pytest.mark.parametrize("chances", [[[0.5, 0.6]], [[1.5, -0.5]]])
def test_what_is_no_probability_is_refused(chances):
    with pytest.raises(
        ValueError, match="`probabilities` must be 0 or more and sum to 1 in every time step; got"
    ):
        least_squares_optimum(chances, [0.0, 1.0])


def test_values_of_another_number_of_states_are_refused():
    with pytest.raises(ValueError, match=r"`values` must be of shape \(n,\) = \(2,\); got \(3,\)"):
        expected_squared_error([0.0, 0.0], [[0.5, 0.5]], [0.0, 1.0, 2.0])


def test_no_cases_are_refused():
    with pytest.raises(ValueError, match="`cases` must be an integer of at least 1; got 0"):
        check_statements(0)


@pytest.mark.parametrize(
    ("difference", "distance", "holds"), [(1e-9, 0.1, True), (1e-3, 0.1, False), (1e-9, 0.0, False)]
)
def test_a_statement_holds_if_the_minimum_is_where_it_says_and_not_at_the_agent(
    difference, distance, holds
):
    assert StatementCheck("", 1, difference, distance).holds is holds
