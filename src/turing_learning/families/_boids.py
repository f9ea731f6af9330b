"""Reynolds' boids."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from turing_learning.errors import brief, refuse

from ..models import Parameter
from ._plane import Particles, offsets


@dataclass(frozen=True, kw_only=True)
class Boids(Particles):
    """Individuals that avoid collisions, match velocities and stay close, in this order of precedence.

    Each urge requests an acceleration. With r the way to another boid within the radius and ``w = 1 / |r|^2``:

    * collision avoidance, ``-separation sum w r / |r|``;
    * velocity matching, alignment (mean of the others' velocities weighted by w, minus the own velocity);
    * flock centering, cohesion (mean of r weighted by w).

    Requests are granted in this order until their lengths sum up to the maximum acceleration; the last one is trimmed.

    Parameters: speed (the largest, cm/s), separation (cm^3/s^2), alignment (1/s), cohesion (1/s^2).

    Parameters
    ----------
    radius_cm
        How far a boid perceives others (cm).
    acceleration_per_s
        Largest acceleration as a multiple of the largest speed (1/s).
    slowest
        Lowest speed as a share of the largest, in [0, 1].

    Source
    ------
    C. W. Reynolds, Computer Graphics 21 (1987) 25, which has no equations: the three behaviors and their order, prioritized
    acceleration allocation, sensitivity by the inverse square of the distance within a radius, and a maximum acceleration
    expressed as a fraction of the maximum speed are his. Left open there, and chosen here: the formulas above, a lowest speed
    so that boids keep moving, the largest speed at the start, the plane instead of space. Boids at the same place do not
    perceive each other. There is no noise: groups differ by their start alone.
    """

    radius_cm: float = 10.0
    acceleration_per_s: float = 2.0
    slowest: float = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_above_zero("radius_cm", "acceleration_per_s")
        if not 0 <= self.slowest <= 1:
            refuse("slowest", "be in [0, 1]", brief(self.slowest))

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Speed, and the strengths of the three urges."""
        return {
            "speed": Parameter(0, 20, unit="cm/s"),
            "separation": Parameter(0, 100, unit="cm^3/s^2"),
            "alignment": Parameter(0, 5, unit="1/s"),
            "cohesion": Parameter(0, 5, unit="1/s^2"),
        }

    def _move(self, parameters: np.ndarray, rngs: Sequence[np.random.Generator]) -> Iterator[np.ndarray]:
        speed, *strengths = parameters
        positions, directions = self._scattered(rngs)
        velocities = speed * directions
        yield positions
        for _ in range(self.moves):
            requests = self._requests(positions, velocities, strengths)
            velocities = velocities + self.interval_s * allocated(requests, self.acceleration_per_s * speed)
            velocities = limited(velocities, self.slowest * speed, speed)
            positions = positions + self.interval_s * velocities
            positions, velocities = self._within(positions, velocities)
            yield positions

    def _requests(
        self, positions: np.ndarray, velocities: np.ndarray, strengths: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the requested accelerations (M, A), the most urgent first."""
        separation, alignment, cohesion = strengths
        way = offsets(positions)
        square = way.real**2 + way.imag**2
        perceived = (square > 0) & (square <= self.radius_cm**2)
        square = np.where(perceived, square, 1.0)
        weight = perceived / square
        away = (weight / np.sqrt(square) * way).sum(axis=-1)
        weights = weight.sum(axis=-1)
        share = weight / np.where(weights > 0, weights, 1.0)[..., None]
        mean_velocity = np.where(weights > 0, (share * velocities[:, None]).sum(axis=-1), velocities)
        return -separation * away, alignment * (mean_velocity - velocities), cohesion * (share * way).sum(axis=-1)


def allocated(requests: Sequence[np.ndarray], most: np.ndarray) -> np.ndarray:
    """Return the sum of requests granted in order until their lengths sum up to `most`, the last one trimmed."""
    granted, left = np.zeros_like(requests[0]), most
    for request in requests:
        length = np.abs(request)
        part = np.minimum(length, left)
        granted = granted + np.divide(part * request, length, out=np.zeros_like(request), where=length > 0)
        left = left - part
    return granted


def limited(velocities: np.ndarray, least: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Return velocities whose length lies between two limits; rest has no direction and stays."""
    length = np.abs(velocities)
    wanted = np.clip(length, least, most)
    return np.divide(wanted * velocities, length, out=np.zeros_like(velocities), where=length > 0)
