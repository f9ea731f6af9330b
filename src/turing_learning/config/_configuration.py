"""A configuration: its sections together, and what it may ask of a machine."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Annotated, Any, cast

import numpy as np
from pydantic import Discriminator, Tag, model_validator

from turing_learning.coevolution import batch_schedule
from turing_learning.errors import ConfigurationError, Setting, refusing_as, reject, require
from turing_learning.interaction import StimulatedSystem
from turing_learning.models import Representation
from turing_learning.swarm import Scenario
from turing_learning.systems import CustomSystem, System, physics_steps, system_of

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
SMALLEST, LARGEST = (
    1e-9,
    1e9,
)  # of a scenario's numbers (cm, g, s): no square or ratio leaves the range of floats
LARGEST_GIB = 64.0
LARGEST_WORK = 1e11  # physics steps of single robots in a generation: minutes; a run stops between generations only

_USUAL = {
    "models.parents": 50, "models.offspring": 50, "classifiers.parents": 50, "classifiers.offspring": 50,
    "classifiers.hidden": 5, "models.hidden": 5, "scenario.agents": 10, "scenario.replicas": 1, "scenario.objects.count": 10,
    "scenario.trial.duration_s": 10.0, "scenario.trial.physics_steps": 10, "run.checkpoint_every": 50,
}  # fmt: skip
_MODELS = ("models.parents", "models.offspring")
_POPULATIONS = (*_MODELS, "classifiers.parents", "classifiers.offspring")
_SWARM = ("scenario.agents", "scenario.replicas")


def scenario_type(scenario: Any) -> type[Scenario | CustomSystem]:
    """Return what a table of a scenario stands for, or a scenario is, by its fields."""
    fields = set(
        scenario if isinstance(scenario, Mapping) else getattr(scenario, "__dataclass_fields__", ())
    )
    if "stimulus" in fields:
        return StimulatedSystem
    return CustomSystem if fields >= {"parameters", "signals", "digest"} else Scenario


TAGS = ("Scenario", "CustomSystem", "StimulatedSystem")
AnyScenario = Annotated[
    Annotated[Scenario, Tag(TAGS[0])]
    | Annotated[CustomSystem, Tag(TAGS[1])]
    | Annotated[StimulatedSystem, Tag(TAGS[2])],
    Discriminator(lambda scenario: scenario_type(scenario).__name__),
]


class Configuration(Section):
    """Everything that determines a run, resolved: no field is left to a default elsewhere.

    Of a custom system `classifiers.input_scale` holds the scales found in the data, unless others were given.
    """

    scenario: AnyScenario
    models: ModelsSection = ModelsSection()
    classifiers: ClassifiersSection = ClassifiersSection()
    coevolution: CoevolutionSection = CoevolutionSection()
    run: RunSection = RunSection()

    @model_validator(mode="after")
    def _check(self) -> "Configuration":
        scale, signals, renewal = (
            self.classifiers.input_scale,
            len(self.scenario.input_scale),
            self.classifiers.renewal,
        )
        rule = f'be "robot" or {signals} positive numbers, one for each signal'
        require(
            scale == "robot" or len(scale) == signals,
            "classifiers.input_scale",
            rule,
            str(list(scale)),
        )
        rule = "be 0 without an archive (coevolution.archive = 0), which would remember what renewed classifiers forget"
        require(renewal == 0 or self.coevolution.archive > 0, "classifiers.renewal", rule, renewal)
        assert self.system  # refuses models that it cannot have
        check_limits(self)
        trials, rule = (
            self.run.trials,
            "be 0 where models are networks, which have too many parameters for few trials",
        )
        require(
            trials == 0 or trials >= LEAST_TRIALS,
            "run.trials",
            f"be 0, or at least {LEAST_TRIALS}",
            trials,
        )
        instead = "Give run.generations instead of trials."
        require(not (trials and self.models.hidden), "run.trials", rule, trials, instead)
        name, usual = self.models.optimizer, sections.OPTIMIZERS[0]
        rule = f"be {usual!r} with run.trials, which has a search of its own"
        require(not trials or name == usual, "models.optimizer", rule, repr(name), instead)
        require(
            trials > 0 or not self.run.tolerance,
            "run.tolerance",
            "be 0 without `run.trials`",
            self.run.tolerance,
        )
        if trials:
            self.system.require_trials()
        ends = [spent for _, spent in self.run.extended] + [trials]
        fits = all(LEAST_TRIALS <= spent <= budget for budget, spent in self.run.extended)
        rule, got = (
            "be pairs of trials, budgeted and spent, that increase up to `run.trials`",
            str(self.run.extended),
        )
        require(fits and sorted(set(ends)) == ends, "run.extended", rule, got)
        return self

    @property
    def length(self) -> int:
        """Number of steps of the run: generations, or batches of trials."""
        return len(self._schedule) if self.run.trials else self.run.generations

    @property
    def _schedule(self) -> list[int]:
        return batch_schedule(self.run.trials, len(self.parameter_names), self.run.extended)

    def trials_after(self, steps: int) -> int:
        """Return the number of trials that so many steps of the run spend, at least one."""
        return self._schedule[steps - 1] if self.run.trials else self.trials_per_generation * steps

    def spent(self, steps: int) -> np.ndarray | None:
        """Return the trials that a run of trials has spent after each of so many batches; None for one of generations."""
        return np.array(self._schedule[:steps]) if self.run.trials else None

    @property
    def trials_per_generation(self) -> int:
        """Number of trials in a generation: executions of the system, whatever the number of replicas in one."""
        return self.system.trials_per_model * (self.models.parents + self.models.offspring)

    @property
    def given(self) -> tuple[Setting, ...]:
        """Optimizer and classifier that are objects of the process that began the run, as arguments."""
        named = (("models", self.models.optimizer), ("classifier", self.classifiers.network))
        return tuple(
            Setting(argument) for argument, name in named if name.startswith(sections.GIVEN)
        )

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
        rule, custom = "be one of robots", scenario_type(self.scenario) is not Scenario
        require(not custom, "scenario", rule, f"{self.scenario.name!r}, a custom system")
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
        """Return models (..., P) in the parameters that results state: the agents', by `scenario.parameter_names`."""
        return self.representation.described(models)

    @property
    def input_scale(self) -> tuple[float, ...]:
        """What the classifiers' inputs are divided by, one number for each signal (cm/s, rad/s)."""
        scale = self.classifiers.input_scale
        return self.scenario.input_scale if scale == "robot" else scale

    @property
    def threads(self) -> int | None:
        """Number of threads, None for all processors."""
        return None if self.run.threads == "all" else self.run.threads


