"""The classifier two-sample test: fresh classifiers, trained on two kinds of samples, judge others, and groups are permuted."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from turing_learning.analysis import Jury
from turing_learning.coevolution import Classifier, Judgments, classifier_reward
from turing_learning.config import ConfigurationError
from turing_learning.errors import integer, refuse, require
from turing_learning.evolution import EvolutionStrategy

from ._evidence import TESTING, Effort, Evidence, stream

PERMUTATIONS = 999
LEVEL = 0.05
BUNDLES = 20
"""Groups of simulated samples that a test has at least."""


@dataclass(frozen=True)
class Permutation:
    """A permutation test of whole groups.

    Attributes
    ----------
    difference
        Mean score of the genuine groups minus that of the counterfeit ones.
    p_value
        Share of the permutations with a difference as large, in units of its standard error; one-sided.
    critical
        The difference above which the p-value is at most 0.05, at the standard error that was found.
    """

    difference: float
    p_value: float
    critical: float


def permutation_test(
    genuine: np.ndarray, counterfeit: np.ndarray, rng: np.random.Generator, *, permutations: int = PERMUTATIONS
) -> Permutation:
    """Test whether genuine groups score higher than counterfeit ones.

    Samples of one individual are alike, so that they are not permuted: each group enters with the mean score of its samples,
    and the labels of groups are permuted. The statistic is the difference of the means over its standard error (Welch), which
    keeps the rate of false alarms near its nominal value also where groups of the two kinds vary differently.

    Parameters
    ----------
    genuine, counterfeit : (groups,)
        Mean score of each group, at least two of each kind.
    rng
        Draws the permutations.
    permutations
        Their number, >= 19.

    Source
    ------
    Chung and Romano, Exact and asymptotically robust permutation tests, Annals of Statistics 41 (2013).
    """
    for name, scores in (("genuine", genuine), ("counterfeit", counterfeit)):
        require(len(scores) >= 2, name, "hold at least 2 groups", len(scores))
    integer("permutations", permutations, 19)
    pooled = np.concatenate((genuine, counterfeit))
    shuffled = rng.permuted(np.tile(pooled, (permutations, 1)), axis=1)
    drawn, _ = _welch(shuffled, len(genuine))
    found, error = (float(value[0]) for value in _welch(pooled[None], len(genuine)))
    return Permutation(
        difference=float(genuine.mean() - counterfeit.mean()),
        p_value=(1 + int(np.count_nonzero(drawn >= found - 1e-9))) / (permutations + 1),
        critical=float(np.sort(drawn)[-int(LEVEL * (permutations + 1))]) * error,
    )


def _welch(scores: np.ndarray, genuine: int) -> tuple[np.ndarray, np.ndarray]:
    """Return t and the standard error of the difference, (R,) each, of scores (R, groups), the genuine groups first."""
    sides = scores[:, :genuine], scores[:, genuine:]
    difference = sides[0].mean(axis=1) - sides[1].mean(axis=1)
    error = np.sqrt(sum(side.var(axis=1, ddof=1) / side.shape[1] for side in sides))
    return difference / np.maximum(error, 1e-12), error


def group_means(scores: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return the mean of the scores (S,) in each group, by the numbers (S,) of the groups, ascending."""
    _, members, counts = np.unique(groups, return_inverse=True, return_counts=True)
    return np.bincount(members, weights=scores) / counts


def train_jury(
    classifier: Classifier,
    genuine: np.ndarray,
    counterfeit: np.ndarray,
    *,
    generations: int,
    population: int,
    seed: tuple[int, ...],
) -> Jury:
    """Evolve classifiers as a run does, by the paper's reward, on samples (K, T, D) and (S, T, D) that stay the same.

    The better half of the last population votes; a vote weighs Youden's J on these samples where that is positive.
    """
    half = population // 2
    strategy = EvolutionStrategy(classifier.parameters, parents=half, offspring=population - half, seed=seed)
    samples = np.concatenate((genuine, counterfeit))
    for _ in range(generations):
        strategy.tell(classifier_reward(_judgments(classifier, strategy.ask(), samples, len(genuine))))
    genomes = strategy.ask()
    found = 2 * classifier_reward(_judgments(classifier, genomes, samples, len(genuine))) - 1  # Youden's J
    best = np.argsort(-found, kind="stable")[:half]
    voters = best[found[best] > 0]
    return Jury(classifier, genomes[voters], found[voters] / max(found[voters].sum(), 1e-12))


