"""Trials: who executes what, from which poses, with which noise."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from ..models import Behavior
from ._scenario import Scenario
from ._simulate import Drivers, initial_poses, observe

AGENT = -1
"""In the place of the number of a model: a robot that executes the agents' controller."""


@dataclass(frozen=True, eq=False)
class Execution:
    """What each robot of R trials executes, as `simulate` and `observe` take it.

    Attributes
    ----------
    controllers : (R, A, 2 n)
        Left and right wheel speed for each sensor state, as fractions of the maximum; of a network the largest that it may give.
    fields_of_view : (R, A)
        Of the sensors (rad); None where all are the scenario's.
    drivers
        Networks that drive some of the robots; None if all are reactive.
    """

    controllers: np.ndarray
    fields_of_view: np.ndarray | None
    drivers: Drivers | None


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
    """R trials of a scenario's A robots: who executes which model, from which poses, with which wheel noise.

    Attributes
    ----------
    scenario
        Of the agents, the arena and the duration.
    executed : (R, A)
        The model that each robot executes; -1 for an agent.
    poses : (R, A + O, 3)
        x, y (cm), heading (rad) at the beginning; robots first, then objects.
    keys : (R,)
        Of the wheel noise, one for each trial.
    """

    scenario: Scenario
    executed: np.ndarray
    poses: np.ndarray
    keys: np.ndarray

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
        return observe(
            self.scenario, robots.controllers, self.poses, self.keys, threads, robots.fields_of_view, robots.drivers
        )


def mixed(scenario: Scenario, models: int, trials: int = 1) -> np.ndarray:
    """Return who executes what (M x trials, A) in some trials of each of M models: the replicas its model, agents before them."""
    executed = np.full((models * trials, scenario.individuals), AGENT)
    executed[:, scenario.agents :] = np.repeat(np.arange(models), trials)[:, None]
    return executed


def alone(scenario: Scenario, trials: int) -> np.ndarray:
    """Return who executes what (trials, A) where all robots are agents."""
    return np.full((trials, scenario.individuals), AGENT)
