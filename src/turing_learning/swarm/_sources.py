"""Sample sources of simulated swarms."""

from dataclasses import dataclass

import numpy as np

from ..coevolution import Samples
from ..models import Behavior, Representation
from ._execution import execution_of, mixed_groups
from ._scenario import Scenario
from ._simulate import initial_poses, observe


@dataclass(frozen=True)
class MixedSwarm:
    """Replicas mixed into a group of agents: one trial per model, in which every replica executes it.

    Parameters
    ----------
    threads
        Number of threads; None takes every processor. It does not change the samples.
    model
        What a model is; None takes the scenario's.

    Source
    ------
    Paper, sections 3.2.2 and 4.2.
    """

    scenario: Scenario
    threads: int | None = None
    model: Representation | None = None

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (trials x agents, T, 2) and counterfeit samples (M, replicas, T, 2) of models (M, P)."""
        scenario = self.scenario
        behavior = _behavior(self.model or scenario.model, models)
        speeds = _observed(scenario, behavior, mixed_groups(scenario, len(models)), rng, self.threads)
        return Samples(genuine=_one_by_one(speeds[:, : scenario.agents]), counterfeit=speeds[:, scenario.agents :])


@dataclass(frozen=True)
class SeparatedSwarm:
    """Groups of agents and groups of replicas, never mixed: a trial of each per model, all replicas of which execute it.

    Both groups have as many individuals as the scenario.

    Parameters
    ----------
    threads
        Number of threads; None takes every processor. It does not change the samples.
    model
        What a model is; None takes the scenario's.

    Source
    ------
    Paper, section 4.6.3.
    """

    scenario: Scenario
    threads: int | None = None
    model: Representation | None = None

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (M x individuals, T, 2) and counterfeit samples (M, individuals, T, 2) of models (M, P)."""
        scenario = self.scenario
        behavior = _behavior(self.model or scenario.model, models)
        agents = Behavior(np.asarray([scenario.controller]))
        groups = np.repeat(np.arange(len(models))[:, None], scenario.individuals, axis=1)
        genuine = _observed(scenario, agents, np.full_like(groups, -1), rng, self.threads)
        counterfeit = _observed(scenario, behavior, groups, rng, self.threads)
        return Samples(genuine=_one_by_one(genuine), counterfeit=counterfeit)


TRIALS = 10


@dataclass(frozen=True)
class ObservedSwarm:
    """A live source of genuine motion: swarms of a scenario without replicas, from new initial poses each time.

    It is what `turing_learning.infer` makes of a scenario that is given as `genuine`.

    Parameters
    ----------
    scenario
        What moves; its replicas are agents, too.
    trials
        Number of swarms R that are observed at once.
    """

    scenario: Scenario
    trials: int = TRIALS

    names = ("speed", "turn")
    headings = True

    @property
    def interval_s(self) -> float:
        """Duration of a time step (s)."""
        return self.scenario.trial.control_interval_s

    def __call__(self, rng: np.random.Generator) -> np.ndarray:
        """Return samples (R x individuals, T, 2): linear speed (cm/s) and angular speed (rad/s)."""
        scenario = self.scenario
        controllers = np.tile(np.asarray(scenario.controller, dtype=np.float64), (self.trials, scenario.individuals, 1))
        keys = rng.integers(0, 2**64, size=self.trials, dtype=np.uint64)
        speeds = observe(scenario, controllers, initial_poses(scenario, self.trials, rng), keys, None)
        return speeds.reshape(-1, *speeds.shape[2:])


def _behavior(model: Representation, models: np.ndarray) -> Behavior:
    """Return what replicas of models (M, P), as the optimizer has them, execute."""
    models, parameters = np.asarray(models, dtype=np.float64), len(model.parameter_names)
    if models.ndim != 2 or models.shape[1] != parameters:
        raise ValueError(f"`models` must have shape (M, P) = (any, {parameters}); got {models.shape}.")
    return model.behavior(model.to_units(models))


def _observed(
    scenario: Scenario, models: Behavior, executed: np.ndarray, rng: np.random.Generator, threads: int | None
) -> np.ndarray:
    """Return the speeds (R, A, T, 2) of robots that execute models, or as agents none (-1), from initial poses of their own."""
    keys = rng.integers(0, 2**64, size=len(executed), dtype=np.uint64)
    poses = initial_poses(scenario, len(executed), rng)
    robots = execution_of(scenario, models, executed)
    return observe(scenario, robots.controllers, poses, keys, threads, robots.fields_of_view, robots.drivers)


def _one_by_one(speeds: np.ndarray) -> np.ndarray:
    """Return the speeds (R, A, T, 2) of all individuals as samples (A x R, T, 2)."""
    return speeds.transpose(1, 0, 2, 3).reshape(-1, *speeds.shape[2:])
