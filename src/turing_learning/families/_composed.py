"""A family of models that is put together from parts: how individuals move, and what acts on them."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from turing_learning.errors import nearest, require

from ..models import Parameter
from ._family import Particles, draw, offsets, rotation
from ._kinds import glided

MOTIONS = ("kicks", "persistent")
PARTS = (*MOTIONS, "walls", "social", "differences", "tracker")
"""All parts, one of the first two of which says how an individual moves by itself."""

SETTLING_STEPS = 100
"""Steps before a group is observed: individuals that are recorded have met before."""


@dataclass(frozen=True, kw_only=True)
class Composed(Particles):
    """Individuals whose motion and influences are parts, each of which can be left out.

    The direction of an individual turns by ``(w + walls + social) dt`` in each step, where w is the turning rate
    of its own motion. The parts and their parameters:

    ``kicks``
        Bursts of speed with sudden turns, and glides between them, as in `BurstAndCoast`; a glide bends at a
        rate w that is drawn at its kick. speed (cm/s), kick_interval (s), glide_time (s), turn (rad), bend
        (standard deviation of w, rad/s).
    ``persistent``
        Speed and turning rate wander around their means and forget the past within a time: w and the logarithm
        of the speed are Ornstein-Uhlenbeck processes. speed (mean, cm/s), speed_variation (standard deviation
        of its logarithm), turning (standard deviation of w, rad/s), memory (s).
    ``walls``
        Each wall at distance r in the direction theta, relative to that of the individual, turns it by
        ``-wall_turning exp(-(r / wall_distance)^2) sin(theta)``. wall_turning (rad/s), wall_distance (cm).
        Needs a tank.
    ``social``
        The other individual with the largest influence, at distance d in the direction theta and with a
        direction of motion that differs by phi, turns it by ``attraction (d / balance_distance - 1) /
        (1 + (d / social_range)^2) sin(theta) + alignment exp(-(d / social_range)^2) sin(phi)``. attraction,
        alignment (rad/s), balance_distance, social_range (cm).
    ``differences``
        Individuals are slow and fast for good: speeds are multiplied by factors whose logarithm has the standard
        deviation speed_differences.
    ``tracker``
        Positions are measured with a normal error in x and y of standard deviation tracker_noise (cm).

    Source
    ------
    Kicks, walls, attraction and alignment: D. S. Calovi and others, PLoS Computational Biology 14 (2018) e1005933,
    equations 5 to 12, without the dependence on the angle of view. There they act at kicks; here all the time, so that they
    go with either motion. The most influential individual alone: L. Lei and others, PLoS Computational Biology 16 (2020)
    e1007194. Persistent turning: J. Gautrais and others, Journal of Mathematical Biology 58 (2009) 429.
    """

    parts: tuple[str, ...] = (
        "kicks",
        "walls",
        "social",
        "differences",
        "tracker",
    )  #: Some of `PARTS`
    settling_steps: int = SETTLING_STEPS
    #: Standard deviation of durations and initial speeds of kicks, as a share of their means
    variation: float = 0.5

    @classmethod
    def settings_of(cls, name: str) -> dict[str, Any]:
        """Return the parts that a name such as ``kicks+walls`` states."""
        return {"parts": parts_of(name)}

    @classmethod
    def needs_tank(cls, **settings: Any) -> bool:
        """Whether walls are among the parts."""
        return "walls" in settings["parts"]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_parts(self.parts, "parts")
        self._check_above_zero("variation")
        blind = "walls" not in self.parts or self.tank_cm is not None
        require(blind, "parts", "have walls only in a tank", self.name, "Give tank_cm.")
        accompanied = "social" not in self.parts or self.individuals > 1
        require(accompanied, "parts", "be social only among several individuals", self.name)

    @property
    def name(self) -> str:
        """The parts as commands name them, such as ``kicks+walls``."""
        return "+".join(self.parts)

    @property
    def parameters(self) -> dict[str, Parameter]:
        """The parameters of the parts, in their order."""
        parameters = {}
        for part in self.parts:
            parameters.update(_PARAMETERS[part])
        return parameters

    def _move(
        self, parameters: np.ndarray, rngs: Sequence[np.random.Generator]
    ) -> Iterator[np.ndarray]:
        values = dict(zip(self.parameters, parameters, strict=True))
        shape = (self.individuals,)
        positions, directions = self._scattered(rngs)
        lasting = draw(rngs, lambda rng: rng.standard_normal(shape))
        pace = np.exp(values.get("speed_differences", 0) * lasting)
        motion: _Motion
        if "kicks" in self.parts:
            motion = _Kicks(self, values, rngs)
        else:
            motion = _Persistent(self, values, rngs)
        errors = draw(rngs, lambda rng: rng.standard_normal((self.moves + 1, 2, *shape)))
        errors = values.get("tracker_noise", 0) * (errors[:, :, 0] + 1j * errors[:, :, 1]).swapaxes(
            0, 1
        )
        yield positions + errors[0]
        for step in range(1, self.moves + 1):
            turning = motion.turning()
            if "walls" in self.parts:
                turning = turning + self._from_walls(positions, directions, values)
            if "social" in self.parts:
                turning = turning + _social(positions, directions, values)
            directions = directions * rotation(turning * self.interval_s)
            for distance, turn in motion.advance(step):
                positions, directions = self._within(
                    positions + pace * distance * directions, directions
                )
                directions = directions * rotation(turn)
            yield positions + errors[step]

    def _from_walls(
        self, positions: np.ndarray, directions: np.ndarray, values: dict[str, np.ndarray]
    ) -> np.ndarray:
        """Return the turning rates (M, A) by which individuals avoid the walls."""
        assert self.tank_cm is not None
        width, height = self.tank_cm
        reach = np.maximum(values["wall_distance"], SHORTEST_CM)
        # distance of a wall, and the direction in which it is
        walls = (
            (positions.real, -1),
            (width - positions.real, 1),
            (positions.imag, -1j),
            (height - positions.imag, 1j),
        )
        turning = np.zeros(positions.shape)
        for distance, normal in walls:
            toward = normal * directions.conj()
            turning -= np.exp(-((distance / reach) ** 2)) * toward.imag
        return values["wall_turning"] * turning


SHORTEST_CM = 1e-9
"""Least distance (cm) that others are divided by."""


def _social(
    positions: np.ndarray, directions: np.ndarray, values: dict[str, np.ndarray]
) -> np.ndarray:
    """Return the turning rates (M, A) toward, away from and along with whoever has the largest influence."""
    balance = np.maximum(values["balance_distance"], SHORTEST_CM)[..., None]
    reach = np.maximum(values["social_range"], SHORTEST_CM)[..., None]
    ways = offsets(positions) * directions.conj()[..., None]
    distance = np.abs(ways)
    sine = ways.imag / np.maximum(distance, SHORTEST_CM)
    difference = (directions[:, None] * directions.conj()[..., None]).imag
    near = (distance / reach) ** 2
    attraction = (distance / balance - 1) / (1 + near) * sine
    alignment = np.exp(-near) * difference
    influence = values["attraction"][..., None] * attraction
    influence = influence + values["alignment"][..., None] * alignment
    # nobody has an influence on itself: its way and its difference are zero
    strongest = np.abs(influence).argmax(axis=-1)
    return np.take_along_axis(influence, strongest[..., None], axis=-1)[..., 0]


class _Motion(ABC):
    """How individuals move if nothing acts on them: asked for the turning, then told to advance, in each step."""

    @abstractmethod
    def turning(self) -> np.ndarray:
        """Return the turning rates (M, A) of this step (rad/s)."""

    @abstractmethod
    def advance(self, step: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield the ways (M, A) of a step (cm), and by how much an individual turns after each (rad)."""