def _judgments(classifier: Classifier, genomes: np.ndarray, samples: np.ndarray, genuine: int) -> Judgments:
    outputs = classifier.judge(genomes, samples)
    return Judgments(outputs[:, :genuine], outputs[:, genuine:, None])


@dataclass(frozen=True)
class TwoSampleTest:
    """Whether fresh classifiers can tell held-out genuine samples from simulated ones.

    Attributes
    ----------
    accuracy
        Mean share of right votes on held-out samples, both kinds weighing the same; 0.5 is guessing.
    p_value
        How often guessing would do as well or better, see `permutation_test`.
    critical
        The accuracy from which on the p-value is at most 0.05.
    genuine_samples, genuine_groups
        Held-out samples, and how many groups they belong to; groups are what is permuted.
    counterfeit_samples, counterfeit_groups
        The same of simulated samples, in bundles of the size of the genuine groups.
    grouping
        What a genuine group is.
    """

    accuracy: float
    p_value: float
    critical: float
    genuine_samples: int
    genuine_groups: int
    counterfeit_samples: int
    counterfeit_groups: int
    grouping: str

    @property
    def told_apart(self) -> bool:
        """Whether the p-value is at most 0.05."""
        return self.p_value <= LEVEL

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name."""
        return asdict(self)


def two_sample_test(
    evidence: Evidence,
    values: np.ndarray,
    effort: Effort,
    *,
    seed: int,
    use: tuple[int, ...] = (TESTING,),
    generations: int | None = None,
    population: int | None = None,
) -> TwoSampleTest:
    """Train fresh classifiers on genuine samples and samples of one model; test them on held-out samples.

    For the arguments see `paired_test`.
    """
    found, _ = paired_test(evidence, values, effort, seed=seed, use=use, generations=generations, population=population)
    return found


def paired_test(
    evidence: Evidence,
    values: np.ndarray,
    effort: Effort,
    *,
    seed: int,
    use: tuple[int, ...] = (TESTING,),
    generations: int | None = None,
    population: int | None = None,
) -> tuple[TwoSampleTest, np.ndarray]:
    """Return the test of one model, and the accuracies (G,) on its G genuine groups, each beside as many of the simulated ones.

    Those of tests of several models are paired: their genuine groups are the same.

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
    generations, population
        Instead of those of `effort`.

    Source
    ------
    Lopez-Paz and Oquab, Revisiting classifier two-sample tests, ICLR 2017; docs/decisions/0022.
    """
    rng = stream(seed, *use)
    genuine = evidence.learning
    if len(genuine) > effort.samples:
        genuine = genuine[rng.choice(len(genuine), effort.samples, replace=False)]
    groups = len(np.unique(evidence.groups))
    jury = train_jury(
        evidence.classifier,
        genuine,
        _simulated(evidence, values, effort.samples, rng),
        generations=generations or effort.generations,
        population=population or effort.population,
        seed=(*rng.integers(2**32, size=4).tolist(),),
    )
    bundle = max(1, round(len(evidence.testing) / groups))
    bundles = max(BUNDLES, -(-effort.samples // bundle))
    counterfeit = _simulated(evidence, values, bundle * bundles, rng)
    scores = group_means(jury.score(evidence.testing), evidence.groups)
    others = group_means(jury.score(counterfeit), np.arange(len(counterfeit)) // bundle)
    found = permutation_test(scores, others, rng)
    beside = (
        [part.mean() for part in np.array_split(others, len(scores))] if len(others) >= len(scores) else others.mean()
    )
    test = TwoSampleTest(
        accuracy=(1 + found.difference) / 2,
        p_value=found.p_value,
        critical=(1 + found.critical) / 2,
        genuine_samples=len(evidence.testing),
        genuine_groups=groups,
        counterfeit_samples=len(counterfeit),
        counterfeit_groups=len(others),
        grouping=evidence.grouping,
    )
    return test, (1 + scores - np.array(beside)) / 2


def _simulated(evidence: Evidence, values: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return samples (count, T, D) of a model, each of a simulation of its own."""
    samples = evidence.simulate(np.tile(values, (count, 1)), rng)
    if 2 * len(samples) < count:
        place = str(dict(zip(evidence.parameters, np.asarray(values).tolist(), strict=True)))
        got = f"{count - len(samples)} failures of {count}"
        refuse("simulate", "simulate the model", got, place=place, error=ConfigurationError)
    return samples[:, 0]
