"""Sample sources of simulated swarms."""

from dataclasses import dataclass

import numpy as np

from ..coevolution import Samples
from ..models import Behavior
from ._scenario import Scenario
from ._simulate import initial_poses, observe


@dataclass(frozen=True)
class MixedSwarm:
    """Replicas mixed into a group of agents: one trial per model, in which every replica executes it.

    Parameters
    ----------
    threads
        Number of threads; None takes every processor. It does not change the samples.

    Source
    ------
    Paper, sections 3.2.2 and 4.2.
    """

    scenario: Scenario
    threads: int | None = None

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return genuine samples (trials x agents, T, 2) and counterfeit samples (M, replicas, T, 2) of models (M, P)."""
        scenario = self.scenario
        models = np.asarray(models, dtype=np.float64)
        if models.ndim != 2 or models.shape[1] != len(scenario.parameter_names):
            raise ValueError(
                f"`models` must have shape (M, P) = (any, {len(scenario.parameter_names)}); got {models.shape}."
            )
        trials = len(models)
        mixed = mix(scenario, scenario.to_units(models))
        keys = rng.integers(0, 2**64, size=trials, dtype=np.uint64)
        poses = initial_poses(scenario, trials, rng)
        speeds = observe(scenario, mixed.wheel_speeds, poses, keys, self.threads, mixed.field_of_view)
        shape = speeds.shape[2:]
        genuine = speeds[:, : scenario.agents].transpose(1, 0, 2, 3).reshape(-1, *shape)
        return Samples(genuine=genuine, counterfeit=speeds[:, scenario.agents :])


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


def mix(scenario: Scenario, parameters: np.ndarray) -> Behavior:
    """Return what the robots of each trial execute (M, A): agents, then replicas of the model with these parameters (M, P)."""
    models = scenario.model.behavior(parameters)
    shape = (len(parameters), scenario.individuals)
    wheel_speeds = np.empty((*shape, len(scenario.controller)))
    wheel_speeds[:, : scenario.agents] = scenario.controller
    wheel_speeds[:, scenario.agents :] = models.wheel_speeds[:, None]
    if models.field_of_view is None:
        return Behavior(wheel_speeds)
    field_of_view = np.full(shape, scenario.sensor.field_of_view)
    field_of_view[:, scenario.agents :] = models.field_of_view[:, None]
    return Behavior(wheel_speeds, field_of_view)
