"""What emulated robots sense, and how they move, a control cycle at a time."""

from collections.abc import Iterator

import numpy as np

from turing_learning.swarm import Scenario, simulate

from ._firmware import SENSOR_ANGLES, avoid_walls

BRIGHTEST, DARK, HALF_CM = 3800.0, 60.0, 0.75
"""Reading with a white wall at the sensor, above that of nothing; of nothing; distance at which it is half the brightest (cm)."""
SKIRT = 0.06  #: Share of a white wall's light that a black skirt reflects
NOISE = 5.0
LARGEST_READING = 4095


def read_infrared(
    poses: np.ndarray, arena_cm: tuple[float, float], radius_cm: float, rng: np.random.Generator
) -> np.ndarray:
    """Return the readings (A, 8) of robots at poses (A, 3), with noise.

    A surface at a distance d whose nearest point lies at an angle a from the sensor's axis gives b cos(a)^2 / (1 + (d / h)^2); of
    all surfaces the strongest counts. The light falls off with the square of the distance, as it does.
    """
    angles = poses[:, 2, None] + SENSOR_ANGLES
    axes = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    sensors = poses[:, None, :2] + radius_cm * axes
    robots = SKIRT * _from_robots(sensors, axes, poses[:, :2], radius_cm)
    light = np.maximum(_from_walls(sensors, axes, arena_cm), robots)
    readings = np.rint(DARK + BRIGHTEST * light + rng.normal(0, NOISE, light.shape))
    return np.clip(readings, 0, LARGEST_READING).astype(int)


def _reflected(distance: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    return np.maximum(cosine, 0) ** 2 / (1 + (np.maximum(distance, 0) / HALF_CM) ** 2)


def _from_walls(sensors: np.ndarray, axes: np.ndarray, arena_cm: tuple[float, float]) -> np.ndarray:
    """Return the strongest light (A, 8) of the four walls, whose nearest points lie along x and y."""
    low, high = _reflected(sensors, -axes), _reflected(np.array(arena_cm) - sensors, axes)
    return np.asarray(np.maximum(low, high).max(axis=-1))


def _from_robots(sensors: np.ndarray, axes: np.ndarray, centers: np.ndarray, radius_cm: float) -> np.ndarray:
    """Return the strongest light (A, 8) of the other robots (A, 2), were they white."""
    apart = centers[None, None] - sensors[:, :, None]
    distance = np.maximum(np.linalg.norm(apart, axis=-1), 1e-6)
    cosine = np.einsum("askc,asc->ask", apart, axes) / distance
    light = _reflected(distance - radius_cm, cosine)
    light[np.arange(len(centers)), :, np.arange(len(centers))] = 0.0
    return np.asarray(light.max(axis=-1))


def move_for_a_cycle(
    scenario: Scenario, poses: np.ndarray, wheels: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the poses (A, 3) after a control cycle with wheel speeds (A, 2), and the readings I (A,) at its end.

    A trial of one step, in which every sensor state has the same wheel speeds.
    """
    controllers = np.tile(wheels, (1, scenario.sensor.states))[None]
    trial = simulate(scenario, controllers, poses[None], control_steps=1, seed=seed, threads=1)
    return trial.poses[0, 1], trial.sensors[0, 1]


def move_alone(
    scenario: Scenario, controller: np.ndarray, start: np.ndarray, *, cycles: int, seed: int
) -> Iterator[np.ndarray]:
    """Let robots execute a controller among walls without a PC, as in state R5: they avoid walls, and meet each other.

    Parameters
    ----------
    scenario
        Robots, sensor and walls of the laboratory; their numbers do not matter.
    controller : (2 n,)
        Wheel speeds for each sensor state, fractions of the maximum.
    start : (A, 3)
        x, y (cm), heading (rad).
    cycles, seed
        Number of control cycles; seed of the wheels' and the infrared sensors' noise.

    Yields
    ------
    (A, 3)
        The poses at the start, and after each cycle.

    Source: paper, section 5.4: trials of 600 s with 40 robots.
    """
    arena = float(scenario.arena.width_cm or 0), float(scenario.arena.height_cm or 0)
    rng, table = np.random.default_rng(seed), np.reshape(controller, (-1, 2))
    poses, sight = start, np.zeros(len(start), int)
    yield poses
    for _ in range(cycles):
        proximity = read_infrared(poses, arena, scenario.robot.radius_cm, rng).tolist()
        pairs = zip(table[sight].tolist(), proximity, strict=True)
        wheels = [avoid_walls((left, right), readings) for (left, right), readings in pairs]
        poses, sight = move_for_a_cycle(scenario, poses, np.array(wheels), int(rng.integers(2**63)))
        yield poses
