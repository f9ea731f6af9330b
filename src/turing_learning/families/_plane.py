"""The plane as complex numbers x + iy: places of individuals relative to each other, and directions."""

from collections.abc import Callable, Sequence

import numpy as np


def offsets(positions: np.ndarray, period: float | None = None) -> np.ndarray:
    """Return where others are, [m, i, j] being the way from individual i to j of model m.

    Parameters
    ----------
    positions : (M, A) complex
        Places (cm).
    period
        Side of the square that is repeated in both directions (cm), and the way is that to the nearest image; None if
        the plane is unbounded.

    Returns
    -------
    (M, A, A) complex
        In cm.
    """
    way = positions[:, None, :] - positions[:, :, None]
    return way if period is None else way - period * np.round(way / period)


def unit(vectors: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    """Return vectors of length 1, or what stands in `otherwise` where a vector has no direction."""
    length = np.abs(vectors)
    return np.divide(vectors, length, out=otherwise.copy(), where=length > 0)


def rotation(angles: np.ndarray) -> np.ndarray:
    """Return the complex numbers that turn by these angles (rad)."""
    return np.exp(1j * angles)


def total(which: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return for each individual the sum (M, A) of vectors over the others for which `which` (M, A, A) holds."""
    return np.where(which, vectors, 0).sum(axis=-1)


def reflected(positions: np.ndarray, vectors: np.ndarray, size: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (M, A) folded back into a tank, and vectors mirrored with them, as light at its walls.

    Parameters
    ----------
    positions, vectors : (M, A) complex
        Places (cm), and directions or velocities.
    size
        Width and height of the tank (cm), one corner of which is the origin.
    """
    x, along = _folded(positions.real, vectors.real, size[0])
    y, across = _folded(positions.imag, vectors.imag, size[1])
    return x + 1j * y, along + 1j * across


def _folded(places: np.ndarray, vectors: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray]:
    tanks, rest = np.divmod(places, length)
    mirrored = tanks % 2 == 1
    return np.where(mirrored, length - rest, rest), np.where(mirrored, -vectors, vectors)


def draw(rngs: Sequence[np.random.Generator], sample: Callable[[np.random.Generator], np.ndarray]) -> np.ndarray:
    """Return random numbers (M, ...), those of each model from its own generator."""
    return np.stack([sample(rng) for rng in rngs])
