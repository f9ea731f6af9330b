"""What swarms of an inferred model do: the dispersion that they reach, from common initial configurations."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from turing_learning.analysis import Comparison, compare, dispersion
from turing_learning.purposes import EMERGENCE_STARTS
from turing_learning.reproduction._work import Work
from turing_learning.swarm import Scenario

REPEATS = 1000
"""Number of the first repetition of the agents' trials; models are numbered from 1 on."""


@dataclass(frozen=True)
class EmergenceSizes:
    """How many trials of how many robots, and for how long; how often the agents' are repeated.

    Objects grow in proportion to the robots.
    """

    robots: int
    trials: int = 30
    duration_s: float = 400.0
    repeats: int = 10
    seed: int = 1


@dataclass(frozen=True)
class Emergence:
    """The dispersion of agents, and of replicas of several models, at the end of their trials.

    Attributes
    ----------
    agents : (R,)
        In R trials.
    models : (M, R)
        The same for replicas of each of M models, from the same initial configurations.
    repeated : (K, R)
        The agents' trials repeated K times from these, with other noise: how much hangs on the agents' R trials.
    """

    agents: np.ndarray
    models: np.ndarray
    repeated: np.ndarray

    @property
    def comparison(self) -> Comparison:
        """Each model's trials tested against those of the agents."""
        return compare(self.agents, self.models)

    @property
    def without_difference_from_repeated(self) -> list[int]:
        """Number of models without a significant difference from each repetition of the agents' trials."""
        return [compare(agents, self.models).without_difference for agents in self.repeated]


def measure_emergence(
    work: Work, scenario: Scenario, models: np.ndarray, sizes: EmergenceSizes, name: str
) -> Emergence:
    """Measure the dispersion of agents and of replicas of models (M, P), a piece of work for each.

    Source
    ------
    Paper, section 4.3.
    """
    agents = _piece(
        work, f"dispersion-{scenario.name}-agents", partial(_reached, scenario, scenario.controller, sizes, 0)
    )
    replicas = [
        _piece(work, f"dispersion-{scenario.name}-{name}-{k:02d}", partial(_reached, scenario, model, sizes, k))
        for k, model in enumerate(models, start=1)
    ]
    repeated = [
        _piece(
            work,
            f"dispersion-{scenario.name}-agents-{k + 1:02d}",
            partial(_reached, scenario, scenario.controller, sizes, REPEATS + k),
        )
        for k in range(sizes.repeats)
    ]
    return Emergence(np.array(agents), np.array(replicas), np.array(repeated))


def _piece(work: Work, name: str, compute: Any) -> list[float]:
    return work.piece(name, compute)["dispersion"]


def _reached(scenario: Scenario, controller: Any, sizes: EmergenceSizes, number: int) -> dict[str, list[float]]:
    """Return the dispersion at the end of each trial (R,): of the objects where there are any, otherwise of the robots."""
    from turing_learning.swarm import initial_poses, simulate

    start = initial_poses(
        scenario, sizes.trials, np.random.default_rng((EMERGENCE_STARTS, sizes.seed)), robots=sizes.robots
    )
    controllers = np.broadcast_to(controller, (sizes.trials, sizes.robots, len(scenario.controller)))
    steps = round(sizes.duration_s / scenario.trial.control_interval_s)
    noise = int(np.random.SeedSequence((EMERGENCE_STARTS + 1 + number, sizes.seed)).generate_state(1)[0])
    ends = simulate(scenario, controllers, start, control_steps=steps, seed=noise).poses[:, -1]
    objects = ends.shape[1] > sizes.robots
    gathered = ends[:, sizes.robots :, :2] if objects else ends[..., :2]
    radius = scenario.objects.radius_cm if objects else scenario.robot.radius_cm
    return {"dispersion": dispersion(gathered, radius).tolist()}
