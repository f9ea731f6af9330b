"""A configuration: its sections together, and what it may ask of a machine."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Annotated, Any, cast

import numpy as np
from pydantic import Discriminator, Tag, model_validator

from turing_learning.errors import ConfigurationError, Setting, refusing_as, reject, require
from turing_learning.few_trials import FEWEST_BATCHES, batch_schedule
from turing_learning.interaction import StimulatedSystem
from turing_learning.models import Representation
from turing_learning.swarm import Scenario
from turing_learning.systems import SMALLEST_SCALE, CustomSystem, System, physics_steps, system_of

from . import _sections as sections
from ._sections import (
    ClassifiersSection,
    CoevolutionSection,
    ModelsSection,
    RunSection,
    Section,
    dotted,
)

LEAST_TRIALS = 20
"""Smallest budget of a run by trials."""
# Sizes of a scenario's numbers (cm, g, s): with these, no square or ratio leaves the range of
# floats.
SMALLEST_INPUT = 1e-9


LARGEST_INPUT = 1e9
LARGEST_GIB = 64.0  # of memory
# Physics steps of single robots in a generation: minutes. A run stops between generations only.
LARGEST_WORK = 1e11

# Settings of the paper's size. Where a run is too large, the setting is named that is farthest
# above this.
_USUAL = {
    "models.parents": 50,
    "models.offspring": 50,
    "classifiers.parents": 50,
    "classifiers.offspring": 50,
    "classifiers.hidden": 5,
    "models.hidden": 5,
    "scenario.agents": 10,
    "scenario.replicas": 1,
    "scenario.objects.count": 10,
    "scenario.trial.duration_s": 10.0,
    "scenario.trial.physics_steps": 10,
    "run.checkpoint_every": 50,
}
_MODELS = ("models.parents", "models.offspring")
_POPULATIONS = (*_MODELS, "classifiers.parents", "classifiers.offspring")
_SWARM = ("scenario.agents", "scenario.replicas")


def scenario_type(scenario: Any) -> type[Scenario | CustomSystem]:
    """Return what a table of a scenario stands for, or a scenario is, by its fields."""
    # Tables of files and of stored runs name no type.
    if isinstance(scenario, Mapping):
        fields = set(scenario)
    else:
        fields = set(getattr(scenario, "__dataclass_fields__", ()))
    if "stimulus" in fields:
        return StimulatedSystem
    if {"parameters", "signals", "digest"} <= fields:
        return CustomSystem
    return Scenario


TAGS = ("Scenario", "CustomSystem", "StimulatedSystem")
AnyScenario = Annotated[
    Annotated[Scenario, Tag(TAGS[0])]
    | Annotated[CustomSystem, Tag(TAGS[1])]
    | Annotated[StimulatedSystem, Tag(TAGS[2])],
    Discriminator(lambda scenario: scenario_type(scenario).__name__),
]


class Configuration(Section):
    """Everything that determines a run, resolved: no field is left to a default elsewhere.

    Of a custom system `classifiers.input_scale` holds the scales found in the data, unless others
    were given.
    """

    scenario: AnyScenario
    models: ModelsSection = ModelsSection()
    classifiers: ClassifiersSection = ClassifiersSection()
    coevolution: CoevolutionSection = CoevolutionSection()
    run: RunSection = RunSection()

    @model_validator(mode="after")
    def _check(self) -> "Configuration":
        signals = len(self.scenario.input_scale)
        scale = self.classifiers.input_scale
        rule = f'be "robot" or {signals} positive numbers, one for each signal'
        fits = scale == "robot" or len(scale) == signals
        require(fits, "classifiers.input_scale", rule, str(list(scale)))
        renewal = self.classifiers.renewal
        rule = "be 0 without an archive (coevolution.archive = 0), which would remember what renewed classifiers forget"
        fits = renewal == 0 or self.coevolution.archive > 0
        require(fits, "classifiers.renewal", rule, renewal)
        # Making the system refuses models that it cannot have.
        assert self.system
        check_limits(self)
        self._check_trials()
        return self

    def _check_trials(self) -> None:
        """Reject settings that do not fit the budget of a run by trials, or a run without one."""
        trials = self.run.trials
        fits = trials == 0 or trials >= LEAST_TRIALS
        require(fits, "run.trials", f"be 0, or at least {LEAST_TRIALS}", trials)
        remedy = "Give run.generations instead of trials."
        rule = "be 0 where models are networks, which have too many parameters for few trials"
        require(not (trials and self.models.hidden), "run.trials", rule, trials, remedy)
        optimizer = self.models.optimizer
        paper = sections.OPTIMIZERS[0]
        rule = f"be {paper!r} with run.trials, which has a search of its own"
        require(not trials or optimizer == paper, "models.optimizer", rule, repr(optimizer), remedy)
        tolerance = self.run.tolerance
        rule = "be 0 without `run.trials`"
        require(trials > 0 or not tolerance, "run.tolerance", rule, tolerance)
        batch = self.run.batch
        rule = "be 0 without `run.trials`"
        if trials:
            rule = f"be 0, or from 2 to a tenth of run.trials, {trials // FEWEST_BATCHES}"
        fits = batch == 0 or 2 <= batch <= trials // FEWEST_BATCHES
        require(fits, "run.batch", rule, batch)
        if trials:
            self.system.require_trials()
        # The run was given more trials after each of these, and ends at the last.
        totals = [spent for _, spent in self.run.extended] + [trials]
        fits = sorted(set(totals)) == totals
        for budget, spent in self.run.extended:
            fits = fits and LEAST_TRIALS <= spent <= budget
        rule = "be pairs of trials, budgeted and spent, that increase up to `run.trials`"
        require(fits, "run.extended", rule, str(self.run.extended))

    @property
    def length(self) -> int:
        """Number of steps of the run: generations, or batches of trials."""
        if self.run.trials:
            return len(self._schedule)
        return self.run.generations

    @property
    def _schedule(self) -> list[int]:
        run = self.run
        return batch_schedule(run.trials, len(self.parameter_names), run.extended, run.batch)

    def trials_after(self, steps: int) -> int:
        """Return the number of trials that so many steps of the run spend, at least one."""
        if self.run.trials:
            return self._schedule[steps - 1]
        # A trial is an execution of the system, whatever the number of replicas in it
        models = self.models.parents + self.models.offspring
        return self.system.trials_per_model * models * steps

    def trials_in_step(self, step: int) -> int:
        """Return the number of trials that one step of the run spends; the first is step 1."""
        before = self.trials_after(step - 1) if step > 1 else 0
        return self.trials_after(step) - before

    def spent(self, steps: int) -> np.ndarray | None:
        """Return the trials that a run of trials has spent after each of so many batches.

        None for one of generations.
        """
        if self.run.trials:
            return np.array(self._schedule[:steps])
        return None

    @property
    def given(self) -> tuple[Setting, ...]:
        """Optimizer and classifier that are objects of the process that began the run, as
        arguments.
        """
        arguments = []
        if self.models.optimizer.startswith(sections.GIVEN):
            arguments.append(Setting("models"))
        if self.classifiers.network.startswith(sections.GIVEN):
            arguments.append(Setting("classifier"))
        return tuple(arguments)

    @property
    def system(self) -> System:
        """What is observed, and what imitates it."""
        initial = (self.models.initial_low, self.models.initial_high)
        return system_of(
            self.scenario, hidden=self.models.hidden, threads=self.threads, initial=initial
        )

    @property
    def swarm(self) -> Scenario:
        """The scenario, where it is one of robots; a custom system is rejected."""
        is_swarm = scenario_type(self.scenario) is Scenario
        rule = "be one of robots"
        require(is_swarm, "scenario", rule, f"{self.scenario.name!r}, a custom system")
        return cast(Scenario, self.scenario)

    @property
    def representation(self) -> Representation:
        """What a model is: that of the scenario, or a network."""
        return self.system.model

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the P parameters of a model, in which the history keeps it."""
        return self.representation.parameter_names

    def described(self, models: np.ndarray) -> np.ndarray:
        """Return models (..., P) in the parameters that results state: the agents', by
        `scenario.parameter_names`.
        """
        return self.representation.described(models)

    @property
    def input_scale(self) -> tuple[float, ...]:
        """What the classifiers' inputs are divided by, one number for each signal (cm/s, rad/s)."""
        scale = self.classifiers.input_scale
        if scale == "robot":
            return self.scenario.input_scale
        return scale

    @property
    def threads(self) -> int | None:
        """Number of threads, None for all processors."""
        if self.run.threads == "all":
            return None
        return self.run.threads


