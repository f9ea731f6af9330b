"""Families of models: what all share, and what those of particles in a plane share."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from typing import Any, ClassVar, Self

import numpy as np

from turing_learning.errors import brief, integer, number, refuse, require

from ..arrays import array, check_tank
from ..models import Parameter
from ..trajectories import SIGNALS, compute_signals
from ._starts import RecordedStarts

LONGEST = 100_000
"""Time steps of a group: more than an hour of motion at 25 steps a second, and some ten seconds of computing."""
MOST_PLACES = 10_000_000
"""Places of all individuals of a group in all steps; more take minutes and gigabytes."""
MOST_PAIRS = 100_000_000
"""Pairs of individuals in all steps, where each is compared with all others; more take minutes."""


@dataclass(frozen=True, kw_only=True)
class Family(ABC):
    """A simulator of models, each executed by all individuals of a group of its own.

    An instance is what `turing_learning.infer` asks for as `simulate`: called with parameters (M, P) and a
    random generator, it returns samples (M, C, T, D). Each model has random numbers of its own, so its motion
    does not depend on the others'.
    """

    individuals: int = 10  #: Individuals A in a group
    steps: int = 100  #: Time steps T of a sample
    interval_s: float = 0.1  #: Duration of a step (s)
    #: Individuals C of a group, the first ones, whose motion becomes samples
    observed: int = 1
    #: The D of a step, from `trajectories.SIGNALS`
    signals: tuple[str, ...] = ("speed", "turn")
    settling_steps: int = 0  #: Steps that a group moves before it is observed
    #: Side of the square (cm) in which a group starts, at places and in directions that are drawn uniformly
    start_side_cm: float = 20.0

    least: ClassVar[float] = 0.0
    """The least value that a parameter may have."""
    headings: ClassVar[bool] = False
    """Whether individuals have headings, with which their signals are measured then."""
    social: ClassVar[bool] = True
    """Whether individuals take notice of each other."""
    cheap: ClassVar[bool] = True
    """Whether a few hundred samples more than the trials of a run cost little."""

    @classmethod
    def settings_of(cls, name: str) -> dict[str, Any]:
        """Return the settings that a name of models states, as kicks+walls its parts; most state none."""
        return {}

    @classmethod
    def needs_tank(cls, **settings: Any) -> bool:
        """Whether models with these settings move in a tank only."""
        return False

    def __post_init__(self) -> None:
        integer("individuals", self.individuals, 1)
        integer("steps", self.steps, 1)
        integer("observed", self.observed, 1)
        integer("settling_steps", self.settling_steps, 0)
        rule = f"be at most `individuals`, {self.individuals}"
        require(self.observed <= self.individuals, "observed", rule, self.observed)
        remedy = "`settling_steps` count, too."
        integer("steps", self.steps + self.settling_steps, 1, LONGEST, remedy=remedy)
        remedy = f"Or take fewer than {self.moves} steps."
        integer("individuals", self.individuals, 1, MOST_PLACES // self.moves, remedy=remedy)
        self._check_above_zero("interval_s", "start_side_cm")
        names = self.signals
        # A list would be shared by copies of a family that cannot be changed.
        fits = isinstance(names, tuple) and bool(names) and set(names) <= set(SIGNALS)
        fits = fits and len(set(names)) == len(names)
        rule = f"be a tuple of some of {', '.join(SIGNALS)}, each once"
        require(fits, "signals", rule, brief(names))
        lonely = self.individuals == 1 and NEIGHBOR & set(names)
        rule = "not speak of neighbors where there is one individual"
        require(not lonely, "signals", rule, brief(names))

    @property
    @abstractmethod
    def parameters(self) -> dict[str, Parameter]:
        """The P parameters with suggested ranges, ready for `turing_learning.infer`."""

    @property
    def units(self) -> dict[str, str]:
        """Units of the parameters; empty for numbers without unit."""
        return {name: parameter.unit for name, parameter in self.parameters.items()}

    @property
    def fps(self) -> float:
        """Steps per second, for `turing_learning.trajectories`."""
        return 1 / self.interval_s

    @property
    def moves(self) -> int:
        """Steps that are simulated: settling, one before the first sampled step, and those of the sample."""
        return self.settling_steps + 1 + self.steps

    def __call__(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Simulate models and return samples of them.

        Parameters
        ----------
        parameters : (M, P)
            In the order of `parameters`, in their units.
        rng
            Source of all randomness.

        Returns
        -------
        (M, C, T, D)
            The signals of the first C individuals, measured as those of recorded motion, by `compute_signals`.
        """
        positions, headings = self._paths(self._checked(parameters), rng)
        focal = positions[:, :, : self.observed, None]
        paths = focal
        if NEIGHBOR & set(self.signals):
            # With whoever is nearest: signals as among all, at the cost of C individuals, not A.
            distance = np.square(positions[:, :, None] - focal).sum(axis=-1)
            distance[..., np.arange(self.observed), np.arange(self.observed)] = np.inf
            # who is absent is nobody's neighbor
            distance[np.isnan(distance)] = np.inf
            nearest = np.take_along_axis(positions, distance.argmin(axis=-1)[..., None], axis=2)
            paths = np.concatenate([focal, nearest[..., None, :]], axis=3)
        # (M, C, F, 1 or 2, 2)
        paths = paths.swapaxes(1, 2)
        if headings is not None:
            headings = headings[..., : self.observed].swapaxes(1, 2)[..., None]
            headings = np.broadcast_to(headings, paths.shape[:-1])
        signals = compute_signals(paths, fps=self.fps, names=self.signals, headings=headings)
        return signals.values[..., 1:, 0, :]

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Simulate models, given as in a call, and return where everybody was.

        Returns
        -------
        (M, F, A, 2)
            x, y (cm) in F = T + 2 frames: the T steps of a sample lead from the second frame to the last, and
            the step before tells the direction in which an individual came.
        """
        return self._paths(self._checked(parameters), rng)[0]

    @property
    def loses_individuals(self) -> bool:
        """Whether it knows how a tracker loses individuals, as a `Network` of such a recording does."""
        return False

    def track(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Simulate as `simulate` does; positions are NaN where a tracker would have lost somebody."""
        return self.simulate(parameters, rng)

    def observe(
        self, truth: Mapping[str, float], *, groups: int, rng: np.random.Generator
    ) -> np.ndarray:
        """Return samples of a system that is known, to be taken for genuine ones.

        Parameters
        ----------
        truth
            Name -> value of each parameter.
        groups
            Number of groups, >= 1, C samples of each.
        rng
            Source of all randomness.

        Returns
        -------
        (K, T, D)
            K = groups x C.

        Raises
        ------
        ValueError
            If a parameter is missing, unknown or out of range, or there is no group.
        """
        complete = set(truth) == set(self.parameters)
        rule = f"name {', '.join(self.parameters)}"
        require(complete, "truth", rule, ", ".join(truth) or "nothing")
        integer("groups", groups, 1, MOST_PLACES // self.moves)
        parameters = np.tile([float(truth[name]) for name in self.parameters], (groups, 1))
        return self(parameters, rng).reshape(-1, self.steps, len(self.signals))

    def in_group(
        self, individuals: int, tank_cm: tuple[float, float] | None = None, **settings: Any
    ) -> Self:
        """Return the same family in a group of another size, and in another tank (cm) if one is given.

        Where a group starts in a square of its own, the square grows with the group. `settings` are others of the family.
        """
        integer("individuals", individuals, 1)
        if tank_cm is not None:
            rule = "be left out for this family, which knows no tank"
            require(hasattr(self, "tank_cm"), "tank_cm", rule, brief(tank_cm))
            settings["tank_cm"] = tank_cm
        wider = math.sqrt(individuals / self.individuals)
        start_side_cm = self.start_side_cm * wider
        settings["start_side_cm"] = start_side_cm
        # a square that is repeated holds them at the same density, too
        period_cm = getattr(self, "period_cm", None)
        if period_cm is not None:
            settings.setdefault("period_cm", period_cm * wider)
        return replace(self, individuals=individuals, **settings)

    @abstractmethod
    def _paths(
        self, parameters: np.ndarray, rng: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Return positions (M, F, A, 2) of models (M, P), and headings (M, F, A) if individuals have some."""

    def _checked(self, parameters: np.ndarray) -> np.ndarray:
        names = list(self.parameters)
        parameters = array("parameters", parameters, "M P", finite=False, P=len(names))
        fits = np.isfinite(parameters) & (parameters >= self.least)
        for model, column in np.argwhere(~fits)[:1].tolist():
            rule = "finite"
            if math.isfinite(self.least):
                rule += f" and {self.least:g} or more"
            value = parameters[model, column]
            refuse("parameters", f"be {rule}", f"{names[column]} = {value}", place=f"model {model}")
        return parameters

    def _check_above_zero(self, *names: str) -> None:
        for name in names:
            number(name, getattr(self, name), above=0)


def most_moves(individuals: int, *, social: bool) -> int:
    """Return how many steps a group of so many individuals, who may take notice of each other, can be simulated for."""
    moves = min(LONGEST, MOST_PLACES // individuals)
    if social:
        moves = min(moves, MOST_PAIRS // individuals**2)
    return moves


NEIGHBOR = {"neighbor_distance", "neighbor_bearing"}


def offsets(positions: np.ndarray, period: float | None = None) -> np.ndarray:
    """Return ways (M, A, A) from places (M, A), complex (cm): [m, i, j] is that from individual i to j of model m.

    In a square of side `period` (cm) that is repeated in both directions it is the way to the nearest image.
    """
    displacement = positions[:, None, :] - positions[:, :, None]
    if period is None:
        return displacement
    return displacement - period * np.round(displacement / period)


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


def reflected(
    positions: np.ndarray, vectors: np.ndarray, size: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (M, A) folded back into a tank, and directions or velocities mirrored with them, as light at its walls.

    `size` is width and height of the tank (cm), one corner of which is the origin.
    """

    def folded(
        coordinates: np.ndarray, along: np.ndarray, length: float
    ) -> tuple[np.ndarray, np.ndarray]:
        # Who leaves a tank enters its mirror image; in every second one, all is mirrored.
        tanks, remainder = np.divmod(coordinates, length)
        mirrored = tanks % 2 == 1
        inside = np.where(mirrored, length - remainder, remainder)
        return inside, np.where(mirrored, -along, along)

    x, along = folded(positions.real, vectors.real, size[0])
    y, across = folded(positions.imag, vectors.imag, size[1])
    return x + 1j * y, along + 1j * across


def draw(
    rngs: Sequence[np.random.Generator], sample: Callable[[np.random.Generator], np.ndarray]
) -> np.ndarray:
    """Return random numbers (M, ...), those of each model from its own generator."""
    return np.stack([sample(rng) for rng in rngs])


@dataclass(frozen=True, kw_only=True)
class BeginsAsRecorded(Family):
    """A family whose groups begin at recorded moments, or scattered."""

    #: Recorded moments, at one of which each group begins, drawn by chance; None for places anywhere
    starts: RecordedStarts | None = field(default=None, repr=False)

    @classmethod
    def can_begin_as_recorded(cls, **settings: Any) -> bool:
        """Whether groups with these settings move where a group can have been recorded."""
        return True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.starts is not None:
            count = self.starts.positions.shape[1]
            rule = f"be of {self.individuals} individuals, as the group"
            require(count == self.individuals, "starts", rule, count)

    def in_group(
        self, individuals: int, tank_cm: tuple[float, float] | None = None, **settings: Any
    ) -> Self:
        """Return the same family in another group; it begins at recorded moments only if group and tank are as recorded."""
        same_tank = tank_cm in (None, getattr(self, "tank_cm", None))
        if individuals != self.individuals or not same_tank:
            settings.setdefault("starts", None)
        return super().in_group(individuals, tank_cm, **settings)


@dataclass(frozen=True, kw_only=True)
class Particles(BeginsAsRecorded):
    """A family of points in the plane, which yields its positions step by step.

    Positions and directions are complex numbers x + iy, in arrays (M, A).
    """

    #: Width and height of a tank (cm), anywhere in which individuals start who were not recorded, and whose walls
    #: reflect them as light; None for the unbounded plane. Individuals do not see the walls
    tank_cm: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        pairs = self.individuals**2 * self.moves
        rule = f"make at most {MOST_PAIRS} pairs in all steps"
        got = f"{self.individuals}, which make {pairs}"
        require(pairs <= MOST_PAIRS or not self.social, "individuals", rule, got)
        check_tank(self.tank_cm)

    @abstractmethod
    def _move(
        self, parameters: np.ndarray, rngs: Sequence[np.random.Generator]
    ) -> Iterator[np.ndarray]:
        """Yield the positions (M, A) before the first of `moves` steps and after each.

        `parameters` (P, M, 1) are ready to be multiplied with arrays (M, A); each model has a generator of its
        own.
        """

    def _paths(self, parameters: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, None]:
        frames = self._move(parameters.T[:, :, None], rng.spawn(len(parameters)))
        settled = np.stack(list(islice(frames, self.settling_steps, None)), axis=1)
        return settled.view(np.float64).reshape(*settled.shape, 2), None

    def _scattered(self, rngs: Sequence[np.random.Generator]) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and directions (M, A) at the start: recorded ones, or else scattered."""
        uniforms = draw(rngs, lambda rng: rng.random((3, self.individuals)))
        if self.starts is not None:
            places, angles = self.starts.drawn(uniforms)
            return self._within(places[..., 0] + 1j * places[..., 1], rotation(angles))
        width, height = self.tank_cm or (self.start_side_cm, self.start_side_cm)
        positions = width * uniforms[:, 0] + 1j * height * uniforms[:, 1]
        return positions, rotation(2 * math.pi * uniforms[:, 2])

    def _within(self, positions: np.ndarray, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return positions and directions or velocities (M, A) after reflection at the walls, if there are some."""
        if self.tank_cm is None:
            return positions, vectors
        return reflected(positions, vectors, self.tank_cm)
