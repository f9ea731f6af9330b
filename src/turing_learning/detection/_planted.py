"""Individuals that are planted into recordings: each moves otherwise, in a way that has a name."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from turing_learning.config import ConfigurationError
from turing_learning.errors import choice
from turing_learning.trajectories import Trajectories, wrap

from ._company import paths_of

SMOOTHING_S = 2.0
"""Duration (s) over which a made-up path is averaged, so that no jump gives it away."""


def plant(
    recording: Trajectories, individual: int, kind: str, rng: np.random.Generator
) -> Trajectories:
    """Return a recording in which an individual moves otherwise, by one of `PLANTED_KINDS`.

    Gaps stay where they were.
    """
    choice("kind", kind, PLANTED_KINDS, noun="kind of planted individual", error=ConfigurationError)
    paths = paths_of(recording)
    path = PLANTED_KINDS[kind](paths, individual, recording.fps, rng)
    positions = recording.positions.copy()
    inside = _folded(path, paths.min(axis=(0, 1)), paths.max(axis=(0, 1)))
    positions[:, individual] = np.where(recording.present[:, individual, None], inside, 0.0)
    return replace(recording, positions=positions)


def _folded(path: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return a path (F, 2) that is reflected at the borders of the space that all move in."""
    size = np.maximum(high - low, 1e-9)
    distances = np.mod(path - low, 2 * size)
    return low + np.where(distances > size, 2 * size - distances, distances)


Planting = Callable[[np.ndarray, int, float, np.random.Generator], np.ndarray]
"""From paths (F, A, 2), an individual's place among them, frames per second, and random numbers to its path (F, 2)."""


def _walked(start: np.ndarray, steps: np.ndarray) -> np.ndarray:
    return start + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def _paced(
    turning: float = 1.0, jitter: float = 0.0, pace: float = 1.0, drift: float = 0.0
) -> Planting:
    """Scale turns and speed, add noise and a drift to the direction, in units of its turns."""

    def path(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
        steps = np.diff(paths[:, k], axis=0)
        speed = np.hypot(steps[:, 0], steps[:, 1])
        course = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        turns = np.diff(course)
        spread = float(np.std(wrap(turns)))
        course = course[0] + np.append(0.0, np.cumsum(turning * turns + drift * spread))
        if jitter:
            course = course + rng.normal(0.0, jitter * spread, len(course))
        directions = np.stack([np.cos(course), np.sin(course)], axis=1)
        return _walked(paths[0, k], pace * speed[:, None] * directions)

    return path


def _smooth(path: np.ndarray, frames: float) -> np.ndarray:
    width = min(int(frames) | 1, (len(path) - 1) | 1)
    padded = np.pad(path, ((width // 2, width // 2), (0, 0)), mode="edge")
    window = np.ones(width) / width
    return np.stack([np.convolve(column, window, "valid") for column in padded.T], axis=1)


def _near(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    to_others = np.delete(paths, k, axis=1) - paths[:, k, None]
    nearest = np.hypot(to_others[..., 0], to_others[..., 1]).argmin(axis=1)
    return paths[:, k] + 0.7 * _smooth(to_others[np.arange(len(paths)), nearest], SMOOTHING_S * fps)


def _far(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    away = _smooth(paths[:, k] - np.delete(paths, k, axis=1).mean(axis=1), SMOOTHING_S * fps)
    length = np.maximum(np.hypot(away[:, :1], away[:, 1:]), 1e-9)
    return paths[:, k] + 0.3 * float(np.hypot(*np.ptp(paths, axis=(0, 1)))) * away / length


def _follows_always(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    followed = _path_behind(paths, k, 0.5 * fps, rng)
    return _smooth(followed, SMOOTHING_S / 4 * fps) + rng.normal(0.0, 0.01, followed.shape)


def _path_behind(paths: np.ndarray, k: int, frames: float, rng: np.random.Generator) -> np.ndarray:
    """Return where a random other individual was so many frames ago."""
    leader = rng.integers(paths.shape[1] - 1)
    return np.roll(np.delete(paths, k, axis=1)[:, leader], int(frames), axis=0)


def _stopping(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    length = max(1, int(2 * fps))
    rests = np.repeat(rng.random(len(paths) // length + 1) < 0.3, length)[: len(paths) - 1]
    return _walked(paths[0, k], np.where(rests[:, None], 0.02, 1.0) * np.diff(paths[:, k], axis=0))


PLANTED_KINDS: dict[str, Planting] = {
    "too jittery": _paced(jitter=1.0),
    "too slow": _paced(pace=0.5),
    "too near": _near,
    "follows nobody": lambda paths, k, fps, rng: np.roll(paths[:, k], len(paths) // 2, axis=0),
    "too straight": _paced(turning=0.25),
    "too fast": _paced(pace=2.0),
    "too far": _far,
    "follows always": _follows_always,
    "delayed copy": lambda paths, k, fps, rng: _path_behind(paths, k, 3 * fps, rng),
    "circling": _paced(drift=0.3),
    "stopping": _stopping,
}
"""Kinds of planted individuals, all of which `detect` plants itself; its settings were tuned on the first four."""

SOCIAL_KINDS = ("too near", "follows nobody", "too far", "follows always", "delayed copy")
"""Kinds that need others."""
