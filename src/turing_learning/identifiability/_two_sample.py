"""The classifier two-sample test: fresh classifiers, trained on two kinds of samples, judge others, and groups are permuted."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from turing_learning.analysis import LEVEL, Jury
from turing_learning.coevolution import Classifier, Judgments, classifier_reward
from turing_learning.config import ConfigurationError
from turing_learning.errors import integer, refuse, require
from turing_learning.evolution import EvolutionStrategy

from .evidence import TESTING, Effort, Evidence, Stored, stream

PERMUTATIONS = 999
CLEARLY = 2 / 3
"""Accuracy of classifiers that are shown a clearly wrong model: of three samples they tell two."""
BUNDLES = 20
"""Groups of simulated samples that a test has at least."""


class Permutation(NamedTuple):
    """The difference of two means of groups, its p-value, and the difference from which on that is at most 0.05."""

    difference: float
    p_value: float
    critical: float


def permutation_test(
    genuine: np.ndarray,
    counterfeit: np.ndarray,
    rng: np.random.Generator,
    *,
    permutations: int = PERMUTATIONS,
) -> Permutation:
    """Test by permuted labels whether genuine groups score higher than counterfeit ones, by the mean score (groups,) of each.

    The statistic is the difference of the means over its standard error (Welch), which keeps the rate of false
    alarms near its nominal value also where groups of the two kinds vary differently. Source: Chung and Romano,
    Exact and asymptotically robust permutation tests, Annals of Statistics 41 (2013).
    """
    for name, scores in (("genuine", genuine), ("counterfeit", counterfeit)):
        require(len(scores) >= 2, name, "hold at least 2 groups", len(scores))
    integer("permutations", permutations, 19)

    def welch(scores: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return t and the standard error of the difference, (R,) each, of scores (R, groups), the genuine groups first."""
        sides = scores[:, : len(genuine)], scores[:, len(genuine) :]
        difference = sides[0].mean(axis=1) - sides[1].mean(axis=1)
        error = np.sqrt(sum(side.var(axis=1, ddof=1) / side.shape[1] for side in sides))
        return difference / np.maximum(error, 1e-12), error

    pooled = np.concatenate((genuine, counterfeit))[None]
    drawn, _ = welch(rng.permuted(np.repeat(pooled, permutations, axis=0), axis=1))
    observed, error = (float(value[0]) for value in welch(pooled))
    return Permutation(
        difference=float(genuine.mean() - counterfeit.mean()),
        p_value=(1 + int(np.count_nonzero(drawn >= observed - 1e-9))) / (permutations + 1),
        critical=float(np.sort(drawn)[-int(LEVEL * (permutations + 1))]) * error,
    )


