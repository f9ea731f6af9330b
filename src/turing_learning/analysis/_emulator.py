"""Mean judgments as functions of the parameters: a Gaussian process with one kernel for all of them."""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, solve_triangular
from scipy.optimize import minimize

TYPICAL = 1.5
"""Length scales are expected to be at least of this size, on a range of 2; smaller ones by a factor of e cost 1/2."""

BOUNDS = (np.log(0.02), np.log(30.0)), (-9.0, 14.0), (-9.0, 14.0)
"""Of the logarithms of length scales, of the variance of slopes, and of the variance of bends."""

FARTHEST_START = np.log(5.0)
"""Length scales are sought from no longer ones: from far out nothing pulls them back."""

CONSTANT = 1e4
"""Variance of the constant, in units of the noise."""

PIVOTS = 120
"""Points whose kernels stand for those of all others."""

LEAST_TOLD = 1e-3
"""Largest share of its variance that the outputs may take from a feature that is left out."""

SIZES = 10.0 ** np.arange(-3, 1.5, 0.5)
"""Factors of the kernel that an output can have."""

ENOUGH = 250
"""Points that length scales and variances are fitted to."""


@dataclass(frozen=True)
class Emulator:
    """Predict M outputs, each with noise of variance 1, at parameters z (S, P); every parameter has a length scale.

    The kernel is linear + exp(-d^2 / 2), with d in length scales: what has no effect gets a length scale beyond
    its range, so that neither slope nor bend is expected of it. The kernels of a few pivots stand for those of
    all points; what they miss is added to the variance. Each output has a size of its own: what says nothing of
    the parameters is hardly expected to move.
    """

    logs: np.ndarray  # (P + 2,): of length scales, of the variance of slopes and of bends
    pivots: np.ndarray  # (Q, P), in length scales
    basis: np.ndarray  # (Q, F), from kernels with the pivots to features with independent coefficients
    sizes: np.ndarray  # (M,), factors of the kernel, one for each output
    spreads: np.ndarray  # (F, M), variances of the features' coefficients
    weights: np.ndarray  # (F, M), the coefficients

    def predict(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean (S, M) and the variance (S, M) of each output."""
        z = z / np.exp(self.logs[:-2])
        features = _covariance(z, self.pivots, self.logs) @ self.basis
        mean = features @ self.weights
        squares = np.multiply(features, features, out=features)
        slopes, bends = np.exp(self.logs[-2:])
        missed = slopes * (z**2).sum(axis=1) + bends + CONSTANT - squares.sum(axis=1)
        return mean, squares @ self.spreads + np.maximum(missed, 0)[:, None] * self.sizes

    def mean(self, z: np.ndarray) -> np.ndarray:
        """Return the mean (S, M) alone."""
        mean: np.ndarray = _covariance(z / np.exp(self.logs[:-2]), self.pivots, self.logs) @ (self.basis @ self.weights)
        return mean


def conditioned(points: np.ndarray, outputs: np.ndarray, logs: np.ndarray) -> Emulator:
    """Return the emulator with these length scales and variances; for the arguments see `learned_kernel`."""
    z = points / np.exp(logs[:-2])
    pivots = z[_pivots(z, logs)]
    factor = _factor(_covariance(pivots, pivots, logs), 1e-10 * CONSTANT)
    basis = solve_triangular(factor, np.eye(len(pivots)), lower=True).T
    features = _covariance(z, pivots, logs) @ basis
    values, vectors = np.linalg.eigh(features.T @ features)
    values, projected = np.maximum(values, 0)[:, None], vectors.T @ (features.T @ outputs)
    shrunk = [  # minus twice the logarithm of the marginal likelihood, but for a constant
        np.log1p(size * values).sum(axis=0) - (projected**2 * size / (1 + size * values)).sum(axis=0) for size in SIZES
    ]
    sizes = SIZES[np.argmin(shrunk, axis=0)]
    # features of which the outputs tell next to nothing count as missed
    told = sizes.max() * values[:, 0] > LEAST_TOLD
    values, projected, vectors = values[told], projected[told], vectors[:, told]
    spreads = sizes / (1 + sizes * values)
    return Emulator(logs, pivots, basis @ vectors, sizes, spreads, spreads * projected)


def _factor(covariance: np.ndarray, noise: float) -> np.ndarray:
    """Return the Cholesky factor of a covariance (N, N) with a noise on its diagonal; with more, as far as rounding needs it."""
    least = np.finfo(float).eps * float(np.diag(covariance).max())
    while True:
        with suppress(np.linalg.LinAlgError):
            return np.linalg.cholesky(covariance + noise * np.eye(len(covariance)))
        # outputs without noise make covariances so large that rounding exceeds the noise
        noise = 10 * max(noise, least)


def surprise(misses: np.ndarray, variance: np.ndarray, covariance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the squared misses (S, M) in units of their covariance (S,), and half the logarithm of its determinant (S,).

    The covariance is `covariance` (M, M) with the variances (S, M) of each row added. All rows are factorized at
    once, one column after the other (Cholesky): M is small, and S large.
    """
    count, outputs = misses.shape
    factors = np.zeros((outputs, outputs, count))
    squares = np.zeros(count)
    half_logs = np.zeros(count)
    solved = np.empty((outputs, count))
    for k in range(outputs):
        # column k of the factor, from the diagonal on
        column = covariance[k:, k, None] - (factors[k:, :k] * factors[k, :k]).sum(axis=1)
        column[0] += variance[:, k]
        root = np.sqrt(column[0])
        factors[k:, k] = column / root
        # forward substitution
        solved[k] = (misses[:, k] - (factors[k, :k] * solved[:k]).sum(axis=0)) / root
        squares += solved[k] ** 2
        half_logs += np.log(root)
    return squares, half_logs


def _covariance(a: np.ndarray, b: np.ndarray, logs: np.ndarray) -> np.ndarray:
    covariance, bell = _parts(a, b)
    covariance *= np.exp(logs[-2])
    bell *= np.exp(logs[-1])
    covariance += bell
    covariance += CONSTANT
    return covariance


def _pivots(z: np.ndarray, logs: np.ndarray) -> np.ndarray:
    """Return the points that one after the other have the largest variance given those before (pivoted Cholesky)."""
    left = np.exp(logs[-2]) * (z**2).sum(axis=1) + np.exp(logs[-1]) + CONSTANT
    rows, chosen = np.zeros((min(PIVOTS, len(z)), len(z))), []
    for k in range(len(rows)):
        best = int(np.argmax(left))
        if left[best] < 1e-6:
            break
        chosen.append(best)
        row = _covariance(z[best : best + 1], z, logs)[0] - rows[:k, best] @ rows[:k]
        rows[k] = row / np.sqrt(left[best])
        left = np.maximum(left - rows[k] ** 2, 0)
    return np.array(chosen)


def learned_kernel(
    points: np.ndarray, outputs: np.ndarray, start: np.ndarray | None = None, longer: float = np.inf
) -> np.ndarray:
    """Return `Emulator.logs` by the marginal likelihood of outputs (N, M), with noise of variance 1, at points (N, P).

    Points are on [-1, 1]. The search begins at the logs `start` (P + 2,). Its length scales grow at most by the factor
    `longer`, because nearby a parameter with an effect may seem to have none.
    """
    first = np.r_[np.full(points.shape[1], np.log(TYPICAL)), 0.0, 0.0] if start is None else start.copy()
    most = [BOUNDS[0][1] if start is None else min(BOUNDS[0][1], log + np.log(longer)) for log in first[:-2]]
    first[:-2] = np.minimum(first[:-2], FARTHEST_START)
    few, options = slice(None, None, -(-len(points) // ENOUGH)), {"maxiter": 30 if start is None else 10}
    told = {"args": (points[few], outputs[few]), "bounds": [(BOUNDS[0][0], log) for log in most] + [*BOUNDS[1:]]}
    logs: np.ndarray = minimize(_loss, first, jac=True, method="L-BFGS-B", options=options, **told).x
    return logs


def _parts(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    inner = a @ b.T
    exponents = inner - 0.5 * (a**2).sum(axis=1)[:, None]
    exponents -= 0.5 * (b**2).sum(axis=1)
    return inner, np.exp(exponents, out=exponents)


def _loss(logs: np.ndarray, points: np.ndarray, outputs: np.ndarray) -> tuple[float, np.ndarray]:
    """Return minus the logarithm of the marginal likelihood and of what is expected of length scales, and its gradient."""
    lengths, (slopes, bends) = np.exp(logs[:-2]), np.exp(logs[-2:])
    z = points / lengths
    linear, bell = _parts(z, z)
    factor = _factor(slopes * linear + bends * bell + CONSTANT, 1.0)
    inverse = cho_solve((factor, True), np.eye(len(z)), check_finite=False)
    weights, count = inverse @ outputs, outputs.shape[1]
    short = np.minimum(logs[:-2] - np.log(TYPICAL), 0)
    value = 0.5 * (outputs * weights).sum() + count * np.log(np.diag(factor)).sum() + 0.5 * (short**2).sum()
    pull = 0.5 * (count * inverse - weights @ weights.T)
    bent = bends * pull * bell
    bending = 2 * (z**2 * bent.sum(axis=1)[:, None] - z * (bent @ z)).sum(axis=0)
    sloping = -2 * slopes * (z * (pull @ z)).sum(axis=0)
    return float(value), np.r_[bending + sloping + short, slopes * (pull * linear).sum(), bent.sum()]
