import math

import numpy as np
import pytest

from turing_learning.analysis import dynamic_outputs, response_error
from turing_learning.models import ElmanModel

MODEL = ElmanModel(hidden=1)
CONSTANT = [0.0, 0.0, 0.0, 0.0, 0.0, 2 * math.atanh(0.5), 2 * math.atanh(-0.25)]
"""Wheel speeds 0.5 and -0.25 whatever is seen."""
SWITCH = [40.0, 0.0, -20.0, 4.0, 0.0, -2.0, 0.0]
"""The left wheel follows the reading at once: tanh(-1) and tanh(1)."""


def test_steady_outputs_are_in_the_order_of_the_agents_parameters():
    np.testing.assert_allclose(MODEL.described(np.array(CONSTANT)), [0.5, -0.25, 0.5, -0.25])
    np.testing.assert_allclose(
        MODEL.described(np.array(SWITCH)), [math.tanh(-1), 0, math.tanh(1), 0], atol=1e-7
    )


def test_the_dynamic_response_sees_nothing_then_something_then_nothing():
    outputs = dynamic_outputs(MODEL, np.array([CONSTANT, SWITCH]))
    assert outputs.shape == (2, 30, 2)
    high = np.isclose(outputs[1, :, 0], math.tanh(1), atol=1e-7)
    assert np.flatnonzero(high).tolist() == list(range(10, 20))


def test_the_metric_sums_the_squared_differences_of_all_parameters_and_twenty_steps():
    truth = (0.5, 0.0, 0.0, -0.25)  # differences 0, 0.25, 0.5, 0 in each step
    assert response_error(MODEL, np.array(CONSTANT), truth) == pytest.approx(20 * (0.0625 + 0.25))


def test_the_metric_counts_the_steps_before_the_outputs_are_steady():
    slow = [0.0, 8.0, -2.0, 6.0, 0.0, -3.0, 0.0]  # the hidden neuron rises over some steps
    steady = MODEL.described(np.array(slow))
    assert response_error(MODEL, np.array(slow), steady) > 0.01
