"""How robots of the emulated laboratory move, a control cycle at a time; and how they move when no PC leads them."""

from collections.abc import Iterator

import numpy as np

from turing_learning.swarm import Scenario, simulate

from ._firmware import avoid_walls
from ._infrared import read_infrared


def move_for_a_cycle(
    scenario: Scenario, poses: np.ndarray, wheels: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return where robots (A, 3) are after a control cycle with wheel speeds (A, 2), and the readings I (A,) that they then have.

    A trial of one step, in which every sensor state has the same wheel speeds.
    """
    controllers = np.tile(wheels, (1, scenario.sensor.states))[None]
    trial = simulate(scenario, controllers, poses[None], control_steps=1, seed=seed, threads=1)
    return trial.poses[0, 1], trial.sensors[0, 1]


def move_alone(
    scenario: Scenario, controller: np.ndarray, start: np.ndarray, *, cycles: int, seed: int
) -> Iterator[np.ndarray]:
    """Let robots that no PC leads execute a controller among walls, as in state R5: they avoid walls, and meet each other.

    Parameters
    ----------
    scenario
        Robots, sensor and walls of the laboratory; their numbers do not matter.
    controller : (2 n,)
        Wheel speeds for each sensor state, fractions of the maximum.
    start : (A, 3)
        x, y (cm), heading (rad).
    cycles
        Control cycles.
    seed
        Of wheel noise, and of noise of the infrared sensors.

    Yields
    ------
    (A, 3)
        The poses at the start, and after every cycle.

    Source
    ------
    Paper, section 5.4: trials of 600 s with 40 robots.
    """
    arena = float(scenario.arena.width_cm or 0), float(scenario.arena.height_cm or 0)
    rng, table = np.random.default_rng(seed), np.reshape(controller, (-1, 2))
    poses, sight = start, np.zeros(len(start), int)
    yield poses
    for _ in range(cycles):
        proximity = read_infrared(poses, arena, scenario.robot.radius_cm, rng).tolist()
        wheels = [
            avoid_walls((speeds[0], speeds[1]), readings)
            for speeds, readings in zip(table[sight].tolist(), proximity, strict=True)
        ]
        poses, sight = move_for_a_cycle(scenario, poses, np.array(wheels), int(rng.integers(2**63)))
        yield poses
