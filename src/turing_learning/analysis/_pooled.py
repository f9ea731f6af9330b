"""One model from several runs, its uncertainty, and whether the runs agree."""

import numpy as np
from scipy.special import ndtri, stdtrit

from ._estimate import CENTRAL, _growth, _independent, _moves
from ._known import UNKNOWN


def pooled_estimate(typical_models: np.ndarray) -> np.ndarray:
    """Estimate the agent's parameters from several runs: the median of the estimates of the runs.

    Parameters
    ----------
    typical_models : (runs, W, P)
        Typical models of the W generations that make the estimate of each of at least 2 runs.

    Returns
    -------
    (P,)
        Parameter by parameter.

    Raises
    ------
    ValueError
        If `typical_models` is not of that shape, empty or not finite.
    """
    return np.median(_estimates(_checked(typical_models)), axis=0)


def pooled_interval(typical_models: np.ndarray) -> np.ndarray:
    """State the uncertainty of the pooled estimate: an interval for each parameter that holds the truth nine times of ten.

    Two things keep an estimate from the truth. The models of a run wander: that is read off the central 90 % of their distances
    from the estimate of their run, all runs together, widened as in `interval` by the number of independent values. And runs
    settle in different regions: if the truth is to the runs what one more run would be, nine of ten truths are within
    t(runs - 1) sqrt(1 + 1 / runs) standard deviations of the runs' estimates, with the 95th percentile of Student's t. This
    factor is 2.6 for 4 runs, 2.0 for 8, and 7.7 for 2. Each end is as far from the estimate as the root of the sum of the squares
    of the two.

    Where the runs agree, the interval of four is about as wide as that of one. Where they do not, it is some times their scatter,
    and that of two is very wide: two values say little of how they scatter. What shifts all runs alike it does not show.

    A run that has not moved (see `interval`) says where it has settled, and nothing of wandering: it counts in the scatter alone.
    Where no run has moved, each is one value of whatever scatters, and the scatter of the runs is all of it. Where neither a
    run has moved nor two differ, the interval is not known.

    Parameters
    ----------
    typical_models
        As for `pooled_estimate`.

    Returns
    -------
    (P, 2)
        Lower and upper end for each parameter; both NaN where they are not known.

    Raises
    ------
    ValueError
        As `pooled_estimate`.

    Source
    ------
    docs/decisions/0026. The prediction interval of normally distributed regions: Higgins, Thompson and Spiegelhalter, A
    re-evaluation of random-effects meta-analysis (2009). Squares of two limits added: Graybill and Wang, Confidence intervals on
    nonnegative linear combinations of variances (1980).
    """
    typical = _checked(typical_models)
    estimates, count = _estimates(typical), len(typical)
    scatter = stdtrit(count - 1, CENTRAL[1] / 100) * np.sqrt(1 + 1 / count) * estimates.std(axis=0, ddof=1)
    wandering = np.stack([_wandering(runs) for runs in np.moveaxis(typical, 2, 0)], axis=1)
    low, high = np.hypot(wandering, scatter)
    known = wandering.any(axis=0) | (np.ptp(estimates, axis=0) > 0)
    middle = np.median(estimates, axis=0)
    return np.where(known[:, None], np.stack([middle - low, middle + high], axis=1), UNKNOWN)


def r_hat(typical_models: np.ndarray) -> np.ndarray:
    """Say how far the runs agree: the potential scale reduction of the ranks, known from Markov chains.

    It compares the scatter of all values with the scatter within the runs. It is about 1 where runs cannot be told apart. Where no
    two share a value it is 2.1 for 2 runs, 3.1 for 4 and 4.6 for 8, however far apart they are. Ranks make it the same on any
    scale, and let no excursion of a run hide that the others disagree. The scatter within is that of the runs that have moved (see
    `interval`).

    Parameters
    ----------
    typical_models
        As for `pooled_estimate`.

    Returns
    -------
    (P,)
        At least about 1, for each parameter; NaN where no run has moved, so that nothing is known of the scatter within.

    Raises
    ------
    ValueError
        As `pooled_estimate`.

    Source
    ------
    Gelman and Rubin, Inference from iterative simulation using multiple sequences (1992); with normal scores of the ranks: Vehtari
    et al., Rank-normalization, folding, and localization: an improved R-hat (2021). Runs are not split into halves.
    """
    from scipy.stats import rankdata

    typical = _checked(typical_models)
    count, length, parameters = typical.shape
    ranks = rankdata(typical.reshape(-1, parameters), axis=0).reshape(typical.shape)
    scores = ndtri((ranks - 3 / 8) / (count * length + 1 / 4))
    moves = _moves(np.moveaxis(typical, 1, 0))
    moving = moves.sum(axis=0)
    within = np.divide(
        scores.var(axis=1).sum(axis=0, where=moves), moving, out=np.full(parameters, UNKNOWN), where=moving > 0
    )
    between = scores.mean(axis=1).var(axis=0, ddof=1)
    return np.sqrt(1 + between / within)


def _wandering(runs: np.ndarray) -> np.ndarray:
    """Return how far typical models (K, W) of one parameter wander to both sides, by the runs that move; 0 if none does."""
    moving = runs[_moves(runs.T)]
    if not len(moving):
        return np.zeros(2)
    distances = moving - np.median(moving, axis=1, keepdims=True)
    return _growth(sum(map(_independent, moving))) * np.percentile(distances, CENTRAL)


def _estimates(typical: np.ndarray) -> np.ndarray:
    """Return the estimate (runs, P) of each run."""
    return np.median(typical, axis=1)


def _checked(typical_models: np.ndarray) -> np.ndarray:
    typical = np.asarray(typical_models, dtype=np.float64)
    if typical.ndim != 3 or typical.size == 0 or len(typical) < 2:
        raise ValueError(
            f"`typical_models` must be of shape (runs, W, P) with at least 2 runs, and not empty; got {typical.shape}."
        )
    if not np.isfinite(typical).all():
        raise ValueError(f"`typical_models` must be finite; got {typical[~np.isfinite(typical)].flat[0]}.")
    return typical
