"""What a check works on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from turing_learning.coevolution import Classifier
from turing_learning.config import Configuration, ConfigurationError, classifier_of
from turing_learning.models import FULL_VIEW, Parameter
from turing_learning.purposes import CHECK
from turing_learning.sources import CenteredClassifier, Genuine, OwnSource, cut_samples
from turing_learning.swarm import Trials, alone, mixed

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

    Raises
    ------
    ConfigurationError
        If a number is too small.
    """

    samples: int = 200
    generations: int = 300
    population: int = 60
    points: int = 8
    profile_generations: int = 120
    profile_population: int = 40

    def __post_init__(self) -> None:
        least = {"samples": 10, "generations": 1, "population": 4, "points": 0, "profile_generations": 1}
        for name, lowest in (least | {"profile_population": 4}).items():
            value = getattr(self, name)
            if type(value) is not int or value < lowest:
                raise ConfigurationError(f"`{name}` must be an integer of at least {lowest}; got {value!r}.")
        if 0 < self.points < LEAST_POINTS:
            raise ConfigurationError(
                f"`points` must be at least {LEAST_POINTS}, or 0 for no profiles; got {self.points}. With fewer, a profile leaves "
                "half of the range open whatever the samples say."
            )


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

    Raises
    ------
    ConfigurationError
        If too few samples were kept out, or all of them are of one group.
    """

    learning: np.ndarray
    testing: np.ndarray
    groups: np.ndarray
    grouping: str
    simulate: Callable[[np.ndarray, np.random.Generator], np.ndarray]
    classifier: Classifier
    parameters: Mapping[str, Parameter]

    def __post_init__(self) -> None:
        if len(self.testing) < LEAST_TESTING:
            raise ConfigurationError(
                f"`held_out` must keep at least {LEAST_TESTING} samples for testing; got {len(self.testing)}. "
                "Run again with a larger share, or shorter windows."
            )
        groups = len(np.unique(self.groups))
        if groups < 2:
            raise ConfigurationError(
                f"`groups` must tell at least 2 groups of kept-out samples apart; got {groups}. Name groups of another kind, "
                "such as blocks of time."
            )


def stream(seed: int, *use: int) -> np.random.Generator:
    """Return the random numbers of one use."""
    return np.random.default_rng((CHECK, seed, *use))


def swarm_evidence(configuration: Configuration, effort: Effort, seed: int) -> Evidence:
    """Observe agents of a scenario, one in each trial, so that no two samples have met.

    Models, of any representation, are executed by a replica among agents, as in the run. `values` of `Evidence.simulate` are their
    parameters (M, P); of networks the weights (M, Q).
    """
    scenario, rng = configuration.scenario, stream(seed, OBSERVING)
    model, low, high = configuration.representation, configuration.models.initial_low, configuration.models.initial_high
    parameters = {name: Parameter(None, None, initial=(low, high)) for name in scenario.parameter_names}
    if configuration.models.hidden:  # its outputs are from -1 to 1, whatever its weights
        parameters = dict.fromkeys(parameters, Parameter(-1, 1))
    if "theta" in parameters:
        parameters["theta"] = Parameter(0, FULL_VIEW, unit="rad")

    def simulate(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        drawn = Trials.draw(scenario, mixed(scenario, len(values)), rng)
        return first_replica(drawn.observe(model.behavior(values), configuration.threads))

    def first_replica(speeds: np.ndarray) -> np.ndarray:
        return np.ascontiguousarray(speeds[:, scenario.agents, None])

    agents = Trials.draw(scenario, alone(scenario, 2 * effort.samples), rng)
    genuine = first_replica(agents.observe(None, configuration.threads))[:, 0]
    return Evidence(
        learning=genuine[: effort.samples],
        testing=genuine[effort.samples :],
        groups=np.arange(effort.samples),
        grouping="trials",
        simulate=simulate,
        classifier=classifier_of(configuration),
        parameters=parameters,
    )


def own_evidence(
    configuration: Configuration, data: Genuine, source: OwnSource, effort: Effort, seed: int, groups: np.ndarray | None
) -> Evidence:
    """Take the samples of a run on a system of one's own: those it learned from, and those that were held out.

    Parameters
    ----------
    data, source
        Of the run, opened again.
    groups : (H,)
        Which held-out samples belong together; None takes each for itself.

    Raises
    ------
    ConfigurationError
        If too few samples were held out, or all of them are of one group.
    """
    system, rng = source.system, stream(seed, OBSERVING)
    source.generation = None  # a failed simulation is left out
    learning, testing = data.learning, data.testing
    if data.live is not None:
        learning, testing = (_observed(data, system.steps, effort.samples, rng) for _ in range(2))

    def simulate(values: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        samples = source.simulate(values, rng)
        return samples[~source.failed]

    return Evidence(
        learning=learning,
        testing=testing,
        groups=np.arange(len(testing)) if groups is None else groups,
        grouping="samples" if groups is None else "individuals",
        simulate=simulate,
        classifier=CenteredClassifier(classifier_of(configuration), system),
        parameters=system.parameters,
    )


def _observed(data: Genuine, steps: int, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return as many samples of a live source as are asked for, or more."""
    assert data.live is not None
    parts = [cut_samples(data.live(rng), steps)]
    while sum(map(len, parts)) < count:
        parts.append(cut_samples(data.live(rng), steps))
    return np.concatenate(parts)
