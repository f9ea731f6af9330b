"""Self-propelled particles that align with those around them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from turing_learning.errors import brief, refuse

from ..models import Parameter
from ._plane import Particles, draw, offsets, rotation, total, unit


@dataclass(frozen=True, kw_only=True)
class Vicsek(Particles):
    """Particles of constant speed that take the mean direction of all within a radius, themselves included, and noise.

    x(t + 1) = x(t) + v(t) dt, and the angle of v(t + 1) is the mean angle within the radius plus noise drawn uniformly from
    [-noise / 2, noise / 2]. Parameters: speed (cm/s), noise (rad per step, up to 2 pi), radius (cm).

    Parameters
    ----------
    period_cm
        Side of the square (cm) that is repeated in both directions, as in the source; None for the unbounded plane. Positions
        run on over its border, so that speeds are right; neighbor signals need the unbounded plane.

    Source
    ------
    T. Vicsek, A. Czirok, E. Ben-Jacob, I. Cohen, O. Shochet, Physical Review Letters 75 (1995) 1226, equations 1 and 2. It has no
    units. It leaves open what a particle does when the mean has no direction: here it keeps its own.
    """

    period_cm: float | None = 20.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.period_cm is None:
            return
        self._check_above_zero("period_cm")
        if self.tank_cm is not None:
            refuse("tank_cm", "be None in a periodic square", brief(self.tank_cm), "Set period_cm=None.")
        if any(name.startswith("neighbor") for name in self.signals):
            refuse("signals", "be speed and turn in a periodic square", brief(self.signals), "Set period_cm=None.")

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Speed, noise, radius."""
        return {
            "speed": Parameter(0, 20, unit="cm/s"),
            "noise": Parameter(0, 2 * np.pi, unit="rad"),
            "radius": Parameter(0, 10, unit="cm"),
        }

    def _move(self, parameters: np.ndarray, rngs: Sequence[np.random.Generator]) -> Iterator[np.ndarray]:
        speed, noise, radius = parameters
        positions, directions = self._scattered(rngs)
        shaken = draw(rngs, lambda rng: rng.uniform(-0.5, 0.5, (self.moves, self.individuals)))
        yield positions
        for step in range(self.moves):
            near = np.abs(offsets(positions, self.period_cm)) <= radius[..., None]
            mean = total(near, directions[:, None])
            positions = positions + speed * self.interval_s * directions
            directions = unit(mean, directions) * rotation(noise * shaken[:, step])
            positions, directions = self._within(positions, directions)
            yield positions
