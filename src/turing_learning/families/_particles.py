"""Families of individuals that are points in the plane."""

import math
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from turing_learning.errors import brief, refuse

from ._family import Family
from ._plane import draw, reflected, rotation


@dataclass(frozen=True, kw_only=True)
class Particles(Family):
    """A family of points in the plane, which yields its positions step by step.

    Positions and directions are complex numbers x + iy, in arrays (M, A).

    Parameters
    ----------
    tank_cm
        Width and height of a tank (cm), anywhere in which individuals start, and whose walls reflect them as light; None for
        the unbounded plane. Individuals do not see the walls.

    Raises
    ------
    ValueError
        If a setting breaks its rule.
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
