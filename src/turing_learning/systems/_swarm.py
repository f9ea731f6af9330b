"""Swarms of a scenario as systems: simulated, or of robots in a laboratory."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..coevolution import Samples
from ..errors import Text, brief, refuse, require
from ..models import FULL_VIEW, ElmanModel, Parameter, Representation
from ..swarm import Scenario
from ..trajectories import SIGNALS
from ._custom import CustomSystem
from ._system import Arguments, Source, System

if TYPE_CHECKING:
    from ..models import Behavior

SPEEDS = ("speed", "turn")
"""Signals of robots, by the names that recordings have."""


def system_of(
    scenario: Scenario | CustomSystem,
    *,
    hidden: int,
    threads: int | None,
    initial: tuple[float, float],
) -> System:
    """Return the system of a scenario, a custom system being one already.

    Models are networks of so many hidden neurons, if any.
    """
    if not isinstance(scenario, Scenario):
        rule = "be 0 for a custom system, whose simulator takes the parameters of its models"
        require(hidden == 0, "models.hidden", rule, str(hidden))
        return scenario
    rule = 'be 0 unless scenario.representation is "reactive", as a network infers no field of view'
    fits = not hidden or scenario.representation == "reactive"
    require(fits, "models.hidden", rule, f"{hidden} with {scenario.representation!r}")
    model: Representation = scenario.model
    if hidden:
        model = ElmanModel(scenario.sensor.states, hidden)
    return Swarm(scenario, model, threads, initial)


@dataclass
class Swarm(System):
    """Simulated robots: agents that execute the scenario's controller, and replicas that execute models."""

    scenario: Scenario  #: What moves and what it senses
    model: Representation  #: What a model is: the agents' parameters, or a network
    #: Number of threads; None takes every processor. It changes no sample
    threads: int | None = None
    #: Range of the first models in each parameter
    initial: tuple[float, float] = (-1.0, 1.0)

    signals = SPEEDS
    signal_units = SIGNALS
    headings = "with"
    noun = "one on simulated robots"

    def __post_init__(self) -> None:
        scenario = self.scenario
        self.name = scenario.name
        self.title = scenario.title
        self.simulated = scenario
        self.steps = scenario.control_steps
        self.interval_s = scenario.trial.control_interval_s
        speed = Parameter(None, None, initial=self.initial)
        if self.model.parameter_names != scenario.parameter_names:
            # Outputs of networks are from -1 to 1, whatever their weights.
            speed = Parameter(-1, 1)
        self.parameters = dict.fromkeys(scenario.parameter_names, speed)
        if "theta" in self.parameters:
            self.parameters["theta"] = Parameter(0, FULL_VIEW, unit="rad")
        if scenario.representation == "morphology":
            self.step_unit = " (that of theta is of the number x, theta = 2 pi sig(x))"

    @property
    def truth(self) -> tuple[float, ...] | None:
        return self.scenario.truth

    @property
    def trials_per_model(self) -> int:
        """Two where agents and replicas move apart."""
        return _groups(self.scenario)

    def imitated(self, values: np.ndarray) -> Scenario:
        """Return the scenario with agents that have these parameters (P,)."""
        robot = self.scenario.model.behavior(values)
        sensor = self.scenario.sensor
        if robot.field_of_view is not None:
            sensor = replace(sensor, field_of_view=float(robot.field_of_view))
        controller = tuple(robot.wheel_speeds.tolist())
        return replace(self.scenario, controller=controller, sensor=sensor, known=True)

    def demands(self, models: int) -> tuple[float, float, tuple[str, ...]]:
        robots = float(models * _groups(self.scenario) * self.scenario.individuals)
        steps = self.scenario.trial.duration_s / self.scenario.trial.control_interval_s
        return robots, 64.0 * robots * steps, ("scenario.agents", "scenario.replicas")

    def accept(self, arguments: Arguments) -> Arguments:
        """Refuse whatever is given: only a custom system has a use for it."""
        for name, value in arguments.named.items():
            rule = "be left out for simulated robots"
            got = type(value).__name__
            if isinstance(value, str | int | float):
                got = brief(value)
            remedy = "A custom system has `genuine`, `simulate` and `parameters`, and no scenario."
            require(value is None, name, rule, got, remedy)
        return arguments

    def open(self, arguments: Arguments) -> Source:
        self.accept(arguments)
        return _SwarmSource(self)


class Laboratory(Swarm):
    """Robots in a laboratory, which only its owner can open: `turing_learning.runs.resume_laboratory`."""

    noun = "one in a laboratory"

    @classmethod
    def of(cls, swarm: System) -> "Laboratory":
        """Return the laboratory whose robots a swarm stands for."""
        assert isinstance(swarm, Swarm)
        return cls(swarm.scenario, swarm.model, swarm.threads, swarm.initial)

    def __post_init__(self) -> None:
        super().__post_init__()
        # A simulation would not be these robots
        self.simulated = None

    def again(self, path: str) -> Text:
        """Return what to do in the laboratory."""
        return 'Run it again in the laboratory, with run.history = "full".'

    def open(self, arguments: Arguments) -> Source:
        """Refuse: the robots have to be there."""
        remedy = "Resume it with `turing-learning robots run`, or `turing_learning.runs.resume_laboratory`."
        refuse("run", "be one that the computer can resume alone", self.noun, remedy)


def physics_steps(scenario: Scenario) -> float:
    """Return the number of physics steps of single robots that a generation has for each model."""
    steps = scenario.trial.duration_s / scenario.trial.control_interval_s
    return _groups(scenario) * scenario.individuals * steps * scenario.trial.physics_steps


def _groups(scenario: Scenario) -> int:
    """Return the number of trials for each model."""
    return 2 if scenario.grouping == "separated" else 1


class _SwarmSource(Source):
    """Trials of a simulated swarm."""

    system: Swarm
    fallible = False
    cheap = True

    def __init__(self, swarm: Swarm) -> None:
        from ..swarm import MixedSwarm, SeparatedSwarm

        groups = MixedSwarm
        if swarm.scenario.grouping == "separated":
            groups = SeparatedSwarm
        self.system = swarm
        self._trials = groups(swarm.scenario, swarm.threads, swarm.model)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        return self._trials.collect(models, rng)

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return samples (M, 1, T, 2) of the first replica in one trial of each model, among agents."""
        return self._replicas(self.system.model.behavior(parameters), len(parameters), rng)

    def genuine_samples(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return a sample of one agent in each of as many trials (count, T, 2)."""
        return self._replicas(None, count, rng)[:, 0]

    def _replicas(
        self, behavior: "Behavior | None", trials: int, rng: np.random.Generator
    ) -> np.ndarray:
        from ..swarm import Trials, alone, mixed

        scenario = self.system.scenario
        if behavior is None:
            executed = alone(scenario, trials)
        else:
            executed = mixed(scenario, trials)
        speeds = Trials.draw(scenario, executed, rng).observe(behavior, self.system.threads)
        return np.ascontiguousarray(speeds[:, scenario.agents, None])
