"""The families: alignment (Vicsek), zones (Couzin), forces (boids), walks in kicks and glides, and the paper's robots."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from turing_learning.errors import brief, require

from ..models import FULL_VIEW, Parameter
from ..swarm import AGGREGATION, Scenario
from ._family import (
    NEIGHBOR,
    BeginsAsRecorded,
    Family,
    Particles,
    draw,
    offsets,
    rotation,
    total,
    unit,
)

ROUNDING = 1e-12
"""By which the cosine of an angle of view may be off."""

REST_CM_S = 1e-8
"""Speed below which a glide has ended (cm/s): the direction of a smaller displacement would not outlive rounding."""


@dataclass(frozen=True, kw_only=True)
class Vicsek(Particles):
    """Particles of constant speed that take the mean direction of all within a radius, themselves included, and noise.

    x(t + 1) = x(t) + v(t) dt, and the angle of v(t + 1) is the mean angle within the radius plus noise drawn
    uniformly from [-noise / 2, noise / 2]. Parameters: speed (cm/s), noise (rad per step, up to 2 pi), radius
    (cm).

    Source
    ------
    T. Vicsek, A. Czirok, E. Ben-Jacob, I. Cohen, O. Shochet, Physical Review Letters 75 (1995) 1226, equations 1 and 2. It has no
    units. It leaves open what a particle does when the mean has no direction: here it keeps its own.
    """

    #: Side of the square (cm) that is repeated in both directions, as in the source; None for the unbounded
    #: plane. Positions run on over its border, so that speeds are right; neighbor signals need the unbounded plane
    period_cm: float | None = 20.0

    @classmethod
    def can_begin_as_recorded(cls, **settings: Any) -> bool:
        """Whether there is no periodic square, in which nobody was recorded."""
        return settings.get("period_cm", cls.period_cm) is None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.period_cm is not None:
            self._check_above_zero("period_cm")
            remedy = "Set period_cm=None."
            rule = "be None in a periodic square"
            require(self.tank_cm is None, "tank_cm", rule, brief(self.tank_cm), remedy)
            rule = "be speed and turn in a periodic square"
            social = NEIGHBOR & set(self.signals)
            require(not social, "signals", rule, brief(self.signals), remedy)

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Speed, noise, radius."""
        return {
            "speed": Parameter(0, 20, unit="cm/s"),
            "noise": Parameter(0, 2 * np.pi, unit="rad"),
            "radius": Parameter(0, 10, unit="cm"),
        }

    def _move(
        self, parameters: np.ndarray, rngs: Sequence[np.random.Generator]
    ) -> Iterator[np.ndarray]:
        speed, noise, radius = parameters
        positions, directions = self._scattered(rngs)
        shaken = draw(rngs, lambda rng: rng.uniform(-0.5, 0.5, (self.moves, self.individuals)))
        yield positions
        for step in range(self.moves):
            neighbors = np.abs(offsets(positions, self.period_cm)) <= radius[..., None]
            mean = total(neighbors, directions[:, None])
            positions = positions + speed * self.interval_s * directions
            directions = unit(mean, directions) * rotation(noise * shaken[:, step])
            positions, directions = self._within(positions, directions)
            yield positions


