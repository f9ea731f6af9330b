"""How often chance alone makes scores as low as those of an individual, or of some windows.

Scores are votes for genuine: low ones are abnormal.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from math import ceil, comb

import numpy as np
from scipy.special import ndtri

SCORE_DIGITS = 9
"""Of a score; what comes after them depends on the order of summation."""
CHANCE_DRAWS = 20_000
"""Random choices, by which a p-value of 0.01 has a standard error of 0.0007."""
FEWEST_DRAWS = 1000
MOST_DRAWN = 10_000_000
"""Samples, or scores, in all draws, at most; they must fit into memory."""
INDIVIDUALS_AT_ONCE = 64
"""Individuals whose p-values are computed together: more take memory, fewer time."""
DRAWN_AT_ONCE = 1_000_000
"""Scores that are drawn together."""


def p_values(genuine: np.ndarray, scores: np.ndarray) -> np.ndarray:
    """Return for each individual how often S of the n genuine samples (n,) and its own (individuals, S), chosen
    at random, have so low a mean score.

    Nothing is assumed of the distribution of scores: if an individual is genuine and all samples
    are independent, p-values of at most q are no more frequent than q, for any n and S. Equal means
    count as lower ones. All choices are tried where that is no more than `CHANCE_DRAWS`, else as many, and
    the one that is observed. Where no sample of an individual has a higher score than any of the n,
    the choices are counted. Source: Pitman, Significance tests which may be applied to samples from
    any populations (1937); docs/decisions/0022.
    """
    genuine_count = len(genuine)
    samples = scores.shape[1]
    chosen = _choices(genuine_count, samples)
    # Of each choice, the sum of its genuine samples, and which of the individual's it has.
    genuine_sums = np.append(genuine, np.zeros(samples))[chosen].sum(axis=1)
    has_own = np.zeros((len(chosen), samples))
    rows, columns = np.nonzero(chosen >= genuine_count)
    has_own[rows, chosen[rows, columns] - genuine_count] = 1.0
    values = np.empty(len(scores))
    for begin in range(0, len(scores), INDIVIDUALS_AT_ONCE):
        individuals = slice(begin, begin + INDIVIDUALS_AT_ONCE)
        individual_scores = scores[individuals].T
        low = (
            genuine_sums[:, None] + has_own @ individual_scores
            <= individual_scores.sum(axis=0) + 10.0**-SCORE_DIGITS / 2
        )
        values[individuals] = low.mean(axis=0)
    _replace_by_counts(values, genuine, scores)
    return values


def _replace_by_counts(values: np.ndarray, genuine: np.ndarray, scores: np.ndarray) -> None:
    """Replace p-values of individuals with no score above the lowest genuine one.

    Draws would not see so rare choices: they are counted. A choice with so low a mean holds all
    scores that are lower, and ties, its own or genuine ones, beside them.
    """
    lowest = genuine.min(initial=np.inf)
    genuine_ties = int((genuine == lowest).sum())
    choices = comb(len(genuine) + scores.shape[1], scores.shape[1])
    for k in np.flatnonzero(scores.max(axis=1) <= lowest):
        own_ties = int((scores[k] == lowest).sum())
        values[k] = comb(genuine_ties + own_ties, own_ties) / choices


def genuine_samples_needed(share: float, samples: int) -> int:
    """Return how many genuine samples are enough for a p-value as small as `share`."""
    if samples == 1:
        return ceil(1 / share) - 1
    genuine_count = 1
    while 1 / comb(genuine_count + samples, samples) > share:
        genuine_count += 1
    return genuine_count


@lru_cache(maxsize=2)
def _choices(genuine_count: int, samples: int) -> np.ndarray:
    """Return choices (any, samples) of numbers below genuine_count + samples; the last are the individual's."""
    total = genuine_count + samples
    draws = max(FEWEST_DRAWS, min(CHANCE_DRAWS, MOST_DRAWN // samples))
    if samples == 1 or comb(total, samples) <= draws:
        return np.array(list(combinations(range(total), samples)), dtype=np.int32)
    rng = np.random.default_rng((genuine_count, samples))
    drawn = [rng.choice(total, samples, replace=False, shuffle=False) for _ in range(draws)]
    return np.array([np.arange(genuine_count, total), *drawn], dtype=np.int32)


@dataclass(frozen=True, eq=False)
class TimedVerdict:
    """What a detector says about an individual over time.

    Scores are those of a `Detector`: low ones are abnormal. Those that `present.timed_verdicts`
    takes from `detect` are distances: high ones are.
    """

    individual: str  #: Its name
    #: Number of its windows W; with none there is no verdict, and it is not abnormal
    windows: int
    score: float  #: Mean score of its windows; 1 without windows
    strength: float  #: Of the evidence against it, see `Detector.timeline`
    threshold: float  #: Above it the individual is called abnormal
    abnormal: bool  #: Whether it behaves abnormally at some time
    #: Begin and end (s) of the times in which it does
    spells: tuple[tuple[float, float], ...]
    times: np.ndarray  #: (W, 2), begin and end (s) of the windows
    scores: np.ndarray  #: (W,), of the windows
    flagged: np.ndarray  #: (W,) bool, which windows belong to a spell


@dataclass(frozen=True, eq=False)
class Scan:
    """Look for the stretch of windows whose scores lie lowest among those (n,) of genuine samples.

    A score counts by its place k among these: its evidence is the value above which a share (k +
    1/2) / (n + 1) of a standard normal distribution lies (the normal score, with its sign turned).
    A score that equals genuine ones has the mean evidence of the places before, between and after
    them. Source: Van der Waerden, Order tests for the two-sample problem and their power (1952);
    docs/decisions/0022.
    """

    genuine_scores: np.ndarray

    def strengths(self, scores: np.ndarray) -> np.ndarray:
        """Return the largest strength (...,) in stretches of 1, 2, 4, ... and all windows (..., W)."""
        return self._strongest(self._evidence(scores))

    def threshold(self, windows: int, false_alarms: float, draws: int) -> float:
        """Return the strength above which genuine individuals with so many windows lie as often as stated.

        Genuine samples and an individual's windows are drawn anew: if they are alike and
        independent, all orders of them are equally frequent, and if no two are equal nothing else
        enters the evidence. Places between equal genuine scores have their evidence. Source: Vovk,
        Gammerman and Shafer, Algorithmic Learning in a Random World (2005).
        """
        ordered = np.sort(self.genuine_scores)
        genuine_count = len(ordered)
        evidence = self._evidence_of_places()
        equal = np.flatnonzero(ordered[1:] == ordered[:-1]) + 1
        evidence[equal] = self._evidence(ordered[equal])
        scores = windows + genuine_count
        draws = max(FEWEST_DRAWS, min(draws, MOST_DRAWN // scores))
        rng = np.random.default_rng(windows)
        strengths = []
        for draw in np.array_split(np.arange(draws), max(1, draws * scores // DRAWN_AT_ONCE)):
            # Rows of genuine samples stand one behind the other, so that one search does for all.
            rows = np.arange(len(draw))[:, None]
            genuine = np.sort(rng.random((len(draw), genuine_count)), axis=1) + rows
            individual = rng.random((len(draw), windows)) + rows
            ranks = np.searchsorted(genuine.ravel(), individual.ravel())
            ranks = ranks.reshape(len(draw), windows) - rows * genuine_count
            strengths.append(self._strongest(evidence[ranks]))
        return float(np.sort(np.concatenate(strengths))[-int(false_alarms * draws) - 1])

    def spells(self, scores: np.ndarray, threshold: float) -> list[slice]:
        """Return the stretches of scores (W,) above the threshold, in order.

        The first that is found is the strongest of any length, then those before and after it
        follow.
        """
        sums = np.append(0.0, np.cumsum(self._evidence(scores)))
        highest = threshold
        strongest = None
        for length in range(1, len(scores) + 1):
            strengths = (sums[length:] - sums[:-length]) / self._standard_error(length)
            begin = int(np.argmax(strengths))
            if strengths[begin] > highest:
                highest = strengths[begin]
                strongest = slice(begin, begin + length)
        if strongest is None:
            return []
        before = self.spells(scores[: strongest.start], threshold)
        after = self.spells(scores[strongest.stop :], threshold)
        begin = strongest.stop
        return [
            *before,
            strongest,
            *(slice(begin + spell.start, begin + spell.stop) for spell in after),
        ]

    def verdict(
        self, name: str, times: np.ndarray, scores: np.ndarray, threshold: float
    ) -> TimedVerdict:
        """Return the verdict on an individual: times (W, 2) and scores (W,) of its windows."""
        score = 1.0
        strength = 0.0
        if len(scores):
            score = float(scores.mean())
            strength = float(self.strengths(scores))
        flagged = np.zeros(len(scores), dtype=bool)
        spells = []
        if strength > threshold:
            for spell in self.spells(scores, threshold):
                flagged[spell] = True
                spells.append((float(times[spell.start, 0]), float(times[spell.stop - 1, 1])))
        return TimedVerdict(
            individual=name,
            windows=len(scores),
            score=score,
            strength=strength,
            threshold=threshold,
            abnormal=strength > threshold,
            spells=tuple(spells),
            times=times,
            scores=scores,
            flagged=flagged,
        )

    def _evidence_of_places(self) -> np.ndarray:
        """Return the evidence (n + 1,) of the places among n different genuine scores."""
        genuine_count = len(self.genuine_scores)
        return np.asarray(-ndtri((np.arange(genuine_count + 1) + 0.5) / (genuine_count + 1)))

    def _evidence(self, scores: np.ndarray) -> np.ndarray:
        """Return the evidence of scores; that of equal genuine ones is a mean over their places."""
        ordered = np.sort(self.genuine_scores)
        lowest = np.searchsorted(ordered, scores, "left")
        highest = np.searchsorted(ordered, scores, "right")
        sums = np.append(0.0, np.cumsum(self._evidence_of_places()))
        return (sums[highest + 1] - sums[lowest]) / (highest + 1 - lowest)

    def _strongest(self, evidence: np.ndarray) -> np.ndarray:
        windows = evidence.shape[-1]
        zero = np.zeros((*evidence.shape[:-1], 1))
        sums = np.concatenate((zero, np.cumsum(evidence, axis=-1)), axis=-1)
        lengths = [2**k for k in range(windows.bit_length()) if 2**k < windows]
        strengths = []
        for length in (*lengths, windows):
            stretches = sums[..., length:] - sums[..., :-length]
            strengths.append(stretches.max(axis=-1) / self._standard_error(length))
        return np.round(np.max(strengths, axis=0), SCORE_DIGITS)

    def _standard_error(self, windows: int) -> float:
        """Return that of the sum over so many windows: the n genuine samples have an error, too."""
        return float(np.sqrt(windows * (1 + windows / len(self.genuine_scores))))
