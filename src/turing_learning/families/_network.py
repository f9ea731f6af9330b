"""Animals as a network has learned them from recordings, with a few numbers that scientists ask about."""

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np

from turing_learning._files import write_atomically
from turing_learning.arrays import check_tank
from turing_learning.errors import brief, integer, refuse, require
from turing_learning.kernels.imitation import (
    AHEAD,
    HISTORY,
    MEMORIES,
    PAST,
    Layers,
    Pieces,
    Tanks,
    Units,
    move_range,
)
from turing_learning.kernels.parallel import run_range
from turing_learning.models import Parameter
from turing_learning.trajectories import Trajectories, Windows

from ._family import MOST_PLACES, Family
from ._losses import NO_LOSSES, Losses, lose, losses_of
from ._pieces import horizon_steps
from ._starts import without_jumps
from ._tank import open_grid, recorded_grid, rectangle_grid, same_tank, tanks_of

GAINS = ("speed", "speed_noise", "turn_noise", "walls", "attraction", "alignment", "memory")
"""Names of the parameters, in the order in which kernels take them; each is 1 as recorded."""
LEAST_NOISE = 0.01
"""Of the choices: below it they are as good as certain."""
TRAINING_STEPS = 3000
"""Batches that a network learns from, one after the other: half a minute of one processor."""
MOST_STARTS = 200
"""Moments of the recordings that are kept for groups to start from."""
MOMENTS = 8
"""Moments that are tried until one has somebody who stays as long as a sample."""
BEHIND_WALLS = 4.0
"""Times the distance at which walls are near that goals lie beyond where individuals left: directions of what is reached
are noise."""
LEAST_ROWS = 1000
"""Steps without gaps around them that there have to be to learn from."""
FORMAT = "turing-learning network 4"


class Starts(NamedTuple):
    """Moments of the recordings from which groups go on: K of them, up to A individuals, NaN where there are fewer."""

    paths: np.ndarray  # (K, HISTORY + 1, A, 2): where everybody has just been (cm)
    memories: np.ndarray  # (K, A, MEMORIES)
    tank: np.ndarray  # (K,): in which tank
    at: np.ndarray  # (K,): the frame, of those of its recording that were learned
    goals: np.ndarray  # (K, A, 2): where everybody goes (cm), NaN where nobody comes or goes


class Moment(NamedTuple):
    """One moment of `Starts`."""

    path: np.ndarray  # (HISTORY + 1, A, 2)
    memory: np.ndarray  # (A, MEMORIES)
    goals: np.ndarray  # (A, 2)
    tank: int
    at: int


class Comings(NamedTuple):
    """Who came into view later: N individuals."""

    paths: np.ndarray  # (N, PAST + 1, 2): their first places (cm)
    tank: np.ndarray  # (N,): in which tank
    at: np.ndarray  # (N,): the frame of the first, of those of its recording that were learned
    memories: np.ndarray  # (N, MEMORIES): at the first
    goals: np.ndarray  # (N, 2): where each goes (cm)
    frames: (
        np.ndarray
    )  # (tanks,): number of the frames that were learned; 0 where nobody comes or goes


class Brain(NamedTuple):
    """What was learned, and all that is needed to let it move."""

    layers: Layers
    pieces: Pieces
    units: Units
    tanks: Tanks
    starts: Starts
    comings: Comings
    losses: Losses
    interval_s: float
    log_likelihood: float  # of steps that were not learned from, nats per step above chance


