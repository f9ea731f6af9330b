"""A persistent random walk in kicks, each followed by a glide."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ..models import Parameter
from ._plane import Particles, draw, rotation

REST_CM_S = 1e-8
"""Speed below which a glide has ended (cm/s): the direction of a smaller displacement would not outlive rounding."""


@dataclass(frozen=True, kw_only=True)
class BurstAndCoast(Particles):
    """Individuals that take no notice of each other: sudden turns with a burst of speed, and straight glides between them.

    At each kick the direction changes by a normal angle and a new speed v is drawn; within a kick, after time
    t, the speed is v exp(-t / glide_time), and the way v glide_time (1 - exp(-t / glide_time)).

    Parameters: speed (mean speed at the start of a kick, cm/s), kick_interval (mean duration of a kick, s),
    glide_time (s), turn (standard deviation of the change of direction at a kick, rad).

    Parameters
    ----------
    variation
        Standard deviation of the durations and of the initial speeds of kicks, as a share of their means.

    Source
    ------
    D. S. Calovi, A. Litchinko, V. Lecheval, U. Lopez, A. Perez Escudero, H. Chate, C. Sire, G. Theraulaz, PLoS Computational
    Biology 14 (2018) e1005933: the motion of a fish that neither walls nor others influence. Durations and speeds come from
    bell-shaped distributions there, as measured in one species; here from gamma distributions, independently. A duration below a
    time step is taken as one time step; walks start at a random moment of a kick.
    """

    variation: float = 0.5

    social: ClassVar[bool] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_above_zero("variation")

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Speed, duration of a kick, time constant of the glide, turn."""
        return {
            "speed": Parameter(0, 40, unit="cm/s"),
            "kick_interval": Parameter(0.1, 2, unit="s"),
            "glide_time": Parameter(0.1, 2, unit="s"),
            "turn": Parameter(0, 1.5, unit="rad"),
        }

    def _move(self, parameters: np.ndarray, rngs: Sequence[np.random.Generator]) -> Iterator[np.ndarray]:
        speed, kick_interval, glide_time, turn = parameters
        glide_time = np.maximum(glide_time, 1e-300)  # no division by zero
        positions, directions = self._scattered(rngs)
        durations, speeds, angles = self._drawn(rngs)
        durations = np.maximum(kick_interval[:, None] * durations, self.interval_s)
        elapsed = durations[:, 0] * draw(rngs, lambda rng: rng.random(self.individuals))
        left = durations[:, 0] - elapsed
        paces = speed * speeds[:, 0] * np.exp(-elapsed / glide_time)
        yield positions
        for step in range(1, self.moves + 1):
            before = np.minimum(left, self.interval_s)
            after = self.interval_s - before
            way, paces = glided(paces, before, glide_time)
            positions, directions = self._within(positions + way * directions, directions)
            kicked = left < self.interval_s
            directions = np.where(kicked, directions * rotation(turn * angles[:, step]), directions)
            paces = np.where(kicked, speed * speeds[:, step], paces)
            left = np.where(kicked, durations[:, step], left - before) - after
            way, paces = glided(paces, after, glide_time)
            positions, directions = self._within(positions + way * directions, directions)
            yield positions

    def _drawn(self, rngs: Sequence[np.random.Generator]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return durations and initial speeds, with a mean of 1, and angles (M, moves + 1, A), enough for a kick in each step."""
        shape = (self.moves + 1, self.individuals)
        form = self.variation**-2
        kicks = draw(rngs, lambda rng: rng.gamma(form, 1 / form, (2, *shape)))
        return kicks[:, 0], kicks[:, 1], draw(rngs, lambda rng: rng.standard_normal(shape))


def glided(paces: np.ndarray, time: np.ndarray, glide_time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the way (cm) of a glide of that duration (s), and the speed at its end, from the speed (cm/s) at its start."""
    moving = np.where(paces < REST_CM_S, 0.0, paces)
    loss = -np.expm1(-time / glide_time)
    return moving * glide_time * loss, moving * (1 - loss)
