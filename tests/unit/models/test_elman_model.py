import math

import numpy as np
import pytest

from turing_learning.models import ElmanModel, Jumps

TRUTH = (-0.7, -1.0, 1.0, -1.0)


def plain(weights, readings, hidden):
    """Return the outputs (T, 2), written plainly."""
    rest = iter(weights)
    w = [next(rest) for _ in range(hidden)]
    u = [[next(rest) for _ in range(hidden)] for _ in range(hidden)]
    b = [next(rest) for _ in range(hidden)]
    v = [[next(rest) for _ in range(hidden)] for _ in range(2)]
    c = [next(rest) for _ in range(2)]
    assert not list(rest)

    def sigmoid(z):
        return 1 / (1 + math.exp(-z))

    h, outputs = [0.0] * hidden, []
    for reading in readings:
        h = [
            sigmoid(w[j] * reading + b[j] + sum(u[j][k] * h[k] for k in range(hidden)))
            for j in range(hidden)
        ]
        outputs.append(
            [2 * sigmoid(sum(v[s][j] * h[j] for j in range(hidden)) + c[s]) - 1 for s in range(2)]
        )
    return np.array(outputs)


@pytest.mark.parametrize(("hidden", "weights"), [(1, 7), (3, 23), (5, 47)])
def test_the_numbers_of_weights_are_the_papers(hidden, weights):
    names = ElmanModel(hidden=hidden).parameter_names
    assert len(names) == len(set(names)) == weights


@pytest.mark.parametrize("hidden", [1, 3, 5])
def test_the_outputs_are_those_of_a_plain_network(hidden):
    rng = np.random.default_rng(hidden)
    model = ElmanModel(states=3, hidden=hidden)
    networks = rng.normal(0, 2, (4, 5, len(model.parameter_names)))
    readings = rng.integers(0, 3, 12)
    outputs = model.respond(networks, readings)
    assert outputs.shape == (4, 5, 12, 2)
    np.testing.assert_allclose(
        outputs[3, 2], plain(networks[3, 2], readings, hidden), rtol=0, atol=1e-13
    )


def test_the_steady_outputs_are_those_of_the_twentieth_step_of_each_reading():
    model = ElmanModel(states=3, hidden=3)
    weights = np.random.default_rng(4).normal(0, 2, len(model.parameter_names))
    expected = np.concatenate([plain(weights, [state] * 20, 3)[-1] for state in range(3)])
    np.testing.assert_allclose(model.described(weights), expected, rtol=0, atol=1e-13)


def test_one_hidden_neuron_can_do_what_the_aggregating_agents_do():
    # h is 0 or 1 with I; the left wheel goes from c to v + c, the right one stays
    weights = np.array(
        [40.0, 0.0, -20.0, 12 - 2 * math.atanh(-0.7), 0.0, 2 * math.atanh(-0.7), -12.0]
    )
    np.testing.assert_allclose(ElmanModel(hidden=1).described(weights), TRUTH, atol=2e-5)


def test_outputs_of_huge_weights_stay_within_the_largest_speeds():
    weights = np.random.default_rng(0).normal(0, 1e12, (50, 47))
    described = ElmanModel(hidden=5).described(weights)
    assert np.abs(described).max() <= 1


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (
            np.zeros((2, 6)),
            r"`models` must be of shape .* \(..., 7\); got \(2, 6\). 1 hidden neurons have 7 weights",
        ),
        (np.full(7, np.inf), "`models` must be finite; got inf"),
    ],
)
def test_networks_that_do_not_fit_are_refused(weights, message):
    with pytest.raises(ValueError, match=message):
        ElmanModel(hidden=1).described(weights)


def test_a_network_without_hidden_neurons_is_refused():
    with pytest.raises(ValueError, match="`hidden` must be an integer of at least 1; got 0"):
        ElmanModel(hidden=0)


def test_replicas_of_networks_are_driven_by_them():
    networks = np.ones((4, 23))
    model = ElmanModel(hidden=3)
    assert model.to_units(networks) is networks
    behavior = model.behavior(networks)
    assert behavior.weights is networks
    assert behavior.hidden == 3
    np.testing.assert_array_equal(behavior.wheel_speeds, np.ones((4, 4)))
    assert behavior.field_of_view is None


def test_no_weights_belong_to_a_sensor_state():
    assert ElmanModel(hidden=3).jumps == Jumps()
