"""When an individual behaves abnormally: the stretch of its motion that speaks most against it."""

from dataclasses import dataclass

import numpy as np

MOST_DRAWN = 5_000_000
SMALLEST_SPREAD = 1e-3  # of scores; a jury that says the same of all genuine samples still needs some room


@dataclass(frozen=True, eq=False)
class TimedVerdict:
    """What a detector says about an individual over time.

    Attributes
    ----------
    individual
        Its name.
    windows
        Number of its windows W; with none there is no verdict, and it is not abnormal.
    score
        Mean score of its windows; 1 without windows.
    strength
        Of the evidence against it, see `Detector.timeline`.
    threshold
        Above it the individual is called abnormal.
    abnormal
        Whether it behaves abnormally at some time.
    spells
        Begin and end (s) of the times in which it does.
    times : (W, 2)
        Begin and end (s) of the windows.
    scores : (W,)
        Of the windows.
    flagged : (W,) bool
        Which windows belong to a spell.
    """

    individual: str
    windows: int
    score: float
    strength: float
    threshold: float
    abnormal: bool
    spells: tuple[tuple[float, float], ...]
    times: np.ndarray
    scores: np.ndarray
    flagged: np.ndarray


@dataclass(frozen=True, eq=False)
class Scan:
    """Look for the stretch of consecutive windows whose mean score lies farthest below that of genuine samples.

    Parameters
    ----------
    genuine_scores : (any,)
        Of single genuine samples that had no part in the weights of the votes.
    """

    genuine_scores: np.ndarray

    def strengths(self, scores: np.ndarray) -> np.ndarray:
        """Return the strength (...,) of the evidence in scores (..., W), the largest of stretches of 1, 2, 4, ... and all windows.

        The evidence of n windows is the distance of their mean score below that of genuine samples, over its standard error:
        the standard deviation of genuine scores over the square root of n.
        """
        windows = scores.shape[-1]
        sums = np.concatenate((np.zeros((*scores.shape[:-1], 1)), np.cumsum(self._evidence(scores), axis=-1)), axis=-1)
        spans = [*(2**k for k in range(windows.bit_length()) if 2**k < windows), windows]
        return np.max([(sums[..., n:] - sums[..., :-n]).max(axis=-1) / np.sqrt(n) for n in spans], axis=0)

    def threshold(self, windows: int, false_alarms: float, draws: int) -> float:
        """Return the strength above which genuine individuals with so many windows lie as often as stated.

        They are made of scores of single samples, drawn at random, and of one that could not be worse: what n samples have not
        shown may still happen once in n + 1 times.
        """
        known = np.append(self.genuine_scores, 0.0)
        draws = max(1000, min(draws, MOST_DRAWN // windows))
        rng = np.random.default_rng(windows)
        parts = np.array_split(np.arange(draws), max(1, draws * windows // 1_000_000))
        drawn = [self.strengths(rng.choice(known, (len(part), windows))) for part in parts]
        return float(np.sort(np.concatenate(drawn))[-int(false_alarms * draws) - 1])

    def spells(self, scores: np.ndarray, threshold: float) -> list[slice]:
        """Return the stretches of scores (W,) above the threshold: the strongest of any length, then those before and after it."""
        if not len(scores):
            return []
        sums = np.append(0.0, np.cumsum(self._evidence(scores)))
        best, found = threshold, None
        for n in range(1, len(scores) + 1):
            strengths = (sums[n:] - sums[:-n]) / np.sqrt(n)
            begin = int(np.argmax(strengths))
            if strengths[begin] > best:
                best, found = strengths[begin], slice(begin, begin + n)
        if found is None:
            return []
        later = self.spells(scores[found.stop :], threshold)
        moved = [slice(spell.start + found.stop, spell.stop + found.stop) for spell in later]
        return [*self.spells(scores[: found.start], threshold), found, *moved]

    def verdict(self, name: str, times: np.ndarray, scores: np.ndarray, threshold: float) -> TimedVerdict:
        """Return the verdict on an individual with windows at times (W, 2) and their scores (W,)."""
        flagged = np.zeros(len(scores), dtype=bool)
        if not len(scores):
            return TimedVerdict(name, 0, 1.0, 0.0, threshold, False, (), times, scores, flagged)
        strength = float(self.strengths(scores))
        spells = self.spells(scores, threshold) if strength > threshold else []
        for spell in spells:
            flagged[spell] = True
        return TimedVerdict(
            individual=name,
            windows=len(scores),
            score=float(scores.mean()),
            strength=strength,
            threshold=threshold,
            abnormal=strength > threshold,
            spells=tuple((float(times[spell.start, 0]), float(times[spell.stop - 1, 1])) for spell in spells),
            times=times,
            scores=scores,
            flagged=flagged,
        )

    def _evidence(self, scores: np.ndarray) -> np.ndarray:
        spread = max(float(self.genuine_scores.std()), SMALLEST_SPREAD)
        return (float(self.genuine_scores.mean()) - scores) / spread
