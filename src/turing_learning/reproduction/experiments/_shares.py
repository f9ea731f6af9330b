"""How often agents are in each sensor state."""

from dataclasses import dataclass

import numpy as np

from turing_learning.swarm import Scenario


@dataclass(frozen=True)
class ShareSizes:
    """How many trials, of the scenario's own duration."""

    trials: int = 100
    seed: int = 1


def sensor_shares(scenario: Scenario, sizes: ShareSizes) -> np.ndarray:
    """Return the share of the agents in each sensor state, trial by trial and step by step.

    All individuals of the scenario are agents.

    Returns
    -------
    (R, T, n)
        Sums to 1 over the n states.

    Source
    ------
    Paper, section 4.3.
    """
    from turing_learning.swarm import initial_poses, simulate

    start = initial_poses(scenario, sizes.trials, np.random.default_rng(sizes.seed))
    controllers = np.broadcast_to(scenario.controller, (sizes.trials, scenario.individuals, len(scenario.controller)))
    sensors = simulate(scenario, controllers, start, control_steps=scenario.control_steps, seed=sizes.seed).sensors
    states = np.arange(scenario.sensor.states)
    return (sensors[:, :-1, :, None] == states).mean(axis=2)
