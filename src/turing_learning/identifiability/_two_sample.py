"""The classifier two-sample test."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from turing_learning.config import ConfigurationError

from ._evidence import TESTING, Effort, Evidence, stream
from ._jury import train_jury
from ._permutation import LEVEL, group_means, permutation_test

BUNDLES = 20
"""Groups of simulated samples that a test has at least."""


@dataclass(frozen=True)
class TwoSampleTest:
    """Whether fresh classifiers can tell kept-out genuine samples from simulated ones.

    Attributes
    ----------
    accuracy
        Mean share of right votes on kept-out samples, both kinds weighing the same; 0.5 is guessing.
    p_value
        How often guessing would do as well or better, see `permutation_test`.
    critical
        The accuracy from which on the p-value is at most 0.05.
    genuine_samples, genuine_groups
        Kept-out samples, and how many groups they belong to; groups are what is permuted.
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
    """Train fresh classifiers on genuine samples and samples of one model; test them on kept-out samples.

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

    Raises
    ------
    ConfigurationError
        If most simulations fail.

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
    return TwoSampleTest(
        accuracy=(1 + found.difference) / 2,
        p_value=found.p_value,
        critical=(1 + found.critical) / 2,
        genuine_samples=len(evidence.testing),
        genuine_groups=groups,
        counterfeit_samples=len(counterfeit),
        counterfeit_groups=len(others),
        grouping=evidence.grouping,
    )


def _simulated(evidence: Evidence, values: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return samples (count, T, D) of a model, each of a simulation of its own."""
    samples = evidence.simulate(np.tile(values, (count, 1)), rng)
    if 2 * len(samples) < count:
        shown = dict(zip(evidence.parameters, np.asarray(values).tolist(), strict=True))
        raise ConfigurationError(
            f"`simulate` must simulate the model; got {count - len(samples)} failures of {count} [{shown}]."
        )
    return samples[:, 0]
