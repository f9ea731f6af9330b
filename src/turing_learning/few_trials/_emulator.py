"""Mean judgments as functions of the parameters.

A Gaussian process with one kernel for all of them.

Goes in: M outputs at S points. Comes out: mean and variance of each output anywhere. It differs
from the map of the loop (`_map`), which is made anew in every batch for many moments at a time and
so chooses among few shapes: here each parameter has a length scale of its own, found by the
marginal likelihood, because intervals depend on it.

Source: Rasmussen and Williams, Gaussian processes for machine learning (2006), chapters 2, 5 and
8. The numbers: decisions 0028 and 0055.
"""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve, solve_triangular
from scipy.optimize import minimize

TYPICAL_LENGTH = 1.5
"""Length scales are expected to be at least of this size, on a range of 2.

Smaller ones by a factor of e cost 1/2.
"""

LOG_LENGTHS = np.log(0.02), np.log(30.0)
"""Bounds of the logarithms of length scales."""

LOG_VARIANCES = -9.0, 14.0
"""Bounds of the logarithms of the variance of slopes, and of that of bends, in units of the
noise."""

LOG_SHAPE_START = 1.0
"""Logarithm of the kernel's shape from which it is sought."""

LOG_SHAPES = 0.0, 3.5
"""Bounds of the logarithm of the kernel's shape: 1 has bends of all lengths, 33 of one length."""

LONGEST_LOG_START = np.log(5.0)
"""Length scales are sought from no longer ones: from far out nothing pulls them back."""

CONSTANT_VARIANCE = 1e4
"""Variance of the constant, in units of the noise."""

PIVOTS = 120
"""Points whose kernels stand for those of all others."""

LEAST_LEARNED = 1e-3
"""Largest share of its variance that the outputs may take from a feature that is left out."""

KERNEL_SIZES = 10.0 ** np.arange(-0.5, 1.5, 0.5)
"""Factors of the kernel that an output can have.

With much smaller ones an output that hardly moves among the samples is held to move nowhere
(decision 0055).
"""

FITTED_POINTS = 250
"""Points that length scales and variances are fitted to."""


