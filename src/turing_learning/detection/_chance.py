"""How often chance alone would make the scores of an individual, or of a stretch of its windows, as low as they are."""

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations, count
from math import ceil, comb

import numpy as np
from scipy.special import ndtri

DIGITS = 9
"""Of a score; what comes after them depends on the order of summation."""
DRAWS = 20_000
MOST_DRAWN = 10_000_000  # samples, or scores, in all draws
AT_ONCE = 64  # individuals


def p_values(genuine: np.ndarray, scores: np.ndarray) -> np.ndarray:
    """Return for each individual how often S of the n genuine samples (n,) and its own (individuals, S), chosen
    at random, have so low a mean score.

    Nothing is assumed of the distribution of scores: if an individual is genuine and all samples are
    independent, p-values of at most q are no more frequent than q, for any n and S. Equal means count as lower
    ones. All choices are tried where that is no more than `DRAWS`, else as many, and the one that is observed.
    Where no sample of an individual has a higher score than any of the n, the choices are counted. Source:
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
    # choices with so low a mean hold all of the S that are lower, and in place of the tied ones any of these and of the ties
    ties, choices = int((genuine == lowest).sum()), comb(known + samples, samples)
    tied = (scores[below] == lowest).sum(axis=1).tolist()
    found[below] = [comb(ties + k, k) / choices for k in tied]
    return found


def known_needed(share: float, samples: int) -> int:
    """Return how many genuine samples are enough for a p-value as small as a share."""
    if samples == 1:
        return ceil(1 / share) - 1
    return next(known for known in count(1) if 1 / comb(known + samples, samples) <= share)


@lru_cache(maxsize=2)
def _choices(known: int, samples: int) -> np.ndarray:
    """Return choices (any, samples) of numbers below known + samples; the individual's own are the last."""
    total, draws = known + samples, max(1000, min(DRAWS, MOST_DRAWN // samples))
    if samples == 1 or comb(total, samples) <= draws:
        return np.array(list(combinations(range(total), samples)), dtype=np.int32)
    rng = np.random.default_rng((known, samples))
    drawn = [rng.choice(total, samples, replace=False, shuffle=False) for _ in range(draws)]
    return np.array([np.arange(known, total), *drawn], dtype=np.int32)


@dataclass(frozen=True, eq=False)
class TimedVerdict:
    """What a detector says about an individual over time."""

    individual: str  #: Its name
    windows: int  #: Number of its windows W; with none there is no verdict, and it is not abnormal
    score: float  #: Mean score of its windows; 1 without windows
    strength: float  #: Of the evidence against it, see `Detector.timeline`
    threshold: float  #: Above it the individual is called abnormal
    abnormal: bool  #: Whether it behaves abnormally at some time
    spells: tuple[tuple[float, float], ...]  #: Begin and end (s) of the times in which it does
    times: np.ndarray  #: (W, 2), begin and end (s) of the windows
    scores: np.ndarray  #: (W,), of the windows
    flagged: np.ndarray  #: (W,) bool, which windows belong to a spell


@dataclass(frozen=True, eq=False)
class Scan:
    """Look for the stretch of consecutive windows whose scores lie lowest among those (n,) of single genuine samples.

    A score counts by its place k among these: the evidence is the normal score of the place, with the sign
    turned, the value above which a share (k + 1/2) / (n + 1) of a standard normal distribution lies. A score
    that equals genuine ones has the mean for the places before, between and after them. Source: Van der
    Waerden, Order tests for the two-sample problem and their power (1952); docs/decisions/0022.
    """

    genuine_scores: np.ndarray

    def strengths(self, scores: np.ndarray) -> np.ndarray:
        """Return the largest strength (...,) of the evidence in stretches of 1, 2, 4, ... and all windows, by scores (..., W)."""
        return self._strongest(self._evidence(scores))

    def threshold(self, windows: int, false_alarms: float, draws: int) -> float:
        """Return the strength above which genuine individuals with so many windows lie as often as stated, but for the draws.

        Genuine samples and an individual's windows are drawn anew: if they are alike and independent, all
        orders of them are equally frequent, and if no two are equal nothing else enters the evidence. Places
        between equal genuine scores have their evidence. Source: Vovk, Gammerman and Shafer, Algorithmic
        Learning in a Random World (2005).
        """
        ordered, evidence = np.sort(self.genuine_scores), self._of_places()
        known, equal = len(ordered), np.flatnonzero(ordered[1:] == ordered[:-1]) + 1
        evidence[equal] = self._evidence(ordered[equal])
        draws = max(1000, min(draws, MOST_DRAWN // (windows + known)))
        rng, drawn = np.random.default_rng(windows), []
        for part in np.array_split(np.arange(draws), max(1, draws * (windows + known) // 1_000_000)):
            rows = np.arange(len(part))[:, None]  # one row of samples behind the other: one search does for all
            samples = np.sort(rng.random((len(part), known)), axis=1) + rows
            places = np.searchsorted(samples.ravel(), (rng.random((len(part), windows)) + rows).ravel())
            drawn.append(self._strongest(evidence[places.reshape(len(part), windows) - rows * known]))
        return float(np.sort(np.concatenate(drawn))[-int(false_alarms * draws) - 1])

    def spells(self, scores: np.ndarray, threshold: float) -> list[slice]:
        """Return the stretches of scores (W,) above the threshold: the strongest of any length, then those before and after it."""
        sums = np.append(0.0, np.cumsum(self._evidence(scores)))
        best, found = threshold, None
        for n in range(1, len(scores) + 1):
            strengths = (sums[n:] - sums[:-n]) / self._error(n)
            begin = int(np.argmax(strengths))
            if strengths[begin] > best:
                best, found = strengths[begin], slice(begin, begin + n)
        if found is None:
            return []
        before, after = (self.spells(some, threshold) for some in (scores[: found.start], scores[found.stop :]))
        return [*before, found, *(slice(each.start + found.stop, each.stop + found.stop) for each in after)]

    def verdict(self, name: str, times: np.ndarray, scores: np.ndarray, threshold: float) -> TimedVerdict:
        """Return the verdict on an individual with windows at times (W, 2) and their scores (W,)."""
        strength = float(self.strengths(scores)) if len(scores) else 0.0
        flagged = np.zeros(len(scores), dtype=bool)
        spells = self.spells(scores, threshold) if strength > threshold else []
        for spell in spells:
            flagged[spell] = True
        when = tuple((float(times[spell.start, 0]), float(times[spell.stop - 1, 1])) for spell in spells)
        score = float(scores.mean()) if len(scores) else 1.0
        said = (name, len(scores), score, strength, threshold, strength > threshold)
        return TimedVerdict(*said, when, times, scores, flagged)

    def _of_places(self) -> np.ndarray:
        """Return the evidence (n + 1,) of the places among n genuine scores of which no two are equal."""
        known = len(self.genuine_scores)
        return np.asarray(-ndtri((np.arange(known + 1) + 0.5) / (known + 1)))

    def _evidence(self, scores: np.ndarray) -> np.ndarray:
        ordered = np.sort(self.genuine_scores)
        first, last = (np.searchsorted(ordered, scores, side) for side in ("left", "right"))
        sums = np.append(0.0, np.cumsum(self._of_places()))
        return (sums[last + 1] - sums[first]) / (last + 1 - first)

    def _strongest(self, evidence: np.ndarray) -> np.ndarray:
        windows = evidence.shape[-1]
        sums = np.concatenate((np.zeros((*evidence.shape[:-1], 1)), np.cumsum(evidence, axis=-1)), axis=-1)
        spans = [*(2**k for k in range(windows.bit_length()) if 2**k < windows), windows]
        strengths = [(sums[..., n:] - sums[..., :-n]).max(axis=-1) / self._error(n) for n in spans]
        return np.round(np.max(strengths, axis=0), DIGITS)

    def _error(self, windows: int) -> float:
        """Return the standard error of the sum of the evidence of so many windows: the n genuine samples have an error, too."""
        return float(np.sqrt(windows * (1 + windows / len(self.genuine_scores))))
