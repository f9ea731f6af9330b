"""A map of the moments over the parameters: Gaussian processes, and the density of the right model.

Goes in: for each trial, the parameters of its model and Q moments, which are 0 on average for a
right model. Comes out: the logarithm of the density with which a model is the right one. Why it
works: where a Gaussian process says that all moments are 0, classifiers judge the model as they
judge the agents.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_solve, cholesky, lapack, solve_triangular

from turing_learning.evolution import join_states, state_arrays, state_part

MOMENT_LENGTHS = (1.2, 0.6, 0.3, 0.15)
"""Length scales that a moment can have, on a range of 2; the longest first (decision 0028)."""

MOMENT_AMPLITUDES = (0.03, 0.3, 3.0, 30.0)
"""Variances of the bends that a moment can have, in units of the noise of one trial (decision
0028)."""

LINEAR_VARIANCE = 100.0
"""Variance of constant and slopes, in the same units: so large that data alone determine them."""

SHAPE_TRIALS = 150
"""Trials by which length and amplitude are chosen."""

INDUCING = 200
"""Trials, at most, whose kernels stand for those of all others."""

MISSED_VARIANCE = 0.5
"""Variance of a moment that a map may miss between those trials, in units of the noise of the
system's mean."""

LEAST_NOISE = 1e-5
"""Smallest such noise that counts, in units of the noise of one trial: less would cost points in
vain."""

MISSED_BY_EVIDENCE = 0.03
"""Variance that may be missed where only length and amplitude are chosen, in units of the noise of
one trial."""

MOST_TEMPER = 2.0
"""Largest number that the logarithm of the density is divided by."""

LEAST_SINGLE_NOISE = 3e-4
"""Noise of the system's mean, in units of the noise of one trial, down to which maps are evaluated
in single precision: that of 3,000 genuine samples, as many as are judged of a live system."""

WIDE_SLACK = 10.0
"""The wide map excludes a model whose log density there is lower than that of the walkers by so
much."""

HOPELESS = 50.0
"""A model whose log density is lower than that of the best by so much is not looked up in the wide
map: it is out anyway."""


class _Bends(NamedTuple):
    """The squared-exponential kernel of one length scale, as a product of features.

    The kernels of a few points stand for all others. These points are chosen one after the other,
    that of the largest remaining variance first (pivoted Cholesky factorization).
    """

    length: float
    #: (R, P), in length scales
    points: np.ndarray
    #: (R,), half their squares
    halves: np.ndarray
    #: (R, R): features are the kernels of the R points times this
    whitening: np.ndarray

    @classmethod
    def of(cls, points: np.ndarray, length: float, missed: float) -> "_Bends":
        """Choose points until a share `missed` of the variance, or less, remains anywhere."""
        scaled = points / length
        halves = 0.5 * (scaled**2).sum(axis=1)
        kernel = _kernel(points / length, scaled, halves)
        factor, order, rank, _ = lapack.dpstrf(kernel, tol=missed, lower=1)
        # LAPACK counts from 1 and leaves the other triangle as it was
        chosen = order[:rank] - 1
        triangle = np.tril(factor[:rank, :rank])
        whitening = solve_triangular(triangle, np.eye(rank), lower=True, check_finite=False).T
        return cls(length, scaled[chosen], halves[chosen], whitening)

    def features(self, models: np.ndarray) -> np.ndarray:
        """Return 1, the parameters, and the features of the bends (N, 1 + P + R)."""
        offset = 1 + models.shape[1]
        precision = self.whitening.dtype
        features = np.empty((len(models), offset + len(self.points)), precision)
        features[:, 0] = 1
        features[:, 1:offset] = models
        kernel = _kernel(models / self.length, self.points, self.halves)
        np.matmul(kernel.astype(precision), self.whitening, out=features[:, offset:])
        return features

    def missed(self, features: np.ndarray) -> np.ndarray:
        """Return the share (N,) of the bends' variance that features (N, 1 + P + R) leave open."""
        bends = features[:, 1 + self.points.shape[1] :]
        return np.maximum(1 - np.einsum("nr,nr->n", bends, bends), 0)

    def scales(self, amplitude: float) -> np.ndarray:
        """Return the standard deviation expected of the weight of each feature."""
        scales = np.full(1 + self.points.shape[1] + len(self.points), np.sqrt(amplitude))
        scales[: 1 + self.points.shape[1]] = np.sqrt(LINEAR_VARIANCE)
        return scales


class _Process(NamedTuple):
    """The Gaussian processes of moments that share one length scale.

    They are fitted in double precision. With up to 3,000 genuine samples they are evaluated in
    single precision: products of so many features are most of what walkers cost. How little that
    changes: decision 0035.
    """

    bends: _Bends
    #: indices of the moments
    columns: np.ndarray
    #: (1 + P + R, moments): expectation of the weights of the features
    weights: np.ndarray
    #: for each amplitude: its value, which of all moments have it, and a square root of the
    #: weights' covariance
    spreads: list[tuple[float, np.ndarray, np.ndarray]]

    def rounded(self, precision: type[np.floating]) -> "_Process":
        """Return the processes with all that they are evaluated with in a precision."""
        bends = self.bends._replace(whitening=self.bends.whitening.astype(precision))
        spreads = [
            (amplitude, sharing, spread.astype(precision))
            for amplitude, sharing, spread in self.spreads
        ]
        return _Process(bends, self.columns, self.weights.astype(precision), spreads)