@dataclass(frozen=True)
class Emulator:
    """Predict M outputs, each with noise of variance 1, at parameters z (S, P).

    Every parameter has a length scale.

    The kernel is linear + (1 + d^2 / 2a)^-a, with d in length scales (rational quadratic). Of shape
    a = 1 it has bends of all lengths, short ones the smaller; of a large one it is exp(-d^2 / 2),
    with bends of one length. Where there are shorter ones, these would count as noise, which many
    samples average away (decision 0055). What has no effect gets a length scale beyond its range, so
    that neither slope nor bend is expected of it.
    The kernels of a few pivots stand for those of all points; what they miss is added to the
    variance. Each output has a size of its own, at least 0.3: one that hardly moves among the
    samples may move beyond them.
    """

    # (P + 3,): of length scales, of the shape, of the variance of slopes and of bends
    logs: np.ndarray
    pivots: np.ndarray  # (Q, P), in length scales
    # (Q, F), from kernels with the pivots to features with independent coefficients
    basis: np.ndarray
    sizes: np.ndarray  # (M,), factors of the kernel, one for each output
    spreads: np.ndarray  # (F, M), variances of the features' coefficients
    weights: np.ndarray  # (F, M), the coefficients

    def predict(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean (S, M) and the variance (S, M) of each output."""
        z = z / np.exp(self.logs[:-3])
        features = _covariance(z, self.pivots, self.logs) @ self.basis
        mean = features @ self.weights
        squares = np.multiply(features, features, out=features)
        slopes, bends = np.exp(self.logs[-2:])
        missed = slopes * (z**2).sum(axis=1) + bends + CONSTANT_VARIANCE - squares.sum(axis=1)
        return mean, squares @ self.spreads + np.maximum(missed, 0)[:, None] * self.sizes

    def mean(self, z: np.ndarray) -> np.ndarray:
        """Return the mean (S, M) alone."""
        mean: np.ndarray = _covariance(z / np.exp(self.logs[:-3]), self.pivots, self.logs) @ (
            self.basis @ self.weights
        )
        return mean


def conditioned(points: np.ndarray, outputs: np.ndarray, logs: np.ndarray) -> Emulator:
    """Return the emulator with these length scales and variances.

    For the arguments see `learned_kernel`.
    """
    z = points / np.exp(logs[:-3])
    pivots = z[_pivots(z, logs)]
    factor = _factor(_covariance(pivots, pivots, logs), 1e-10 * CONSTANT_VARIANCE)
    basis = solve_triangular(factor, np.eye(len(pivots)), lower=True).T
    features = _covariance(z, pivots, logs) @ basis
    values, vectors = np.linalg.eigh(features.T @ features)
    values = np.maximum(values, 0)[:, None]
    projected = vectors.T @ (features.T @ outputs)
    losses = []
    for size in KERNEL_SIZES:
        # minus twice the logarithm of the marginal likelihood, but for a constant
        explained = projected**2 * size / (1 + size * values)
        losses.append(np.log1p(size * values).sum(axis=0) - explained.sum(axis=0))
    sizes = KERNEL_SIZES[np.argmin(losses, axis=0)]
    # features of which the outputs say next to nothing count as missed
    learned = sizes.max() * values[:, 0] > LEAST_LEARNED
    values = values[learned]
    projected = projected[learned]
    vectors = vectors[:, learned]
    spreads = sizes / (1 + sizes * values)
    return Emulator(logs, pivots, basis @ vectors, sizes, spreads, spreads * projected)


def _factor(covariance: np.ndarray, noise: float) -> np.ndarray:
    """Return the Cholesky factor of a covariance (N, N) with a noise on its diagonal.

    With more, as far as rounding needs it.
    """
    least_noise = np.finfo(float).eps * float(np.diag(covariance).max())
    while True:
        with suppress(np.linalg.LinAlgError):
            return np.linalg.cholesky(covariance + noise * np.eye(len(covariance)))
        # outputs without noise make covariances so large that rounding exceeds the noise
        noise = 10 * max(noise, least_noise)


def surprise(
    misses: np.ndarray, variance: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the squared misses (S,) and half the logarithm of the determinant (S,).

    Misses (S, M) are in units of their covariance.

    The covariance is `covariance` (M, M) with the variances (S, M) of each row added. All rows are
    factorized at once, one column after the other (Cholesky): M is small, and S large.
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
    shape = np.exp(logs[-3])
    # (1 + d^2 / 2a)^-a, in place
    bell /= shape
    bell += 1
    np.power(bell, -shape, out=bell)
    covariance *= np.exp(logs[-2])
    bell *= np.exp(logs[-1])
    covariance += bell
    covariance += CONSTANT_VARIANCE
    return covariance


def _pivots(z: np.ndarray, logs: np.ndarray) -> np.ndarray:
    """Return the points that one after the other have the largest variance given those before.

    Source: pivoted Cholesky factorization.
    """
    remaining = np.exp(logs[-2]) * (z**2).sum(axis=1) + np.exp(logs[-1]) + CONSTANT_VARIANCE
    rows = np.zeros((min(PIVOTS, len(z)), len(z)))
    chosen: list[int] = []
    for k in range(len(rows)):
        best = int(np.argmax(remaining))
        if remaining[best] < 1e-6:
            break
        chosen.append(best)
        row = _covariance(z[best : best + 1], z, logs)[0] - rows[:k, best] @ rows[:k]
        rows[k] = row / np.sqrt(remaining[best])
        remaining = np.maximum(remaining - rows[k] ** 2, 0)
    return np.array(chosen)


def learned_kernel(
    points: np.ndarray, outputs: np.ndarray, start: np.ndarray | None = None, longer: float = np.inf
) -> np.ndarray:
    """Return `Emulator.logs` by the marginal likelihood of outputs (N, M) at points (N, P).

    Points are on [-1, 1]; outputs have noise of variance 1. The search begins at the logs `start`
    (P + 3,). Its length scales grow at most by the factor `longer`, because nearby a parameter with
    an effect may seem to have none.
    """
    shortest, widest = LOG_LENGTHS
    if start is None:
        start_logs = np.r_[
            np.full(points.shape[1], np.log(TYPICAL_LENGTH)), LOG_SHAPE_START, 0.0, 0.0
        ]
        longest = [widest] * points.shape[1]
        steps = 30
    else:
        start_logs = start.copy()
        longest = [min(widest, log + np.log(longer)) for log in start_logs[:-3]]
        steps = 10
    start_logs[:-3] = np.minimum(start_logs[:-3], LONGEST_LOG_START)
    few = np.linspace(0, len(points) - 1, min(len(points), FITTED_POINTS)).astype(int)
    logs: np.ndarray = minimize(
        _loss,
        start_logs,
        args=(points[few], outputs[few]),
        jac=True,
        method="L-BFGS-B",
        bounds=[(shortest, log) for log in longest] + [LOG_SHAPES, LOG_VARIANCES, LOG_VARIANCES],
        options={"maxiter": steps},
    ).x
    return logs


def _parts(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return inner products, and half the squared distances (N, M) of points in length scales."""
    inner = a @ b.T
    halves = 0.5 * (a**2).sum(axis=1)[:, None] - inner
    halves += 0.5 * (b**2).sum(axis=1)
    return inner, np.maximum(halves, 0, out=halves)


def _loss(logs: np.ndarray, points: np.ndarray, outputs: np.ndarray) -> tuple[float, np.ndarray]:
    """Return minus the logarithm of the posterior of `Emulator.logs`, and its gradient."""
    lengths = np.exp(logs[:-3])
    slopes, bends = np.exp(logs[-2:])
    z = points / lengths
    linear, halves = _parts(z, z)
    shape = np.exp(logs[-3])
    wider = 1 + halves / shape
    bell = wider**-shape
    factor = _factor(slopes * linear + bends * bell + CONSTANT_VARIANCE, 1.0)
    inverse = cho_solve((factor, True), np.eye(len(z)), check_finite=False)
    weights = inverse @ outputs
    count = outputs.shape[1]
    # short length scales are not expected
    short = np.minimum(logs[:-3] - np.log(TYPICAL_LENGTH), 0)
    value = 0.5 * (outputs * weights).sum()
    value = value + count * np.log(np.diag(factor)).sum() + 0.5 * (short**2).sum()
    # derivatives of the value by the covariance, and through it by each logarithm
    pull = 0.5 * (count * inverse - weights @ weights.T)
    bend_pull = bends * pull * bell
    # minus the derivative of the bell by half the squared distance is the bell by `wider`
    bent = bend_pull / wider
    shaping = shape * (bend_pull * (1 - 1 / wider - np.log(wider))).sum()
    bending = 2 * (z**2 * bent.sum(axis=1)[:, None] - z * (bent @ z)).sum(axis=0)
    sloping = -2 * slopes * (z * (pull @ z)).sum(axis=0)
    return float(value), np.r_[
        bending + sloping + short, shaping, slopes * (pull * linear).sum(), bend_pull.sum()
    ]
