"""One model from many generations or runs, its uncertainty, and what is not known of it: NaN in Python, null in files."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import ndtri, stdtrit

from ..arrays import array
from ..errors import integer, require

UNKNOWN = math.nan
"""Stands for a number that is not known."""

WHY_UNKNOWN = "the typical model has not moved, or hardly, in the generations that make the estimate: run more generations"
"""Why an interval is not known, see `interval`."""

WHY_UNKNOWN_OF_TRIALS = (
    "the run had not settled, or its models differ from the system: run more trials"
)
"""Why an interval of a run of trials is not known."""

INTERVAL_PERCENTILES = (5.0, 95.0)
"""Percentiles that end the interval of an estimate."""

NORMAL = 1.6448536
"""The upper one, of the standard normal distribution."""

FEWEST_INDEPENDENT = 2.0
"""Independent values that even the slowest series is taken to hold."""

CONTRACTED = 0.3
"""Share of the spread of the first models below which a population has settled on a value."""

GUESSING = 0.51
"""Median fitness of the classifiers, over the last generations, up to which they guess; 0.5 is chance."""


def is_known(*values: float | None) -> bool:
    """Return whether there are all of these numbers: none of them is None or NaN."""
    return not any(value is None or math.isnan(value) for value in values)


def replace_unknown(
    instead: float | None, interval: Mapping[str, Sequence[float | None]]
) -> dict[str, list[Any]]:
    """Return an interval, name -> two ends, with something instead of each end that is not known.

    That is None for a file, and `UNKNOWN` in Python: as one and the same object, so that lists of it are equal.
    """
    replaced = {}
    for name, bounds in interval.items():
        replaced[name] = [bound if is_known(bound) else instead for bound in bounds]
    return replaced


def estimate(typical_models: np.ndarray, window: int = 100) -> np.ndarray:
    """Estimate the agent's parameters (P,): the median over the last generations of a run, parameter by parameter.

    The subjectively best model of the last generation is a noisy estimate: its fitness rests on a single trial,
    so it is drawn almost at random from a converged population. The typical model of a generation, the median
    of the better half of its models, varies less; the median of the typical models over many generations still
    less. Medians rather than means, because a population sometimes makes an excursion and returns. All of it
    costs no simulation.

    Parameters
    ----------
    typical_models : (G, P)
        Typical model of each generation, see `coevolution.Generation.typical_model`.
    window
        Number of generations taken, counted from the last, >= 1; all if there are fewer.
    """
    return np.median(_last(typical_models, window), axis=0)


def interval(typical_models: np.ndarray, window: int = 100) -> np.ndarray:
    """State the uncertainty of the estimate: an interval for each parameter (P, 2) that holds the truth nine times of ten.

    Near the truth the models wander where no classifier tells them apart; the range that they wander over is
    what the data leave open. It is read off the central 90 % of the typical models over the generations that
    make the estimate. A series that wanders slowly has shown little of its range: as much as n independent
    values would, n being the number of generations divided by the autocorrelation time. So both ends are moved
    away from the estimate, by the factor by which the next of normally distributed values, of which only n are
    known, is less certain: t(n - 1) sqrt(1 + 1 / n) / z, with the 95th percentiles of Student's t and the
    normal distribution. It is 1.1 for n = 15, 1.4 for 5, and 4.7 for 2.

    Where the models have not moved, nothing is known of the range, and so nothing of the interval, whose ends
    are NaN. That is so where the central 90 % are one and the same value: in very short runs, and where an
    output is saturated.

    That this range is about as wide as the errors is an observation, not a theorem: its coverage was measured,
    see docs/results.md. It says nothing of runs that settle in another region; `pooled_interval` of several
    runs does.

    Source: docs/decisions/0011 and 0022; Geyer, Practical Markov chain Monte Carlo (1992), for the
    autocorrelation time.

    Parameters
    ----------
    typical_models, window
        As for `estimate`.
    """
    tail = _last(typical_models, window)
    middle = np.median(tail, axis=0)
    bounds = np.percentile(tail, INTERVAL_PERCENTILES, axis=0)
    growth = np.full(tail.shape[1], UNKNOWN)
    for p in np.flatnonzero(_moves(tail)):
        growth[p] = _growth(_independent(tail[:, p]))
    return (middle + growth * (bounds - middle)).T


def _moves(typical_models: np.ndarray) -> np.ndarray:
    """Return whether the typical models (W, ...) move: whether their central 90 % are more than one value."""
    low, high = np.percentile(typical_models, INTERVAL_PERCENTILES, axis=0)
    return np.less(low, high)


def _growth(count: float) -> float:
    """Return by how much the range of so many independent values is to be widened."""
    return float(
        stdtrit(count - 1, INTERVAL_PERCENTILES[1] / 100) * np.sqrt(1 + 1 / count) / NORMAL
    )


def _independent(series: np.ndarray) -> float:
    """Return how many independent values tell as much as a series (W,) that moves, by Geyer's initial positive sequence."""
    count = len(series)
    deviations = series - series.mean()
    # twice as long, so that the end of the series does not meet its beginning
    spectrum = np.fft.rfft(deviations / np.abs(deviations).max(), 2 * count)
    correlations = np.fft.irfft(spectrum * spectrum.conj(), 2 * count)[:count]
    pairs = correlations[: count // 2 * 2].reshape(-1, 2).sum(axis=1) / correlations[0]
    positive = pairs
    if (pairs <= 0).any():
        positive = pairs[: int(np.argmax(pairs <= 0))]
    return max(count / max(2 * positive.sum() - 1, 1.0), FEWEST_INDEPENDENT)


def _last(typical_models: np.ndarray, window: int) -> np.ndarray:
    models = array("typical_models", typical_models, "G P", finite=False)
    return array("typical_models", models[-integer("window", window, 1) :], "G P")


def pooled_estimate(typical_models: np.ndarray) -> np.ndarray:
    """Estimate the agent's parameters (P,) from several runs: the median of the estimates of the runs, one by one.

    Parameters
    ----------
    typical_models : (runs, W, P)
        Typical models of the W generations that make the estimate of each of at least 2 runs.
    """
    return np.median(np.median(_checked_runs(typical_models), axis=1), axis=0)


def pooled_interval(typical_models: np.ndarray) -> np.ndarray:
    """State the uncertainty of the pooled estimate: an interval for each parameter (P, 2) that holds the truth nine times of ten.

    Two things keep an estimate from the truth. The models of a run wander: that is read off the central 90 %
    of their distances from the estimate of their run, all runs together, widened as in `interval` by the
    number of independent values. And runs settle in different regions: if the truth is to the runs what one
    more run would be, nine of ten truths are within t(runs - 1) sqrt(1 + 1 / runs) standard deviations of the
    runs' estimates, with the 95th percentile of Student's t. This factor is 2.6 for 4 runs, 2.0 for 8, and
    7.7 for 2. Each end is as far from the estimate as the root of the sum of the squares of the two.

    Where the runs agree, the interval of four is about as wide as that of one. Where they do not, it is some
    times their scatter, and that of two is very wide: two values say little of how they scatter. What shifts
    all runs alike it does not show.

    A run that has not moved (see `interval`) says where it has settled, and nothing of wandering: it counts in
    the scatter alone. Where no run has moved, each is one value of whatever scatters, and the scatter of the
    runs is all of it. Where neither a run has moved nor two differ, the interval is not known, and its ends are
    NaN.

    Source: docs/decisions/0026. The prediction interval of normally distributed regions: Higgins, Thompson and
    Spiegelhalter, A re-evaluation of random-effects meta-analysis (2009). Squares of two limits added: Graybill
    and Wang, Confidence intervals on nonnegative linear combinations of variances (1980).

    Parameters
    ----------
    typical_models
        As for `pooled_estimate`.
    """
    typical = _checked_runs(typical_models)
    estimates = np.median(typical, axis=1)
    count = len(typical)
    factor = stdtrit(count - 1, INTERVAL_PERCENTILES[1] / 100) * np.sqrt(1 + 1 / count)
    scatter = factor * estimates.std(axis=0, ddof=1)
    wandering = np.stack(list(map(_wandering, np.moveaxis(typical, 2, 0))), axis=1)
    low, high = np.hypot(wandering, scatter)
    varies = wandering.any(axis=0) | (np.ptp(estimates, axis=0) > 0)
    middle = np.median(estimates, axis=0)
    return np.where(varies[:, None], np.stack([middle - low, middle + high], axis=1), UNKNOWN)


def r_hat(typical_models: np.ndarray) -> np.ndarray:
    """Say how far the runs agree (P,): the potential scale reduction of the ranks, known from Markov chains.

    It compares the scatter of all values with the scatter within the runs. It is about 1 where runs cannot be
    told apart. Where no two share a value it is 2.1 for 2 runs, 3.1 for 4 and 4.6 for 8, however far apart they
    are. Ranks make it the same on any scale, and let no excursion of a run hide that the others disagree. The
    scatter within is that of the runs that have moved (see `interval`); NaN where none has.

    Source: Gelman and Rubin, Inference from iterative simulation using multiple sequences (1992); with normal
    scores of the ranks: Vehtari et al., Rank-normalization, folding, and localization: an improved R-hat
    (2021). Runs are not split into halves.

    Parameters
    ----------
    typical_models
        As for `pooled_estimate`.
    """
    typical = _checked_runs(typical_models)
    parameters = typical.shape[2]
    scores = normal_scores(typical.reshape(-1, parameters)).reshape(typical.shape)
    moves = _moves(np.moveaxis(typical, 1, 0))
    moving = moves.sum(axis=0)
    scatter = scores.var(axis=1).sum(axis=0, where=moves)
    unknown = np.full(parameters, UNKNOWN)
    within = np.divide(scatter, moving, out=unknown, where=moving > 0)
    between = scores.mean(axis=1).var(axis=0, ddof=1)
    return np.sqrt(1 + between / within)


def mixed_interval(
    draws: Sequence[np.ndarray], intervals: Sequence[Sequence[Sequence[float]]], parameters: int
) -> tuple[np.ndarray, np.ndarray]:
    """Mix the draws of runs of trials: the interval (P, 2) of all together, and Birge ratios (P,); NaN where they are not known.

    Parameters
    ----------
    draws : (D, P) each
        Of the runs that have settled, none or more.
    intervals : (runs, P, 2)
        That they state. Where one is wider than its draws, the interval spans those of all runs.
    parameters
        Their number, P.
    """
    if not draws:
        return np.full((parameters, 2), UNKNOWN), np.full(parameters, UNKNOWN)
    bounds = np.quantile(np.concatenate(draws), (0.05, 0.95), axis=0).T
    stated = np.array(intervals)
    draw_bounds = np.stack([np.quantile(draw, (0.05, 0.95), axis=0).T for draw in draws])
    # an interval that was widened no longer follows from the draws; 1.001 allows for rounding
    widened = (np.ptp(stated, axis=2) > 1.001 * np.ptp(draw_bounds, axis=2)).any(axis=0)
    spans = np.stack((stated[..., 0].min(axis=0), stated[..., 1].max(axis=0)), axis=1)
    bounds[widened] = spans[widened]
    if len(draws) == 1:
        return bounds, np.full(parameters, UNKNOWN)
    middles = np.array([np.median(draw, axis=0) for draw in draws])
    variances = np.array([draw.var(axis=0) for draw in draws])
    squares = ((middles - middles.mean(axis=0)) ** 2 / variances).sum(axis=0)
    return bounds, np.sqrt(squares / (len(draws) - 1))


def _wandering(runs: np.ndarray) -> np.ndarray:
    """Return how far typical models (K, W) of one parameter wander to both sides, by the runs that move; 0 if none does."""
    moving = runs[_moves(runs.T)]
    if not len(moving):
        return np.zeros(2)
    distances = moving - np.median(moving, axis=1, keepdims=True)
    return _growth(sum(map(_independent, moving))) * np.percentile(distances, INTERVAL_PERCENTILES)


def _checked_runs(typical_models: np.ndarray) -> np.ndarray:
    typical = array("typical_models", typical_models, "runs W P")
    rule = "be of shape (runs, W, P) with at least 2 runs"
    require(len(typical) >= 2, "typical_models", rule, typical.shape)
    return typical


def settled(
    typical_models: np.ndarray, window: int, spreads: np.ndarray | None = None
) -> np.ndarray:
    """Say whether the models of a run have settled, parameter by parameter (P,) bool.

    A parameter has settled if the halves of the generations that make the estimate agree within its interval,
    and if the population has contracted, or its typical model has been through all that the population still
    spans: then the parameter is open, not on its way.

    Source: docs/decisions/0033.

    Parameters
    ----------
    typical_models : (G, P)
        Typical model of each generation.
    window
        Number of generations that make the estimate, as for `estimate`.
    spreads : (G, P)
        Standard deviation of the models of each generation, in the same units; None where that is not known.
    """
    tail = array("typical_models", typical_models, "G P", finite=False)[-window:]
    half = np.diff(interval(tail, window), axis=1)[:, 0] / 2
    middles = [np.median(piece, axis=0) for piece in np.array_split(tail, 2) if len(piece)]
    still = ~(np.abs(middles[-1] - middles[0]) > half)
    if spreads is None:
        return still & ~np.isnan(half)
    now = spreads[-window:].mean(axis=0)
    before = np.where(spreads[0] > 0, spreads[0], spreads.max(axis=0))
    quiet: np.ndarray = still & ((now < CONTRACTED * before) | (half >= now))
    return quiet


def classifiers_tell(classifier_fitness: np.ndarray, window: int, above: float = GUESSING) -> bool:
    """Say whether classifiers tell the models of a run from the system: their median fitness (G,) is above chance at last."""
    return bool(np.mean(classifier_fitness[-window:]) > above)


def normal_scores(table: np.ndarray) -> np.ndarray:
    """Return the normal scores of the ranks of each column (S, F); equal values share theirs."""
    from scipy.stats import rankdata

    ranks = rankdata(table, axis=0)
    return ndtri((ranks - 3 / 8) / (len(table) + 1 / 4))
