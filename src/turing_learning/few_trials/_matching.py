"""The parameters with which classifiers judge a model as they judge the agents, and how surely the
samples tell them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from turing_learning.arrays import array
from turing_learning.errors import require

from ._draws import draw
from ._emulator import conditioned
from ._likelihood import SAMPLE_FOLDS, JudgedSamples, Likelihood
from ._modes import modes

INTERVAL_TAIL = 0.05
"""Share of the draws beyond each end of an interval."""

FEWEST_COUNTERFEIT = 30
"""Counterfeit samples below which there is nothing to regress."""

UNTOLD_WIDTH = 1.2
"""Central 90 % of draws as wide as that, on a range of 2, tell nothing: 1.8 is all of it."""

FAR_SHARE = 1 / 7
"""Share of the samples of a broad fit that are from anywhere: they rule out what is far."""

LEAST_P = 0.005
"""p-value of the distance below which classifiers tell the model from the agents."""

HALVES_WITHIN = 3.0
"""Standard deviations by which the solutions of two halves of the samples may differ."""

LEAST_CANARY_RANGE = 0.6
"""Share of its range that the canary, a parameter without any effect, has to keep: a sound fit leaves all."""

MIXED_WITHIN = 10.0
"""Distance up to which solutions from other trials are mixed."""

FARTHEST_SOLUTION = 20.0
"""Distance up to which they are solutions at all."""

LEAST_DEVIATION = 1e-4
"""Standard deviation over the samples below which an output of a classifier does not vary."""

BROAD_FITS = 4
"""How often samples near the solution are chosen anew, at most."""

BROAD_DRAWS = 200
"""Draws by which it is seen where that solution is."""

STEADY_MIDDLE = 0.2
"""Standard deviations of the draws by which their median moves when that is no longer needed."""

WEIGHT_FLOORS = None, 0.14, 0.01
"""Weights, relative to the largest, down to which the samples of a fine fit are taken.

