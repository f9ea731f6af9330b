"""What infrared sensors of emulated robots read: light that comes back from walls and other robots."""

import numpy as np

from ._firmware import SENSOR_ANGLES

BRIGHTEST, DARK, HALF_CM = 3800.0, 60.0, 0.75
"""Reading with a white wall at the sensor, above that with nothing; that without anything; where it is half the brightest (cm)."""
SKIRT = 0.06
"""Share of a white wall's light that a black skirt gives back."""
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
    light = np.maximum(
        _from_walls(sensors, axes, arena_cm), SKIRT * _from_robots(sensors, axes, poses[:, :2], radius_cm)
    )
    return np.clip(np.rint(DARK + BRIGHTEST * light + rng.normal(0, NOISE, light.shape)), 0, LARGEST_READING).astype(
        int
    )


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