class MomentField:
    """What each moment is expected to be for a model with given parameters, and how sure that is.

    A moment is a number per trial, with noise of variance 1, whose expectation is 0 for models that
    are right. Each moment is a Gaussian process over the parameters with constant, slope and a
    squared-exponential part, whose length and amplitude are those of the highest evidence in a
    small grid. The process is computed as a linear regression on features. So its cost per trial
    does not grow with the number of trials, and moments that share a length share their features.

    Source: Rasmussen and Williams, Gaussian processes for machine learning (2006), sections 2.7 and
    8.3; Gutmann and Corander, BOLFI (2016); Fine and Scheinberg, Efficient SVM training using
    low-rank kernel representations (2001), for the points.

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
        Number of trials from which points of the processes are chosen.

    Attributes
    ----------
    misfit
        Chi square per moment of the best model, >= 1: how much worse than chance it still matches.
        See `calibrate`.
    """

    def __init__(
        self,
        parameters: np.ndarray,
        moments: np.ndarray,
        noise: float,
        rng: np.random.Generator,
        *,
        inducing: int = INDUCING,
    ) -> None:
        tried = rng.permutation(len(parameters))[:SHAPE_TRIALS]
        center = np.median(parameters, axis=0)
        state = {
            "parameters": parameters,
            "moments": moments,
            "center": center,
            "inducing": np.sort(rng.permutation(len(parameters))[:inducing]),
            "shapes": _likeliest_shapes(parameters[tried] - center, moments[tried]),
            "noise": np.array(noise),
            "misfit": np.array(1.0),
        }
        self._build(state)

    def _build(self, state: dict[str, np.ndarray]) -> None:
        self._state = state
        self._noise = float(state["noise"])
        self.misfit = float(state["misfit"])
        self._center = state["center"]
        models = state["parameters"] - self._center
        points = models[state["inducing"]]
        lengths = state["shapes"][:, 0]
        missed = MISSED_VARIANCE * max(self._noise, LEAST_NOISE)
        # the smaller the noise, the more a rounded expectation changes the density
        precision = np.float32 if self._noise >= LEAST_SINGLE_NOISE else np.float64
        self._processes = []
        for length in np.unique(lengths):
            columns = np.flatnonzero(lengths == length)
            amplitudes = state["shapes"][columns, 1]
            bends = _Bends.of(points, length, missed / amplitudes.max())
            process = _fitted(bends, models, state["moments"], columns, amplitudes)
            self._processes.append(process.rounded(precision))

    def predict(self, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return mean and variance (N, Q) of the expectations of the moments of N models (N, P)."""
        models = parameters - self._center
        mean = np.empty((len(models), len(self._state["shapes"])))
        variance = np.empty_like(mean)
        for bends, columns, weights, spreads in self._processes:
            features = bends.features(models)
            mean[:, columns] = features @ weights
            missed = bends.missed(features)
            for amplitude, sharing, spread in spreads:
                deviations = features @ spread
                posterior_variance = np.einsum("nr,nr->n", deviations, deviations)
                variance[:, sharing] = (amplitude * missed + posterior_variance)[:, None]
        return mean, variance

    def log_density(self, parameters: np.ndarray, optimistic: bool = False) -> np.ndarray:
        """Return the logarithm (N,) of the density of models (N, P), up to a constant.

        It is that of the moments 0 where they are expected so; where nothing has been tried little
        is excluded. If optimistic, models are not the less likely for being little known.
        """
        mean, variance = self.predict(parameters)
        variance += self._noise
        surprise = mean**2 / variance
        if not optimistic:
            surprise += np.log(variance)
        return -0.5 * surprise.sum(axis=1) / self.temper

    @property
    def temper(self) -> float:
        """What the logarithm of the density is divided by: the misfit, at most 2.

        With more the next trials would lie too far apart.
        """
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
        shapes = {
            "parameters": "S P",
            "moments": "S Q",
            "center": "P",
            "inducing": "B",
            "shapes": "Q 2",
        }
        arrays = state_arrays(state, shapes | {"noise": "", "misfit": ""})
        field = cls.__new__(cls)
        field._build(arrays | {"inducing": arrays["inducing"].astype(np.int64)})
        return field


class Density:
    """The density of the right model.

    Where it is by the nearest trials, as far as a map of all trials does not exclude it.

    Parameters
    ----------
    near
        Map of the nearest trials; None before there is one.
    wide
        Map of all trials; None while there are few.
    reference
        The largest density that it gives a walker, as a logarithm.
    """

    def __init__(
        self, near: MomentField | None, wide: MomentField | None = None, reference: float = 0.0
    ) -> None:
        self.near = near
        self.wide = wide
        self._reference = reference

    def __call__(
        self,
        models: np.ndarray,
        optimistic: bool = False,
        power: float = 1.0,
        least: np.ndarray | None = None,
    ) -> np.ndarray:
        """Return the logarithm (N,) of the density of models (N, P).

        Parameters
        ----------
        models : (N, P)
            In units of the space.
        optimistic
            Whether models are not the less likely for being little known.
        power
            Of the density, 0 to 1. Below 1 the map of all trials counts in full, not only where it
            excludes models.
        least : (N,)
            From which value on a model counts: what lies below need not be exact, which saves
            computing it. None is 50 below the best.
        """
        assert self.near is not None
        density = self.near.log_density(models, optimistic)
        if self.wide is None:
            return power * density
        if power < 1:
            return power * (density + self.wide.log_density(models, optimistic))
        if least is None:
            least = np.full(len(density), density.max(initial=-np.inf) - HOPELESS)
        # the wide map only makes models less likely
        counts = density > least
        if counts.any():
            wide = self.wide.log_density(models[counts])
            density[counts] += np.minimum(wide - self._reference + WIDE_SLACK, 0)
        return density

    def state(self) -> dict[str, np.ndarray]:
        """Return all that is needed to resume."""
        fields = {"near": self.near, "wide": self.wide}
        states = {name: field.state() for name, field in fields.items() if field is not None}
        return {"reference": np.array(self._reference), **join_states(states)}

    @classmethod
    def restored(cls, state: Mapping[str, np.ndarray]) -> "Density":
        """Return the density of a state."""
        near = state_part(state, "near/")
        wide = state_part(state, "wide/")
        return cls(
            MomentField.restored(near) if near else None,
            MomentField.restored(wide) if wide else None,
            float(state["reference"]),
        )


def _fitted(
    bends: _Bends,
    models: np.ndarray,
    moments: np.ndarray,
    columns: np.ndarray,
    amplitudes: np.ndarray,
) -> _Process:
    """Fit some columns of the moments (S, Q), which have these amplitudes."""
    features = bends.features(models)
    missed = bends.missed(features)
    weights = np.empty((features.shape[1], len(columns)))
    spreads = []
    for amplitude in np.unique(amplitudes):
        sharing = amplitudes == amplitude
        # a trial far from all points says less of the weights
        weighted = features / (1 + amplitude * missed)[:, None]
        scales = bends.scales(amplitude)
        factor = _precision_factor(weighted.T @ features, scales)
        products = weighted.T @ moments[:, columns[sharing]]
        weights[:, sharing] = scales[:, None] * cho_solve(
            (factor, True), scales[:, None] * products, check_finite=False
        )
        spread = (
            scales[:, None]
            * solve_triangular(factor, np.eye(len(factor)), lower=True, check_finite=False).T
        )
        spreads.append((float(amplitude), columns[sharing], spread))
    return _Process(bends, columns, weights, spreads)


def _precision_factor(squares: np.ndarray, scales: np.ndarray) -> np.ndarray:
    """Return the Cholesky factor of the weights' precision, in units of the scales.

    Noise has variance 1.
    """
    precision = squares * np.outer(scales, scales)
    precision[np.diag_indices(len(precision))] += 1
    return cholesky(precision, lower=True, overwrite_a=True, check_finite=False)


def _likeliest_shapes(models: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """Return length and amplitude (Q, 2) of each moment by evidence.

    Shorter lengths are tried as long as the last one is the best so far for some moment: the
    shorter, the more features there are.
    """
    shapes = np.empty((moments.shape[1], 2))
    highest = np.full(moments.shape[1], -np.inf)
    for length in MOMENT_LENGTHS:
        bends = _Bends.of(models, length, MISSED_BY_EVIDENCE / MOMENT_AMPLITUDES[-1])
        features = bends.features(models)
        squares = features.T @ features
        products = features.T @ moments
        best_so_far = highest
        for amplitude in MOMENT_AMPLITUDES:
            scales = bends.scales(amplitude)
            factor = _precision_factor(squares, scales)
            explained = solve_triangular(
                factor, scales[:, None] * products, lower=True, check_finite=False
            )
            # but for a constant, by the matrix inversion lemma
            evidence = 0.5 * (explained**2).sum(axis=0) - np.log(np.diag(factor)).sum()
            shapes[evidence > highest] = length, amplitude
            highest = np.maximum(highest, evidence)
        if (highest == best_so_far).all():
            break
    return shapes


def _kernel(first: np.ndarray, second: np.ndarray, halves: np.ndarray) -> np.ndarray:
    """Return exp(-d^2 / 2) (N, B) of points (N, P) and (B, P) in length scales.

    Their distance is d; `halves` (B,) are half the squares of the second ones.
    """
    exponents = first @ second.T
    exponents -= 0.5 * (first**2).sum(axis=1)[:, None]
    exponents -= halves
    return np.exp(exponents, out=exponents)
