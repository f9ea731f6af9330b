"""A map of the moments over the parameters: Gaussian processes, and the density of the truth that follows from them."""

from collections.abc import Mapping

import numpy as np
from scipy.linalg import cho_solve, cholesky, solve_triangular

from ._checks import state_arrays

LENGTHS = (0.15, 0.3, 0.6, 1.2)
AMPLITUDES = (0.03, 0.3, 3.0, 30.0)
_WIDE = 100.0  # variance of constant and slope
_TRIED_ON = 250  # samples that choose length and amplitude
INDUCING = 200
"""Points that a map rests on."""
_JITTER = 1e-6
MOST_TEMPER = 2.0


class MomentField:
    """What each moment is expected to be for a model with given parameters, and how sure that is.

    A moment is a number per trial, with noise of variance 1, whose expectation is 0 for models that are
    right. Each moment is a Gaussian process over the parameters with constant, slope and a
    squared-exponential part, whose length and amplitude are those of the highest evidence in a small grid.
    With many trials the processes are projected on some of them.

    Source: Rasmussen and Williams, Gaussian processes for machine learning (2006), sections 2.7 and 8.3;
    Gutmann and Corander, BOLFI (2016).

    Parameters
    ----------
    parameters : (S, P)
        Of the models; ranges about [-1, 1].
    moments : (S, Q)
        Of one trial of each.
    noise
        Variance of the moments of the system itself, 1 / K for K genuine samples.
    rng
        Draws the subsets.
    inducing
        Number of trials on which the processes are projected.

    Attributes
    ----------
    misfit
        Chi square per moment of the best model, >= 1: how much worse than chance it still matches; see
        `calibrate`.
    """

    def __init__(
        self, parameters: np.ndarray, moments: np.ndarray, noise: float, rng: np.random.Generator, *,
        inducing: int = INDUCING,
    ) -> None:  # fmt: skip
        tried = rng.permutation(len(parameters))[:_TRIED_ON]
        center = np.median(parameters, axis=0)
        points = np.sort(rng.permutation(len(parameters))[:inducing])
        shapes = _chosen(parameters[tried] - center, moments[tried])
        known = {"parameters": parameters, "moments": moments, "center": center, "inducing": points, "shapes": shapes}
        self._build({**known, "noise": np.array(noise), "misfit": np.array(1.0)})

    def _build(self, state: dict[str, np.ndarray]) -> None:
        self._state, self._noise, self.misfit = state, float(state["noise"]), float(state["misfit"])
        parameters, moments, self._center, shapes = (
            state[name] for name in ("parameters", "moments", "center", "shapes")
        )
        self._points = parameters[state["inducing"]] - self._center
        self._parts = []
        places, identity = parameters - self._center, np.eye(len(self._points))
        for shape in np.unique(shapes, axis=0):
            columns = np.flatnonzero((shapes == shape).all(axis=1))
            own = _kernel(self._points, self._points, *shape)
            own[np.diag_indices(len(own))] *= 1 + _JITTER
            inverse = solve_triangular(cholesky(own, lower=True), identity, lower=True).T
            features = _kernel(places, self._points, *shape) @ inverse
            factor = cholesky(features.T @ features + identity, lower=True)
            weights = inverse @ cho_solve((factor, True), features.T @ moments[:, columns])
            spread = inverse @ solve_triangular(factor, identity, lower=True).T
            self._parts.append((shape, columns, weights, inverse, spread))

    def predict(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and variance (N, Q) of the expectations of the moments of N models (N, P)."""
        places = parameters - self._center
        mean = np.empty((len(places), len(self._state["shapes"])))
        variance = np.empty_like(mean)
        distance = _squared(places, self._points)
        product = places @ self._points.T
        for (length, amplitude), columns, weights, inverse, spread in self._parts:
            kernel = _combined(distance, product, length, amplitude)
            mean[:, columns] = kernel @ weights
            prior = amplitude + _WIDE * (1 + (places**2).sum(axis=1))
            left = np.maximum(prior - ((kernel @ inverse) ** 2).sum(axis=1), 0)
            variance[:, columns] = (left + ((kernel @ spread) ** 2).sum(axis=1))[:, None]
        return mean, variance

    def log_density(self, parameters: np.ndarray, hopeful: bool = False) -> np.ndarray:
        """Return the logarithm (N,) of the density with which models (N, P) are the right one, up to a constant.

        It is that of the moments 0 where they are expected so; where nothing has been tried little is excluded.
        If hopeful, models are not the less likely for being little known.
        """
        mean, variance = self.predict(parameters)
        variance += self._noise
        surprise = mean**2 / variance if hopeful else mean**2 / variance + np.log(variance)
        return -0.5 * surprise.sum(axis=1) / self.temper

    @property
    def temper(self) -> float:
        """What the logarithm of the density is divided by: the misfit, at most 2; else the next trials would lie too far apart."""
        return min(self.misfit, MOST_TEMPER)

    def calibrate(self, parameters: np.ndarray) -> None:
        """Set `misfit` by the best of N models (N, P)."""
        mean, variance = self.predict(parameters)
        variance += self._noise
        squares = mean**2 / variance
        best = int(np.argmax(-(squares + np.log(variance)).sum(axis=1)))
        self.misfit = max(1.0, float(squares[best].mean()))

    def state(self) -> dict[str, np.ndarray]:
        """Return what the field is built from."""
        return self._state | {"misfit": np.array(self.misfit)}

    @classmethod
    def restored(cls, state: Mapping[str, np.ndarray]) -> "MomentField":
        """Return the field of a state."""
        shapes = {"parameters": "S P", "moments": "S Q", "center": "P", "inducing": "B", "shapes": "Q 2"}
        held = state_arrays(state, shapes | {"noise": "", "misfit": ""})
        field = cls.__new__(cls)
        field._build(held | {"inducing": held["inducing"].astype(np.int64)})
        return field


def _chosen(places: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """Return length and amplitude (Q, 2) of each moment by evidence."""
    grid = np.array([(length, amplitude) for length in LENGTHS for amplitude in AMPLITUDES])
    evidence = np.empty((len(grid), moments.shape[1]))
    distance, product = _squared(places, places), places @ places.T
    for k, shape in enumerate(grid):
        factor = cholesky(_combined(distance, product, *shape) + np.eye(len(places)), lower=True)
        white = solve_triangular(factor, moments, lower=True)
        evidence[k] = -0.5 * (white**2).sum(axis=0) - np.log(np.diag(factor)).sum()
    return grid[evidence.argmax(axis=0)]


def _squared(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the squared distances (N, B) of points (N, P) and (B, P)."""
    sums = (first**2).sum(axis=1)[:, None] + (second**2).sum(axis=1)
    return np.maximum(sums - 2 * first @ second.T, 0)


def _kernel(first: np.ndarray, second: np.ndarray, length: float, amplitude: float) -> np.ndarray:
    return _combined(_squared(first, second), first @ second.T, length, amplitude)


def _combined(distance: np.ndarray, product: np.ndarray, length: float, amplitude: float) -> np.ndarray:
    return amplitude * np.exp(distance * (-0.5 / length**2)) + _WIDE * (1 + product)