@dataclass(frozen=True, kw_only=True)
class Couzin(Particles):
    """Individuals of constant speed that turn away from the nearest, along with the nearer and toward the farther others.

    With d the distance of another individual, the zones are repulsion, d < r_r; orientation, r_r <= d < r_o;
    attraction, r_o <= d <= r_a. Whoever has others in the zone of repulsion wants to go away from them, ``-sum
    r_ij / |r_ij|``. Else the wish is the sum of the directions of those in the zone of orientation and of the
    unit vectors to those in the zone of attraction, both visible ones only. Without a wish an individual keeps
    its direction. The wish is rotated by a normal angle, and the individual turns toward it by at most
    turning_rate times the time step.

    Parameters: speed (cm/s), turning_rate (rad/s), repulsion_radius r_r (cm), orientation_width r_o - r_r (cm),
    attraction_width r_a - r_o (cm), noise (standard deviation of the angle, rad per step).

    Source
    ------
    I. D. Couzin, J. Krause, R. James, G. D. Ruxton, N. R. Franks, Journal of Theoretical Biology 218 (2002) 1, equations 1 to 3 and
    table 1, where a step is 0.1 s; here in the plane instead of in space. Left open there, and chosen here: the new
    direction is taken before the step in space; nobody counts as one's own neighbor; who is at exactly the same place repels
    nobody; a group starts in a square.
    """

    #: Angle (rad) in which others are seen, symmetric to the direction of motion; it does not limit repulsion
    field_of_view_rad: float = 1.5 * math.pi

    def __post_init__(self) -> None:
        super().__post_init__()
        fits = 0 < self.field_of_view_rad <= 2 * math.pi
        require(
            fits, "field_of_view_rad", "be above 0 and at most 2 pi", brief(self.field_of_view_rad)
        )

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

    def _move(
        self, parameters: np.ndarray, rngs: Sequence[np.random.Generator]
    ) -> Iterator[np.ndarray]:
        speed, turning_rate, *zones, noise = parameters
        borders = np.cumsum(zones, axis=0)
        most_turn = turning_rate * self.interval_s
        positions, directions = self._scattered(rngs)
        shaken = draw(rngs, lambda rng: rng.standard_normal((self.moves, self.individuals)))
        yield positions
        for step in range(self.moves):
            wish = unit(self._wish(positions, directions, borders), directions) * rotation(
                noise * shaken[:, step]
            )
            angle = np.angle(wish * directions.conj())
            directions = directions * rotation(np.clip(angle, -most_turn, most_turn))
            positions = positions + speed * self.interval_s * directions
            positions, directions = self._within(positions, directions)
            yield positions

    def _wish(
        self, positions: np.ndarray, directions: np.ndarray, borders: np.ndarray
    ) -> np.ndarray:
        """Return where individuals want to go (M, A), zero without a wish; borders (3, M, 1) of the zones."""
        repulsion, orientation, attraction = borders[..., None]
        displacements = offsets(positions)
        distance = np.abs(displacements)
        toward = np.divide(
            displacements, distance, out=np.zeros_like(displacements), where=distance > 0
        )
        distinct = ~np.eye(self.individuals, dtype=bool)
        ahead = (toward * directions.conj()[..., None]).real
        visible = distinct & (ahead >= math.cos(self.field_of_view_rad / 2) - ROUNDING)
        close = distinct & (distance < repulsion)
        middle = visible & (distance >= repulsion) & (distance < orientation)
        attracting = visible & (distance >= orientation) & (distance <= attraction)
        social = total(middle, directions[:, None]) + total(attracting, toward)
        return np.where(close.any(axis=-1), -total(close, toward), social)


@dataclass(frozen=True, kw_only=True)
class Boids(Particles):
    """Individuals that avoid collisions, match velocities and stay close, in this order of precedence.

    Each urge requests an acceleration. With r the way to another boid within the radius and ``w = 1 / |r|^2``:

    * collision avoidance, ``-separation sum w r / |r|``;
    * velocity matching, alignment (mean of the others' velocities weighted by w, minus the own velocity);
    * flock centering, cohesion (mean of r weighted by w).

    Requests are granted in this order until their lengths sum up to the maximum acceleration; the last one is
    trimmed.

    Parameters: speed (the largest, cm/s), separation (cm^3/s^2), alignment (1/s), cohesion (1/s^2).

    Source
    ------
    C. W. Reynolds, Computer Graphics 21 (1987) 25, which has no equations: the three behaviors and their order, prioritized
    acceleration allocation, sensitivity by the inverse square of the distance within a radius, and a maximum acceleration
    expressed as a fraction of the maximum speed are his. Left open there, and chosen here: the formulas above, a lowest speed
    so that boids keep moving, the largest speed at the start, the plane instead of space. Boids at the same place do not
    perceive each other. There is no noise: groups differ by their start alone.
    """

    radius_cm: float = 10.0  #: How far a boid perceives others (cm)
    acceleration_per_s: float = (
        2.0  #: Largest acceleration as a multiple of the largest speed (1/s)
    )
    slowest: float = 0.5  #: Lowest speed as a share of the largest, in [0, 1]

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_above_zero("radius_cm", "acceleration_per_s")
        require(0 <= self.slowest <= 1, "slowest", "be in [0, 1]", brief(self.slowest))

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Speed, and the strengths of the three urges."""
        return {
            "speed": Parameter(0, 20, unit="cm/s"),
            "separation": Parameter(0, 100, unit="cm^3/s^2"),
            "alignment": Parameter(0, 5, unit="1/s"),
            "cohesion": Parameter(0, 5, unit="1/s^2"),
        }

    def _move(
        self, parameters: np.ndarray, rngs: Sequence[np.random.Generator]
    ) -> Iterator[np.ndarray]:
        speed, *strengths = parameters
        positions, directions = self._scattered(rngs)
        velocities = speed * directions
        yield positions
        for _ in range(self.moves):
            requests = self._requests(positions, velocities, strengths)
            velocities = velocities + self.interval_s * allocated(
                requests, self.acceleration_per_s * speed
            )
            velocities = limited(velocities, self.slowest * speed, speed)
            positions = positions + self.interval_s * velocities
            positions, velocities = self._within(positions, velocities)
            yield positions

    def _requests(
        self, positions: np.ndarray, velocities: np.ndarray, strengths: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the requested accelerations (M, A), the most urgent first."""
        separation, alignment, cohesion = strengths
        displacements = offsets(positions)
        square = displacements.real**2 + displacements.imag**2
        perceived = (square > 0) & (square <= self.radius_cm**2)
        square = np.where(perceived, square, 1.0)
        weight = perceived / square
        away = (weight / np.sqrt(square) * displacements).sum(axis=-1)
        weights = weight.sum(axis=-1)
        share = weight / np.where(weights > 0, weights, 1.0)[..., None]
        mean_velocity = np.where(
            weights > 0, (share * velocities[:, None]).sum(axis=-1), velocities
        )
        return (
            -separation * away,
            alignment * (mean_velocity - velocities),
            cohesion * (share * displacements).sum(axis=-1),
        )


