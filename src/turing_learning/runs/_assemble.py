"""From arguments to a configuration, and from a configuration to the loop that it describes."""

from copy import deepcopy
from typing import Any

import numpy as np

from turing_learning.arrays import array
from turing_learning.coevolution import ClassifierArchive, Coevolution, jury_reward
from turing_learning.config import (
    OPTIMIZERS,
    Configuration,
    ConfigurationError,
    PopulationSection,
    built,
    classifier_of,
    part_of,
)
from turing_learning.errors import refusing_as, require
from turing_learning.evolution import (
    CMAEvolutionStrategy,
    EvolutionStrategy,
    FitnessMemory,
    Jumper,
    Optimizer,
    PhasedMating,
    RenewedOptimizer,
)
from turing_learning.purposes import ARCHIVE, CLASSIFIERS, INTERROGATION, MODELS
from turing_learning.systems import Source

_APART = 1e-9  # of the range: individuals that begin in its middle


class Generations(Coevolution):
    """A coevolution as the loop of a run, as `TrialsLoop`: its history is all that is stored and read off."""

    tolerated = False

    def rows(self) -> dict[str, np.ndarray]:
        """Return nothing."""
        return {}

    readout = rows


def generations_of(configuration: Configuration, source: Source) -> Generations:
    """Build the coevolution that a configuration describes, with its samples."""
    classifier, run, archive = classifier_of(configuration), configuration.run, configuration.coevolution.archive
    models, classifiers = configuration.models, configuration.classifiers
    dimension, jumps = len(configuration.parameter_names), configuration.representation.jumps
    jumper = Jumper(
        np.full(dimension, models.initial_low),
        np.full(dimension, models.initial_high),
        redraw=models.redraw,
        reach=jumps.reach,
        exchange=models.exchange,
        groups=jumps.groups,
        dependent=jumps.dependent,
        refinement=run.halfway,
        settled=run.settled,
    )
    size = models.parents + models.offspring
    imitators = optimizer_of(
        models,
        dimension,
        (MODELS, run.seed),
        "models",
        mating=PhasedMating(models.recombination, models.intermediate, run.halfway),
        jumper=jumper,
        memory=FitnessMemory(size, models.memory, run.halfway) if models.memory else None,
    )

    def judges(*number: int) -> Optimizer:
        return optimizer_of(classifiers, classifier.parameters, (CLASSIFIERS, run.seed, *number), "classifiers")

    # renewed in the first half of the run only
    renewed = RenewedOptimizer(judges, classifiers.renewal, last=run.halfway) if classifiers.renewal else judges()
    known = ClassifierArchive(archive, seed=(ARCHIVE, run.seed)) if archive else None
    reward = {"reward_models": jury_reward} if archive else {}
    interrogation, seed = source.interrogation(classifier), (INTERROGATION, run.seed)
    return Generations(interrogation, imitators, renewed, seed=seed, archive=known, **reward)


def optimizer_of(
    section: PopulationSection, dimension: int, seed: tuple[int, ...], argument: str, **parts: Any
) -> Optimizer:
    """Return the optimizer that a section describes; `argument` names it in messages, `parts` are those of the built-in one."""
    name, size = section.optimizer, section.parents + section.offspring
    low, high = section.initial_low, section.initial_high
    if section.start == "middle":
        low, high = (0.5 * (low + high) + side * _APART * (high - low) for side in (-1, 1))
    begin = {"seed": seed, "initial_low": low, "initial_high": high}
    if name == OPTIMIZERS[0]:
        return EvolutionStrategy(
            dimension,
            parents=section.parents,
            offspring=section.offspring,
            initial_step_size=section.initial_step_size,
            minimum_step_size=section.minimum_step_size,
            **begin,  # type: ignore[arg-type]
            **parts,
        )
    with refusing_as(ConfigurationError):
        if name == "cma":
            try:
                least = section.minimum_step_size
                return CMAEvolutionStrategy(dimension, size=size, minimum_step_size=least, **begin)  # type: ignore[arg-type]
            except ImportError as error:
                raise ConfigurationError(str(error)) from error
        found = part_of(argument, name)
        made = (isinstance(found, Optimizer) and not isinstance(found, type)) or not callable(found)
        # a copy, so that the caller's begins every run as it is
        optimizer = deepcopy(found) if made else built(argument, found, dimension, size=size, **begin)
    rule, remedy = "have the methods and properties of an `Optimizer`", "See docs/your-own-parts.md."
    fits = isinstance(optimizer, Optimizer)
    require(fits, argument, rule, type(optimizer).__name__, remedy, error=ConfigurationError)
    given, remedy = (optimizer.size, optimizer.dimension), "Or change the population's settings."
    rule, got = f"have {size} candidates of {dimension} parameters", f"{given[0]} of {given[1]}"
    require(given == (size, dimension), argument, rule, got, remedy, error=ConfigurationError)
    return _Guarded(optimizer, argument)


class _Guarded:
    """An optimizer that the package does not know: what it returns has the shape that it must have, and is finite."""

    def __init__(self, optimizer: Optimizer, argument: str) -> None:
        self._optimizer, self._argument = optimizer, argument
        self.size, self.dimension = optimizer.size, optimizer.dimension
        self.state, self.restore = optimizer.state, optimizer.restore

    def _array(self, what: str, value: Any, shape: str) -> np.ndarray:
        name = f"{self._argument}.{what}"
        return array(name, value, shape, error=ConfigurationError, M=self.size, P=self.dimension).copy()

    @property
    def step_sizes(self) -> np.ndarray:
        return self._array("step_sizes", self._optimizer.step_sizes, "M P")

    def ask(self) -> np.ndarray:
        return self._array("ask()", self._optimizer.ask(), "M P")

    def tell(self, fitness: np.ndarray) -> np.ndarray:
        return self._array("tell()", self._optimizer.tell(fitness.copy()), "M")
