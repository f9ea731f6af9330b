"""Who executes what in a trial, and swarms as sources of samples."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from ..arrays import array
from ..coevolution import Samples
from ..models import Behavior, Representation
from ._scenario import Scenario
from ._simulate import Drivers, initial_poses, observe

AGENT = -1
"""In the place of the number of a model: a robot that executes the agents' controller."""

TRIALS = 10


@dataclass(frozen=True, eq=False)
class Execution:
    """What each robot of R trials executes, as `simulate` and `observe` take it."""

    controllers: np.ndarray  #: Wheel speeds (R, A, 2 n), of a network the largest that it may give
    fields_of_view: np.ndarray | None  #: (R, A), None where all are the scenario's
    drivers: Drivers | None  #: Networks that drive some of the robots, None if all are reactive


def execution_of(scenario: Scenario, models: Behavior, executed: np.ndarray) -> Execution:
    """Return what robots execute of which some are replicas.

    Parameters
    ----------
    models : (M, ...)
        What replicas of M models execute.
    executed : (R, A)
        The model, 0 to M - 1, that each robot executes; -1 for an agent.
    """
    replica = executed >= 0
    speeds, view = models.wheel_speeds, models.field_of_view
    return Execution(
        controllers=np.where(replica[..., None], speeds[executed], scenario.controller),
        fields_of_view=None if view is None else np.where(replica, view[executed], scenario.sensor.field_of_view),
        drivers=None if models.weights is None else Drivers(models.weights, models.hidden, executed),
    )


@dataclass(frozen=True, eq=False)
class Trials:
    """R trials of a scenario's A robots: who executes which model, from which poses, with which wheel noise."""

    scenario: Scenario  #: Of the agents, the arena and the duration
    executed: np.ndarray  #: (R, A): The model that each robot executes; -1 for an agent
    poses: np.ndarray  #: (R, A + O, 3): x, y (cm), heading (rad) at the beginning; robots first, then objects
    keys: np.ndarray  #: (R,): Of the wheel noise, one for each trial

    @classmethod
    def draw(cls, scenario: Scenario, executed: np.ndarray, rng: np.random.Generator) -> Self:
        """Return trials with new keys and initial poses, drawn in this order."""
        keys = rng.integers(0, 2**64, size=len(executed), dtype=np.uint64)
        return cls(scenario, executed, initial_poses(scenario, len(executed), rng), keys)

    def observe(self, models: Behavior | None = None, threads: int | None = None) -> np.ndarray:
        """Return the speeds (R, A, T, 2) of robots that execute models (M, ...); None if all are agents.

        Linear speed (cm/s), negative when moving against the heading, and angular speed (rad/s). The number
        of threads, None for every processor, does not change them.
        """
        agents = Behavior(np.asarray([self.scenario.controller], dtype=np.float64))
        robots = execution_of(self.scenario, agents if models is None else models, self.executed)
        more = (robots.fields_of_view, robots.drivers)
        return observe(self.scenario, robots.controllers, self.poses, self.keys, threads, *more)


def mixed(scenario: Scenario, models: int, trials: int = 1) -> np.ndarray:
    """Return who executes what (M x trials, A) in some trials of each of M models: the replicas its model, agents before them."""
    executed = np.full((models * trials, scenario.individuals), AGENT)
    executed[:, scenario.agents :] = np.repeat(np.arange(models), trials)[:, None]
    return executed


def alone(scenario: Scenario, trials: int) -> np.ndarray:
    """Return who executes what (trials, A) where all robots are agents."""
    return np.full((trials, scenario.individuals), AGENT)


@dataclass(frozen=True)
class MixedSwarm:
    """Replicas mixed into a group of agents: one trial per model, in which every replica executes it.

    Source: paper, sections 3.2.2 and 4.2.
    """

    scenario: Scenario
    threads: int | None = None  #: Number of threads; None takes every processor. It does not change the samples
    model: Representation | None = None  #: What a model is; None takes the scenario's

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (trials x agents, T, 2) and counterfeit samples (M, replicas, T, 2) of models (M, P)."""
        agents, replicas = self.scenario.agents, self._replicas(models)
        speeds = Trials.draw(self.scenario, mixed(self.scenario, len(models)), rng).observe(replicas, self.threads)
        return Samples(genuine=_one_by_one(speeds[:, :agents]), counterfeit=speeds[:, agents:])

    def _replicas(self, models: np.ndarray) -> Behavior:
        """Return what replicas of models (M, P), as the optimizer has them, execute."""
        model = self.model or self.scenario.model
        models = array("models", models, "M P", finite=False, empty=True, P=len(model.parameter_names))
        return model.behavior(model.to_units(models))


@dataclass(frozen=True)
class SeparatedSwarm(MixedSwarm):
    """Groups of agents and groups of replicas, never mixed: a trial of each per model, all replicas of which execute it.

    Both groups have as many individuals as the scenario (paper, section 4.6.3).
    """

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (M x individuals, T, 2) and counterfeit samples (M, individuals, T, 2) of models (M, P)."""
        scenario, replicas = self.scenario, self._replicas(models)
        groups = np.repeat(np.arange(len(models))[:, None], scenario.individuals, axis=1)
        genuine = Trials.draw(scenario, alone(scenario, len(models)), rng).observe(None, self.threads)
        return Samples(_one_by_one(genuine), Trials.draw(scenario, groups, rng).observe(replicas, self.threads))


@dataclass(frozen=True)
class ObservedSwarm:
    """A live source of genuine motion: swarms of a scenario without replicas, from new initial poses each time.

    `turing_learning.infer` makes one of a scenario that is given as `genuine`.
    """

    scenario: Scenario  #: What moves; its replicas are agents, too
    trials: int = TRIALS  #: Number of swarms R that are observed at once

    names = ("speed", "turn")
    headings = True

    @property
    def interval_s(self) -> float:
        """Duration of a time step (s)."""
        return self.scenario.trial.control_interval_s

    def __call__(self, rng: np.random.Generator) -> np.ndarray:
        """Return samples (R x individuals, T, 2): linear speed (cm/s) and angular speed (rad/s)."""
        speeds = Trials.draw(self.scenario, alone(self.scenario, self.trials), rng).observe()
        return speeds.reshape(-1, *speeds.shape[2:])


def _one_by_one(speeds: np.ndarray) -> np.ndarray:
    """Return the speeds (R, A, T, 2) of all individuals as samples (A x R, T, 2)."""
    return speeds.transpose(1, 0, 2, 3).reshape(-1, *speeds.shape[2:])
