"""From a configuration to the loop that it describes."""

from typing import Any

import numpy as np

from turing_learning.coevolution import ClassifierArchive, Coevolution, jury_reward
from turing_learning.config import Configuration, PopulationSection, classifier_of
from turing_learning.evolution import (
    EvolutionStrategy,
    FitnessMemory,
    Jumper,
    Optimizer,
    PhasedMating,
    RenewedOptimizer,
)
from turing_learning.models import Jumps
from turing_learning.purposes import ARCHIVE, CLASSIFIERS, INTERROGATION, MODELS
from turing_learning.systems import Source


def assemble(configuration: Configuration, source: Source) -> Coevolution:
    """Build the coevolution that a configuration describes.

    Parameters
    ----------
    configuration
        A resolved configuration.
    source
        Its samples.
    """
    classifier = classifier_of(configuration)
    return Coevolution(
        source.interrogation(classifier),
        _models(configuration, configuration.representation.jumps),
        _classifiers(configuration, classifier.parameters),
        seed=(INTERROGATION, configuration.run.seed),
        **_archive(configuration),
    )


def _models(configuration: Configuration, jumps: Jumps) -> Optimizer:
    section, run, dimension = configuration.models, configuration.run, len(configuration.parameter_names)
    low, high = np.full(dimension, section.initial_low), np.full(dimension, section.initial_high)
    jumper = Jumper(
        low,
        high,
        redraw=section.redraw,
        reach=jumps.reach,
        exchange=section.exchange,
        groups=jumps.groups,
        dependent=jumps.dependent,
        refinement=run.halfway,
        settled=run.settled,
    )
    size = section.parents + section.offspring
    return _optimizer(
        section,
        dimension,
        (MODELS, run.seed),
        mating=PhasedMating(section.recombination, section.intermediate, run.halfway),
        jumper=jumper,
        memory=FitnessMemory(size, section.memory, run.halfway) if section.memory else None,
    )


def _classifiers(configuration: Configuration, parameters: int) -> Optimizer:
    """Return the classifiers' optimizer, which is renewed in the first half of the run only."""
    section, run = configuration.classifiers, configuration.run
    if section.renewal == 0:
        return _optimizer(section, parameters, (CLASSIFIERS, run.seed))
    return RenewedOptimizer(
        lambda k: _optimizer(section, parameters, (CLASSIFIERS, run.seed, k)),
        section.renewal,
        last=run.halfway,
    )


def _archive(configuration: Configuration) -> dict[str, Any]:
    section = configuration.coevolution
    if section.archive == 0:
        return {}
    return {
        "archive": ClassifierArchive(section.archive, seed=(ARCHIVE, configuration.run.seed)),
        "reward_models": jury_reward,
    }


def _optimizer(section: PopulationSection, dimension: int, seed: tuple[int, ...], **parts: Any) -> EvolutionStrategy:
    return EvolutionStrategy(
        dimension,
        parents=section.parents,
        offspring=section.offspring,
        seed=seed,
        initial_low=section.initial_low,
        initial_high=section.initial_high,
        initial_step_size=section.initial_step_size,
        minimum_step_size=section.minimum_step_size,
        **parts,
    )