def check_limits(configuration: Configuration) -> None:
    """Reject a run that would leave the range of numbers, of memory, or of patience."""
    scenario = configuration.system.simulated
    if scenario:
        _check_sizes(scenario)
    name = "classifiers.input_scale"
    rule = "be"
    if configuration.classifiers.input_scale == "robot":
        name = "scenario.robot.wheel_distance_cm"
        rule = "make the largest speeds"
    rule += f" between {SMALLEST_SCALE:g} and {LARGEST_INPUT:g}"
    for value in configuration.input_scale:
        require(SMALLEST_SCALE <= value <= LARGEST_INPUT, name, rule, f"{value:g}")
    if configuration.classifiers.network == sections.NETWORKS[0]:
        hidden = configuration.classifiers.hidden
        largest = sections.LARGEST_NEURONS - len(configuration.input_scale)
        rule = f"be at most {largest}, as a network has at most {sections.LARGEST_NEURONS} inputs and hidden neurons"
        require(hidden <= largest, "classifiers.hidden", rule, hidden)
    for demand, size, keys in _demands(configuration):
        if size > LARGEST_GIB * 2**30:
            need = f"{demand} needs {size / 2**30:.3g} GiB, and {LARGEST_GIB:g} are allowed"
            _refuse_largest(configuration, keys, need)
    if scenario:
        models = configuration.models.parents + configuration.models.offspring
        work = float(models) * physics_steps(scenario)
        if work > LARGEST_WORK:
            times = ("scenario.trial.duration_s", "scenario.trial.physics_steps")
            need = f"a generation has {work:.3g} physics steps of a robot, and {LARGEST_WORK:g} are allowed"
            _refuse_largest(configuration, (*_MODELS, *_SWARM, *times), need)


