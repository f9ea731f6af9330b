"""Sample sources of simulated swarms."""

from dataclasses import dataclass

import numpy as np

from ..arrays import array
from ..coevolution import Samples
from ..models import Behavior, Representation
from ._scenario import Scenario
from ._trials import Trials, alone, mixed

TRIALS = 10


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
        agents, behavior = self.scenario.agents, _behavior(self.model or self.scenario.model, models)
        speeds = Trials.draw(self.scenario, mixed(self.scenario, len(models)), rng).observe(behavior, self.threads)
        return Samples(genuine=one_by_one(speeds[:, :agents]), counterfeit=speeds[:, agents:])


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
        scenario, behavior = self.scenario, _behavior(self.model or self.scenario.model, models)
        groups = np.repeat(np.arange(len(models))[:, None], scenario.individuals, axis=1)
        genuine = Trials.draw(scenario, alone(scenario, len(models)), rng).observe(None, self.threads)
        return Samples(one_by_one(genuine), Trials.draw(scenario, groups, rng).observe(behavior, self.threads))


@dataclass(frozen=True)
class ObservedSwarm:
    """A live source of genuine motion: swarms of a scenario without replicas, from new initial poses each time.

    `turing_learning.infer` makes one of a scenario that is given as `genuine`.

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
        speeds = Trials.draw(self.scenario, alone(self.scenario, self.trials), rng).observe()
        return speeds.reshape(-1, *speeds.shape[2:])


def _behavior(model: Representation, models: np.ndarray) -> Behavior:
    """Return what replicas of models (M, P), as the optimizer has them, execute."""
    models = array("models", models, "M P", finite=False, empty=True, P=len(model.parameter_names))
    return model.behavior(model.to_units(models))


def one_by_one(speeds: np.ndarray) -> np.ndarray:
    """Return the speeds (R, A, T, 2) of all individuals as samples (A x R, T, 2)."""
    return speeds.transpose(1, 0, 2, 3).reshape(-1, *speeds.shape[2:])
