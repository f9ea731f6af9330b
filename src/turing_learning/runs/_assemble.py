"""From a configuration to the loop that it describes."""

from typing import Any

from turing_learning.classifiers import ElmanClassifier
from turing_learning.coevolution import (
    ClassifierArchive,
    Coevolution,
    PassiveInterrogation,
    jury_reward,
)
from turing_learning.config import Configuration, PopulationSection
from turing_learning.evolution import EvolutionStrategy, Optimizer, RenewedOptimizer
from turing_learning.swarm import MixedSwarm

MODELS, CLASSIFIERS, INTERROGATION, REPLAY, ARCHIVE = range(1, 6)
"""Purposes of random numbers: the entropy of each is (purpose, seed of the run), so that no two streams meet."""


def assemble(configuration: Configuration) -> Coevolution:
    """Build the coevolution that a configuration describes.

    Parameters
    ----------
    configuration
        A resolved configuration.
    """
    scenario, seed = configuration.scenario, configuration.run.seed
    classifier = classifier_of(configuration)
    interrogation = PassiveInterrogation(MixedSwarm(scenario, configuration.threads), classifier)
    return Coevolution(
        interrogation,
        _optimizer(configuration.models, len(scenario.parameter_names), (MODELS, seed)),
        _classifiers(configuration, classifier.parameters),
        seed=(INTERROGATION, seed),
        **_archive(configuration),
    )


def _classifiers(configuration: Configuration, parameters: int) -> Optimizer:
    """Return the classifiers' optimizer, which is renewed in the first half of the run only."""
    section, run = configuration.classifiers, configuration.run
    if section.renewal == 0:
        return _optimizer(section, parameters, (CLASSIFIERS, run.seed))
    return RenewedOptimizer(
        lambda k: _optimizer(section, parameters, (CLASSIFIERS, run.seed, k)),
        section.renewal,
        last=run.generations // 2,
    )


def _archive(configuration: Configuration) -> dict[str, Any]:
    section = configuration.coevolution
    if section.archive == 0:
        return {}
    return {
        "archive": ClassifierArchive(section.archive, seed=(ARCHIVE, configuration.run.seed)),
        "reward_models": jury_reward,
    }


def classifier_of(configuration: Configuration) -> ElmanClassifier:
    """Return the classifiers' network."""
    return ElmanClassifier(
        inputs=len(configuration.input_scale),
        hidden=configuration.classifiers.hidden,
        scale=configuration.input_scale,
        threads=configuration.threads,
    )


def _optimizer(section: PopulationSection, dimension: int, seed: tuple[int, ...]) -> EvolutionStrategy:
    return EvolutionStrategy(
        dimension,
        parents=section.parents,
        offspring=section.offspring,
        seed=seed,
        initial_low=section.initial_low,
        initial_high=section.initial_high,
        initial_step_size=section.initial_step_size,
        minimum_step_size=section.minimum_step_size,
    )
