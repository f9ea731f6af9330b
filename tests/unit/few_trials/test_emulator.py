"""How sure the emulator is of mean judgments between its points, and of its length scales."""

import numpy as np
from scipy.optimize import approx_fprime

from turing_learning.few_trials import _emulator
from turing_learning.few_trials._emulator import conditioned, learned_kernel

POINTS = 250
OUTPUTS = 3


def _bent(points, rng):
    """Return outputs (N, 3) at points (N, P): long waves, and shorter ones less high than noise."""
    outputs = np.zeros((len(points), OUTPUTS))
    for frequency, height in ((1, 8.0), (5, 0.7)):
        directions = rng.standard_normal((points.shape[1], OUTPUTS))
        phases = rng.uniform(0, 2 * np.pi, OUTPUTS)
        outputs += height * np.sin(frequency * (points @ directions) / 2 + phases)
    return outputs


def test_it_is_as_sure_as_it_is_right_of_outputs_with_bends_of_several_lengths():
    squares = []
    variances = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        points = rng.uniform(-1, 1, (POINTS + 200, 3))
        truth = _bent(points, rng)
        outputs = truth[:POINTS] + rng.standard_normal((POINTS, OUTPUTS))
        logs = learned_kernel(points[:POINTS], outputs)
        mean, variance = conditioned(points[:POINTS], outputs, logs).predict(points[POINTS:])
        squares.append(((mean - truth[POINTS:]) ** 2).mean())
        variances.append(variance.mean())
    ratio = np.mean(squares) / np.mean(variances)
    # 1.2; with bends of one length 2.4
    assert 0.5 < ratio < 1.6


def test_an_output_that_does_not_move_among_the_points_may_move_beyond_them():
    rng = np.random.default_rng(1)
    points = rng.uniform(-0.3, 0.3, (POINTS, 2))
    outputs = np.c_[5 * points[:, 0], np.zeros(POINTS)] + rng.standard_normal((POINTS, 2))
    logs = learned_kernel(points, outputs)
    variance = conditioned(points, outputs, logs).predict(np.array([[0.9, 0.9]]))[1][0]
    assert variance[1] > 0.1 * variance[0]


def test_the_gradient_of_the_loss_is_its_derivative():
    rng = np.random.default_rng(2)
    points = rng.uniform(-1, 1, (40, 3))
    outputs = 3 * np.c_[np.sin(3 * points[:, 0]), points[:, 1]] + rng.standard_normal((40, 2))
    logs = np.array([0.1, 0.3, -0.2, 0.7, 0.4, 0.2])
    gradient = _emulator._loss(logs, points, outputs)[1]
    expected = approx_fprime(logs, lambda at: _emulator._loss(at, points, outputs)[0], 1e-6)
    np.testing.assert_allclose(gradient, expected, atol=1e-3)
