"""What a check works on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from turing_learning.coevolution import Classifier
from turing_learning.config import Configuration, ConfigurationError, classifier_of
from turing_learning.errors import integer, require
from turing_learning.models import Parameter
from turing_learning.purposes import CHECK
from turing_learning.systems import Source

OBSERVING, TESTING, PROFILING, COMPARING, RECOVERING = range(5)
LEAST_TESTING = 4
"""Genuine samples that must be kept out for a test."""
LEAST_POINTS = 6
"""Values of a profile: with fewer, the stretch between the neighbors of one of them is half of the range or more."""


@dataclass(frozen=True)
class Effort:
    """How much is simulated and trained.

    Parameters
    ----------
    samples
        Samples of each kind that classifiers are trained on, at most, and simulated ones that they are tested on, at least.
    generations, population
        Of the fresh classifiers in the test of the estimate.
    points
        Values of each parameter in a profile, over its initial range, at least 6; 0 leaves profiles out.
    profile_generations, profile_population
        Of the fresh classifiers at each of these values.
    """

    samples: int = 200
    generations: int = 300
    population: int = 60
    points: int = 8
    profile_generations: int = 120
    profile_population: int = 40

    def __post_init__(self) -> None:
        least = {"samples": 10, "generations": 1, "population": 4, "points": 0}
        for name, lowest in (least | {"profile_generations": 1, "profile_population": 4}).items():
            integer(name, getattr(self, name), lowest, error=ConfigurationError)
        rule, remedy = (
            f"be at least {LEAST_POINTS}, or 0 for no profiles",
            "With fewer, a profile leaves half of the range open.",
        )
        require(not 0 < self.points < LEAST_POINTS, "points", rule, self.points, remedy, error=ConfigurationError)


@dataclass(frozen=True, eq=False)
class Evidence:
    """Genuine samples, a simulator of models, and the network of the classifiers.

    Attributes
    ----------
    learning : (K, T, D)
        Genuine samples to train classifiers with.
    testing : (H, T, D)
        Genuine samples that neither the run nor the fresh classifiers have learned from.
    groups : (H,)
        Which of them belong together, because they are of one individual.
    grouping
        What a group is, in a word.
    simulate
        (values (M, P) in their users' units, rng) -> samples (at most M, C, T, D); simulations that fail are left out.
    classifier
        Judges samples as they were observed.
    parameters
        Name -> parameter with its initial range, P of them.
    """

    learning: np.ndarray
    testing: np.ndarray
    groups: np.ndarray
    grouping: str
    simulate: Callable[[np.ndarray, np.random.Generator], np.ndarray]
    classifier: Classifier
    parameters: Mapping[str, Parameter]

    def __post_init__(self) -> None:
        rule, remedy = (
            f"keep at least {LEAST_TESTING} samples for testing",
            "Run again with a larger share, or shorter windows.",
        )
        count = len(self.testing)
        require(count >= LEAST_TESTING, "held_out", rule, count, remedy, error=ConfigurationError)
        rule, remedy = "tell at least 2 groups of held-out samples apart", "Name other groups, such as blocks of time."
        groups = len(np.unique(self.groups))
        require(groups >= 2, "groups", rule, groups, remedy, error=ConfigurationError)


def stream(seed: int, *use: int) -> np.random.Generator:
    """Return the random numbers of one use."""
    return np.random.default_rng((CHECK, seed, *use))


def evidence_of(
    configuration: Configuration,
    source: Source,
    effort: Effort,
    seed: int,
    groups: np.ndarray | None = None,
    grouping: str = "",
) -> Evidence:
    """Return genuine samples of a run's system, and what simulates models of it.

    Agents of a simulated swarm are observed one in each trial, so that no two samples have met; models are executed by a replica
    among agents, as in the run. Of a custom system they are the samples that the run learned from, and those held out.

    Parameters
    ----------
    source
        Of the run, opened again.
    groups : (H,)
        Which held-out samples belong together; None takes each for itself.
    grouping
        What a group is, in a word.
    """
    system, rng, data = configuration.system, stream(seed, OBSERVING), source.genuine
    source.generation = None  # a failed simulation is left out
    if data is None:
        genuine = source.genuine_samples(2 * effort.samples, rng)
        learning, testing = genuine[: effort.samples], genuine[effort.samples :]
    elif data.live is None:
        learning, testing = data.learning, data.testing
    else:
        learning, testing = (source.genuine_samples(effort.samples, rng) for _ in range(2))
    return Evidence(
        learning=learning,
        testing=testing,
        groups=np.arange(len(testing)) if groups is None else groups,
        grouping=grouping or ("trials" if data is None else "samples"),
        simulate=source.simulate,
        classifier=system.classifier(classifier_of(configuration)),
        parameters=system.parameters,
    )
