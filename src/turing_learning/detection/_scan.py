"""When an individual behaves abnormally: the worst stretch of its motion."""

from dataclasses import dataclass

import numpy as np

from ._verdict import DIGITS

SPAN = 5
"""Windows of a stretch."""
MOST_DRAWN = 10_000_000


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
        Lowest mean score of a stretch of consecutive windows; 1 without windows.
    threshold
        Below it the individual is called abnormal.
    abnormal
        Whether it behaves abnormally in some stretch.
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
    threshold: float
    abnormal: bool
    spells: tuple[tuple[float, float], ...]
    times: np.ndarray
    scores: np.ndarray
    flagged: np.ndarray


def stretch_means(scores: np.ndarray, span: int) -> np.ndarray:
    """Return the mean of each stretch of `span` consecutive scores (..., W), or of all if there are fewer; (..., W - span + 1)."""
    span = min(span, scores.shape[-1])
    return np.round(np.lib.stride_tricks.sliding_window_view(scores, span, axis=-1).mean(axis=-1), DIGITS)


def scan_threshold(genuine_scores: np.ndarray, windows: int, span: int, false_alarms: float, draws: int) -> float:
    """Return the value below which the lowest stretch of a genuine individual lies as often as stated.

    Genuine individuals are made of scores of single samples, drawn at random.
    """
    draws = max(1000, min(draws, MOST_DRAWN // windows))
    rng = np.random.default_rng((windows, span))
    lowest = np.sort(
        np.concatenate(
            [
                stretch_means(rng.choice(genuine_scores, (len(part), windows)), span).min(axis=1)
                for part in np.array_split(np.arange(draws), max(1, draws * windows // 1_000_000))
            ]
        )
    )
    return float(lowest[int(false_alarms * draws)])


def timed_verdict(
    name: str, times: np.ndarray, scores: np.ndarray, *, span: int, threshold: float, middle: float
) -> TimedVerdict:
    """Return the verdict on an individual with windows at times (W, 2) and their scores (W,).

    Spells are stretches below the threshold, without windows at their ends that look genuine, with a score of `middle` or more.
    """
    if not len(scores):
        return TimedVerdict(name, 0, 1.0, threshold, False, (), times, scores, np.zeros(0, dtype=bool))
    means = stretch_means(scores, span)
    below = np.flatnonzero(means < threshold)
    flagged = np.zeros(len(scores), dtype=bool)
    for begin in below:
        flagged[begin : begin + span] = True
    spells = []
    for run in _runs(flagged):
        run_scores = np.flatnonzero(scores[run] < middle)
        flagged[run] = False
        if len(run_scores):
            kept = slice(run.start + int(run_scores[0]), run.start + int(run_scores[-1]) + 1)
            flagged[kept] = True
            spells.append((float(times[kept.start, 0]), float(times[kept.stop - 1, 1])))
    return TimedVerdict(
        name, len(scores), float(means.min()), threshold, bool(len(below)), tuple(spells), times, scores, flagged
    )


def _runs(flags: np.ndarray) -> list[slice]:
    """Return where flags (W,) are up without a break."""
    edges = np.flatnonzero(np.diff(flags, prepend=False, append=False))
    return [slice(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]