None takes the nearest alone; the smaller one is, the farther samples are from.
"""


@dataclass(frozen=True)
class Matched:
    """The solution of a matching, see `match`.

    Attributes
    ----------
    estimate : (P,)
        Median of the draws.
    covariance : (P, P)
        Covariance of the draws.
    interval_low, interval_high : (P,)
        Ends of the central 90 % of the draws; NaN where none can be given.
    draws : (D, P)
        Parameters that explain the judgments, in proportion to how well they do.
    identified : (P,) bool
        Whether the judgments say something of the parameter: whether the draws of each solution
        cover less than the range.
    passed_checks
        Whether intervals can be given: classifiers do not tell the model from the agents, halves of
        the samples agree, and the canary has its range.
    distance, p_value
        How far the classifiers still tell the model with the estimate from the agents, and how
        often they would by chance.
    leverage
        Variance of the predicted judgment at the estimate, in units of that of one sample: one by
        the number of samples that it rests on.
    canary_range
        Share of its range that a parameter without any effect, added to all, was left.
    halves_apart
        How far the solutions of two halves of the samples are apart, in standard deviations of the
        draws: the most of all parameters.
    mode : (D,) int
        To which solution each of the draws belongs, 0 that of most: see `modes`.
    """

    estimate: np.ndarray
    covariance: np.ndarray
    interval_low: np.ndarray
    interval_high: np.ndarray
    draws: np.ndarray
    identified: np.ndarray
    passed_checks: bool
    distance: float
    p_value: float
    leverage: float
    canary_range: float
    halves_apart: float
    mode: np.ndarray

    @property
    def usable(self) -> bool:
        """Whether it says anything: it has passed its checks, and rests on a sample or more."""
        return self.passed_checks and self.leverage <= 1

    @property
    def main_draws(self) -> np.ndarray:
        """Draws (N, P) of the solution that has most of them."""
        return self.draws[self.mode == 0]

    def with_draws(self, draws: np.ndarray) -> "Matched":
        """Return the same solution with other draws (N, P), and what these state."""
        low, high = np.quantile(draws, [INTERVAL_TAIL, 1 - INTERVAL_TAIL], axis=0)
        return replace(
            self,
            estimate=np.median(draws, axis=0),
            covariance=np.atleast_2d(np.cov(draws.T)),
            interval_low=np.where(self.identified, low, self.interval_low),
            interval_high=np.where(self.identified, high, self.interval_high),
            draws=draws,
            mode=np.zeros(len(draws), dtype=np.int64),
        )

    @property
    def sort_key(self) -> tuple[bool, float]:
        """Key by which the better one of two solutions comes first: a usable one, then the nearer."""
        return not self.usable, self.distance


def combined(solutions: Sequence[Matched], widest: np.ndarray) -> Matched:
    """Mix the solutions that classifiers tell least from the agents, within +-widest (P,).

    Draws and interval are of all that are mixed, the checks those of the best one.
    """
    best = min(solutions, key=lambda matched: matched.sort_key)
    farthest = max(best.distance, MIXED_WITHIN)
    mixed = [
        alternative for alternative in solutions if alternative.sort_key <= (False, farthest)
    ] or [best]
    # as many draws as one solution has
    draws = np.concatenate([alternative.draws for alternative in mixed])[:: len(mixed)]
    low, high = np.quantile(draws, [INTERVAL_TAIL, 1 - INTERVAL_TAIL], axis=0)
    identified = high - low < UNTOLD_WIDTH * widest
    passed_checks = best.sort_key <= (False, FARTHEST_SOLUTION)
    unknown = np.full(len(low), np.nan)
    return replace(
        best,
        estimate=np.median(draws, axis=0),
        covariance=np.atleast_2d(np.cov(draws.T)),
        interval_low=np.where(identified, low, -widest) if passed_checks else unknown,
        interval_high=np.where(identified, high, widest) if passed_checks else unknown,
        draws=draws,
        identified=identified,
        passed_checks=passed_checks,
        mode=np.zeros(len(draws), dtype=np.int64),
    )


# Sums in one order; the matrices are too small for threads.
@threadpool_limits.wrap(limits=1, user_api="blas")  # type: ignore[untyped-decorator]
def match(
    parameters: np.ndarray,
    counterfeit_outputs: np.ndarray,
    genuine_outputs: np.ndarray,
    *,
    low: np.ndarray,
    high: np.ndarray,
    start: np.ndarray,
    spread: np.ndarray,
    samples_per_trial: int = 1,
    farther: bool = False,
    rng: np.random.Generator,
    draws: int = 600,
    size: int = 1200,
) -> Matched:
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
    samples_per_trial
        Number of samples of one trial that each counterfeit output is the mean of. As many genuine
        samples count as one, because they may be of one trial, too.
    farther
        Whether fits to samples from farther out are tried, where a third of all is more than
        `size`. The narrowest draws may lose models that are equally good.
    rng
        For the folds and the draws.
    draws
        How many of them, D.
    size
        How many of the nearest counterfeit samples the regression is fitted to: a third of them all
        where that is more, and half (at least 250) where that is fewer.

    Notes
    -----
    1. From the outputs for samples of four fifths of the models, the parameters are predicted by
       ridge regression: one composite judgment for each parameter. It is applied to the other
       fifth, and to the genuine samples.
    2. Near the solution the mean composite judgments are Gaussian processes of the parameters
       (`Emulator`), the covariance of single samples about them is that of the left-out residuals.
    3. Parameters are the likelier the nearer the mean judgment predicted for them is to that of the
       genuine samples, in units of the covariance of both. Draws from this likelihood, uniform
       beforehand, follow every bend of it. Those of the canary test the fit; for the interval the
       canary is held at its middle, because its lack of effect is known.
    4. The samples nearest in judgment to the agents are chosen, and all is done again; at last with
       these alone. The fit before, to which samples from anywhere belong, says then what is ruled
       out. Where the nearest lie closer together than the noise of one, half are taken from farther
       out, by how much they tell of slopes.
    5. The nearest of very many samples are too much alike to tell how judgments change with the
       parameters. If `farther`, as many are also taken evenly from farther out, twice, and the fit
       with the narrowest draws counts among those that pass the checks of `passed_checks`.

    Source
    ------
    docs/decisions/0028; see `_likelihood` and `_draws`.
    """
    parameters = array("parameters", parameters, "S P")
    x = array("counterfeit_outputs", counterfeit_outputs, "J S", S=len(parameters)).T
    g = array("genuine_outputs", genuine_outputs, "J K", J=x.shape[1]).T
    dimension = parameters.shape[1]
    low = array("low", low, "P", P=dimension)
    high = array("high", high, "P", P=dimension)
    start = array("start", start, "P", P=dimension)
    spread = array("spread", spread, "P", P=dimension)
    enough = len(parameters) >= FEWEST_COUNTERFEIT
    require(enough, "parameters", f"be at least {FEWEST_COUNTERFEIT} models", str(len(parameters)))
    require((low < high).all(), "low", "be below `high`", low)
    require((spread > 0).all(), "spread", "be positive", spread)
    require(len(g) > 1, "genuine_outputs", "be of at least 2 samples", str(len(g)))
    require(samples_per_trial >= 1, "samples_per_trial", "be 1 or more", str(samples_per_trial))

    units = (high - low) / 2
    judged = _prepared((parameters - low) / units - 1, x, g, samples_per_trial, size, rng)
    # The canary is looked for in all its range.
    middle = np.append((start - low) / units - 1, 0.0)
    width = np.append(spread / units, 1.0)
    broad = _broad_fit(judged, middle, width, rng)

    floors: Sequence[float | None] = WEIGHT_FLOORS[:1]
    if farther and len(parameters) // 3 > size:
        floors = WEIGHT_FLOORS
    fits = [_fine_fit(judged, broad, floor, draws, rng) for floor in floors]
    best = min(fits, key=lambda fit: (fit.doubtful, fit.log_volume))

    mode = modes(best.points, best.likelihood.without_canary)
    identified = identified_by(best.points, mode, UNTOLD_WIDTH)
    middle = np.median(best.points, axis=0)
    at_middle = np.append(middle, 0.0)[None]
    leverage = float(best.likelihood.emulator.predict(at_middle)[1].mean())
    distance, p_value = judged.distance(best.likelihood, broad.remoteness, leverage, rng)
    passed_checks = p_value >= LEAST_P and not best.doubtful
    # Of what classifiers do not tell the whole range is stated, of a fit in doubt nothing.
    interval_low = np.full(len(low), np.nan)
    interval_high = np.full(len(low), np.nan)
    if passed_checks:
        ends = low + units * (best.ends + 1)
        interval_low = np.where(identified, ends[0], low)
        interval_high = np.where(identified, ends[1], high)
    return Matched(
        estimate=low + units * (middle + 1),
        covariance=np.atleast_2d(np.cov(best.points.T)) * np.outer(units, units),
        interval_low=interval_low,
        interval_high=interval_high,
        draws=low + units * (best.points + 1),
        identified=identified,
        passed_checks=passed_checks,
        distance=distance,
        p_value=p_value,
        leverage=leverage,
        canary_range=best.canary_range,
        halves_apart=best.halves_apart,
        mode=mode,
    )


