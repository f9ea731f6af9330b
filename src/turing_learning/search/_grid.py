"""Reactive controllers on a grid, and how badly each gathers a swarm, or the objects that it moves."""

import numpy as np

from turing_learning.analysis import dispersion
from turing_learning.swarm import Scenario, simulate

SAMPLING_S = 1.0
"""Time between two looks at the dispersion (s): a robot moves less than two diameters."""


def mirrored(controllers: np.ndarray) -> np.ndarray:
    """Return controllers (..., 2 n) with left and right exchanged: their swarms do the same, seen in a mirror."""
    return controllers.reshape(*controllers.shape[:-1], -1, 2)[..., ::-1].reshape(controllers.shape)


def grid_controllers(states: int, steps: int) -> np.ndarray:
    """Return every controller whose wheel speeds are on a grid from -1 to 1, one of each mirror pair.

    Of a pair it is the one that is larger at the first wheel speed in which the two differ.

    Parameters
    ----------
    states
        Number of sensor states n.
    steps
        Settings of each wheel speed.

    Returns
    -------
    (about steps^(2 n) / 2, 2 n)
        The last wheel speed changes fastest.

    Source
    ------
    Paper, section 4.6.1, after Gauci et al. 2014.
    """
    places = np.indices((steps,) * (2 * states)).reshape(2 * states, -1).T
    number = steps ** np.arange(2 * states)[::-1]
    kept = places[places @ number >= mirrored(places) @ number]
    return np.linspace(-1, 1, steps).round(12)[kept]


def gathering_costs(
    scenario: Scenario,
    controllers: np.ndarray,
    starts: np.ndarray,
    *,
    duration_s: float,
    seed: int,
    threads: int | None = None,
) -> np.ndarray:
    """Let swarms of one controller each gather, and measure their dispersion.

    The cost is sum t u(t) / sum t over the seconds t = 1, 2, ... of a trial, where u is the dispersion of the objects,
    or of the robots where there are no objects: the sum of the dispersion weighted by time, scaled so that it is a dispersion.

    Parameters
    ----------
    controllers : (M, 2 n)
        What all robots of a swarm execute.
    starts : (R, A + O, 3)
        Initial poses of R trials of the scenario's robots and objects, common to all controllers.
    duration_s
        Duration of a trial (s).
    seed
        Seed of the wheel noise.
    threads
        Number of threads; None takes every processor.

    Returns
    -------
    (M, R, 2)
        Cost, and dispersion at the end.

    Source
    ------
    Gauci et al. 2014, Int. J. Robotics Research 33; see docs/decisions/0016 for what is assumed.
    """
    models, trials, robots = len(controllers), len(starts), scenario.individuals
    objects = starts.shape[1] > robots
    executed = np.repeat(controllers, trials, axis=0)[:, None].repeat(robots, axis=1)
    cycles = scenario.trial.steps_of(duration_s, "duration_s")
    stride = max(1, round(SAMPLING_S / scenario.trial.control_interval_s))
    poses = simulate(
        scenario, executed, np.tile(starts, (models, 1, 1)), control_steps=cycles, seed=seed, threads=threads
    ).poses
    seen = poses[:, stride::stride, robots if objects else 0 :, :2]
    radius = scenario.objects.radius_cm if objects else scenario.robot.radius_cm
    spread = dispersion(seen, radius)
    weights = np.arange(1, spread.shape[1] + 1)
    costs = spread @ weights / weights.sum()
    return np.stack((costs, spread[:, -1]), axis=-1).reshape(models, trials, 2)