def allocated(requests: Sequence[np.ndarray], budget: np.ndarray) -> np.ndarray:
    """Return the sum of requests granted in order until their lengths sum up to `budget`, the last one trimmed."""
    granted = np.zeros_like(requests[0])
    remaining = budget
    for request in requests:
        length = np.abs(request)
        granted_length = np.minimum(length, remaining)
        granted = granted + np.divide(
            granted_length * request, length, out=np.zeros_like(request), where=length > 0
        )
        remaining = remaining - granted_length
    return granted


def limited(velocities: np.ndarray, slowest: np.ndarray, fastest: np.ndarray) -> np.ndarray:
    """Return velocities whose length lies between two limits; rest has no direction and stays."""
    length = np.abs(velocities)
    wanted = np.clip(length, slowest, fastest)
    return np.divide(wanted * velocities, length, out=np.zeros_like(velocities), where=length > 0)


@dataclass(frozen=True, kw_only=True)
class BurstAndCoast(Particles):
    """Individuals that take no notice of each other: sudden turns with a burst of speed, and straight glides between them.

    At each kick the direction changes by a normal angle and a new speed v is drawn; within a kick, after time
    t, the speed is v exp(-t / glide_time), and the way v glide_time (1 - exp(-t / glide_time)).

    Parameters: speed (mean speed at the start of a kick, cm/s), kick_interval (mean duration of a kick, s),
    glide_time (s), turn (standard deviation of the change of direction at a kick, rad).

    Source
    ------
    D. S. Calovi, A. Litchinko, V. Lecheval, U. Lopez, A. Perez Escudero, H. Chate, C. Sire, G. Theraulaz, PLoS Computational
    Biology 14 (2018) e1005933: the motion of a fish that neither walls nor others influence. Durations and speeds come from
    bell-shaped distributions there, as measured in one species; here from gamma distributions, independently. A duration below a
    time step is taken as one time step; walks start at a random moment of a kick.
    """

    #: Standard deviation of the durations and of the initial speeds of kicks, as a share of their means
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

    def _move(
        self, parameters: np.ndarray, rngs: Sequence[np.random.Generator]
    ) -> Iterator[np.ndarray]:
        speed, kick_interval, glide_time, turn = parameters
        # no division by zero
        glide_time = np.maximum(glide_time, 1e-300)
        positions, directions = self._scattered(rngs)
        durations, speeds, angles = self._drawn(rngs)
        durations = np.maximum(kick_interval[:, None] * durations, self.interval_s)
        elapsed = durations[:, 0] * draw(rngs, lambda rng: rng.random(self.individuals))
        remaining = durations[:, 0] - elapsed
        paces = speed * speeds[:, 0] * np.exp(-elapsed / glide_time)
        yield positions
        for step in range(1, self.moves + 1):
            before = np.minimum(remaining, self.interval_s)
            after = self.interval_s - before
            traveled, paces = glided(paces, before, glide_time)
            positions, directions = self._within(positions + traveled * directions, directions)
            kicked = remaining < self.interval_s
            directions = np.where(kicked, directions * rotation(turn * angles[:, step]), directions)
            paces = np.where(kicked, speed * speeds[:, step], paces)
            remaining = np.where(kicked, durations[:, step], remaining - before) - after
            traveled, paces = glided(paces, after, glide_time)
            positions, directions = self._within(positions + traveled * directions, directions)
            yield positions

    def _drawn(
        self, rngs: Sequence[np.random.Generator]
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return durations and initial speeds, with a mean of 1, and angles (M, moves + 1, A), enough for a kick in each step."""
        shape = (self.moves + 1, self.individuals)
        form = self.variation**-2
        kicks = draw(rngs, lambda rng: rng.gamma(form, 1 / form, (2, *shape)))
        return kicks[:, 0], kicks[:, 1], draw(rngs, lambda rng: rng.standard_normal(shape))


def glided(
    paces: np.ndarray, time: np.ndarray, glide_time: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the way (cm) of a glide of that duration (s), and the speed at its end, from the speed (cm/s) at its start."""
    moving = np.where(paces < REST_CM_S, 0.0, paces)
    loss = -np.expm1(-time / glide_time)
    return moving * glide_time * loss, moving * (1 - loss)


@dataclass(frozen=True, kw_only=True)
class Robots(BeginsAsRecorded):
    """Robots with wheels and a sensor that sees what is ahead; every robot of a group executes the model.

    Parameters: wheel speeds for each sensor state, as fractions of the maximum (vl0, vr0, vl1, vr1, ...); the
    field of view of the sensor as well, theta (rad), if that is the scenario's representation of models. Speeds
    are signed, as the robots' headings are known. Source: paper, sections 3.2 and 4.1; docs/physics.md.
    """

    individuals: int = 11
    start_side_cm: float = 331.66
    #: Robots, objects, sensor and walls; what it says of the agents' controller and of numbers of robots does
    #: not matter. Where there are walls, robots and objects start anywhere within them instead of in the square
    scenario: Scenario = AGGREGATION

    least: ClassVar[float] = -math.inf
    headings: ClassVar[bool] = True

    @classmethod
    def can_begin_as_recorded(cls, **settings: Any) -> bool:
        """Whether there are robots alone: a recording says neither where walls were nor objects."""
        scenario = settings.get("scenario", cls.scenario)
        alone = scenario.objects.count == 0 and not scenario.items
        return alone and not scenario.arena.bounded

    def __post_init__(self) -> None:
        super().__post_init__()
        crowd = self.scenario.start(self.individuals, self._side).crowd
        remedy = "Take fewer, or give them more room: `start_side_cm`, or within the walls of the scenario."
        got = f"{self.individuals}, and {crowd}"
        require(not crowd, "individuals", "have room where they start", got, remedy)

    @property
    def _side(self) -> float | None:
        if self.scenario.arena.bounded:
            return None
        return self.start_side_cm

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Left and right wheel speed for each sensor state; field of view, where it is a parameter."""
        speed = Parameter(-2, 2, initial=(-1, 1))
        angle = Parameter(0, FULL_VIEW, unit="rad")
        pairs = zip(self.scenario.parameter_names, self.scenario.model.parameter_units, strict=True)
        return {name: angle if unit else speed for name, unit in pairs}

    def _paths(
        self, parameters: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        # needs the compiled kernels
        from ..swarm import execution_of, initial_poses, simulate

        seed = int(rng.integers(2**63))
        duration_s = self.moves * self.interval_s
        trial = replace(
            self.scenario.trial, control_interval_s=self.interval_s, duration_s=duration_s
        )
        scenario = replace(self.scenario, trial=trial)
        starts = initial_poses(
            scenario, len(parameters), rng, robots=self.individuals, side_cm=self._side
        )
        if self.starts is not None:
            uniforms = rng.spawn(1)[0].random((len(parameters), 3, self.individuals))
            starts[..., :2], starts[..., 2] = self.starts.drawn(uniforms)
        executed = np.repeat(np.arange(len(parameters))[:, None], self.individuals, axis=1)
        robots = execution_of(scenario, scenario.model.behavior(parameters), executed)
        how: dict[str, Any] = {
            "control_steps": self.moves,
            "seed": seed,
            "fields_of_view": robots.fields_of_view,
        }
        poses = simulate(scenario, robots.controllers, starts, **how).poses
        settled = poses[:, self.settling_steps :, : self.individuals]
        return settled[..., :2], settled[..., 2]


FAMILIES: dict[str, type[Family]] = {
    "vicsek": Vicsek,
    "couzin": Couzin,
    "boids": Boids,
    "burst-and-coast": BurstAndCoast,
    "robots": Robots,
}
"""The families by the names that commands use."""