def _prepared(
    z: np.ndarray,
    x: np.ndarray,
    g: np.ndarray,
    samples_per_trial: int,
    size: int,
    rng: np.random.Generator,
) -> JudgedSamples:
    """Return samples with parameters (S, P) on [-1, 1] as regressions need them.

    The canary, which no simulation knows, is added as the last parameter. Samples of one model are
    in one fold, and have one canary: they are no independent witnesses. Outputs that never vary say
    nothing, and go; the others get mean 0 and standard deviation 1.
    """
    model = np.unique(z, axis=0, return_inverse=True)[1].reshape(-1)
    models = model.max() + 1
    fold = rng.permutation(models)[model] % SAMPLE_FOLDS
    canary = rng.uniform(-1, 1, models)[model]
    varies = x.std(axis=0) > LEAST_DEVIATION
    rule = "return samples that classifiers can tell apart"
    remedy = "See whether it uses its parameters and `rng`."
    require(varies.any(), "simulate", rule, f"{len(x)} samples that all look alike", remedy)
    x = x[:, varies]
    mean = x.mean(axis=0)
    scale = x.std(axis=0)
    return JudgedSamples(
        parameters=np.c_[z, canary],
        counterfeit=(x - mean) / scale,
        genuine=(g[:, varies] - mean) / scale,
        fold=fold,
        samples_per_trial=samples_per_trial,
        size=min(max(size, len(z) // 3), max(len(z) // 2, 250)),
    )


@dataclass(frozen=True)
class _BroadFit:
    """A fit to samples near and far, which says which samples are near the agents."""

    likelihood: Likelihood
    #: (S,) squared distance of each sample from the agents, as the fit sees it
    remoteness: np.ndarray
    points: np.ndarray  #: draws (D, P + 1), the canary last


def _broad_fit(
    judged: JudgedSamples, middle: np.ndarray, width: np.ndarray, rng: np.random.Generator
) -> _BroadFit:
    """Fit again and again to the samples nearest to the solution, until its middle keeps its place.

    The first fit is to those nearest to `middle` (P + 1,), in units of `width` (P + 1,).
    """
    remoteness: np.ndarray = (((judged.parameters - middle) / width) ** 2).sum(axis=1)
    logs = None
    for _ in range(BROAD_FITS):
        likelihood = judged.fit(remoteness, logs, FAR_SHARE)
        logs = likelihood.emulator.logs
        remoteness = likelihood.remoteness(judged.parameters)
        points = draw(likelihood.log_likelihood, likelihood.points, BROAD_DRAWS, rng)
        before = middle
        middle = np.median(points, axis=0)
        if (np.abs(middle - before) / points.std(axis=0)).max() < STEADY_MIDDLE:
            break
    return _BroadFit(likelihood, remoteness, points)


def _fine_fit(
    judged: JudgedSamples,
    broad: _BroadFit,
    weight_floor: float | None,
    draws: int,
    rng: np.random.Generator,
) -> "_Solution":
    """Fit to the samples nearest to the agents alone, within what the broad fit does not rule out."""
    logs = broad.likelihood.emulator.logs
    nearest = judged.fit(broad.remoteness, logs, 0.0, weight_floor)
    fine = replace(nearest, broad=broad.likelihood)
    if not np.isfinite(fine.log_likelihood(fine.points)).any():
        # The two fits contradict each other.
        fine = broad.likelihood
    return _solved(fine, broad.points, draws, rng)


def identified_by(draws: np.ndarray, mode: np.ndarray, width: np.typing.ArrayLike) -> np.ndarray:
    """Say whether draws (D, P) tell each parameter (P,).

    They do if the central 90 % of those of each solution, by its number `mode` (D,), are narrower
    than a width. Of several solutions each may be narrow though they are far apart.
    """
    low, high = ends_of_modes(draws, mode).swapaxes(0, 1)
    narrow: np.ndarray = (high - low < width).all(axis=0)
    return narrow


def ends_of_modes(draws: np.ndarray, mode: np.ndarray) -> np.ndarray:
    """Return the ends (M, 2, P) of the central 90 % of the draws (D, P) of each solution, by its number `mode` (D,)."""
    solutions = [draws[mode == number] for number in range(int(mode.max()) + 1)]
    return np.stack(
        [
            np.quantile(solution, [INTERVAL_TAIL, 1 - INTERVAL_TAIL], axis=0)
            for solution in solutions
        ]
    )


@dataclass(frozen=True)
class _Solution:
    """A fit, its draws (D, P), and what its checks say; see `Matched`."""

    likelihood: Likelihood
    points: np.ndarray
    canary_range: float
    halves_apart: float

    @property
    def doubtful(self) -> bool:
        """Whether halves of the samples disagree, or the canary has lost its range."""
        return self.halves_apart > HALVES_WITHIN or self.canary_range < LEAST_CANARY_RANGE

    @property
    def ends(self) -> np.ndarray:
        """Ends of the central 90 % of the draws (2, P)."""
        return np.quantile(self.points, [INTERVAL_TAIL, 1 - INTERVAL_TAIL], axis=0)

    @property
    def log_volume(self) -> float:
        """Logarithm of the volume between these ends."""
        widths = np.diff(self.ends, axis=0)
        return float(np.log(np.maximum(widths, 1e-300)).sum())


def _solved(
    likelihood: Likelihood, broad_points: np.ndarray, draws: int, rng: np.random.Generator
) -> _Solution:
    """Draw from a likelihood, and check the draws.

    Draws begin at its own samples, and at those of a broad fit (D, P + 1).
    """
    start = np.r_[likelihood.points, broad_points]
    points = draw(likelihood.log_likelihood, start, draws, rng)
    low, high = np.quantile(points[:, -1], [INTERVAL_TAIL, 1 - INTERVAL_TAIL])
    canary_range = float((high - low) / (2 - 4 * INTERVAL_TAIL))
    halves_apart = _halves_apart(likelihood, points, rng)
    points = points[:, :-1]
    # Where no draw is likely with the canary at 0, in the middle of its range, those over all of it stay
    if np.isfinite(likelihood.without_canary(points)).any():
        points = draw(likelihood.without_canary, points, draws, rng, power=1.0)
    return _Solution(likelihood, points, canary_range, halves_apart)


def _halves_apart(likelihood: Likelihood, points: np.ndarray, rng: np.random.Generator) -> float:
    """Return how far the solutions of two halves of the samples are apart, see `Matched.halves_apart`.

    The draws (D, P + 1) of all samples are weighted by what each half says of them.
    """
    order = rng.permutation(len(likelihood.points))
    before = likelihood.log_likelihood(points)
    means = []
    for half in np.array_split(order, 2):
        emulator = conditioned(
            likelihood.points[half], likelihood.outputs[half], likelihood.emulator.logs
        )
        portion = replace(likelihood, emulator=emulator, trust=np.inf, broad=None)
        gain = portion.log_likelihood(points) - before
        weights = np.exp(gain - gain.max())
        means.append(weights @ points / weights.sum())
    return float((np.abs(means[0] - means[1]) / points.std(axis=0)).max())
