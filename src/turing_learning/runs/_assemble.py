"""From arguments to a configuration, and from a configuration to the loop that it describes."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.coevolution import ClassifierArchive, Coevolution, jury_reward
from turing_learning.config import (
    Configuration,
    ConfigurationError,
    PopulationSection,
    classifier_of,
    dotted,
    load_configuration,
)
from turing_learning.errors import brief, nearest, require
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
from turing_learning.swarm import Scenario
from turing_learning.systems import CustomSystem, Source


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
    return optimizer_of(
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
        return optimizer_of(section, parameters, (CLASSIFIERS, run.seed))
    return RenewedOptimizer(
        lambda k: optimizer_of(section, parameters, (CLASSIFIERS, run.seed, k)),
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


def optimizer_of(section: PopulationSection, dimension: int, seed: tuple[int, ...], **parts: Any) -> EvolutionStrategy:
    """Return the evolution strategy that a section describes."""
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


def resolved(
    scenario: str | Scenario | CustomSystem | None,
    preset: str,
    config: str | Path | Configuration | None,
    overrides: Mapping[str, Any],
) -> Configuration:
    """Return a configuration from a file, or from another one, with what comes before it."""
    labels = {key: f"argument {key.rpartition('.')[2]}" for key in overrides if key.startswith("run.")}
    if not isinstance(config, str | Path | Configuration | None):
        raise ConfigurationError(
            f"`config` must be a TOML file or a Configuration; got {type(config).__name__}. Give single settings to "
            "`turing_learning.config.load_configuration`, and its result here."
        )
    if isinstance(config, Configuration):
        flat = dotted(config.model_dump())
        known = {key: value for key, value in flat.items() if not key.startswith("scenario.")} | dict(overrides)
        if scenario is not None and config.system.resuming:  # other data has scales of its own
            known = {key: value for key, value in known.items() if key != "classifiers.input_scale" or key in overrides}
        return load_configuration(None, preset, known, scenario=scenario or config.scenario, labels=labels)
    return load_configuration(config, preset, overrides, scenario=scenario, labels=labels)


def refuse_unknown(options: Mapping[str, Any], known: Iterable[str]) -> None:
    """Reject an option that is none of the known arguments of a call."""
    for name, value in options.items():
        shown = brief(value) if isinstance(value, str | int | float) else type(value).__name__
        require(name in known, name, "be a known option", shown, nearest(name, known), error=ConfigurationError)
