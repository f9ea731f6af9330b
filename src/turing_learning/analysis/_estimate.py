"""One model from many generations."""

import numpy as np
from scipy.special import stdtrit

from ._known import UNKNOWN

CENTRAL = (5.0, 95.0)
"""Percentiles that end the interval of an estimate."""

NORMAL = 1.6448536
"""The upper one, of the standard normal distribution."""

FEWEST = 2.0
"""Independent values that even the slowest series is taken to hold."""


def estimate(typical_models: np.ndarray, window: int = 100) -> np.ndarray:
    """Estimate the agent's parameters from the last generations of a run.

    The subjectively best model of the last generation is a noisy estimate: its fitness rests on a single trial, so
    it is drawn almost at random from a converged population. The typical model of a generation, the median of the
    better half of its models, varies less; the median of the typical models over many generations still less. Medians
    rather than means, because a population sometimes makes an excursion and returns. All of it costs no simulation.

    Parameters
    ----------
    typical_models : (G, P)
        Typical model of each generation, see `coevolution.Generation.typical_model`.
    window
        Number of generations taken, counted from the last, >= 1; all if there are fewer.

    Returns
    -------
    (P,)
        Median over the generations, parameter by parameter.

    Raises
    ------
    ValueError
        If `typical_models` is not of that shape, empty or not finite, or `window` is below 1.
    """
    return np.median(_last(typical_models, window), axis=0)


def interval(typical_models: np.ndarray, window: int = 100) -> np.ndarray:
    """State the uncertainty of the estimate: an interval for each parameter that holds the truth nine times of ten.

    Near the truth the models wander where no classifier tells them apart; the range that they wander over is what the data leave
    open. It is read off the central 90 % of the typical models over the generations that make the estimate. A series that wanders
    slowly has shown little of its range: as much as n independent values would, n being the number of generations divided by the
    autocorrelation time. So both ends are moved away from the estimate, by the factor by which the next of normally distributed
    values, of which only n are known, is less certain: t(n - 1) sqrt(1 + 1 / n) / z, with the 95th percentiles of Student's t and
    the normal distribution. It is 1.1 for n = 15, 1.4 for 5, and 4.7 for 2.

    Where the models have not moved, nothing is known of the range, and so nothing of the interval: not that it is a point. That is
    so where the central 90 % are one and the same value: in very short runs, and where an output is saturated.

    That this range is about as wide as the errors is an observation, not a theorem: its coverage was measured, see
    docs/results.md. It says nothing of runs that settle in another region; `pooled_interval` of several runs does.

    Parameters
    ----------
    typical_models, window
        As for `estimate`.

    Returns
    -------
    (P, 2)
        Lower and upper end for each parameter; both NaN where they are not known.

    Raises
    ------
    ValueError
        As `estimate`.

    Source
    ------
    docs/decisions/0011 and 0022; Geyer, Practical Markov chain Monte Carlo (1992), for the autocorrelation time.
    """
    last = _last(typical_models, window)
    middle, ends = np.median(last, axis=0), np.percentile(last, CENTRAL, axis=0)
    growth = np.array(
        [
            _growth(_independent(series)) if moves else UNKNOWN
            for series, moves in zip(last.T, _moves(last), strict=True)
        ]
    )
    return (middle + growth * (ends - middle)).T


def _moves(typical_models: np.ndarray) -> np.ndarray:
    """Return whether the typical models (W, ...) move: whether their central 90 % are more than one value."""
    low, high = np.percentile(typical_models, CENTRAL, axis=0)
    moves: np.ndarray = low < high
    return moves


def _growth(count: float) -> float:
    """Return by how much the range of so many independent values is to be widened."""
    return float(stdtrit(count - 1, CENTRAL[1] / 100) * np.sqrt(1 + 1 / count) / NORMAL)


def _independent(series: np.ndarray) -> float:
    """Return how many independent values tell as much as a series (W,) that moves, by Geyer's initial positive sequence."""
    count, deviations = len(series), series - series.mean()
    spectrum = np.fft.rfft(deviations / np.abs(deviations).max(), 2 * count)
    correlations = np.fft.irfft(spectrum * spectrum.conj(), 2 * count)[:count]
    pairs = correlations[: count // 2 * 2].reshape(-1, 2).sum(axis=1) / correlations[0]
    positive = pairs[: int(np.argmax(pairs <= 0))] if (pairs <= 0).any() else pairs
    return max(count / max(2 * positive.sum() - 1, 1.0), FEWEST)


def _last(typical_models: np.ndarray, window: int) -> np.ndarray:
    typical_models = np.asarray(typical_models, dtype=np.float64)
    if typical_models.ndim != 2 or typical_models.size == 0:
        raise ValueError(f"`typical_models` must be of shape (G, P) and not empty; got {typical_models.shape}.")
    if window < 1:
        raise ValueError(f"`window` must be at least 1; got {window}.")
    last = typical_models[-window:]
    if not np.isfinite(last).all():
        raise ValueError(f"`typical_models` must be finite; got {last[~np.isfinite(last)].flat[0]}.")
    return last
