"""The parameters with which classifiers judge a model as they judge the agents, and how surely the samples tell them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from turing_learning.arrays import array
from turing_learning.errors import require

from ._draws import draw
from ._emulator import Emulator, conditioned, learned_kernel, surprise
from ._modes import modes

FOLDS = 5
"""Parts of the counterfeit samples; what is learned from four is applied to the fifth."""

TAIL = 0.05
"""Share of the draws beyond each end of an interval."""

FEWEST = 30
"""Counterfeit samples below which there is nothing to regress."""

WHOLE = 1.2
"""Central 90 % of draws as wide as that, on a range of 2, tell nothing: 1.8 is all of it."""

TRUST = 0.7
"""Share of the samples at which the prediction is sure enough for draws."""

SURE = 0.25
"""Variance of a prediction, in units of that of the target, that is sure enough in any case."""

TIGHT = 0.5
"""Squared distance in judgment, in units of the noise of one sample, within which samples are too much alike to tell slopes."""

TELLING = 4.0
"""Squared distance, in the same units, up to which samples are taken in place of half of those."""

LONGER = 2.5
"""By how much length scales of the fine fit may be longer than those of the broad one."""

FAR = 1 / 7
"""Share of the samples of a broad fit that are from anywhere: they rule out what is far."""

RULED_OUT = 20.0
"""Half the squared misses beyond which a broad fit rules models out: twenty judgments do so by chance in one of a hundred cases."""

PROPOSED = 0.16
"""Power of the likelihood that further samples are proposed by: 2.5 times as wide as the draws."""

CHANCES = 1000
"""Means of samples of the model that the distance is held against."""

LEAST_P, MOST_MOVED, LEAST_CANARY = 0.005, 3.0, 0.6
"""Bounds within which `Matched.settled` is said of a solution."""

ALIKE, FARTHEST = 10.0, 20.0
"""Distances up to which solutions from other trials are mixed, and are solutions at all."""

ROUNDS = 4
"""How often samples near the solution are chosen anew."""

REACHES = 0.0, 0.14, 0.01
"""Weights, relative to the largest, down to which the samples of a fine fit are taken; 0 takes the nearest alone."""


@dataclass(frozen=True)
class Matched:
    """The solution of a matching, see `match`.

    Parameters
    ----------
    estimate : (P,)
        Median of the draws.
    covariance : (P, P)
        Covariance of the draws.
    interval_low, interval_high : (P,)
        Ends of the central 90 % of the draws; NaN where none can be given.
    draws : (D, P)
        Parameters that explain the judgments, in proportion to how well they do.
    proposals : (D, P)
        Where further samples would tell most: parameters at some distance from those that explain the
        judgments, also where little is known.
    identified : (P,) bool
        Whether the judgments say something of the parameter: whether its draws cover less than the range.
    settled
        Whether intervals can be given: classifiers do not tell the model from the agents, halves of the
        samples agree, and the canary has its range.
    distance, p_value
        How far the classifiers still tell the model with the estimate from the agents, and how often they would
        by chance.
    leverage
        Variance of the predicted judgment at the estimate, in units of that of one sample: one by the number of
        samples that it rests on.
    canary
        Share of its range that a parameter without any effect, added to all, was left.
    moved
        How far the solutions of two halves of the samples are apart, in standard deviations of the draws: the
        most of all.
    mode : (D,) int
        To which solution each of the draws belongs, 0 that of most: see `modes`.
    """

    estimate: np.ndarray
    covariance: np.ndarray
    interval_low: np.ndarray
    interval_high: np.ndarray
    draws: np.ndarray
    proposals: np.ndarray
    identified: np.ndarray
    settled: bool
    distance: float
    p_value: float
    leverage: float
    canary: float
    moved: float
    mode: np.ndarray

    @property
    def order(self) -> tuple[bool, float]:
        """What is less for the better one of two solutions; one that rests on less than a sample says nothing."""
        return not self.settled or self.leverage > 1, self.distance


def combined(found: Sequence[Matched], wide: np.ndarray) -> Matched:
    """Mix the draws of the solutions that classifiers tell least from the agents, as one solution, within +-wide (P,)."""
    best = min(found, key=lambda each: each.order)
    most = max(best.distance, ALIKE)
    alike = [each for each in found if each.order <= (False, most)] or [best]
    draws = np.concatenate([each.draws for each in alike])[:: len(alike)]
    low, high = np.quantile(draws, [TAIL, 1 - TAIL], axis=0)
    known, settled = high - low < WHOLE * wide, best.order <= (False, FARTHEST)
    return replace(
        best,
        estimate=np.median(draws, axis=0),
        covariance=np.atleast_2d(np.cov(draws.T)),
        interval_low=np.where(known, low, -wide) if settled else np.full(len(low), np.nan),
        interval_high=np.where(known, high, wide) if settled else np.full(len(low), np.nan),
        draws=draws,
        identified=known,
        settled=settled,
        mode=np.zeros(len(draws), dtype=np.int64),
    )


# Sums in one order; the matrices are too small for threads.
@threadpool_limits.wrap(limits=1, user_api="blas")  # type: ignore[untyped-decorator]
def match(
    parameters: np.ndarray, counterfeit_outputs: np.ndarray, genuine_outputs: np.ndarray, *, low: np.ndarray,
    high: np.ndarray, start: np.ndarray, spread: np.ndarray, recordings: np.ndarray | None = None,
    averaged: int = 1, farther: bool = False, rng: np.random.Generator, draws: int = 600, size: int = 1200,
) -> Matched:  # fmt: skip
    """Find the parameters whose samples every classifier judges as it judges the genuine ones.

    Parameters
    ----------
    parameters : (S, P)
        Of the model of each counterfeit sample; equal rows are samples of one model.
    counterfeit_outputs : (J, S)
        Outputs of the classifiers for the counterfeit samples.
    genuine_outputs : (J, K)
        Their outputs for the genuine samples.
    low, high : (P,)
        The range of each parameter, within which all values are equally likely beforehand.
    start, spread : (P,)
        Where to look, and how far around: samples count the less the farther they are.
    recordings : (K,)
        A label for each genuine sample; those with the same one are alike. None: each is on its own.
    averaged
        Number of samples of one trial that each counterfeit output is the mean of. As many genuine samples
        count as one, because they may be of one trial, too.
    farther
        Whether fits to samples from farther out are tried, where a third of all is more than `size`. The
        narrowest draws may lose models that are equally good.
    rng
        For the folds and the draws.
    draws
        How many of them, D.
    size
        How many of the nearest counterfeit samples the regression is fitted to; a third of them all where that
        is more.

    Notes
    -----
    1. From the outputs for the samples of four fifths of the models, the parameters are predicted by ridge
       regression: one composite judgment for each parameter. It is applied to the other fifth, and to the
       genuine samples.
    2. Near the solution the mean composite judgments are Gaussian processes of the parameters (`Emulator`), the
       covariance of single samples about them is that of the left-out residuals.
    3. Parameters are the likelier the nearer the mean judgment predicted for them is to that of the genuine
       samples, in units of the covariance of both. Draws from this likelihood, uniform beforehand, follow every
       bend of it. Those of the canary test the fit; for the interval the canary is held at its middle, because
       its lack of effect is known.
    4. The samples nearest in judgment to the agents are chosen, and all is done again; at last with these
       alone, within what the fit before, which knows samples from anywhere, does not rule out. Where the
       nearest lie closer together than the noise of one, half are taken from farther out, by how much they tell
       of slopes.
    5. The nearest of very many samples are too much alike to tell how judgments change with the parameters. If
       `farther`, as many are also taken evenly from farther out, twice, and the fit with the narrowest draws
       counts among those that pass the checks of `settled`.

    Source
    ------
    docs/decisions/0028. Fearnhead and Prangle, Constructing summary statistics for approximate Bayesian computation (2012);
    Price et al., Bayesian synthetic likelihood (2018); Goodman and Weare, Ensemble samplers with affine invariance (2010).
    """
    parameters = array("parameters", parameters, "S P")
    x = array("counterfeit_outputs", counterfeit_outputs, "J S", S=len(parameters)).T
    g = array("genuine_outputs", genuine_outputs, "J K", J=x.shape[1]).T
    low, high, start, spread = (
        array(name, value, "P", P=parameters.shape[1])
        for name, value in (("low", low), ("high", high), ("start", start), ("spread", spread))
    )
    require(len(parameters) >= FEWEST, "parameters", f"be at least {FEWEST} models", str(len(parameters)))
    require((low < high).all(), "low", "be below `high`", low)
    require((spread > 0).all(), "spread", "be positive", spread)
    if recordings is not None:
        require(len(recordings) == len(g), "recordings", "be a label for each genuine sample", str(len(recordings)))
        groups = len(np.unique(recordings))
        require(groups > 1, "recordings", "tell at least 2 groups apart", str(groups))
    require(len(g) > 1, "genuine_outputs", "be of at least 2 samples", str(len(g)))
    require(averaged >= 1, "averaged", "be 1 or more", str(averaged))
    units = (high - low) / 2
    z, center, width = (parameters - low) / units - 1, (start - low) / units - 1, spread / units
    model = np.unique(z, axis=0, return_inverse=True)[1].reshape(-1)
    fold, canary = rng.permutation(model.max() + 1)[model] % FOLDS, rng.uniform(-1, 1, model.max() + 1)[model]
    varies = x.std(axis=0) > 1e-4
    x, g = x[:, varies], g[:, varies]
    mean, scale = x.mean(axis=0), x.std(axis=0)
    reaches = REACHES if farther and len(z) // 3 > size else REACHES[:1]
    size = min(max(size, len(z) // 3), max(len(z) // 2, 250))
    samples = _Samples(np.c_[z, canary], (x - mean) / scale, (g - mean) / scale, fold, recordings, averaged, size)
    middle, logs = np.append(center, 0.0), None
    near: np.ndarray = (((samples.z - middle) / np.append(width, 1.0)) ** 2).sum(axis=1)
    for _ in range(ROUNDS):
        broad = samples.fit(near, logs, FAR)
        logs, near = broad.emulator.logs, broad.remoteness(samples.z)
        points = draw(broad.log_likelihood, broad.points, draws, rng)
        before, middle = middle, np.median(points, axis=0)
        if (np.abs(middle - before) / points.std(axis=0)).max() < 0.2:
            break
    proposals = draw(partial(broad.log_likelihood, hopeful=True), broad.points, draws, rng, PROPOSED)[:, :-1]
    broadly, fits = points, []
    for reach in reaches:
        local = replace(samples.fit(near, logs, 0.0, reach), region=broad)
        if not np.isfinite(local.log_likelihood(local.points)).any():  # the two fits contradict each other
            local = broad
        points = draw(local.log_likelihood, np.r_[local.points, broadly], draws, rng)
        low_c, high_c = np.quantile(points[:, -1], [TAIL, 1 - TAIL])
        left, moved = float((high_c - low_c) / (2 - 4 * TAIL)), _moved_by_halves(local, points, rng)
        points = points[:, :-1]
        if np.isfinite(local.without_canary(points)).any():  # else the canary has lost the middle of its range
            points = draw(local.without_canary, points, draws, rng)
        fits.append(_Solution(local, points, left, moved))
    best = min(fits, key=lambda fit: (fit.doubtful, float(np.log(np.maximum(np.diff(fit.ends, axis=0), 1e-300)).sum())))
    middle, (low_z, high_z) = np.median(best.points, axis=0), best.ends
    known = high_z - low_z < WHOLE
    leverage = float(best.local.emulator.predict(np.append(middle, 0.0)[None])[1].mean())
    distance, p_value = samples.distance(best.local, near, leverage, rng)
    settled = p_value >= LEAST_P and not best.doubtful
    return Matched(
        estimate=low + units * (middle + 1),
        covariance=np.atleast_2d(np.cov(best.points.T)) * np.outer(units, units),
        interval_low=np.where(known, low + units * (low_z + 1), low) if settled else np.full(len(low), np.nan),
        interval_high=np.where(known, low + units * (high_z + 1), high) if settled else np.full(len(low), np.nan),
        draws=low + units * (best.points + 1),
        proposals=low + units * (proposals + 1),
        identified=known,
        settled=settled,
        distance=distance,
        p_value=p_value,
        leverage=leverage,
        canary=best.canary,
        moved=best.moved,
        mode=modes(best.points, best.local.without_canary),
    )


@dataclass(frozen=True)
class _Local:
    """Composite judgments, one for each parameter, as functions of the parameters, and where those of the agents are."""

    emulator: Emulator
    points: np.ndarray  # (N, P), that it was fitted to
    outputs: np.ndarray  # (N, P), composite judgments there
    trust: float  # largest variance of a prediction that counts
    target: np.ndarray  # (P,), in units of the noise of one sample
    covariance: np.ndarray  # (P, P), of the target, likewise
    region: "_Local | None" = None  # what else must not rule models out

    def remoteness(self, z: np.ndarray) -> np.ndarray:
        """Return how far (S,) models are judged from the agents, in standard deviations of one sample, squared."""
        distances: np.ndarray = ((self.emulator.mean(z) - self.target) ** 2).sum(axis=1)
        return distances

    def log_likelihood(self, z: np.ndarray, hopeful: bool = False, least: np.ndarray | None = None) -> np.ndarray:
        """Return the logarithm (S,) of the likelihood of the target; minus infinity outside the range.

        If hopeful, models of which little is known are not held to be unlikely. What is below `least` (S,) need
        not be exact.
        """
        inside = (np.abs(z) <= 1).all(axis=1)
        mean, extra = self.emulator.predict(z[inside])
        squares, half_logs = surprise(mean - self.target, extra, self.covariance)
        values = -0.5 * squares
        if not hopeful:
            values -= half_logs
        result = np.full(len(z), -np.inf)
        result[inside] = np.where(extra.mean(axis=1) <= self.trust, values, -np.inf)
        if self.region is not None:
            counts = result > (-np.inf if least is None else least)
            ruled_out = self.region.log_likelihood(z[counts], hopeful=True) <= -RULED_OUT
            result[np.flatnonzero(counts)[ruled_out]] = -np.inf
        return result

    def without_canary(self, z: np.ndarray, least: np.ndarray | None = None) -> np.ndarray:
        """Return the likelihood of models (S, P - 1) without the last parameter, which is known to have no effect."""
        return self.log_likelihood(np.c_[z, np.zeros(len(z))], least=least)


@dataclass(frozen=True)
class _Solution:
    """A fit, its draws (D, P), and what its checks say; see `Matched`."""

    local: _Local
    points: np.ndarray
    canary: float
    moved: float

    @property
    def doubtful(self) -> bool:
        return self.moved > MOST_MOVED or self.canary < LEAST_CANARY

    @property
    def ends(self) -> np.ndarray:
        return np.quantile(self.points, [TAIL, 1 - TAIL], axis=0)


@dataclass(frozen=True, eq=False)
class _Samples:
    """What the classifiers say of samples: outputs in units of their spread over the counterfeit ones, those that vary."""

    z: np.ndarray  # (S, P), parameters of the models on [-1, 1], the canary the last
    x: np.ndarray  # (S, J), outputs for the counterfeit samples
    g: np.ndarray  # (K, J), outputs for the genuine ones
    fold: np.ndarray  # (S,)
    recordings: np.ndarray | None  # (K,)
    averaged: int
    size: int

    def widened(self, remoteness: np.ndarray) -> np.ndarray:
        """Return weights (S,) that fall with the remoteness of samples, slowly enough for a regression."""
        wanted = min(self.size / 2, 0.7 * len(remoteness))
        factor = 1.0
        while True:
            weights = np.exp(-0.5 * (remoteness - remoteness.min()) / factor**2)
            if weights.sum() ** 2 >= wanted * (weights**2).sum() or factor > 1e4:
                return weights
            factor *= 1.1

    def fit(self, near: np.ndarray, logs: np.ndarray | None, far: float, reach: float = 0.0) -> _Local:
        """Predict composite judgments as functions of the parameters, from samples by their remoteness (S,).

        A share `far` of them is from anywhere; with a `reach` they are taken evenly down to that weight. Length scales
        are sought from those in `logs`, see `Emulator`.
        """
        # composite judgments: of each fold by what was learned from the others
        weights = self.widened(near)
        broad = np.sqrt(weights)
        t, judged = np.zeros_like(self.z), np.zeros((len(self.g), self.z.shape[1]))
        for part in range(FOLDS):
            out = self.fold == part
            middle, readout, offset = _readout(self.x[~out], self.z[~out], broad[~out])
            t[out] = (self.x[out] - middle) @ readout + offset
            judged += ((self.g - middle) @ readout + offset) / FOLDS
        t, judged = t[:, :-1], judged[:, :-1]
        # the samples that count
        order = np.argsort(-weights, kind="stable")
        few, remote = round(self.size * (1 - far)), near[order] - near.min()
        if reach:
            inside = max(few, int((weights > reach * weights.max()).sum()))
            chosen = order[np.linspace(0, inside - 1, few).astype(int)]
        elif not far and remote[min(few, len(remote)) - 1] < TIGHT:  # half of them by how much they tell of slopes
            lever, half = np.cumsum(remote[remote < TELLING]), few // 2
            spread = np.searchsorted(lever, lever[-1] * (np.arange(half) + 0.5) / half)
            chosen = order[np.unique(np.r_[: min(half, len(order)), spread])]
        else:
            chosen = np.r_[order[:few], order[few :: max((len(order) - few) // max(self.size - few, 1), 1)]]
        z, t, weights = self.z[chosen], t[chosen], weights[chosen] / weights.max()
        # composite judgments as functions of the parameters, in units of the noise of one sample
        f, root = np.c_[np.ones(len(z)), z], np.sqrt(weights)[:, None]
        expected = f @ np.linalg.lstsq(root * f, root * t, rcond=None)[0]
        misses, offset = t - expected, np.average(t, axis=0, weights=weights)
        longer = np.inf if far else LONGER
        for _ in range(2):  # the second time with the covariance that the first has found
            residual = (misses * weights[:, None]).T @ misses / weights.sum()
            residual += 1e-6 * np.trace(residual) / len(residual) * np.eye(len(residual))
            values, vectors = np.linalg.eigh(residual)
            whiten = vectors / np.sqrt(values)
            whiten = whiten @ np.linalg.svd((expected - offset) @ whiten, full_matrices=False)[2].T
            outputs = (t - offset) @ whiten
            logs, longer = learned_kernel(z, outputs, logs, longer), min(longer, LONGER)
            emulator = conditioned(z, outputs, logs)
            mean, variance = emulator.predict(z)  # as if left out, less what the emulator does not know: noise alone
            known = np.maximum(1 - variance, 0.2)
            misses = (outputs - mean) / (known * np.sqrt(1 + variance / known)) @ np.linalg.inv(whiten)
        residual = (misses * weights[:, None]).T @ misses / weights.sum()
        target, covariance = self.target(judged, residual)
        covariance = whiten.T @ covariance @ whiten
        sure = SURE * float(np.trace(covariance)) / len(covariance)
        trust = max(float(np.quantile(variance.mean(axis=1), TRUST)), sure)
        return _Local(emulator, z, outputs, trust, (target - offset) @ whiten, covariance)

    def target(self, judged: np.ndarray, residual: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the mean composite judgment of genuine samples and its covariance.

        Few samples say little of their own covariance: that of the model's samples stands in for 2 P + 10 of them.
        It knows nothing of recordings that differ; where there are labels, it stands in for 2, and the rest is as
        uncertain as Student's t has it. Where trials have several samples, it is the least that is expected, as
        samples of one trial are alike.
        """
        mean, count = judged.mean(axis=0), len(judged)
        expected = residual * self.averaged / count
        if self.recordings is None:
            prior, own = 2 * judged.shape[1] + 10, np.atleast_2d(np.cov(judged.T)) / count
            if self.averaged > 1:
                factor = np.linalg.cholesky(expected)
                values, vectors = np.linalg.eigh(np.linalg.solve(factor, np.linalg.solve(factor, own).T))
                own = factor @ (vectors * np.maximum(values, 1)) @ vectors.T @ factor.T
            return mean, (prior * expected + count * own) / (prior + count)
        groups = np.unique(self.recordings, return_inverse=True)[1]
        sums = np.zeros((groups.max() + 1, judged.shape[1]))
        np.add.at(sums, groups, judged - mean)
        few = len(sums)
        own = sums.T @ sums / count**2 * few / max(few - 3, 1)
        return mean, (2 * expected + few * own) / (2 + few)

    def distance(
        self, local: _Local, near: np.ndarray, leverage: float, rng: np.random.Generator
    ) -> tuple[float, float]:
        """Return the mean squared miss over classifiers, in standard errors, and how often samples of the model exceed it.

        The model is the one that composite judgments, predicted for each sample, say; their misses are not counted.
        """
        weights, places, g = self.widened(near), local.emulator.mean(self.z), self.g
        few = np.argsort(-weights, kind="stable")[: int(weights.sum() ** 2 / (weights**2).sum())]
        x, d = self.x[few], (places - local.target)[few]
        d = d[:, d.std(axis=0) > 0.1]
        first, second = np.triu_indices(d.shape[1])
        f = np.c_[np.ones(len(d)), d, d[:, first] * d[:, second]]
        penalty = np.repeat([1e-9, 1.0, 4.0], [1, d.shape[1], len(first)])  # slopes of about 1, bends of about 1/2
        inverse = np.linalg.inv(f.T @ f + np.diag(penalty))
        coefficients = inverse @ (f.T @ x)
        misses = x - f @ coefficients
        count = max(round(len(g) / self.averaged), 2)
        # genuine events may be rare
        scale = np.maximum(misses.std(axis=0), g.std(axis=0) / np.sqrt(self.averaged)) + 1e-9
        basis = np.linalg.qr((coefficients[1 : 1 + d.shape[1]] / scale).T)[0]

        def statistic(means: np.ndarray) -> np.ndarray:
            means = means / scale
            rest = means - (means @ basis) @ basis.T
            squares: np.ndarray = (rest**2).mean(axis=1) * count
            return squares

        # how often each sample is drawn, in each of the simulated means
        drawn = rng.integers(len(x), size=(CHANCES, count)) + len(x) * np.arange(CHANCES)[:, None]
        shares = np.bincount(drawn.ravel(), minlength=CHANCES * len(x)).reshape(CHANCES, len(x)) / count
        simulated = statistic(shares @ misses) * (1 + count * (inverse[0, 0] + leverage))
        observed = float(statistic((g.mean(axis=0) - coefficients[0])[None])[0])
        return observed, float((1 + (simulated >= observed).sum()) / (1 + len(simulated)))


