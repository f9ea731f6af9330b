"""The laboratory's trials in plain simulation: the same robots and arena, and none of a laboratory's conditions."""

import numpy as np

from turing_learning.coevolution import Samples
from turing_learning.models import Behavior
from turing_learning.purposes import REHEARSAL
from turing_learning.swarm import Scenario, Trials, alone


class SimulatedLaboratory:
    """Samples of trials in which each replica executes a model of its own, among the same agents.

    It is to `LaboratorySource` what simulation is to the laboratory in the paper: the same setup, without links, images, a tracker,
    dispersal and infrared sensors. The robots begin each trial at places drawn uniformly; a wall only stops them.

    Parameters
    ----------
    scenario
        The laboratory's, with R replicas.
    seed
        Of `observe`; what `collect` draws comes from the run.

    Attributes
    ----------
    generation
        Kept by whoever runs the generations; nothing depends on it.

    Source
    ------
    Paper, section 5.4.
    """

    def __init__(self, scenario: Scenario, seed: int = 0) -> None:
        self.generation = 0
        self._scenario, self._seed = scenario, seed

    def to_units(self, models: np.ndarray) -> np.ndarray:
        """Return the wheel speeds (M, P), fractions of the maximum, of models (M, P) as the optimizer has them: their tanh."""
        return np.tanh(models)

    def collect(self, models: np.ndarray, rng: np.random.Generator) -> Samples:
        """Return samples of the agents in all trials (trials x agents, T, 2), and one of each model (M, 1, T, 2)."""
        return self._samples(self.to_units(models), rng)

    def observe(self, speeds: np.ndarray, stage: str) -> Samples:
        """Return samples of models (M, P) in wheel speeds; see `collect`. Each stage has its own random numbers."""
        return self._samples(speeds, np.random.default_rng([REHEARSAL, self._seed, *stage.encode()]))

    def _samples(self, speeds: np.ndarray, rng: np.random.Generator) -> Samples:
        scenario = self._scenario
        trials, rest = divmod(len(speeds), scenario.replicas)
        if rest or not trials:
            raise ValueError(f"`models` must be a multiple of {scenario.replicas} replicas, not 0; got {len(speeds)}.")
        executed = alone(scenario, trials)
        executed[:, scenario.agents :] = np.arange(len(speeds)).reshape(trials, -1)
        motion = Trials.draw(scenario, executed, rng).observe(Behavior(speeds), 1)
        shape = motion.shape[2:]
        return Samples(
            genuine=motion[:, : scenario.agents].reshape(-1, *shape),
            counterfeit=motion[:, scenario.agents :].reshape(-1, 1, *shape),
        )
