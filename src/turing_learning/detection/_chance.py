"""How often chance alone would make the scores of an individual as low as they are."""

from functools import lru_cache
from itertools import combinations
from math import ceil, comb

import numpy as np

from ._verdict import DIGITS

DRAWS = 20_000
MOST_DRAWN = 10_000_000  # samples in all draws
AT_ONCE = 64  # individuals


def p_values(genuine: np.ndarray, scores: np.ndarray) -> np.ndarray:
    """Return for each individual how often S of the n genuine samples and its own, chosen at random, have so low a mean score.

    Nothing is assumed of the distribution of scores: if an individual is genuine and all samples are independent, every choice of
    S of the n + S is equally likely to be the individual's, so that p-values of at most a share q are no more frequent than q, for
    any n and S. Equal means count as lower ones. With a single sample it is the place of its score among the n. All choices are
    tried where that is no more than `DRAWS`, else as many, and the one that is observed. Where no sample of an individual has a
    higher score than any of the n, the choices are counted.

    Parameters
    ----------
    genuine : (n,)
        Scores of genuine samples that had no part in the weights of the votes.
    scores : (individuals, S)
        Of the samples of each individual.

    Returns
    -------
    (individuals,)

    Source
    ------
    Pitman, Significance tests which may be applied to samples from any populations (1937); docs/decisions/0022.
    """
    known, samples = len(genuine), scores.shape[1]
    chosen = _choices(known, samples)
    sums = np.append(genuine, np.zeros(samples))[chosen].sum(axis=1)
    own = np.zeros((len(chosen), samples))
    rows, places = np.nonzero(chosen >= known)
    own[rows, chosen[rows, places] - known] = 1.0
    found = np.empty(len(scores))
    for begin in range(0, len(scores), AT_ONCE):
        some = scores[begin : begin + AT_ONCE].T
        low = sums[:, None] + own @ some <= some.sum(axis=0) + 10.0**-DIGITS / 2
        found[begin : begin + AT_ONCE] = low.mean(axis=0)
    lowest = genuine.min(initial=np.inf)
    below = scores.max(axis=1) <= lowest
    found[below] = _counted(known, int((genuine == lowest).sum()), (scores[below] == lowest).sum(axis=1), samples)
    return found


def _counted(known: int, ties: int, tied: np.ndarray, samples: int) -> np.ndarray:
    """Return the share of the choices with so low a mean, where the lowest of the n scores is the highest of the S, or above it.

    Such choices hold all of the S that are lower, and in place of the tied ones (individuals,) any of these and of the ties.
    """
    choices = comb(known + samples, samples)
    return np.array([comb(ties + int(k), int(k)) / choices for k in tied])


def known_needed(share: float, samples: int) -> int:
    """Return the number of genuine samples from which on choices are enough for a p-value as small as a share."""
    if samples == 1:
        return ceil(1 / share) - 1
    known = 1
    while 1 / comb(known + samples, samples) > share:
        known += 1
    return known


def _draws(samples: int) -> int:
    return max(1000, min(DRAWS, MOST_DRAWN // samples))


@lru_cache(maxsize=2)
def _choices(known: int, samples: int) -> np.ndarray:
    """Return choices (any, samples) of numbers below known + samples; the individual's own are the last ones."""
    total = known + samples
    if samples == 1:
        return np.arange(total, dtype=np.int32)[:, None]
    if comb(total, samples) <= _draws(samples):
        return np.array(list(combinations(range(total), samples)), dtype=np.int32)
    rng = np.random.default_rng((known, samples))
    drawn = [rng.choice(total, samples, replace=False, shuffle=False) for _ in range(_draws(samples))]
    return np.array([np.arange(known, total), *drawn], dtype=np.int32)
