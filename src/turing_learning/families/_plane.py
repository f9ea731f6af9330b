"""The plane as complex numbers x + iy: places of individuals relative to each other, and directions."""

import math
from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from turing_learning.errors import brief, refuse

from ._family import Family


def offsets(positions: np.ndarray, period: float | None = None) -> np.ndarray:
    """Return where others are, [m, i, j] being the way from individual i to j of model m.

    Parameters
    ----------
    positions : (M, A) complex
        Places (cm).
    period
        Side of the square that is repeated in both directions (cm), and the way is that to the nearest image;
        None if the plane is unbounded.

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


@dataclass(frozen=True, kw_only=True)
class Particles(Family):
    """A family of points in the plane, which yields its positions step by step.

    Positions and directions are complex numbers x + iy, in arrays (M, A).

    Parameters
    ----------
    tank_cm
        Width and height of a tank (cm), anywhere in which individuals start, and whose walls reflect them as
        light; None for the unbounded plane. Individuals do not see the walls.
    """

    tank_cm: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.tank_cm is None:
            return
        if np.shape(self.tank_cm) != (2,) or not all(math.isfinite(side) and side > 0 for side in self.tank_cm):
            refuse("tank_cm", "be two finite numbers above 0, or None", brief(self.tank_cm))

    @abstractmethod
    def _move(self, parameters: np.ndarray, rngs: Sequence[np.random.Generator]) -> Iterator[np.ndarray]:
        """Yield the positions (M, A) before the first of `moves` steps and after each.

        Parameters
        ----------
        parameters : (P, M, 1)
            The columns, each ready to be multiplied with an array (M, A).
        rngs
            Each model's own generator.
        """

    def _paths(self, parameters: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, None]:
        frames = self._move(parameters.T[:, :, None], rng.spawn(len(parameters)))
        seen = np.stack(list(islice(frames, self.settling_steps, None)), axis=1)
        return seen.view(np.float64).reshape(*seen.shape, 2), None

    def _scattered(self, rngs: Sequence[np.random.Generator]) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and directions (M, A) at the start."""
        width, height = self.tank_cm or (self.start_side_cm, self.start_side_cm)
        places = draw(rngs, lambda rng: rng.random((3, self.individuals)))
        return width * places[:, 0] + 1j * height * places[:, 1], rotation(2 * math.pi * places[:, 2])

    def _within(self, positions: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and directions or velocities (M, A) after reflection at the walls, if there are some."""
        return (positions, vectors) if self.tank_cm is None else reflected(positions, vectors, self.tank_cm)
