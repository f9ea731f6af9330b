"""One model from many generations."""

import numpy as np

CENTRAL = (5.0, 95.0)
"""Percentiles that end the interval of an estimate."""


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

    It is the range of the central 90 % of the typical models over the generations that make the estimate. Near the truth
    the models wander where no classifier tells them apart; the range they wander over is what the data leave open.
    That this range is about as wide as the errors is an observation, not a theorem: its coverage was measured, see
    docs/results.md. It says nothing of runs that settle in another region.

    Parameters
    ----------
    typical_models, window
        As for `estimate`.

    Returns
    -------
    (P, 2)
        Lower and upper end for each parameter.

    Raises
    ------
    ValueError
        As `estimate`.

    Source
    ------
    docs/decisions/0011.
    """
    return np.percentile(_last(typical_models, window), CENTRAL, axis=0).T


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
