"""Swarms of a scenario as systems: simulated, or of robots in a laboratory."""

import shlex
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..coevolution import Classifier, Samples
from ..errors import Setting, Text, brief, refuse, require
from ..models import FULL_VIEW, ElmanModel, Parameter, Representation
from ..swarm import Scenario
from ..trajectories import SIGNALS
from ._custom import CustomSystem
from ._system import Given, Source, System

if TYPE_CHECKING:
    from ..models import Behavior

SPEEDS = ("speed", "turn")
"""Signals of robots, by the names that recordings have."""


def system_of(
    scenario: Scenario | CustomSystem,
    *,
    hidden: int = 0,
    threads: int | None = None,
    initial: tuple[float, float] = (-1.0, 1.0),
) -> System:
    """Return the system of a scenario.

    Parameters
    ----------
    scenario
        A swarm, or a custom system, which is one already.
    hidden
        Hidden neurons of models that are networks; 0 for models in the agents' parameters.
    threads
        Number of threads; None takes every processor.
    initial
        Range of the first models in each parameter of a swarm.
    """
    if not isinstance(scenario, Scenario):
        rule = "be 0 for a custom system, whose simulator takes the parameters of its models"
        require(hidden == 0, "models.hidden", rule, str(hidden))
        return scenario
    rule = 'be 0 unless scenario.representation is "reactive", as a network infers no field of view'
    fits = not hidden or scenario.representation == "reactive"
    require(fits, "models.hidden", rule, f"{hidden} with {scenario.representation!r}")
    model = ElmanModel(scenario.sensor.states, hidden) if hidden else scenario.model
    return Swarm(scenario, model, threads, initial)


