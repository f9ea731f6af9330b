"""The optimizers and classifiers that a configuration names: those that are built in, and parts
of one's own.
"""

import pickle
from collections.abc import Callable
from copy import deepcopy
from inspect import signature
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from turing_learning import evolution
from turing_learning.arrays import array
from turing_learning.coevolution import Classifier
from turing_learning.errors import ConfigurationError, brief, check, refusing_as, reject
from turing_learning.evolution import (
    CMAEvolutionStrategy,
    EvolutionStrategy,
    Jumper,
    Optimizer,
    RenewedOptimizer,
)
from turing_learning.purposes import CLASSIFIERS, MODELS
from turing_learning.systems import importable_name, imported

from ._configuration import Configuration
from ._sections import GIVEN, NETWORKS, OPTIMIZERS, PopulationSection

_REMEDY = "See docs/your-own-parts.md."


if TYPE_CHECKING:
    from turing_learning.few_trials import PooledClassifier


# Distance of individuals that begin in the middle of their range, as a share of the range.
_APART = 1e-9
# Standard deviations of a custom system's samples that its input scale spans: 99 % of normal
# values.
_STANDARD = 2.576
# Objects of this process by their names in configurations.
_objects: dict[str, Any] = {}


def classifier_of(configuration: Configuration) -> Classifier:
    """Return what the classifiers of a run share."""
    scale = configuration.input_scale
    name = configuration.classifiers.network
    if name == NETWORKS[0]:
        # The kernels are imported only where they are needed.
        from turing_learning.classifiers import ElmanClassifier

        elman = ElmanClassifier(
            inputs=len(scale),
            hidden=configuration.classifiers.hidden,
            scale=scale,
            threads=configuration.threads,
        )
        return configuration.system.evolved(elman)
    classifier = _made("classifier", name, Classifier, inputs=len(scale), scale=scale)
    rule = "have `parameters` and `judge`, or be a function that returns it"
    fits = isinstance(classifier, Classifier)
    check(fits, "classifier", rule, type(classifier).__name__, _REMEDY)
    return configuration.system.evolved(cast(Classifier, classifier))


def observers_of(configuration: Configuration) -> "PooledClassifier":
    """Return the random networks that judge in a run of trials, beside its classifiers."""
    from turing_learning.few_trials import PooledClassifier

    scale = configuration.input_scale
    # Samples of a custom system: divided by one standard deviation
    if hasattr(configuration.system, "centered"):
        scale = tuple(value / _STANDARD for value in scale)
    return PooledClassifier(inputs=len(scale), scale=scale, threads=configuration.threads)


def models_optimizer(configuration: Configuration) -> Optimizer:
    """Return the optimizer of the models in a run of generations, with the phases of the
    built-in one.
    """
    models = configuration.models
    run = configuration.run
    jumps = configuration.representation.jumps
    dimension = len(configuration.parameter_names)
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
    memory = None
    if models.memory:
        size = models.parents + models.offspring
        memory = evolution.FitnessMemory(size, models.memory, run.halfway)
    mating = evolution.PhasedMating(models.recombination, models.intermediate, run.halfway)
    seed = (MODELS, run.seed)
    return optimizer_of(
        models, dimension, seed, "models", mating=mating, jumper=jumper, memory=memory
    )


def classifiers_optimizer(configuration: Configuration, parameters: int) -> Optimizer:
    """Return the optimizer of classifiers with so many parameters in a run of generations.

    It is renewed in the first half of the run only.
    """
    section = configuration.classifiers
    run = configuration.run

    def optimizer(*renewal: int) -> Optimizer:
        return optimizer_of(section, parameters, (CLASSIFIERS, run.seed, *renewal), "classifiers")

    if section.renewal:
        return RenewedOptimizer(optimizer, section.renewal, last=run.halfway)
    return optimizer()