def _readout(x: np.ndarray, z: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Regress parameters on outputs, with the ridge that predicts best by generalized cross-validation."""
    share = weights / weights.sum()
    middle, offset = share @ x, share @ z
    x, z = x - middle, z - offset
    weighted = x * weights[:, None]
    values, vectors = np.linalg.eigh(x.T @ weighted)
    values, projected = np.maximum(values, 0), vectors.T @ (weighted.T @ z)
    total = weights @ z**2
    effective = weights.sum() ** 2 / (weights**2).sum()
    best, score = values[-1], np.inf
    for ridge in values[-1] * 10.0 ** np.arange(-7, 1):
        shrunk = projected / (values + ridge)[:, None]
        left = (total - (shrunk * (2 * projected - values[:, None] * shrunk)).sum(axis=0)) / total
        freedom = 1 - min((values / (values + ridge)).sum() / effective, 0.99)
        if left.sum() / freedom**2 < score:
            best, score = ridge, left.sum() / freedom**2
    return middle, vectors @ (projected / (values + best)[:, None]), offset


def _moved_by_halves(local: _Local, points: np.ndarray, rng: np.random.Generator) -> float:
    """Return how far the solutions of two halves of the samples are apart: the most of all parameters, in standard deviations."""
    order, means = rng.permutation(len(local.points)), []
    before = local.log_likelihood(points)
    for half in np.array_split(order, 2):
        emulator = conditioned(local.points[half], local.outputs[half], local.emulator.logs)
        after = replace(local, emulator=emulator, trust=np.inf, region=None).log_likelihood(points)
        weights = np.exp(after - before - (after - before).max())
        means.append(weights @ points / weights.sum())
    return float((np.abs(means[0] - means[1]) / points.std(axis=0)).max())
