"""The optimizers and classifiers that a configuration names: those that are built in, and parts of one's own."""

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

if TYPE_CHECKING:
    from turing_learning.classifiers import PooledClassifier

_OWN = "See docs/your-own-parts.md."

_APART = 1e-9  # of the range: individuals that begin in its middle
_STANDARD = 2.576  # standard deviations of a custom system's samples that its input scale spans: 99 % of normal values
_objects: dict[str, Any] = {}  # by their names in configurations


def classifier_of(configuration: Configuration) -> Classifier:
    """Return what the classifiers of a run share; the kernels are imported only where they are needed."""
    scale, name = configuration.input_scale, configuration.classifiers.network
    if name == NETWORKS[0]:
        from turing_learning.classifiers import ElmanClassifier

        hidden = configuration.classifiers.hidden
        elman = ElmanClassifier(
            inputs=len(scale), hidden=hidden, scale=scale, threads=configuration.threads
        )
        return configuration.system.evolved(elman)
    found = _made("classifier", name, Classifier, inputs=len(scale), scale=scale)
    rule, fits = (
        "have `parameters` and `judge`, or be a function that returns it",
        isinstance(found, Classifier),
    )
    check(fits, "classifier", rule, type(found).__name__, _OWN)
    return configuration.system.evolved(cast(Classifier, found))


def observers_of(configuration: Configuration) -> "PooledClassifier":
    """Return the random networks that judge in a run of trials, beside its classifiers."""
    from turing_learning.classifiers import PooledClassifier

    finer = _STANDARD if hasattr(configuration.system, "centered") else 1.0
    scale = [each / finer for each in configuration.input_scale]
    return PooledClassifier(inputs=len(scale), scale=scale, threads=configuration.threads)


def models_optimizer(configuration: Configuration) -> Optimizer:
    """Return the optimizer of the models in a run of generations, with the phases of the built-in one."""
    models, run, jumps = configuration.models, configuration.run, configuration.representation.jumps
    dimension, size = len(configuration.parameter_names), models.parents + models.offspring
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
    return optimizer_of(
        models,
        dimension,
        (MODELS, run.seed),
        "models",
        mating=evolution.PhasedMating(models.recombination, models.intermediate, run.halfway),
        jumper=jumper,
        memory=evolution.FitnessMemory(size, models.memory, run.halfway) if models.memory else None,
    )


def classifiers_optimizer(configuration: Configuration, parameters: int) -> Optimizer:
    """Return the optimizer of classifiers with so many parameters in a run of generations, renewed in its first half only."""
    section, run = configuration.classifiers, configuration.run

    def made(*number: int) -> Optimizer:
        return optimizer_of(section, parameters, (CLASSIFIERS, run.seed, *number), "classifiers")

    return RenewedOptimizer(made, section.renewal, last=run.halfway) if section.renewal else made()


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
        optimizer = _made(argument, name, Optimizer, dimension, size=size, **begin)
        if optimizer is part_of(
            argument, name
        ):  # a copy, so that the caller's begins every run as it is
            optimizer = deepcopy(optimizer)
    rule, fits = (
        "have the methods and properties of an `Optimizer`",
        isinstance(optimizer, Optimizer),
    )
    check(fits, argument, rule, type(optimizer).__name__, _OWN)
    given, remedy = (optimizer.size, optimizer.dimension), "Or change the population's settings."
    rule, got = f"have {size} candidates of {dimension} parameters", f"{given[0]} of {given[1]}"
    check(given == (size, dimension), argument, rule, got, remedy)
    return _Guarded(optimizer, argument)


class _Guarded:
    """An optimizer that the package does not know: what it returns has the shape that it must have, and is finite."""

    def __init__(self, optimizer: Optimizer, argument: str) -> None:
        self._optimizer, self._argument = optimizer, argument
        self.size, self.dimension = optimizer.size, optimizer.dimension
        self.state, self.restore = optimizer.state, optimizer.restore

    def _array(self, what: str, value: Any, shape: str) -> np.ndarray:
        name = f"{self._argument}.{what}"
        return array(
            name, value, shape, error=ConfigurationError, M=self.size, P=self.dimension
        ).copy()

    @property
    def step_sizes(self) -> np.ndarray:
        return self._array("step_sizes", self._optimizer.step_sizes, "M P")

    def ask(self) -> np.ndarray:
        return self._array("ask()", self._optimizer.ask(), "M P")

    def tell(self, fitness: np.ndarray) -> np.ndarray:
        return self._array("tell()", self._optimizer.tell(fitness.copy()), "M")


def part_named(given: Any) -> str:
    """Return how a configuration names an optimizer or a classifier.

    That is its name, "module:function" if it can be imported, and else "given:NAME": only this process has it.
    """
    if name := given if isinstance(given, str) else importable_name(given):
        return name
    label = getattr(given, "__name__", type(given).__name__)
    name, number = f"{GIVEN}{label}", 2
    while not _same(_objects.setdefault(name, given), given):
        name, number = f"{GIVEN}{label}-{number}", number + 1
    return name


def _same(one: Any, other: Any) -> bool:
    try:
        return one is other or pickle.dumps(one) == pickle.dumps(other)
    except Exception:  # whatever an object raises that cannot be pickled
        return False


def give_again(argument: str, stored: str, given: Any) -> None:
    """Take an object for the part that a stored run had; reject it for a run that did not begin with an object."""
    if given is None:
        return
    if not stored.startswith(GIVEN):
        named = part_named(given)
        check(named == stored, argument, f"be that of the run, {stored!r}", named, "Leave it out.")
        return
    _objects[stored] = given


def part_of(argument: str, name: str) -> Any:
    """Return the object of a name that is not built in; reject one that has to be given again."""
    if not name.startswith(GIVEN):
        return imported(name, argument, ConfigurationError)
    rule, label = "be given again, as no folder holds an object of Python", name.removeprefix(GIVEN)
    remedy = f"Give `{argument}` to `turing_learning.resume` or `turing_learning.load_run`, as the run began with it."
    check(name in _objects, argument, rule, f"nothing for {label!r}", remedy)
    return _objects[name]


def _made(argument: str, name: str, kind: type, *given: Any, **options: Any) -> Any:
    """Return the part of a name: what is found is of its kind already, or a function that makes one."""
    found = part_of(argument, name)
    ready = isinstance(found, kind) and not isinstance(found, type)
    return found if ready or not callable(found) else built(argument, found, *given, **options)


def built(argument: str, maker: Callable[..., Any], *given: Any, **options: Any) -> Any:
    """Return what a function makes of a part; reject one that does not take what it is given."""
    try:
        signature(maker).bind(*given, **options)
    except (TypeError, ValueError):  # ValueError: a function in C that does not say what it takes
        rule = f"be a function that takes {', '.join((*['a dimension'] * len(given), *options))}"
        reject(argument, rule, brief(maker), _OWN)
    return maker(*given, **options)
