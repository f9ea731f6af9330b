"""Sample sources of simulated swarms."""

from dataclasses import dataclass

import numpy as np

from ..coevolution import Samples
from ..models import Execution, ReactiveModel, Representation
from ._drivers import Drivers, drivers_of
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
        What the numbers of a model mean; None for reactive models.

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
        execution = _executed(scenario, self.model, models)
        trials = len(execution.wheel_speeds)
        controllers = np.empty((trials, scenario.individuals, len(scenario.controller)))
        controllers[:, : scenario.agents] = scenario.controller
        controllers[:, scenario.agents :] = execution.wheel_speeds[:, None]
        driver = np.full((trials, scenario.individuals), -1)
        driver[:, scenario.agents :] = np.arange(trials)[:, None]
        speeds = _observed(scenario, controllers, drivers_of(execution, driver), rng, self.threads)
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
        What the numbers of a model mean; None for reactive models.

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
        execution = _executed(scenario, self.model, models)
        size = (len(execution.wheel_speeds), scenario.individuals)
        agents = np.broadcast_to(scenario.controller, (*size, len(scenario.controller)))
        replicas = np.broadcast_to(execution.wheel_speeds[:, None], agents.shape)
        drivers = drivers_of(execution, np.broadcast_to(np.arange(size[0])[:, None], size))
        genuine = _observed(scenario, np.array(agents), None, rng, self.threads)
        counterfeit = _observed(scenario, np.array(replicas), drivers, rng, self.threads)
        return Samples(genuine=_one_by_one(genuine), counterfeit=counterfeit)


def _executed(scenario: Scenario, model: Representation | None, models: np.ndarray) -> Execution:
    """Return what models (M, P) are executed as."""
    representation = ReactiveModel(scenario.sensor.states) if model is None else model
    models, parameters = np.asarray(models, dtype=np.float64), len(representation.names)
    if models.ndim != 2 or models.shape[1] != parameters:
        raise ValueError(f"`models` must have shape (M, P) = (any, {parameters}); got {models.shape}.")
    return representation.executed(models)


def _observed(
    scenario: Scenario, controllers: np.ndarray, drivers: Drivers | None, rng: np.random.Generator, threads: int | None
) -> np.ndarray:
    """Return the speeds (R, A, T, 2) in a trial for each of the controllers (R, A, 2 n), from initial poses of its own."""
    keys = rng.integers(0, 2**64, size=len(controllers), dtype=np.uint64)
    poses = initial_poses(scenario, len(controllers), rng)
    return observe(scenario, controllers, poses, keys, threads, drivers)


def _one_by_one(speeds: np.ndarray) -> np.ndarray:
    """Return the speeds (R, A, T, 2) of all individuals as samples (A x R, T, 2)."""
    return speeds.transpose(1, 0, 2, 3).reshape(-1, *speeds.shape[2:])
