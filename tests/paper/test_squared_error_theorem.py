"""Theorem 1 of the paper, section 4.5, its corollaries, and the numbers that follow from it."""

import numpy as np
import pytest

from turing_learning.reproduction._methods import (
    check_statements,
    expected_squared_error,
    least_squares_optimum,
)
from turing_learning.swarm import AGGREGATION


def test_the_weighted_mean_of_the_left_wheel_is_the_printed_one():
    left = AGGREGATION.controller[0::2]
    np.testing.assert_allclose(least_squares_optimum([[0.912, 0.088]], left), [-0.5504, -0.5504])


def test_the_right_wheel_is_inferred_because_its_speed_is_the_same_in_both_states():
    right = AGGREGATION.controller[1::2]
    np.testing.assert_allclose(least_squares_optimum([[0.912, 0.088]], right), [-1.0, -1.0])


def test_theorem_1_the_expected_error_has_four_cases():
    (x1, x2), (y1, y2), p = (0.3, -0.2), (1.0, -0.5), 0.7
    error = (
        p**2 * (x1 - y1) ** 2
        + p * (1 - p) * (x1 - y2) ** 2
        + (1 - p) * p * (x2 - y1) ** 2
        + (1 - p) ** 2 * (x2 - y2) ** 2
    )
    assert expected_squared_error((x1, x2), [[p, 1 - p]], (y1, y2)) == pytest.approx(error)


def test_theorem_1_the_optimum_is_a_minimum_in_every_direction():
    chances, outputs = [[0.7, 0.3]], [1.0, -0.5]
    optimum = least_squares_optimum(chances, outputs)
    least = expected_squared_error(optimum, chances, outputs)
    for step in np.random.default_rng(0).normal(size=(50, 2)):
        assert expected_squared_error(optimum + step, chances, outputs) > least


def test_corollary_3_two_time_steps_as_printed():
    p1, p2, y1, y2 = 0.2, 0.6, 1.0, -0.5
    x1 = (p1**2 + p2**2) / (p1 + p2) * y1 + (p1 * (1 - p1) + p2 * (1 - p2)) / (p1 + p2) * y2
    assert least_squares_optimum([[p1, 1 - p1], [p2, 1 - p2]], [y1, y2])[0] == pytest.approx(x1)


def test_the_theorem_and_its_corollaries_hold_in_random_cases():
    checks = check_statements(20, seed=3)
    assert len(checks) == 3
    assert all(check.holds for check in checks)