def group_means(scores: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return the mean of the scores (S,) in each group, by the numbers (S,) of the groups, ascending."""
    _, members, counts = np.unique(groups, return_inverse=True, return_counts=True)
    return np.bincount(members, weights=scores) / counts


def train_jury(
    classifier: Classifier,
    genuine: np.ndarray,
    counterfeit: np.ndarray,
    effort: Effort,
    seed: tuple[int, ...],
) -> Jury:
    """Evolve classifiers as a run does, by the paper's reward, on samples (K, T, D) and (S, T, D) that stay the same.

    The better half of the last population votes; a vote weighs Youden's J on these samples where that is
    positive.
    """
    half, count = effort.population // 2, len(genuine)
    strategy = EvolutionStrategy(
        classifier.parameters, parents=half, offspring=effort.population - half, seed=seed
    )
    samples = np.concatenate((genuine, counterfeit))

    def rewarded() -> tuple[np.ndarray, np.ndarray]:
        genomes = strategy.ask()
        outputs = classifier.judge(genomes, samples)
        return genomes, classifier_reward(Judgments(outputs[:, :count], outputs[:, count:, None]))

    for _ in range(effort.generations):
        strategy.tell(rewarded()[1])
    genomes, reward = rewarded()
    youden = 2 * reward - 1  # Youden's J
    best = np.argsort(-youden, kind="stable")[:half]
    voters = best[youden[best] > 0]
    return Jury(classifier, genomes[voters], youden[voters] / max(youden[voters].sum(), 1e-12))


@dataclass(frozen=True)
class TwoSampleTest(Stored):
    """Whether fresh classifiers can tell held-out genuine samples from simulated ones."""

    accuracy: float  #: Mean share of right votes on held-out samples, both kinds weighing the same; 0.5 is guessing
    p_value: float  #: How often guessing would do as well or better, see `permutation_test`
    critical: float  #: The accuracy from which on the p-value is at most 0.05
    genuine_samples: int  #: Number of held-out samples
    genuine_groups: int  #: How many groups they belong to, which are what is permuted
    counterfeit_samples: int  #: Number of simulated samples
    counterfeit_groups: int  #: In bundles of the size of the genuine groups
    grouping: str  #: What a genuine group is

    @property
    def power(self) -> float:
        """How often so many groups would show a clearly wrong model, which is told with an accuracy of 2/3.

        The difference of the means is taken for normally distributed; its standard error is that of the critical
        value. Classifiers that say the same of all samples show nothing.
        """
        error = (self.critical - 0.5) / ndtri(1 - LEVEL)
        return float(ndtr((CLEARLY - self.critical) / error)) if error > 0 else 0.0

    @property
    def told_apart(self) -> bool:
        """Whether the p-value is at most 0.05."""
        return self.p_value <= LEVEL


def two_sample_test(
    evidence: Evidence, values: np.ndarray, effort: Effort, *, seed: int, use: tuple[int, ...] = (TESTING,),
) -> TwoSampleTest:  # fmt: skip
    """Train fresh classifiers on genuine samples and samples of one model; test them on held-out samples.

    Source: Lopez-Paz and Oquab, Revisiting classifier two-sample tests, ICLR 2017; docs/decisions/0022.

    Parameters
    ----------
    evidence
        The samples and the simulator.
    values : (P,)
        The model, in its parameters' units.
    effort
        How much is simulated and trained.
    seed
        Of all random numbers, >= 0.
    use
        Tells the random numbers of several tests apart.
    """
    return paired_test(evidence, values, effort, seed, use)[0]


def paired_test(
    evidence: Evidence, values: np.ndarray, effort: Effort, seed: int, purpose: tuple[int, ...]
) -> tuple[TwoSampleTest, np.ndarray]:
    """Return the test of one model, and the accuracies (G,) on its G genuine groups, each beside as many of the simulated ones.

    Those of tests of several models are paired: their genuine groups are the same.
    """
    rng, genuine = stream(seed, *purpose), evidence.learning
    if len(genuine) > effort.samples:
        genuine = genuine[rng.choice(len(genuine), effort.samples, replace=False)]

    def simulated(count: int) -> np.ndarray:
        """Return samples (count, T, D), each of a simulation of its own."""
        samples = evidence.simulate(np.tile(values, (count, 1)), rng)
        if 2 * len(samples) < count:
            where = str(dict(zip(evidence.parameters, np.asarray(values).tolist(), strict=True)))
            got = f"{count - len(samples)} failures of {count}"
            refuse("simulate", "simulate the model", got, place=where, error=ConfigurationError)
        return samples[:, 0]

    counterfeit = simulated(effort.samples)
    key = (*rng.integers(2**32, size=4).tolist(),)
    jury = train_jury(evidence.classifier, genuine, counterfeit, effort, key)
    groups = len(np.unique(evidence.groups))
    bundle = max(1, round(len(evidence.testing) / groups))
    counterfeit = simulated(bundle * max(BUNDLES, -(-effort.samples // bundle)))
    scores = group_means(jury.score(evidence.testing), evidence.groups)
    counterfeit_scores = group_means(jury.score(counterfeit), np.arange(len(counterfeit)) // bundle)
    permuted = permutation_test(scores, counterfeit_scores, rng)
    parts = (
        np.array_split(counterfeit_scores, len(scores))
        if len(counterfeit_scores) >= len(scores)
        else [counterfeit_scores]
    )
    test = TwoSampleTest(
        accuracy=(1 + permuted.difference) / 2,
        p_value=permuted.p_value,
        critical=(1 + permuted.critical) / 2,
        genuine_samples=len(evidence.testing),
        genuine_groups=groups,
        counterfeit_samples=len(counterfeit),
        counterfeit_groups=len(counterfeit_scores),
        grouping=evidence.grouping,
    )
    return test, (1 + scores - np.array([group.mean() for group in parts])) / 2
