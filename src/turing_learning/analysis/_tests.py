"""Whether samples differ, how often decisions are right, and classifiers with votes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import array
from ..coevolution import THRESHOLD, Classifier
from ..errors import number, require

LEVEL = 0.05
"""Significance level of the paper's tests, section 4.3."""


@dataclass(frozen=True)
class Comparison:
    """Two-sided Mann-Whitney tests of several samples against one reference."""

    p_values: np.ndarray  #: (S,), of each test, not corrected
    level: float  #: Significance level of all tests together

    @property
    def significant(self) -> np.ndarray:
        """Which samples differ (S,), with Bonferroni's correction: p below the level over the number of tests."""
        return self.p_values < self.level / len(self.p_values)

    @property
    def without_difference(self) -> int:
        """Number of samples that do not differ significantly."""
        return int(np.count_nonzero(~self.significant))


def compare(
    reference: np.typing.ArrayLike,
    samples: Sequence[np.typing.ArrayLike] | np.ndarray,
    *,
    level: float = LEVEL,
) -> Comparison:
    """Test samples against a reference, each with a two-sided Mann-Whitney test, and Bonferroni's correction.

    Source: paper, section 4.3.

    Parameters
    ----------
    reference : (R,)
        For example the dispersion of agents in R trials.
    samples : S arrays (R,)
        For example the dispersion of replicas; they may differ in length.
    level
        Significance level of all tests together, in (0, 1).
    """
    from scipy.stats import mannwhitneyu

    number("level", level, above=0, below=1)
    require(len(samples), "samples", "hold at least one sample", "none")
    reference_values = array("reference", reference, "R")
    compared = [array(f"samples[{k}]", sample, "R") for k, sample in enumerate(samples)]
    tests = (mannwhitneyu(reference_values, sample, alternative="two-sided") for sample in compared)
    return Comparison(np.array([test.pvalue for test in tests]), level)


def decision_accuracy(agents: np.typing.ArrayLike, models: np.typing.ArrayLike) -> np.ndarray:
    """Compute the decision accuracy of classifiers (...), in [0, 1].

    An individual counts as a model only if it is judged counterfeit in all of its trials. Agents and models
    have half of the weight each.

    Source: paper, section 4.4.

    Parameters
    ----------
    agents : (..., S, R) bool
        Whether each of S agents was judged genuine in each of R trials; classifiers come first.
    models : (..., M, R) bool
        Whether each of M models was judged genuine.
    """
    shares = []
    for name, judgments in (("agents", agents), ("models", models)):
        values = np.asarray(judgments)
        judged = array(name, values.astype(int) if values.dtype == bool else values, "... S R")
        wrong = judged[~np.isin(judged, (0, 1))]
        require(not wrong.size, name, "hold nothing but 0 and 1", wrong[:1].tolist())
        shares.append(judged.any(axis=-1).mean(axis=-1))
    return (shares[0] + (1 - shares[1])) / 2


def polarization(directions: np.ndarray, present: np.ndarray | None = None) -> np.ndarray:
    """Compute the length of the mean direction of a group: 1 if all go one way, about 0 in disorder.

    Returns those (moments,) of the moments in which at least two individuals have a direction.

    Source: Vicsek and others, Phys. Rev. Lett. 75 (1995), the absolute value of the average normalized
    velocity.

    Parameters
    ----------
    directions : (..., A, 2)
        Displacements or headings as vectors of any length; those of length 0 have no direction and do not
        count.
    present : (..., A)
        Which of them are known; None for all.
    """
    length = np.hypot(directions[..., 0], directions[..., 1])
    counted = (length > 0) if present is None else present & (length > 0)
    unit = np.where(
        counted[..., None], directions / np.where(length > 0, length, 1.0)[..., None], 0.0
    )
    count, total = counted.sum(axis=-1), unit.sum(axis=-2)
    aligned = np.asarray(np.hypot(total[..., 0], total[..., 1]) / np.maximum(count, 1))
    return aligned[count >= 2]


@dataclass(frozen=True, eq=False)
class Jury:
    """Classifiers with votes."""

    classifier: Classifier  #: Judges
    genomes: np.ndarray  #: (N, Q), those that vote
    #: (N,), of the votes, summing to 1; none where no classifier can tell samples apart
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

    Source: Youden, Index for rating diagnostic tests (1950).
    """
    axes = tuple(range(1, genuine.ndim))
    return genuine.mean(axis=axes) - counterfeit.mean(axis=axes)


def area_under_curve(
    high: np.typing.ArrayLike, low: np.typing.ArrayLike, weights: np.typing.ArrayLike | None = None
) -> float:
    """Return the probability that one of scores (K,) is above one of others (n,), ties counted half.

    Parameters
    ----------
    weights : (n,)
        Of the others; None for equal ones.
    """
    high, low = array("high", high, "K"), array("low", low, "n")
    if weights is None:
        weights = np.ones(len(low))
    else:
        weights = array("weights", weights, "n", n=len(low))
    order = np.argsort(low)
    sums = np.append(0.0, np.cumsum(weights[order]))
    below, also = (sums[np.searchsorted(low[order], high, side)] for side in ("left", "right"))
    return float(np.mean(below + also) / (2 * sums[-1]))