@dataclass(frozen=True)
class Swarm:
    """Simulated robots: agents that execute the scenario's controller, and replicas that execute models.

    Parameters
    ----------
    scenario
        What moves and what it senses.
    model
        What a model is: the agents' parameters, or a network.
    threads
        Number of threads; None takes every processor. It changes no sample.
    initial
        Range of the first models in each parameter.
    """

    scenario: Scenario
    model: Representation
    threads: int | None = None
    initial: tuple[float, float] = (-1.0, 1.0)

    signals = SPEEDS
    signal_units = SIGNALS
    headings = "with"
    smooth_frames = 1
    kind = "one on simulated robots"
    stimulated = False
    resuming: tuple[Setting, ...] = ()

    @property
    def name(self) -> str:
        """A word for folders and tables."""
        return self.scenario.name

    @property
    def title(self) -> str:
        """Heading of the report."""
        return self.scenario.title

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Name -> parameter of the agents, with the range of the first models, or of what models can be at all."""
        names = self.scenario.parameter_names
        networks = self.model.parameter_names != names  # their outputs are from -1 to 1, whatever their weights
        speed = Parameter(-1, 1) if networks else Parameter(None, None, initial=self.initial)
        angle = Parameter(0, FULL_VIEW, unit="rad")
        return {name: angle if name == "theta" else speed for name in names}

    @property
    def parameter_labels(self) -> tuple[str, ...]:
        """Names of the parameters, with units where they have any."""
        return self.scenario.parameter_labels

    @property
    def truth(self) -> tuple[float, ...] | None:
        """The agents' parameters; None if they are not known."""
        return self.scenario.truth

    @property
    def trials_per_model(self) -> int:
        """Two where agents and replicas move apart."""
        return _groups(self.scenario)

    @property
    def steps(self) -> int:
        """Control cycles of a trial, T."""
        return self.scenario.control_steps

    @property
    def interval_s(self) -> float:
        """Duration of a control cycle (s)."""
        return self.scenario.trial.control_interval_s

    @property
    def simulated(self) -> Scenario | None:
        """The scenario."""
        return self.scenario

    @property
    def step_unit(self) -> str:
        """A field of view steps as a number, not as an angle."""
        inferred = self.scenario.representation == "morphology"
        return " (that of theta is of the number x, theta = 2 pi sig(x))" if inferred else ""

    def evolved(self, network: Classifier) -> Classifier:
        """Return the network itself."""
        return network

    classifier = evolved

    def require_trials(self) -> None:
        """Do nothing: samples can be judged again."""

    def imitated(self, values: np.ndarray) -> Scenario:
        """Return the scenario with agents that have these parameters (P,)."""
        robot = self.scenario.model.behavior(values)
        view = self.scenario.sensor.field_of_view if robot.field_of_view is None else float(robot.field_of_view)
        controller, sensor = tuple(robot.wheel_speeds.tolist()), replace(self.scenario.sensor, field_of_view=view)
        return replace(self.scenario, controller=controller, sensor=sensor, known=True)

    def on_scales(self, models: np.ndarray, summarize: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Return the summary of all parameters at once: all scales are linear, and no side has a bound."""
        return summarize(models)

    def again(self, path: str) -> Text:
        """Return the command that runs it again."""
        return f"Run it again: turing-learning infer --config {shlex.quote(path)} --set run.history=full"

    def demands(self, models: int) -> tuple[float, float, tuple[str, ...]]:
        """Return samples and bytes of motion in a generation of so many models, and the settings that both grow with."""
        robots = float(models * _groups(self.scenario) * self.scenario.individuals)
        steps = self.scenario.trial.duration_s / self.scenario.trial.control_interval_s
        return robots, 64.0 * robots * steps, ("scenario.agents", "scenario.replicas")

    def accept(self, given: Given) -> Given:
        """Refuse whatever is given: only a custom system has a use for it."""
        for name, value in given.named.items():
            remedy = "A custom system has `genuine`, `simulate` and `parameters`, and no scenario."
            shown = brief(value) if isinstance(value, str | int | float) else type(value).__name__
            require(value is None, name, "be left out for simulated robots", shown, remedy)
        return given

    def open(self, given: Given) -> Source:
        """Return the samples of simulated robots."""
        self.accept(given)
        return _SwarmSource(self)


class Laboratory(Swarm):
    """Robots in a laboratory, which only its owner can open: `turing_learning.runs.resume_laboratory`."""

    kind = "one in a laboratory"

    @classmethod
    def of(cls, swarm: System) -> "Laboratory":
        """Return the laboratory whose robots a swarm stands for."""
        assert isinstance(swarm, Swarm)
        return cls(swarm.scenario, swarm.model, swarm.threads, swarm.initial)

    @property
    def simulated(self) -> Scenario | None:
        """None: a simulation would not be these robots."""
        return None

    def again(self, path: str) -> Text:
        """Return what to do in the laboratory."""
        return 'Run it again in the laboratory, with run.history = "full".'

    def open(self, given: Given) -> Source:
        """Refuse: the robots have to be there."""
        refuse(
            "run",
            "be one that the computer can resume alone",
            "one in a laboratory",
            "Resume it with `turing-learning robots run`, or `turing_learning.runs.resume_laboratory`.",
        )


def physics_steps(scenario: Scenario) -> float:
    """Return the number of physics steps of single robots that a generation has for each model."""
    steps = scenario.trial.duration_s / scenario.trial.control_interval_s
    return _groups(scenario) * scenario.individuals * steps * scenario.trial.physics_steps


def _groups(scenario: Scenario) -> int:
    """Return the number of trials for each model."""
    return 2 if scenario.grouping == "separated" else 1


class _SwarmSource(Source):
    """Trials of a simulated swarm."""

    fallible = False

    def __init__(self, swarm: Swarm) -> None:
        from ..swarm import MixedSwarm, SeparatedSwarm

        kind = SeparatedSwarm if swarm.scenario.grouping == "separated" else MixedSwarm
        self._swarm = swarm
        self._trials = kind(swarm.scenario, swarm.threads, swarm.model)

    def to_units(self, models: np.ndarray) -> np.ndarray:
        return self._swarm.model.to_units(models)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        return self._trials.collect(models, rng)

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return samples (M, 1, T, 2) of the first replica in one trial of each model, among agents."""
        return self._replicas(self._swarm.model.behavior(parameters), len(parameters), rng)

    def genuine_samples(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Return a sample of one agent in each of as many trials (count, T, 2)."""
        return self._replicas(None, count, rng)[:, 0]

    def _replicas(self, behavior: "Behavior | None", trials: int, rng: np.random.Generator) -> np.ndarray:
        from ..swarm import Trials, alone, mixed

        scenario = self._swarm.scenario
        executed = alone(scenario, trials) if behavior is None else mixed(scenario, trials)
        speeds = Trials.draw(scenario, executed, rng).observe(behavior, self._swarm.threads)
        return np.ascontiguousarray(speeds[:, scenario.agents, None])