class _Kicks(_Motion):
    """Bursts of speed with sudden turns, and glides that bend between them."""

    def __init__(
        self, family: Composed, values: dict[str, np.ndarray], rngs: Sequence[np.random.Generator]
    ) -> None:
        self._interval_s = family.interval_s
        # no division by zero
        self._glide_time = np.maximum(values["glide_time"], 1e-300)
        shape = (family.moves + 1, family.individuals)
        form = family.variation**-2
        kicks = draw(rngs, lambda rng: rng.gamma(form, 1 / form, (2, *shape)))
        normals = draw(rngs, lambda rng: rng.standard_normal((2, *shape)))
        durations = values["kick_interval"][:, None] * kicks[:, 0]
        self._durations = np.maximum(durations, family.interval_s)
        self._speeds = values["speed"][:, None] * kicks[:, 1]
        self._turns = values["turn"][:, None] * normals[:, 0]
        self._bends = values["bend"][:, None] * normals[:, 1]
        # at a random moment of a kick
        elapsed = self._durations[:, 0] * draw(rngs, lambda rng: rng.random(family.individuals))
        self._remaining = self._durations[:, 0] - elapsed
        self._speed = self._speeds[:, 0] * np.exp(-elapsed / self._glide_time)
        self._bend = self._bends[:, 0]

    def turning(self) -> np.ndarray:
        return self._bend

    def advance(self, step: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        before = np.minimum(self._remaining, self._interval_s)
        after = self._interval_s - before
        kicked = self._remaining < self._interval_s
        distance, speed = glided(self._speed, before, self._glide_time)
        yield distance, np.where(kicked, self._turns[:, step], 0.0)
        speed = np.where(kicked, self._speeds[:, step], speed)
        self._bend = np.where(kicked, self._bends[:, step], self._bend)
        remaining = np.where(kicked, self._durations[:, step], self._remaining - before)
        self._remaining = remaining - after
        distance, self._speed = glided(speed, after, self._glide_time)
        yield distance, np.zeros(distance.shape)


class _Persistent(_Motion):
    """Speed and turning rate that wander, and forget the past."""

    def __init__(
        self, family: Composed, values: dict[str, np.ndarray], rngs: Sequence[np.random.Generator]
    ) -> None:
        self._values = values
        self._interval_s = family.interval_s
        shape = (family.moves + 1, 2, family.individuals)
        self._normals = draw(rngs, lambda rng: rng.standard_normal(shape))
        # what is left of the past after a step
        self._kept = np.exp(-family.interval_s / np.maximum(values["memory"], 1e-300))
        self._state = self._normals[:, 0]

    def turning(self) -> np.ndarray:
        return self._values["turning"] * self._state[:, 0]

    def advance(self, step: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        variation = self._values["speed_variation"]
        # the mean of a log-normal speed is that of the parameter
        factor = np.exp(variation * self._state[:, 1] - variation**2 / 2)
        yield self._values["speed"] * factor * self._interval_s, np.zeros(factor.shape)
        kept = self._kept[:, None]
        renewed = np.sqrt(1 - kept**2) * self._normals[:, step]
        self._state = kept * self._state + renewed


def parts_of(name: str) -> tuple[str, ...]:
    """Return the parts of a name such as ``kicks+walls``."""
    return tuple(name.split("+"))


def check_parts(parts: Sequence[str], name: str) -> None:
    """Reject parts that do not make a family, in a message on the setting of that name."""
    text = "+".join(parts)
    for part in parts:
        require(part in PARTS, name, f"be of {', '.join(PARTS)}", repr(part), nearest(part, PARTS))
    require(len(set(parts)) == len(parts), name, "have each part once", text)
    motions = set(parts) & set(MOTIONS)
    require(len(motions) == 1, name, f"have one of {' and '.join(MOTIONS)}", text)


_SPEED = Parameter(0, 40, unit="cm/s")
_PARAMETERS: dict[str, dict[str, Parameter]] = {
    "kicks": {
        "speed": _SPEED,
        "kick_interval": Parameter(0.1, 2, unit="s"),
        "glide_time": Parameter(0.1, 2, unit="s"),
        "turn": Parameter(0, 1.5, unit="rad"),
        "bend": Parameter(0, 4, unit="rad/s"),
    },
    "persistent": {
        "speed": _SPEED,
        "speed_variation": Parameter(0, 1.5),
        "turning": Parameter(0, 6, unit="rad/s"),
        "memory": Parameter(0.05, 5, unit="s"),
    },
    "walls": {
        "wall_turning": Parameter(0, 10, unit="rad/s"),
        "wall_distance": Parameter(0, 20, unit="cm"),
    },
    "social": {
        "attraction": Parameter(0, 6, unit="rad/s"),
        "alignment": Parameter(0, 6, unit="rad/s"),
        "balance_distance": Parameter(0.1, 10, unit="cm"),
        "social_range": Parameter(1, 30, unit="cm"),
    },
    "differences": {"speed_differences": Parameter(0, 1)},
    "tracker": {"tracker_noise": Parameter(0, 0.5, unit="cm")},
}
"""Part -> its parameters, with suggested ranges for animals of some cm/s in a tank of some 10 cm."""
