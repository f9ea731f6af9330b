"""Animals with zones of repulsion, orientation and attraction."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from turing_learning.errors import brief, refuse

from ..models import Parameter
from ._plane import Particles, draw, offsets, rotation, total, unit

ROUNDING = 1e-12
"""By which the cosine of an angle of view may be off."""


@dataclass(frozen=True, kw_only=True)
class Couzin(Particles):
    """Individuals of constant speed that turn away from the nearest, along with the nearer and toward the farther others.

    With d the distance of another individual, the zones are repulsion, d < r_r; orientation, r_r <= d < r_o; attraction,
    r_o <= d <= r_a. Whoever has others in the zone of repulsion wants to go away from them, ``-sum r_ij / |r_ij|``. Else the wish
    is the sum of the directions of those in the zone of orientation and of the unit vectors to those in the zone of attraction,
    both visible ones only. Without a wish an individual keeps its direction. The wish is rotated by a normal angle, and the
    individual turns toward it by at most turning_rate times the time step.

    Parameters: speed (cm/s), turning_rate (rad/s), repulsion_radius r_r (cm), orientation_width r_o - r_r (cm),
    attraction_width r_a - r_o (cm), noise (standard deviation of the angle, rad per step).

    Parameters
    ----------
    field_of_view_rad
        Angle (rad) in which others are seen, symmetric to the direction of motion; it does not limit repulsion.

    Source
    ------
    I. D. Couzin, J. Krause, R. James, G. D. Ruxton, N. R. Franks, Journal of Theoretical Biology 218 (2002) 1, equations 1 to 3 and
    table 1, where a step is 0.1 s; here in the plane instead of in space. Left open there, and chosen here: the new
    direction is taken before the step in space; nobody counts as one's own neighbor; who is at exactly the same place repels
    nobody; a group starts in a square.
    """

    field_of_view_rad: float = 1.5 * math.pi

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0 < self.field_of_view_rad <= 2 * math.pi:
            refuse("field_of_view_rad", "be above 0 and at most 2 pi", brief(self.field_of_view_rad))

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Speed, turning rate, one radius and two widths of zones, noise."""
        return {
            "speed": Parameter(0, 20, unit="cm/s"),
            "turning_rate": Parameter(0, 6, unit="rad/s"),
            "repulsion_radius": Parameter(0, 5, unit="cm"),
            "orientation_width": Parameter(0, 15, unit="cm"),
            "attraction_width": Parameter(0, 15, unit="cm"),
            "noise": Parameter(0, 0.5, unit="rad"),
        }

    def _move(self, parameters: np.ndarray, rngs: Sequence[np.random.Generator]) -> Iterator[np.ndarray]:
        speed, turning_rate, *zones, noise = parameters
        borders = np.cumsum(zones, axis=0)
        most = turning_rate * self.interval_s
        positions, directions = self._scattered(rngs)
        shaken = draw(rngs, lambda rng: rng.standard_normal((self.moves, self.individuals)))
        yield positions
        for step in range(self.moves):
            wish = unit(self._wish(positions, directions, borders), directions) * rotation(noise * shaken[:, step])
            angle = np.angle(wish * directions.conj())
            directions = directions * rotation(np.clip(angle, -most, most))
            positions = positions + speed * self.interval_s * directions
            positions, directions = self._within(positions, directions)
            yield positions

    def _wish(self, positions: np.ndarray, directions: np.ndarray, borders: np.ndarray) -> np.ndarray:
        """Return where individuals want to go (M, A), zero without a wish; borders (3, M, 1) of the zones."""
        repulsion, orientation, attraction = borders[..., None]
        way = offsets(positions)
        distance = np.abs(way)
        toward = np.divide(way, distance, out=np.zeros_like(way), where=distance > 0)
        others = ~np.eye(self.individuals, dtype=bool)
        ahead = (toward * directions.conj()[..., None]).real
        seen = others & (ahead >= math.cos(self.field_of_view_rad / 2) - ROUNDING)
        close = others & (distance < repulsion)
        middle = seen & (distance >= repulsion) & (distance < orientation)
        far = seen & (distance >= orientation) & (distance <= attraction)
        social = total(middle, directions[:, None]) + total(far, toward)
        return np.where(close.any(axis=-1), -total(close, toward), social)
