"""Individuals that are planted into recordings: each moves otherwise, in a way that has a name."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from turing_learning.config import ConfigurationError
from turing_learning.errors import choice
from turing_learning.trajectories import Trajectories

from ._company import paths_of

SMOOTH_S = 2.0


def plant(recording: Trajectories, individual: int, kind: str, rng: np.random.Generator) -> Trajectories:
    """Return a recording in which one individual, by its place, moves otherwise, by one of `KINDS`; gaps stay where they were."""
    choice("kind", kind, KINDS, noun="kind of planted individual", error=ConfigurationError)
    paths = paths_of(recording)
    moved = KINDS[kind](paths, individual, recording.fps, rng)
    low, high = paths.min(axis=(0, 1)), paths.max(axis=(0, 1))
    size = np.maximum(high - low, 1e-9)
    places = np.mod(moved - low, 2 * size)  # folded back into the space that all move in
    moved = low + np.where(places > size, 2 * size - places, places)
    positions = recording.positions.copy()
    positions[:, individual] = np.where(recording.present[:, individual, None], moved, 0.0)
    return replace(recording, positions=positions)


Kind = Callable[[np.ndarray, int, float, np.random.Generator], np.ndarray]
"""How an individual moves otherwise: from paths (F, A, 2), its place among them, frames per second, and random numbers."""


def _walked(start: np.ndarray, steps: np.ndarray) -> np.ndarray:
    return start + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def _paced(turning: float = 1.0, jitter: float = 0.0, pace: float = 1.0, drift: float = 0.0) -> Kind:
    """Return a kind with its turns and speed scaled, noise in its direction, and a drift to the left, in its own turns' spread."""

    def moved(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
        step = np.diff(paths[:, k], axis=0)
        speed, course = np.hypot(step[:, 0], step[:, 1]), np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
        turn = np.diff(course)
        spread = float(np.std((turn + np.pi) % (2 * np.pi) - np.pi))
        course = course[0] + np.append(0.0, np.cumsum(turning * turn + drift * spread))
        course = course + rng.normal(0.0, jitter * spread, len(course)) if jitter else course
        return _walked(paths[0, k], pace * speed[:, None] * np.stack([np.cos(course), np.sin(course)], axis=1))

    return moved


def _smooth(path: np.ndarray, fps: float) -> np.ndarray:
    width = min(int(SMOOTH_S * fps) | 1, (len(path) - 1) | 1)
    padded = np.pad(path, ((width // 2, width // 2), (0, 0)), mode="edge")
    return np.stack([np.convolve(column, np.ones(width) / width, "valid") for column in padded.T], axis=1)


def _near(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    way = np.delete(paths, k, axis=1) - paths[:, k, None]
    nearest = np.hypot(way[..., 0], way[..., 1]).argmin(axis=1)
    return paths[:, k] + 0.7 * _smooth(way[np.arange(len(way)), nearest], fps)


def _far(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    away = _smooth(paths[:, k] - np.delete(paths, k, axis=1).mean(axis=1), fps)
    length = np.maximum(np.hypot(away[:, :1], away[:, 1:]), 1e-9)
    return paths[:, k] + 0.3 * float(np.hypot(*np.ptp(paths, axis=(0, 1)))) * away / length


def _behind(paths: np.ndarray, k: int, frames: float, rng: np.random.Generator) -> np.ndarray:
    """Return where somebody else was so many frames ago."""
    leader = rng.integers(paths.shape[1] - 1)
    return np.roll(np.delete(paths, k, axis=1)[:, leader], int(frames), axis=0)


def _always(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    followed = _behind(paths, k, 0.5 * fps, rng)
    return _smooth(followed, fps / 4) + rng.normal(0.0, 0.01, followed.shape)


def _stopping(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    length = max(1, int(2 * fps))
    rests = np.repeat(rng.random(len(paths) // length + 1) < 0.3, length)[: len(paths) - 1]
    return _walked(paths[0, k], np.where(rests[:, None], 0.02, 1.0) * np.diff(paths[:, k], axis=0))


KINDS: dict[str, Kind] = {
    "too jittery": _paced(jitter=1.0),
    "too slow": _paced(pace=0.5),
    "too near": _near,
    "follows nobody": lambda paths, k, fps, rng: np.roll(paths[:, k], len(paths) // 2, axis=0),
    "too straight": _paced(turning=0.25),
    "too fast": _paced(pace=2.0),
    "too far": _far,
    "follows always": _always,
    "delayed copy": lambda paths, k, fps, rng: _behind(paths, k, 3 * fps, rng),
    "circling": _paced(drift=0.3),
    "stopping": _stopping,
}
"""Kinds of planted individuals, all of which `detect` plants itself; its settings were tuned on the first four."""

SOCIAL = ("too near", "follows nobody", "too far", "follows always", "delayed copy")
"""Kinds that need others."""