def optimizer_of(
    section: PopulationSection, dimension: int, seed: tuple[int, ...], argument: str, **parts: Any
) -> Optimizer:
    """Return the optimizer that a section describes.

    `argument` names it in messages, `parts` are those of the built-in one.
    """
    low = section.initial_low
    high = section.initial_high
    # Not exactly in the middle: individuals that are the same cannot be told apart
    if section.start == "middle":
        middle = 0.5 * (low + high)
        distance = _APART * (high - low)
        low = middle - distance
        high = middle + distance
    start: dict[str, Any] = {"seed": seed, "initial_low": low, "initial_high": high}
    if section.optimizer == OPTIMIZERS[0]:
        return EvolutionStrategy(
            dimension,
            parents=section.parents,
            offspring=section.offspring,
            initial_step_size=section.initial_step_size,
            minimum_step_size=section.minimum_step_size,
            adaptation=section.adaptation,
            **start,
            **parts,
        )
    size = section.parents + section.offspring
    with refusing_as(ConfigurationError):
        if section.optimizer == "cma":
            try:
                return CMAEvolutionStrategy(
                    dimension, size=size, minimum_step_size=section.minimum_step_size, **start
                )
            except ImportError as error:
                raise ConfigurationError(str(error)) from error
        optimizer = _made(argument, section.optimizer, Optimizer, dimension, size=size, **start)
        if optimizer is part_of(argument, section.optimizer):
            # A copy, so that every run begins with the caller's object as it was given.
            optimizer = deepcopy(optimizer)
    rule = "have the methods and properties of an `Optimizer`"
    check(isinstance(optimizer, Optimizer), argument, rule, type(optimizer).__name__, _REMEDY)
    fits = (optimizer.size, optimizer.dimension) == (size, dimension)
    rule = f"have {size} candidates of {dimension} parameters"
    got = f"{optimizer.size} of {optimizer.dimension}"
    check(fits, argument, rule, got, "Or change the population's settings.")
    return _Guarded(optimizer, argument)


class _Guarded:
    """An optimizer that the package does not know: what it returns has the shape that it must
    have, and is finite.
    """

    def __init__(self, optimizer: Optimizer, argument: str) -> None:
        self._optimizer = optimizer
        self._argument = argument
        self.size = optimizer.size
        self.dimension = optimizer.dimension
        self.state = optimizer.state
        self.restore = optimizer.restore

    def _array(self, field: str, value: Any, shape: str) -> np.ndarray:
        name = f"{self._argument}.{field}"
        return array(
            name, value, shape, error=ConfigurationError, M=self.size, P=self.dimension
        ).copy()

    @property
    def step_sizes(self) -> np.ndarray:
        return self._array("step_sizes", self._optimizer.step_sizes, "M P")

    def ask(self) -> np.ndarray:
        return self._array("ask()", self._optimizer.ask(), "M P")

    def tell(self, fitness: np.ndarray) -> np.ndarray:
        # a copy, because an optimizer of somebody else may write into what it is given
        return self._array("tell()", self._optimizer.tell(fitness.copy()), "M")


def part_named(part: Any) -> str:
    """Return how a configuration names an optimizer or a classifier.

    That is its name, "module:function" if it can be imported, and else "given:NAME": only this
    process has it.
    """
    name = part if isinstance(part, str) else importable_name(part)
    if name:
        return name
    label = GIVEN + getattr(part, "__name__", type(part).__name__)
    name = label
    number = 2
    while not _same(_objects.setdefault(name, part), part):
        name = f"{label}-{number}"
        number += 1
    return name


def _same(part: Any, earlier: Any) -> bool:
    try:
        return part is earlier or pickle.dumps(part) == pickle.dumps(earlier)
    except Exception:
        # Whatever an object raises that cannot be pickled
        return False


def give_again(argument: str, stored: str, part: Any) -> None:
    """Take an object for the part that a stored run had.

    Reject it for a run that did not begin with an object.
    """
    if part is None:
        return
    if stored.startswith(GIVEN):
        _objects[stored] = part
        return
    name = part_named(part)
    check(name == stored, argument, f"be that of the run, {stored!r}", name, "Leave it out.")


def part_of(argument: str, name: str) -> Any:
    """Return the object of a name that is not built in; reject one that has to be given again."""
    if not name.startswith(GIVEN):
        return imported(name, argument, ConfigurationError)
    rule = "be given again, as no folder holds an object of Python"
    got = f"nothing for {name.removeprefix(GIVEN)!r}"
    functions = "`turing_learning.resume` or `turing_learning.load_run`"
    remedy = f"Give `{argument}` to {functions}, as the run began with it."
    check(name in _objects, argument, rule, got, remedy)
    return _objects[name]


def _made(argument: str, name: str, protocol: type, *arguments: Any, **options: Any) -> Any:
    """Return the part of a name: an object that fulfils the protocol, or what a function makes."""
    part = part_of(argument, name)
    ready = isinstance(part, protocol) and not isinstance(part, type)
    if ready or not callable(part):
        return part
    return built(argument, part, *arguments, **options)


def built(argument: str, maker: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """Return what a function makes of a part; reject one that does not take the arguments."""
    try:
        signature(maker).bind(*arguments, **options)
    except (TypeError, ValueError):
        # ValueError: a function in C that does not say what it takes
        names = ["a dimension"] * len(arguments) + list(options)
        reject(argument, f"be a function that takes {', '.join(names)}", brief(maker), _REMEDY)
    return maker(*arguments, **options)