@dataclass(frozen=True, kw_only=True, eq=False)
class Network(Family):
    """Individuals that do again what was recorded, where a network says it fits: `Network.learned` makes one.

    From what an individual perceives, the network says what to expect, and so which recorded contexts are most like
    this one. The step that was done in one of them, drawn by chance, is done again, and then those that came next, as
    long as their contexts are alike. An individual perceives its own last displacements, averages of its speed over
    1 and 5 s and over all that was recorded of it, the distance of the walls in eight directions, and places and
    velocities of the eight nearest others, among which attention decides. All is relative to its course, and the same
    in a mirror.

    A group starts as one was recorded at some moment of the learning part. What would lead out of the tank is turned
    along the wall. What cannot be turned so is not chosen, nor what leads nearer to another than individuals come, by
    where the pieces of both lead. Nobody who comes and goes is turned. Where a
    recording has many more individuals than are ever there at once, such as pedestrians who pass, others come when and
    where others came after that moment. Each of them has what it had when it was recorded: a goal, to where it left,
    whose direction is its course; and how fast it is when it is fast, in place of the averages. Whoever of them
    is not held up goes on for longer with what came next. They leave as they were recorded to leave, or where others
    left. In a group of another size more come, or fewer, in proportion. There is no other tank for them.

    Where a tracker has lost individuals, mostly those who were near to others, it loses those of a model as often and for
    as long, and a sample is of one whom it never loses. `simulate` returns where everybody was all the time.

    The parameters are gains, 1 as recorded. `speed` multiplies all lengths. `speed_noise` and `turn_noise` multiply
    the variance of where the alike contexts led, how far and in which direction: 0 is always the most usual, above 1
    is more random. `walls`, `attraction` and `alignment` multiply what the walls, the places and the velocities of the
    others add to the context, where the network is asked with and without: 0 ignores them. `memory` multiplies how far
    the averages are from the usual speed.

    Source
    ------
    Recorded steps done again: U. Lall, A. Sharma, A nearest neighbor bootstrap for resampling hydrologic time series,
    Water Resources Research 32 (1996); L. Kovar, M. Gleicher, F. Pighin, Motion graphs, SIGGRAPH 2002. Learning from
    demonstrations: V. Papaspyros and others, PLoS Computational Biology 20 (2024), arXiv:2302.06839. Attention among
    neighbors: F. J. H. Heras and others, PLoS Computational Biology 15 (2019) e1007354. Answers with and without a
    condition, extrapolated: J. Ho, T. Salimans, Classifier-free diffusion guidance (2022), arXiv:2207.12598.
    """

    brain: Brain = field(repr=False)  #: What was learned
    #: Width and height of another tank (cm) than the recorded one, one corner of which is the origin; None for that
    tank_cm: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        check_tank(self.tank_cm)
        if self.tank_cm is not None:
            rule = "be None, as the network was learned without walls"
            require(self.brain.tanks.walls.any(), "tank_cm", rule, brief(self.tank_cm))
            rule = "be None, as individuals come and go where the network was learned"
            require(not self._open, "tank_cm", rule, brief(self.tank_cm))
        ratio = self.interval_s / self.brain.interval_s
        rule = f"be that of what was learned, {self.brain.interval_s:g} s"
        require(
            abs(ratio - 1) < 1e-6,
            "interval_s",
            rule,
            f"{self.interval_s:g} s",
            "Thin the recording alike.",
        )

    @property
    def parameters(self) -> dict[str, Parameter]:
        """The gains; without `walls` where no tank has some."""
        ranges = {"speed": (0.5, 1.5), "speed_noise": (0.5, 1.5), "turn_noise": (0.5, 1.5)}
        walls = bool(self.brain.tanks.walls.any())
        names = [name for name in GAINS if walls or name != "walls"]
        return {name: Parameter(*ranges.get(name, (0.0, 2.0))) for name in names}

    @classmethod
    def learned(
        cls, recordings: Trajectories | Sequence[Trajectories], windows: Windows, *,
        tanks: Sequence[tuple[float, float] | str | None] = ("recorded",), seed: int = 0, steps: int = TRAINING_STEPS,
        progress: Callable[[int, int], None] | None = None, **settings: Any,
    ) -> Self:  # fmt: skip
        """Learn from the frames of recordings that their windows do not hold out.

        Parameters
        ----------
        recordings, windows
            What was recorded, once or several times, in cm, and the windows of all of it.
        tanks
            Of each recording, or one for all: "recorded" for as far as positions reach, of any shape; width and height
            (cm); None for the plane without walls.
        seed
            Of the training.
        steps
            Of the training, in batches.
        progress
            Called now and then with the steps that are done, and all steps.
        **settings
            Of the family, such as `settling_steps`, by default as many as a window has.

        Raises
        ------
        ValueError
            If there is one individual only, a recording in pixels, or too little without gaps.
        ImportError
            If PyTorch is not installed: it comes with the extra `networks`.
        """
        from ._imitation import MOST_ROWS, in_a_mirror, learn, memories_of, traits_of, units_of
        from ._pieces import (
            comings_and_goings,
            goals_of,
            joined,
            last_places,
            pieces_of,
            recorded,
            rows_of,
            some_blocks,
            with_borrowed,
        )

        recordings = [recordings] if isinstance(recordings, Trajectories) else list(recordings)
        _check_recordings(recordings, windows)
        paths = [without_jumps(recording) for recording in recordings]
        grids, walls = _grids(paths, tanks)
        learned = windows.frames("learning")
        learned_paths = [
            np.where(steps_learned[..., None], path, np.nan)
            for path, steps_learned in zip(paths, learned, strict=True)
        ]
        units = units_of(learned_paths, windows.interval_s)
        moves = [comings_and_goings(recording.present) for recording in recordings]
        goals = []
        left = []
        for path, (_, gone) in zip(learned_paths, moves, strict=True):
            places = last_places(path, gone)
            goals.append(goals_of(path, gone, places, BEHIND_WALLS * units.wall))
            left.append(places[np.isfinite(places[:, 0])])
        shapes = tanks_of(grids, walls, left)
        memories = []
        for path, learned_path, places in zip(paths, learned_paths, left, strict=True):
            if len(places):
                memories.append(traits_of(path))
            else:
                memories.append(memories_of(path, learned_path, units))
        rng = np.random.default_rng([seed, 46])
        batches = []
        frames = []
        starts: list[Moment] = []
        comings = []
        all_rows = [
            rows_of(path, steps_learned) for path, steps_learned in zip(paths, learned, strict=True)
        ]
        for k, rows in enumerate(all_rows):
            # with a course that is not that to the goal, a step would be another one
            if len(left[k]):
                all_rows[k] = rows[np.isfinite(goals[k][rows[:, 1], 0])]
        count = sum(map(len, all_rows))
        rule = f"have at least {LEAST_ROWS} steps with {PAST} steps before them and no gap"
        require(
            count >= LEAST_ROWS, "recordings", rule, count, "Bridge gaps, or record for longer."
        )
        for k, (path, memory, rows) in enumerate(zip(paths, memories, all_rows, strict=True)):
            come, gone = moves[k]
            # a clock that stands still where nothing may be learned
            clock = np.cumsum(learned[k].any(axis=1)) - 1
            going = with_borrowed(goals[k], learned_paths[k])
            comings.append(_comings(learned_paths[k], memory, going, come, clock, k))
            if not len(rows):
                continue
            chosen = some_blocks(rows, MOST_ROWS / count, rng)
            batch = recorded(
                path,
                learned_paths[k],
                memory,
                chosen,
                shapes,
                k,
                units,
                windows.interval_s,
                gone,
                goals[k],
            )
            batches.append(batch)
            frames.append(len(path))
            starts += _moments(
                path,
                memory,
                going,
                rows,
                k,
                math.ceil(MOST_STARTS * len(rows) / count),
                rng,
                clock,
                busy=0.0 if (come >= 0).any() else 0.5,
            )
        examples = joined(batches, frames)
        layers, log_likelihood = learn(examples, steps=steps, seed=seed, progress=progress)
        pieces = pieces_of(examples, in_a_mirror(examples), layers, seed)
        brain = Brain(
            layers,
            pieces,
            units,
            shapes,
            _joined(starts),
            Comings(*(np.concatenate(parts) for parts in zip(*comings, strict=True))),
            # whoever is gone where people pass has left
            NO_LOSSES if any(map(len, left)) else losses_of(recordings, learned),
            windows.interval_s,
            log_likelihood,
        )
        length = windows.learning.shape[1]
        timing = {"steps": length, "interval_s": windows.interval_s, "signals": windows.names}
        usual = {"individuals": brain.starts.paths.shape[2], "settling_steps": length}
        return cls(brain=brain, **timing, **usual | settings)

    def in_recordings(
        self, recordings: Trajectories | Sequence[Trajectories], windows: Windows, *,
        tanks: Sequence[tuple[float, float] | str | None] = ("recorded",), seed: int = 0,
    ) -> Self:  # fmt: skip
        """Return the same animals in groups that begin as other recordings say, in their tanks, to infer gains from these.

        Groups that begin as those that were learned from, and have moved for some seconds, are not where animals
        with other gains have been for long.

        Parameters
        ----------
        recordings, windows
            What was recorded of others, once or several times, in cm, and the windows of all of it.
        tanks
            As in `learned`; "recorded" is the tank that was learned from, where they move in the same one.
        seed
            Of the choice of moments.

        Raises
        ------
        ValueError
            If individuals come and go, there is nothing without gaps, or walls where the network has not seen any.
        """
        from ._imitation import memories_of, units_of
        from ._pieces import comings_and_goings, rows_of

        recordings = [recordings] if isinstance(recordings, Trajectories) else list(recordings)
        _check_recordings(recordings, windows)
        comers = False
        for recording in recordings:
            come, _ = comings_and_goings(recording.present)
            comers = comers or bool((come >= 0).any())
        rule = "be of individuals that stay, as those that were learned from"
        require(not comers and not self._open, "recordings", rule, "some that come and go")
        paths = [without_jumps(recording) for recording in recordings]
        grids, walls = _grids(paths, tanks, self.brain.tanks)
        rule = "be None, as the network was learned without walls"
        require(self.brain.tanks.walls.any() or not any(walls), "tanks", rule, brief(tanks))
        learned = windows.frames("learning")
        learned_paths = [
            np.where(is_present[..., None], path, np.nan)
            for path, is_present in zip(paths, learned, strict=True)
        ]
        units = self.brain.units
        # the gain `speed` multiplies what was before the start: others may be faster already
        faster = units_of(learned_paths, windows.interval_s).step / units.step
        rng = np.random.default_rng([seed, 48])
        count = math.ceil(MOST_STARTS / len(paths))
        starts: list[Moment] = []
        for k, (path, learned_path) in enumerate(zip(paths, learned_paths, strict=True)):
            rows = rows_of(path, learned[k])
            if not len(rows):
                continue
            memory = memories_of(path, learned_path, units)
            memory /= np.repeat((faster, faster**2), MEMORIES // 2)
            nowhere = np.full(path.shape[1:], np.nan)
            clock = np.arange(len(path))
            for moment in _moments(path, memory, nowhere, rows, k, count, rng, clock, busy=0.5):
                before = (moment.path - moment.path[-1]) / faster
                starts.append(moment._replace(path=moment.path[-1] + before))
        rule = f"have steps with {PAST} steps before them and no gap"
        require(starts, "recordings", rule, "none", "Bridge gaps.")
        nobody = [np.empty((0, 2))] * len(paths)
        brain = self.brain._replace(
            tanks=tanks_of(grids, walls, nobody),
            starts=_joined(starts),
            losses=losses_of(recordings, learned),
        )
        return replace(
            self,
            brain=brain,
            individuals=brain.starts.paths.shape[2],
            steps=windows.learning.shape[1],
            signals=windows.names,
        )

    def in_group(
        self, individuals: int, tank_cm: tuple[float, float] | None = None, **settings: Any
    ) -> Self:
        """Return the same animals in a group, or a tank (cm), that was never recorded."""
        integer("individuals", individuals, 2)
        return super().in_group(individuals, tank_cm, **settings)

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return where everybody was, also those who came later or left, or would have been lost; see `Family.simulate`."""
        gains = self._gains(self._checked(parameters))
        return self._moved(gains, rng.spawn(len(gains)), NO_LOSSES)

    @property
    def loses_individuals(self) -> bool:
        """Whether the tracker of the recordings has lost individuals who were found again."""
        return bool(len(self.brain.losses.gaps))

    def track(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return the groups of `simulate`, lost as often and for as long as the recorded animals were."""
        gains = self._gains(self._checked(parameters))
        rngs = rng.spawn(len(gains))
        positions = self._moved(gains, rngs, NO_LOSSES)
        if self.loses_individuals:
            positions = lose(positions, self.brain.losses, rngs, fewest=0)
        return positions

    def to_bytes(self) -> bytes:
        """Return what was learned in the format safetensors: numbers alone, no code."""
        from safetensors.numpy import save

        names = ("interval_s", "steps", "individuals", "settling_steps", "observed")
        description = {name: getattr(self, name) for name in names}
        description["format"] = FORMAT
        description["log_likelihood"] = self.brain.log_likelihood
        description["signals"] = list(self.signals)
        rates = self.brain.units.memory_rates.tolist()
        description["units"] = self.brain.units._replace(memory_rates=rates)._asdict()
        tensors = {}
        for section in PARTS:
            if section == "losses" and not len(self.brain.losses.gaps):
                continue
            for name, values in getattr(self.brain, section)._asdict().items():
                tensors[f"{section}.{name}"] = np.ascontiguousarray(values)
        return save(tensors, {"network": json.dumps(description)})

    @classmethod
    def from_bytes(cls, content: bytes) -> Self:
        """Return the network that `to_bytes` made these bytes of."""
        from safetensors import SafetensorError
        from safetensors.numpy import load

        rule = "be a network that `save` wrote"
        try:
            tensors = load(content)
        except SafetensorError as error:
            refuse("content", rule, f"other bytes ({error})")
        # the header, a JSON object, stands behind eight bytes that are its length
        header = json.loads(content[8 : 8 + int.from_bytes(content[:8], "little")])
        description = json.loads(header.get("__metadata__", {}).get("network", "{}"))
        require(
            description.get("format") == FORMAT, "content", rule, f"tensors {brief(list(tensors))}"
        )
        fields: dict[str, Any] = {"losses": NO_LOSSES}
        for section, tuple_type in PARTS.items():
            # not in networks from before decision 0078, nor where nobody is ever lost
            if section == "losses" and "losses.gaps" not in tensors:
                continue
            fields[section] = tuple_type(
                **{name: tensors[f"{section}.{name}"] for name in tuple_type._fields}
            )
        units = Units(**description.pop("units"))
        brain = Brain(
            **fields,
            units=units._replace(memory_rates=np.array(units.memory_rates)),
            interval_s=description["interval_s"],
            log_likelihood=description.pop("log_likelihood"),
        )
        signals = tuple(description.pop("signals"))
        del description["format"]
        return cls(brain=brain, signals=signals, **description)

    def save(self, path: str | Path) -> None:
        """Write `to_bytes` to a file."""
        write_atomically(Path(path), self.to_bytes())

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read what `save` wrote."""
        return cls.from_bytes(Path(path).read_bytes())

    def _paths(self, parameters: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, None]:
        gains = self._gains(parameters)
        rngs = rng.spawn(len(gains))
        losses = self.brain.losses
        positions = self._moved(gains, rngs, losses)
        if not (self._open or len(losses.gaps)):
            return positions, None
        # samples are of those who were there all the time; where there are too few, another moment is tried
        for attempt in range(MOMENTS):
            failed = np.flatnonzero(_stayed(positions).sum(axis=1) < self.observed)
            if not len(failed):
                break
            # in a long sample somebody is always lost
            last = attempt == MOMENTS - 1
            again = self._moved(
                gains[failed], [rngs[m] for m in failed], NO_LOSSES if last else losses
            )
            wider = again.shape[2] - positions.shape[2]
            if wider > 0:
                room = ((0, 0), (0, 0), (0, wider), (0, 0))
                positions = np.pad(positions, room, constant_values=np.nan)
            positions[failed] = np.nan
            positions[failed, :, : again.shape[2]] = again
        # those of the start who are there still are the slow ones: others have to have the same chance
        lots = np.array([own_rng.random(positions.shape[2]) for own_rng in rngs])
        order = np.argsort(np.where(_stayed(positions), lots, 1.0), axis=1, kind="stable")
        return np.take_along_axis(positions, order[:, None, :, None], axis=2), None

    def _gains(self, parameters: np.ndarray) -> np.ndarray:
        """Return all gains (M, 7) of models (M, P)."""
        gains = np.ones((len(parameters), len(GAINS)))
        for name, column in zip(self.parameters, parameters.T, strict=True):
            gains[:, GAINS.index(name)] = column
        gains[:, 1:3] = np.maximum(gains[:, 1:3], LEAST_NOISE)
        return gains

    @property
    def _open(self) -> bool:
        """Whether individuals come and go."""
        return bool(self.brain.comings.frames.any())

    def _moved(
        self, gains: np.ndarray, rngs: Sequence[np.random.Generator], losses: Losses
    ) -> np.ndarray:
        """Return where groups with these gains (M, 7) are seen (M, F, A, 2), each with random numbers of its own."""
        brain = self.brain
        count = len(gains)
        tanks = brain.tanks if self.tank_cm is None else _rectangular_tank(*self.tank_cm)
        which = np.zeros(count, dtype=np.int64)
        keys = np.empty(count, dtype=np.uint64)
        begun = []
        for m, own_rng in enumerate(rngs):
            moment = self._start(own_rng)
            which[m] = moment.tank
            keys[m] = own_rng.integers(2**64, dtype=np.uint64)
            coming = self._coming(moment.tank, moment.at, own_rng) if self._open else []
            begun.append((moment, coming))
        individuals = self.individuals + max((len(coming) for *_, coming in begun), default=0)
        frames = HISTORY + 1 + self.moves
        rule = f"make at most {MOST_PLACES} places of {individuals} who come and go"
        fits = frames * individuals <= MOST_PLACES
        require(fits, "steps", rule, f"{frames * individuals}", "Take a shorter duration.")
        paths = np.full((count, frames, individuals, 2), np.nan)
        memories = np.zeros((count, individuals, MEMORIES))
        goals = np.full((count, individuals, 2), np.nan)
        for m, (moment, coming) in enumerate(begun):
            # lengths before the start are those of a faster group, too
            speed = gains[m, 0]
            path = moment.path
            paths[m, : HISTORY + 1, : self.individuals] = path[-1] + speed * (path - path[-1])
            memories[m, : self.individuals] = moment.memory
            goals[m, : self.individuals] = moment.goals
            for column, (after, n) in enumerate(coming, self.individuals):
                begin = HISTORY + after
                end = min(begin + PAST + 1, frames)
                first_places = brain.comings.paths[n]
                places = first_places[0] + speed * (first_places - first_places[0])
                memories[m, column] = brain.comings.memories[n]
                goals[m, column] = brain.comings.goals[n]
                paths[m, begin:end, column] = places[: end - begin]
            memories[m] *= np.repeat((speed, speed**2), MEMORIES // 2)
        leaving = brain.comings.frames[which] > 0 if self._open else np.zeros(count, dtype=bool)
        run_range(
            move_range,
            count,
            None,
            paths,
            memories,
            goals,
            keys,
            gains,
            which,
            leaving,
            horizon_steps(brain.interval_s)[1 : 1 + AHEAD],
            tanks,
            brain.units,
            brain.layers,
            brain.pieces,
        )
        paths = paths[:, HISTORY:]
        if len(losses.gaps):
            paths = lose(paths, losses, rngs)
        return paths[:, self.settling_steps :]

    def _coming(self, tank: int, at: int, rng: np.random.Generator) -> list[tuple[int, int]]:
        """Return after how many steps individuals come into a tank after a moment, and their numbers among `Comings`.

        After the end of what was learned it begins anew. Where the group is larger or smaller than it was, those of
        several moments come, and of the last of these a share.
        """
        brain = self.brain
        cycle = int(brain.comings.frames[tank])
        if cycle == 0:
            return []
        ratio = 1.0
        if self.individuals != brain.starts.paths.shape[2]:
            is_present = np.isfinite(brain.starts.paths[brain.starts.tank == tank, -1, :, 0])
            ratio = self.individuals / float(is_present.sum(axis=1).mean())
        coming = []
        # whoever had come just before the moment is not among those who start there
        earliest = 1 - PAST
        for k in range(math.ceil(ratio)):
            begin = at if k == 0 else int(rng.integers(cycle))
            for n in np.flatnonzero(brain.comings.tank == tank):
                after = (int(brain.comings.at[n]) - begin - earliest) % cycle + earliest
                while after <= self.moves:
                    if rng.random() < ratio - k:
                        coming.append((after, int(n)))
                    after += cycle
        return coming

    def _start(self, rng: np.random.Generator) -> Moment:
        """Return the moment from which a group starts: absent individuals come last."""
        starts = self.brain.starts
        recorded = starts.paths.shape[2]
        moment = int(rng.integers(len(starts.paths)))
        if self.tank_cm is None and self.individuals == recorded:
            order = rng.permutation(recorded)
            order = order[np.argsort(np.isnan(starts.paths[moment, -1, order, 0]), kind="stable")]
            return Moment(
                starts.paths[moment][:, order],
                starts.memories[moment, order],
                starts.goals[moment, order],
                int(starts.tank[moment]),
                int(starts.at[moment]),
            )
        # a group that was never recorded: individuals of different moments, in one tank
        tank = 0
        alike = np.ones(len(starts.tank), dtype=bool)
        if self.tank_cm is None:
            tank = int(starts.tank[moment])
            alike = starts.tank == tank
        moments, individuals = np.nonzero(alike[:, None] & np.isfinite(starts.paths[:, -1, :, 0]))
        chosen = rng.integers(len(moments), size=self.individuals)
        path = starts.paths[moments[chosen], :, individuals[chosen]].swapaxes(0, 1)
        goals = starts.goals[moments[chosen], individuals[chosen]]
        if self.tank_cm is not None:
            places = rng.random((self.individuals, 2)) * np.array(self.tank_cm)
            path = path - path[-1] + places
        memory = starts.memories[moments[chosen], individuals[chosen]]
        return Moment(path, memory, goals, tank, int(starts.at[moment]))


PARTS: dict[str, Any] = {
    "layers": Layers,
    "pieces": Pieces,
    "tanks": Tanks,
    "starts": Starts,
    "comings": Comings,
    "losses": Losses,
}


def _check_recordings(recordings: Sequence[Trajectories], windows: Windows) -> None:
    """Reject recordings that a network cannot learn from."""
    for k, recording in enumerate(recordings):
        where = f"recording {k + 1}"
        rule = "be in cm, as tanks and speeds are"
        require(
            recording.unit == "cm",
            "recordings",
            rule,
            "pixels",
            "Give their scale, pixels_per_cm.",
            place=where,
        )
        ratio = windows.interval_s * recording.fps
        rule = "have the frame rate of the windows"
        require(
            abs(ratio - 1) < 1e-6,
            "recordings",
            rule,
            f"{recording.fps:g} frames per second",
            place=where,
        )
    at_once = max(recording.at_once for recording in recordings)
    rule = "have two individuals or more at once: a network learns how they respond to each other"
    require(
        at_once > 1,
        "recordings",
        rule,
        f"{at_once} individual",
        "Take another family, such as BurstAndCoast.",
    )


def _grids(
    paths: Sequence[np.ndarray],
    tanks: Sequence[tuple[float, float] | str | None],
    known: Tanks | None = None,
) -> tuple[list[tuple[np.ndarray, np.ndarray, float]], list[bool]]:
    """Return the grid of each recording's tank, and whether it has walls, by paths (F, A, 2) with NaN.

    One that is `known` is not measured again.
    """
    asked = list(tanks) * (len(paths) if len(tanks) == 1 else 1)
    fits = len(asked) == len(paths)
    require(fits, "tanks", f"be one, or one for each of {len(paths)} recordings", len(tanks))
    grids = []
    for path, tank in zip(paths, asked, strict=True):
        positions = path[np.isfinite(path[..., 0])]
        if tank is None:
            grids.append(open_grid())
        elif isinstance(tank, str):
            grid = recorded_grid(positions)
            if known is not None:
                grid = same_tank(positions, grid, known)
            grids.append(grid)
        else:
            center = (positions.min(axis=0) + positions.max(axis=0)) / 2
            grids.append(rectangle_grid(center, tank))
    return grids, [tank is not None for tank in asked]


# its table of distances takes a second, and every batch of models asks for it
@lru_cache(maxsize=4)
def _rectangular_tank(width_cm: float, height_cm: float) -> Tanks:
    """Return a rectangle, one corner of which is the origin."""
    sides = (width_cm, height_cm)
    return tanks_of([rectangle_grid(np.array(sides) / 2, sides)], [True])


def _moments(
    path: np.ndarray,
    memory: np.ndarray,
    goals: np.ndarray,
    rows: np.ndarray,
    tank: int,
    count: int,
    rng: np.random.Generator,
    clock: np.ndarray,
    busy: float,
) -> list[Moment]:
    """Return moments to start from: not the share `busy` with the fewest individuals whose past is there."""
    frames, present = np.unique(rows[:, 0], return_counts=True)
    usable = frames[present >= np.quantile(present, busy)]
    chosen = np.sort(rng.choice(usable, size=min(count, len(usable)), replace=False))
    moments = []
    for frame in chosen:
        past = path[frame - HISTORY : frame + 1].copy()
        past[:, np.isnan(past[-1 - PAST :]).any(axis=(0, 2))] = np.nan
        moments.append(Moment(past, memory[frame], goals, tank, int(clock[frame])))
    return moments


def _joined(moments: Sequence[Moment]) -> Starts:
    """Return moments as arrays with room for the most individuals that one of them has.

    Those who are there come first, and NaN fills the rest.
    """
    most_present = max(int(np.isfinite(moment.path[-1, :, 0]).sum()) for moment in moments)
    paths = np.full((len(moments), HISTORY + 1, most_present, 2), np.nan)
    memories = np.zeros((len(moments), most_present, MEMORIES))
    goals = np.full((len(moments), most_present, 2), np.nan)
    for k, moment in enumerate(moments):
        present = np.flatnonzero(np.isfinite(moment.path[-1, :, 0]))
        paths[k, :, : len(present)] = moment.path[:, present]
        memories[k, : len(present)] = moment.memory[present]
        goals[k, : len(present)] = moment.goals[present]
    tanks = np.array([moment.tank for moment in moments])
    return Starts(paths, memories, tanks, np.array([moment.at for moment in moments]), goals)


def _comings(
    path: np.ndarray,
    memory: np.ndarray,
    goals: np.ndarray,
    come: np.ndarray,
    clock: np.ndarray,
    tank: int,
) -> Comings:
    """Return who came into a recording, by first frames `come` (A,), and when by the clock (F,) of what was learned."""
    places = []
    at = []
    comers = []
    for individual in np.flatnonzero(come >= 0):
        begin = come[individual]
        first_places = path[begin : begin + PAST + 1, individual]
        if len(first_places) == PAST + 1 and np.isfinite(first_places).all():
            places.append(first_places)
            at.append(clock[begin])
            comers.append(individual)
    open_frames = int(clock[-1]) + 1 if places else 0
    return Comings(
        np.array(places).reshape(-1, PAST + 1, 2),
        np.full(len(places), tank),
        np.array(at, dtype=np.int64),
        memory[come[comers], comers],
        goals[comers],
        np.array([open_frames]),
    )


def _stayed(positions: np.ndarray) -> np.ndarray:
    """Return who was there in all frames (M, A) of positions (M, F, A, 2)."""
    return np.isfinite(positions[..., 0]).all(axis=1)