def check_limits(configuration: Configuration) -> None:
    """Reject a run that would leave the range of numbers, of memory, or of patience."""
    scenario, inputs = configuration.system.simulated, len(configuration.input_scale)
    for key, value in dotted(asdict(scenario), "scenario.").items() if scenario else ():
        for number in value if isinstance(value, tuple) else (value,):
            fits = (
                not isinstance(number, float | int)
                or number == 0
                or SMALLEST <= abs(number) <= LARGEST
            )
            require(
                fits, key, f"be 0 or of a size between {SMALLEST:g} and {LARGEST:g}", str(number)
            )
    name, rule = "classifiers.input_scale", "be"
    if configuration.classifiers.input_scale == "robot":
        name, rule = "scenario.robot.wheel_distance_cm", "make the largest speeds"
    for value in configuration.input_scale:
        require(
            SMALLEST <= value <= LARGEST,
            name,
            f"{rule} between {SMALLEST:g} and {LARGEST:g}",
            f"{value:g}",
        )
    hidden, most = configuration.classifiers.hidden, sections.LARGEST_NEURONS - inputs
    because = f"be at most {most}, as a network has at most {sections.LARGEST_NEURONS} inputs and hidden neurons"
    elman = configuration.classifiers.network == sections.NETWORKS[0]
    require(hidden <= most or not elman, "classifiers.hidden", because, hidden)
    for what, size, keys in _demands(configuration):
        if size > LARGEST_GIB * 2**30:
            need = f"{what} needs {size / 2**30:.3g} GiB, and {LARGEST_GIB:g} are allowed"
            _refuse_largest(configuration, keys, need)
    models = configuration.models.parents + configuration.models.offspring
    if scenario and (work := float(models) * physics_steps(scenario)) > LARGEST_WORK:
        keys = (*_MODELS, *_SWARM, "scenario.trial.duration_s", "scenario.trial.physics_steps")
        need = f"a generation has {work:.3g} physics steps of a robot, and {LARGEST_WORK:g} are allowed"
        _refuse_largest(configuration, keys, need)


def require_whole_cycles(scenario: Scenario, duration_s: float) -> None:
    """Reject a `duration` that is no whole number of control cycles."""
    with refusing_as(ConfigurationError):
        scenario.trial.steps_of(duration_s, "duration")


def require_visible_objects(configuration: Configuration) -> None:
    """Reject, for new runs, a sensor that tells objects apart that are not there: reactions to them could not be inferred."""
    scenario = configuration.system.simulated
    if (
        scenario
        and not scenario.objects.count
        and (reading := scenario.sensor.reading_of("object"))
    ):
        speeds = f"the parameters vl{reading} and vr{reading} cannot be inferred"
        rule = f"be at least 1 where the sensor tells objects apart, without which {speeds}"
        remedy = (
            "Set it, or leave 'object' out of scenario.sensor.readings and these two speeds out of"
        )
        remedy += " scenario.controller."
        reject("scenario.objects.count", rule, "0", remedy)


def _demands(configuration: Configuration) -> Iterator[tuple[str, float, tuple[str, ...]]]:
    """Yield what needs memory, how many bytes, and the settings that add up to it."""
    run, inputs, hidden = (
        configuration.run,
        len(configuration.input_scale),
        configuration.classifiers.hidden,
    )
    models = configuration.models.parents + configuration.models.offspring
    classifiers = configuration.classifiers.parents + configuration.classifiers.offspring
    weights = (
        hidden * (inputs + hidden + 2) + 1
        if configuration.classifiers.network == sections.NETWORKS[0]
        else 0
    )
    population = 16.0 * (
        models * len(configuration.parameter_names) + classifiers * weights
    )  # values and step sizes
    chunk = 1 if run.history == "thin" else min(run.checkpoint_every, run.generations)
    keys = (*_POPULATIONS, "classifiers.hidden", "models.hidden", "run.checkpoint_every")
    yield "keeping the history between two checkpoints", chunk * population, keys
    samples, motion, of_system = configuration.system.demands(models)
    yield "judging a generation", 8.0 * classifiers * samples, (*_POPULATIONS, *of_system)
    times = ("scenario.trial.duration_s",) if of_system else ()
    yield "a generation's motion", motion, (*_MODELS, *of_system, *times)
    if scenario := configuration.system.simulated:
        bodies = scenario.individuals + scenario.objects.count
        yield (
            "searching the bodies of a trial for near pairs",
            16.0 * bodies**2,
            (*_SWARM, "scenario.objects.count"),
        )


def _refuse_largest(configuration: Configuration, keys: tuple[str, ...], need: str) -> None:
    """Reject the one of some settings that is farthest above its usual value."""
    values = dotted(configuration.model_dump())
    key = max(sorted(keys), key=lambda key: math.log(max(values[key], 1e-9) / _USUAL[key]))
    reject(key, f"be smaller, as {need}", values[key])
