"""The classifier two-sample test: a panel learns from two kinds of samples, judges others, and groups are permuted."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr, ndtri

from turing_learning import examination
from turing_learning.analysis import LEVEL
from turing_learning.config import ConfigurationError
from turing_learning.errors import integer, refuse, require

from .evidence import TESTING, Effort, Evidence, Stored, stream

PERMUTATIONS = 999
CLEAR_ACCURACY = 2 / 3
"""Accuracy of classifiers that are shown a clearly wrong model: of three samples they tell two."""
BUNDLES = 20
"""Groups of simulated samples that a test has at least."""
REFERENCE = 1_000
"""Begins the random numbers of references."""


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
    # Welch's t and no plain difference: sides may have groups of unequal spread
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


@dataclass(frozen=True)
class TwoSampleTest(Stored):
    """Whether a panel of examiners can tell held-out genuine samples from simulated ones."""

    #: Share of right answers on held-out samples, both kinds weighing the same; 0.5 is guessing
    accuracy: float
    #: How often guessing would do as well or better, see `permutation_test`
    p_value: float
    critical: float  #: The accuracy from which on the p-value is at most 0.05
    genuine_samples: int  #: Number of held-out samples
    #: How many groups they belong to, which are what is permuted
    genuine_groups: int
    counterfeit_samples: int  #: Number of simulated samples
    counterfeit_groups: int  #: In bundles of the size of the genuine groups
    grouping: str  #: What a genuine group is
    #: Accuracies of the same test of models that the run calls plausible, as if each were the system
    plausible: tuple[float, ...] = ()

    @property
    def power(self) -> float:
        """How often so many groups would show a clearly wrong model, which is told with an accuracy of 2/3.

        The difference of the means is taken for normally distributed; its standard error is that of the critical
        value. A panel that says the same of all samples shows nothing.
        """
        error = (self.critical - 0.5) / ndtri(1 - LEVEL)
        if error > 0:
            return float(ndtr((CLEAR_ACCURACY - self.critical) / error))
        return 0.0

    @property
    def told_apart(self) -> bool:
        """Whether the p-value is at most 0.05."""
        return self.p_value <= LEVEL


def two_sample_test(
    evidence: Evidence, models: np.ndarray, effort: Effort, *, seed: int, purpose: tuple[int, ...] = (TESTING,),
    references: int = 0,
) -> TwoSampleTest:  # fmt: skip
    """Let a panel learn from genuine samples and samples of a model; test it on held-out ones.

    Source: Lopez-Paz and Oquab, Revisiting classifier two-sample tests, ICLR 2017; Rubin, Bayesianly
    justifiable and relevant frequency calculations (1984), for the references; docs/decisions/0045.

    Parameters
    ----------
    evidence
        The samples and the simulator.
    models : (P,) or (W, P)
        The model, in its parameters' units; or W that are called plausible, from which each
        simulated sample takes one at random.
    effort
        How much is simulated.
    seed
        Of all random numbers, >= 0.
    purpose
        Tells the random numbers of several tests apart.
    references
        How many of the models are tested as if each were the system.
    """
    models = np.atleast_2d(models)
    test = paired_test(evidence, models, effort, seed, purpose)[0]
    plausible = reference_accuracies(
        evidence, models, effort, references, seed=seed, purpose=purpose
    )
    return replace(test, plausible=tuple(plausible))


def reference_accuracies(
    evidence: Evidence, models: np.ndarray, effort: Effort, references: int, *, seed: int,
    purpose: tuple[int, ...] = (TESTING,),
) -> Iterator[float]:  # fmt: skip
    """Yield accuracies of tests of some of the models (W, P), each as if it were the system; see `two_sample_test`.

    Each is simulated and tested when it is asked for. Who needs no more of the `references` saves the others.
    """
    count = min(len(evidence.learning), effort.samples)
    for k in range(references):
        rng = stream(seed, *purpose, REFERENCE, k)
        system = models[rng.integers(len(models))][None]
        samples = _simulated(evidence, system, count + len(evidence.testing), rng)
        testing = samples[count:]
        groups = evidence.groups[: len(testing)]
        as_if = replace(evidence, learning=samples[:count], testing=testing, groups=groups)
        test, _ = paired_test(as_if, models, effort, seed, (*purpose, REFERENCE, k))
        yield test.accuracy


def paired_test(
    evidence: Evidence, models: np.ndarray, effort: Effort, seed: int, purpose: tuple[int, ...]
) -> tuple[TwoSampleTest, np.ndarray]:
    """Return the test of models (W, P), and the accuracies (G,) on its G genuine groups, each beside as many of the simulated ones.

    Those of tests of several models are paired: their genuine groups are the same.
    """
    rng = stream(seed, *purpose)
    genuine = evidence.learning
    if len(genuine) > effort.samples:
        genuine = genuine[rng.choice(len(genuine), effort.samples, replace=False)]
    learned = _simulated(evidence, models, effort.samples, rng)
    groups = len(np.unique(evidence.groups))
    # Simulated samples are bundled as genuine ones are: means of as many are compared
    bundle = max(1, round(len(evidence.testing) / groups))
    counterfeit = _simulated(
        evidence, models, bundle * max(BUNDLES, -(-effort.samples // bundle)), rng
    )
    answers = examination.answers(
        genuine,
        learned,
        np.concatenate((evidence.testing, counterfeit)),
        names=evidence.names,
        interval_s=evidence.interval_s,
        seed=int(rng.integers(2**32)),
    ).astype(float)
    count = len(evidence.testing)
    scores = group_means(answers[:count], evidence.groups)
    counterfeit_scores = group_means(answers[count:], np.arange(len(counterfeit)) // bundle)
    permuted = permutation_test(scores, counterfeit_scores, rng)
    # Each genuine group stands beside counterfeit ones of its own, where there are enough of them.
    portions = [counterfeit_scores]
    if len(counterfeit_scores) >= len(scores):
        portions = np.array_split(counterfeit_scores, len(scores))
    test = TwoSampleTest(
        accuracy=(1 + permuted.difference) / 2,
        p_value=permuted.p_value,
        critical=(1 + permuted.critical) / 2,
        genuine_samples=count,
        genuine_groups=groups,
        counterfeit_samples=len(counterfeit),
        counterfeit_groups=len(counterfeit_scores),
        grouping=evidence.grouping,
    )
    return test, (1 + scores - np.array([portion.mean() for portion in portions])) / 2


def _simulated(
    evidence: Evidence, models: np.ndarray, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Return samples (count, T, D), each of one of the models (W, P), but for those that fail."""
    chosen = models[rng.integers(len(models), size=count)]
    samples = evidence.simulate(chosen, rng)
    if 2 * len(samples) < count:
        values = np.median(models, axis=0).tolist()
        model = str(dict(zip(evidence.parameters, values, strict=True)))
        got = f"{count - len(samples)} failures of {count}"
        refuse("simulate", "simulate the model", got, place=model, error=ConfigurationError)
    return samples[:, 0]
