"""Classifiers with votes, and how well scores separate two kinds."""

from dataclasses import dataclass

import numpy as np

from ..coevolution import THRESHOLD, Classifier


@dataclass(frozen=True, eq=False)
class Jury:
    """Classifiers with votes.

    Attributes
    ----------
    classifier
        Judges.
    genomes : (N, Q)
        Those that vote.
    weights : (N,)
        Of the votes, summing to 1; none where no classifier can tell samples apart.
    """

    classifier: Classifier
    genomes: np.ndarray
    weights: np.ndarray

    def votes(self, samples: np.ndarray) -> np.ndarray:
        """Return whether each classifier judges each of samples (..., T, D) genuine (N, ...)."""
        outputs = self.classifier.judge(self.genomes, samples.reshape(-1, *samples.shape[-2:]))
        return (outputs >= THRESHOLD).reshape(len(self.genomes), *samples.shape[:-2])

    def score(self, samples: np.ndarray) -> np.ndarray:
        """Return the weighted share of votes (...) that say genuine, of samples (..., T, D); 0.5 where nobody votes."""
        if not len(self.weights):
            return np.full(samples.shape[:-2], 0.5)
        votes = self.votes(samples)
        return (self.weights @ votes.reshape(len(votes), -1)).reshape(votes.shape[1:])


def competence(genuine: np.ndarray, counterfeit: np.ndarray) -> np.ndarray:
    """Return Youden's J (N,) = specificity + sensitivity - 1 of votes (N, ...) on both kinds of samples.

    Source
    ------
    Youden, Index for rating diagnostic tests (1950).
    """
    axes = tuple(range(1, genuine.ndim))
    return genuine.mean(axis=axes) - counterfeit.mean(axis=axes)


def area_under_curve(high: np.ndarray, low: np.ndarray, weights: np.ndarray | None = None) -> float:
    """Return the probability that one of scores (K,) is above one of others (n,), ties counted half.

    Parameters
    ----------
    weights : (n,)
        Of the others; None for equal ones.
    """
    weights = np.ones(len(low)) if weights is None else weights
    order = np.argsort(low)
    sums = np.append(0.0, np.cumsum(weights[order]))
    below, also = (sums[np.searchsorted(low[order], high, side)] for side in ("left", "right"))
    return float(np.mean(below + also) / (2 * sums[-1]))