def _check_sizes(scenario: Scenario) -> None:
    """Reject a scenario whose numbers would leave the range of floats."""
    rule = f"be 0 or of a size between {SMALLEST_INPUT:g} and {LARGEST_INPUT:g}"
    for key, value in dotted(asdict(scenario), "scenario.").items():
        # Centers of items are pairs in a list; an array of objects leaves every value as it is.
        for number in np.array(value, dtype=object).ravel():
            if isinstance(number, float | int) and number != 0:
                require(SMALLEST_INPUT <= abs(number) <= LARGEST_INPUT, key, rule, str(number))


def require_whole_cycles(scenario: Scenario, duration_s: float) -> None:
    """Reject a `duration` that is no whole number of control cycles."""
    with refusing_as(ConfigurationError):
        scenario.trial.steps_of(duration_s, "duration")


def require_visible_objects(configuration: Configuration) -> None:
    """Reject, for new runs, a sensor that tells objects apart that are not there.

    Reactions to them could not be inferred.
    """
    scenario = configuration.system.simulated
    if not scenario:
        return
    counts = {"object": ("scenario.objects.count", "objects", scenario.objects.count)}
    for name, item in scenario.items.items():
        counts[name] = (f"scenario.items.{name}.count", f"{name!r}", item.count)
    for name, (key, noun, count) in counts.items():
        reading = scenario.sensor.reading_of(name)
        if reading and not count:
            speeds = f"the parameters vl{reading} and vr{reading} cannot be inferred"
            rule = f"be at least 1 where the sensor tells {noun} apart, without which {speeds}"
            remedy = f"Set it, or leave {name!r} out of scenario.sensor.readings and these two"
            remedy += " speeds out of scenario.controller."
            reject(key, rule, "0", remedy)


def _demands(configuration: Configuration) -> Iterator[tuple[str, float, tuple[str, ...]]]:
    """Yield what needs memory, how many bytes, and the settings that add up to it."""
    run = configuration.run
    models = configuration.models.parents + configuration.models.offspring
    classifiers = configuration.classifiers.parents + configuration.classifiers.offspring
    weights = 0
    if configuration.classifiers.network == sections.NETWORKS[0]:
        inputs = len(configuration.input_scale)
        hidden = configuration.classifiers.hidden
        weights = hidden * (inputs + hidden + 2) + 1
    # Of each individual the parameters and their step sizes, 8 bytes each.
    population = 16.0 * (models * len(configuration.parameter_names) + classifiers * weights)
    chunk = 1
    if run.history == "full":
        chunk = min(run.checkpoint_every, run.generations)
    keys = (*_POPULATIONS, "classifiers.hidden", "models.hidden", "run.checkpoint_every")
    yield "keeping the history between two checkpoints", chunk * population, keys
    samples, motion, of_system = configuration.system.demands(models)
    yield "judging a generation", 8.0 * classifiers * samples, (*_POPULATIONS, *of_system)
    times = ("scenario.trial.duration_s",) if of_system else ()
    yield "a generation's motion", motion, (*_MODELS, *of_system, *times)
    scenario = configuration.system.simulated
    if scenario:
        bodies = scenario.bodies
        of_items = [f"scenario.items.{name}.count" for name in scenario.items]
        of_bodies = (*_SWARM, "scenario.objects.count", *of_items)
        yield "searching the bodies of a trial for near pairs", 16.0 * bodies**2, of_bodies


def _refuse_largest(configuration: Configuration, keys: tuple[str, ...], need: str) -> None:
    """Reject the one of some settings that is farthest above its usual value."""
    values = dotted(configuration.model_dump())
    key = max(sorted(keys), key=lambda key: math.log(max(values[key], 1e-9) / _USUAL.get(key, 10)))
    reject(key, f"be smaller, as {need}", values[key])
