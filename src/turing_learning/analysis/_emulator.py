"""Mean judgments as functions of the parameters: a Gaussian process with one kernel for all of them."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve
from scipy.optimize import minimize

TYPICAL = 1.5
"""Length scales are expected to be at least of this size, on a range of 2; smaller ones by a factor of e cost 1/2."""

BOUNDS = (np.log(0.1), np.log(30.0)), (-9.0, 6.0), (-9.0, 6.0)
"""Of the logarithms of length scales, of the variance of slopes, and of the variance of bends."""

FARTHEST_START = np.log(5.0)
"""Length scales are sought from no longer ones: from far out nothing pulls them back."""

CONSTANT = 100.0
"""Variance of the constant, in units of the noise."""

ENOUGH = 250
"""Points that length scales and variances are fitted to."""


@dataclass(frozen=True)
class Emulator:
    """Predict M outputs, each with noise of variance 1, at parameters z (S, P); every parameter has a length scale.

    The kernel is linear + exp(-d^2 / 2), with d in length scales: what has no effect gets a length scale beyond its range, so
    that neither slope nor bend is expected of it.
    """

    points: np.ndarray  # (N, P)
    logs: np.ndarray  # (P + 2,): of length scales, of the variance of slopes and of bends
    inverse: np.ndarray  # (N, N), of the covariance of the outputs
    weights: np.ndarray  # (N, M)

    def predict(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean (S, M) and the variance (S,), one for all outputs."""
        cross = self._cross(z)
        lengths, (slopes, bends) = np.exp(self.logs[:-2]), np.exp(self.logs[-2:])
        own = slopes * ((z / lengths) ** 2).sum(axis=1) + bends + CONSTANT
        return cross @ self.weights, np.maximum(own - (cross @ self.inverse * cross).sum(axis=1), 1e-9)

    def mean(self, z: np.ndarray) -> np.ndarray:
        """Return the mean (S, M) alone."""
        return self._cross(z) @ self.weights

    def _cross(self, z: np.ndarray) -> np.ndarray:
        lengths = np.exp(self.logs[:-2])
        linear, bell = _parts(z / lengths, self.points / lengths)
        cross: np.ndarray = np.exp(self.logs[-2]) * linear + np.exp(self.logs[-1]) * bell + CONSTANT
        return cross


def learned_kernel(
    points: np.ndarray, outputs: np.ndarray, noise: np.ndarray, start: np.ndarray | None = None
) -> np.ndarray:
    """Return `Emulator.logs` by the marginal likelihood.

    Parameters
    ----------
    points : (N, P)
        Parameters, on [-1, 1].
    outputs : (N, M)
        With noise of about variance 1.
    noise : (N,)
        Variance of the noise of each point, in units of the outputs'.
    start : (P + 2,)
        `Emulator.logs` to start from.
    """
    first = np.r_[np.full(points.shape[1], np.log(TYPICAL)), 0.0, 0.0] if start is None else start.copy()
    first[:-2] = np.minimum(first[:-2], FARTHEST_START)
    few = slice(None, None, -(-len(points) // ENOUGH))
    bounds = [BOUNDS[0]] * points.shape[1] + [*BOUNDS[1:]]
    logs: np.ndarray = minimize(
        _loss,
        first,
        args=(points[few], outputs[few], noise[few]),
        jac=True,
        method="L-BFGS-B",
        bounds=bounds,
        options={"maxiter": 30 if start is None else 10},
    ).x
    return logs


def conditioned(points: np.ndarray, outputs: np.ndarray, noise: np.ndarray, logs: np.ndarray) -> Emulator:
    """Return the emulator with these length scales and variances; for the arguments see `learned_kernel`."""
    linear, bell = _parts(points / np.exp(logs[:-2]), points / np.exp(logs[:-2]))
    covariance = np.exp(logs[-2]) * linear + np.exp(logs[-1]) * bell + CONSTANT + np.diag(noise)
    inverse = cho_solve((np.linalg.cholesky(covariance), True), np.eye(len(points)), check_finite=False)
    return Emulator(points, logs, inverse, inverse @ outputs)


def _parts(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    inner = a @ b.T
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * inner
    return inner, np.exp(-0.5 * np.maximum(squares, 0))


def _loss(logs: np.ndarray, points: np.ndarray, outputs: np.ndarray, noise: np.ndarray) -> tuple[float, np.ndarray]:
    """Return minus the logarithm of the marginal likelihood and of what is expected of length scales, and its gradient."""
    lengths, (slopes, bends) = np.exp(logs[:-2]), np.exp(logs[-2:])
    z = points / lengths
    linear, bell = _parts(z, z)
    factor = np.linalg.cholesky(slopes * linear + bends * bell + CONSTANT + np.diag(noise))
    inverse = cho_solve((factor, True), np.eye(len(z)), check_finite=False)
    weights, count = inverse @ outputs, outputs.shape[1]
    short = np.minimum(logs[:-2] - np.log(TYPICAL), 0)
    value = 0.5 * (outputs * weights).sum() + count * np.log(np.diag(factor)).sum() + 0.5 * (short**2).sum()
    pull = 0.5 * (count * inverse - weights @ weights.T)
    bent = bends * pull * bell
    bending = 2 * (z**2 * bent.sum(axis=1)[:, None] - z * (bent @ z)).sum(axis=0)
    sloping = -2 * slopes * (z * (pull @ z)).sum(axis=0)
    return float(value), np.r_[bending + sloping + short, slopes * (pull * linear).sum(), bent.sum()]
