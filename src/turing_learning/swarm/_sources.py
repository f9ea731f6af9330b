"""Sample sources of simulated swarms."""

from dataclasses import dataclass

import numpy as np

from ..coevolution import Samples
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
        """Return genuine samples (trials x agents, T, 2) and counterfeit samples (M, replicas, T, 2) of models (M, 2 n)."""
        scenario = self.scenario
        models = np.asarray(models, dtype=np.float64)
        if models.ndim != 2 or models.shape[1] != len(scenario.controller):
            raise ValueError(
                f"`models` must have shape (M, P) = (any, {len(scenario.controller)}); got {models.shape}."
            )
        trials = len(models)
        controllers = np.empty((trials, scenario.individuals, models.shape[1]))
        controllers[:, : scenario.agents] = scenario.controller
        controllers[:, scenario.agents :] = models[:, None]
        keys = rng.integers(0, 2**64, size=trials, dtype=np.uint64)
        poses = initial_poses(scenario, trials, rng)
        speeds = observe(scenario, controllers, poses, keys, self.threads)
        shape = speeds.shape[2:]
        genuine = speeds[:, : scenario.agents].transpose(1, 0, 2, 3).reshape(-1, *shape)
        return Samples(genuine=genuine, counterfeit=speeds[:, scenario.agents :])
