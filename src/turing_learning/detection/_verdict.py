"""What is said about an individual."""

from dataclasses import dataclass

import numpy as np

DIGITS = 9
"""Of a score that are kept; what comes after them depends on the order of summation."""


@dataclass(frozen=True)
class Verdict:
    """What a detector says about an individual.

    Attributes
    ----------
    individual
        Its name.
    score
        Mean over its samples of the weighted share of votes that say genuine; 0 to 1.
    p_value
        How often chance makes a score as low, see `Detector.p_values`.
    genuine_share
        Share of its samples that are judged genuine: whose score is nearer to the mean score of genuine samples than to
        that of abnormal ones.
    abnormal
        Whether it behaves abnormally.
    since
        Number, from 1, of the sample at which abnormal motion most likely begins; None for a normal individual.
    """

    individual: str
    score: float
    p_value: float
    genuine_share: float
    abnormal: bool
    since: int | None


def mean_score(scores: np.ndarray) -> np.ndarray:
    """Return the mean of scores (..., S) over the samples."""
    return np.round(scores.mean(axis=-1), DIGITS)


def decide_verdict(name: str, scores: np.ndarray, p_value: float, abnormal: bool, middle: float) -> Verdict:
    """Return the verdict on an individual with the scores (S,); samples with a score below `middle` count as counterfeit."""
    return Verdict(
        individual=name,
        score=float(mean_score(scores)),
        p_value=p_value,
        genuine_share=float(np.mean(scores >= middle)),
        abnormal=abnormal,
        since=_beginning(middle - scores) if abnormal else None,
    )


def _beginning(evidence: np.ndarray) -> int:
    """Return from which sample on, counted from 1, the sum of the evidence (S,) is largest."""
    return int(np.argmax(np.cumsum(evidence[::-1])[::-1])) + 1
