"""The recording: who was where at which frame."""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from turing_learning import trajectories
from turing_learning.errors import (
    RefusedError,
    Setting,
    brief,
    integer,
    number,
    refuse,
    refusing_as,
    require,
)

from ._implausible import implausible
from ._recording import JUMP_FACTOR, Jump, Problems, Reading, counted, doubt_headings, thinning
from ._signals import Signals, compute_signals, last_true, lives_of, next_true, wrap
from ._unlikely import LONGEST_REST_S, Unlikely, find_unlikely
from ._windows import EXCERPT_S, Windows, cut_windows, join_windows

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr


_LOGGER = logging.getLogger("turing_learning")
FREQUENT_JUMPS = 0.01
"""Share of jumps among all steps above which they are hardly a tracker's single errors."""
FREQUENT_REPEATS = 0.1
"""Share of frames that repeat the one before, but never for long, above which nobody rests in them."""
FEW_OCCURRENCES = 9
"""Number up to which there are few of these."""
UNSURE = 0.5
"""Confidence below which a tracker is not sure of a position."""
_ARRAYS = ("positions", "present", "headings", "confidence", "interpolated")


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Positions of individuals over time, y upwards."""

    positions: np.ndarray  #: (F, A, 2): x, y in `unit`; 0 where an individual is absent
    present: np.ndarray  #: (F, A): Whether the position is known
    fps: float  #: Frame rate (1/s)
    individuals: tuple[str, ...]  #: Names (A,)
    unit: Literal["cm", "px"] = "cm"  #: "px" where the scale is unknown
    first_frame: int = 0  #: Its number in the file
    headings: np.ndarray | None = None  #: (F, A), optional: rad, anticlockwise from the x axis
    confidence: np.ndarray | None = None  #: (F, A), optional: The tracker's own, usually in [0, 1]
    interpolated: np.ndarray | None = (
        None  #: (F, A), optional: Where positions were interpolated by `bridged`
    )
    source: str = ""  #: Where it comes from
    format: str = ""  #: The tracker's, one of `FORMATS`
    remarks: tuple[str, ...] = ()  #: What was done on the way here, in words
    #: What its reader took a file for that could be read otherwise, in words
    choices: tuple[str, ...] = ()
    reading: Reading = field(default_factory=Reading)  #: How its file was read

    def __post_init__(self) -> None:
        if self.positions.ndim != 3 or self.positions.shape[2] != 2 or 0 in self.positions.shape:
            refuse("positions", "be of shape (F, A, 2) and not empty", str(self.positions.shape))
        shape = self.positions.shape[:2]
        for name, array in self._arrays(...).items():
            rule = f"be of shape (F, A) = {shape}"
            require(array.shape[:2] == shape, name, rule, str(array.shape))
            for index in map(tuple, np.argwhere(~np.isfinite(array))[:1].tolist()):
                call = "`load_trajectories(positions, fps=..., ...)`"
                remedy = "Where somebody is absent, `present` is false and positions are 0; "
                remedy += f"{call} makes that of an array with NaN."
                refuse(name, "be finite", f"{array[index]} at {index}", remedy)
        if self.present.dtype != bool or not self.present.any():
            refuse("present", "be booleans, some of them true", str(self.present.dtype))
        number("fps", self.fps, above=0)
        different = len(self.individuals) == shape[1] == len(set(self.individuals))
        require(different, "individuals", f"be {shape[1]} different names", str(self.individuals))
        require(self.unit in ("cm", "px"), "unit", "be 'cm' or 'px'", brief(self.unit))

    def __str__(self) -> str:
        frames, individuals = self.present.shape
        summary = (
            f"{counted(individuals, 'individual')}, {counted(frames)} at {self.fps:g} per second"
        )
        missing = 1 - self.present.sum() / self._lives.sum()
        return f"{summary} ({self.duration_s:.4g} s), in {self.unit}, {missing:.2%} missing"

    @property
    def duration_s(self) -> float:
        """Time from the first frame to the last (s)."""
        return (len(self.positions) - 1) / self.fps

    @property
    def every(self) -> int:
        """Only one frame in so many is there, evenly, as where a tracker left the others out; 1 otherwise."""
        frames = np.flatnonzero(self.present.any(axis=1))
        return int(np.gcd.reduce(np.diff(frames))) if len(frames) > 2 else 1

    @property
    def at_once(self) -> int:
        """Largest number of individuals at a time, each of them there from its first position to its last."""
        return int(self._lives.sum(axis=1).max())

    @property
    def _lives(self) -> np.ndarray:
        """Frames from the first position of each individual to its last one (F, A)."""
        return lives_of(self.present)

    @property
    def reach(self) -> np.ndarray:
        """Lowest and highest x, y (2, 2) of all positions, in `unit`."""
        visited = self.positions[self.present]
        return np.array([visited.min(axis=0), visited.max(axis=0)])

    def look(self) -> "trajectories.Look":
        """Return how the recording was read, what is odd about it, and pictures; it prints, and shows in notebooks."""
        return trajectories.Look(self)

    @property
    def problems(self) -> Problems:
        """What `check` finds with its defaults."""
        return self.check()

    def check(self, jump_factor: float = JUMP_FACTOR) -> Problems:
        """Look for missing values, jumps, individuals that never move, repeated and empty frames, and odd headings.

        Parameters
        ----------
        jump_factor
            Above 1. A step longer than this many typical steps is a jump, perhaps two identities exchanged.
            The typical step is the median over all individuals of the steps that are not 0.
        """
        positions = self.positions
        present = self.present
        names = self.individuals
        first_frame = self.first_frame
        consecutive = present[1:] & present[:-1]
        unlikely = self._unlikely(jump_factor, LONGEST_REST_S)
        # Jumps from or to a stand-in for a missing position are no jumps
        likely = ~(unlikely.stand_ins | unlikely.outside)
        steps, jumping, typical = self._steps(jump_factor, likely)
        jumps = []
        for frame, who in np.argwhere(jumping):
            length = float(steps[frame, who])
            jumps.append(Jump(names[who], int(first_frame + frame), length, length / typical))
        same = (
            (steps == 0).all(axis=1)
            & (present[1:] == present[:-1]).all(axis=1)
            & present[1:].any(axis=1)
        )
        missing = {}
        gaps = {}
        longest_gap = {}
        away = {}
        for k, name in enumerate(names):
            lengths = np.diff(np.flatnonzero(present[:, k])) - 1
            missing[name] = int(lengths.sum())
            gaps[name] = int((lengths > 0).sum())
            longest_gap[name] = int(lengths.max(initial=0))
            away[name] = len(present) - int(present[:, k].sum()) - missing[name]
        # Where each individual was first seen
        starts = positions[present.argmax(axis=0), np.arange(present.shape[1])]
        moved = ((positions != starts).any(axis=2) & present).any(axis=0)
        doubts = []
        for description in self._described(unlikely):
            doubts.append(f"{description}; windows leave that out")
        plausible = consecutive & likely[1:] & likely[:-1]
        doubts += implausible(
            positions, present & likely, steps[plausible], fps=self.fps, unit=self.unit, names=names
        )
        if len(jumps) > max(FEW_OCCURRENCES, FREQUENT_JUMPS * consecutive.sum()):
            share = f"{len(jumps) / consecutive.sum():.1%} of all steps are jumps"
            doubts.append(f"{share}: see whether the file tells individuals apart as they are")
        # Single repeated frames are of a slower video; several in a row are a rest
        alone = not (same[1:] & same[:-1]).any()
        if alone and same.sum() > max(FEW_OCCURRENCES, FREQUENT_REPEATS * len(same)):
            share = f"{same.mean():.0%} of all frames repeat the one before"
            doubts.append(f"{share}: they may be of a video at a lower rate")
        at_once = self.at_once
        if len(names) > at_once:
            shortest = counted(int(np.median(present.sum(axis=0))))
            who = f"{len(names)} individuals, of whom at most {at_once} are there at once"
            doubts.append(f"{who}, and half for {shortest} or fewer: they may be pieces of paths")
        if self.confidence is not None:
            unsure = self.confidence[present] < UNSURE
            share = f"{unsure.mean():.1%} of all positions have a confidence below {UNSURE}"
            if unsure.any():
                doubts.append(f"{share}; `min_confidence` drops those")
        headings: tuple[str, ...] = ()
        if self.headings is not None:
            headings = doubt_headings(positions, present, self.headings)
        return Problems(
            missing=missing,
            gaps=gaps,
            longest_gap=longest_gap,
            away=away,
            jumps=tuple(jumps),
            repeated_frames=tuple((np.flatnonzero(same) + first_frame + 1).tolist()),
            empty_frames=tuple((np.flatnonzero(~present.any(axis=1)) + first_frame).tolist()),
            typical_step=typical,
            frames=len(present),
            remarks=self.remarks,
            still=tuple(names[who] for who in np.flatnonzero((present.sum(axis=0) > 1) & ~moved)),
            every=self.every,
            unit=self.unit,
            headings=headings,
            doubts=(*self.choices, *doubts),
        )

    def _steps(
        self, jump_factor: float, likely: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Return lengths of steps (F - 1, A), 0 over gaps, which of them are jumps, and the typical one.

        Steps from or to a position that is not `likely` (F, A) are no jumps.
        """
        number("jump_factor", jump_factor, above=1)
        consecutive = self.present[1:] & self.present[:-1]
        lengths = np.hypot(*np.moveaxis(np.diff(self.positions, axis=0), -1, 0))
        steps = np.where(consecutive, lengths, 0.0)
        sound = np.where(likely[1:] & likely[:-1], steps, 0.0)
        # Steps of 0 are rests, or frames that a tracker repeats: they say nothing of how far individuals move.
        typical = 0.0
        if (sound > 0).any():
            typical = float(np.median(sound[sound > 0]))
        return steps, sound > jump_factor * typical, typical

    def announce(self) -> None:
        """Log what may be meant otherwise than it was read, as `load_trajectories` does."""
        problems = self.problems
        for doubt in (*problems.doubts, *problems.headings):
            _LOGGER.warning("%s: %s", self.source or "recording", doubt)

    def _unlikely(self, jump_factor: float | None, longest_rest_s: float | None) -> Unlikely:
        return find_unlikely(self.positions, self.present, self.fps, jump_factor, longest_rest_s)

    def _described(self, unlikely: Unlikely) -> list[str]:
        """Return in words which positions can hardly be true."""
        lines = []
        for flags, why in (
            (unlikely.stand_ins, "at exactly one point, as if for missing ones"),
            (unlikely.outside, "far outside all others"),
        ):
            for frame, who in np.argwhere(flags)[:1].tolist():
                x, y = self.positions[frame, who]
                where = f"({x:.6g}, {y:.6g}) of {self.individuals[who]} in frame {self.first_frame + frame}"
                lines.append(f"{counted(int(flags.sum()), 'position')} {why}, such as {where}")
        return lines

    def cleared(
        self, jump_factor: float | None = JUMP_FACTOR, longest_rest_s: float | None = LONGEST_REST_S
    ) -> "Trajectories":
        """Return a copy in which positions that can hardly be true are missing; the recording itself if there are none.

        They are those at exactly one point that a tracker writes where it has lost somebody, as (0, 0) or the
        last position, and those far outside all others.

        Parameters
        ----------
        jump_factor
            Typical steps from which on a step is a jump, by which such positions are told; None keeps what only
            jumps tell.
        longest_rest_s
            Time at exactly one point (s), and 50 frames, from which on nobody rests; None for no limit.
        """
        if longest_rest_s is not None:
            number("longest_rest_s", longest_rest_s, above=0)
        unlikely = self._unlikely(jump_factor, longest_rest_s)
        present = self.present & ~(unlikely.stand_ins | unlikely.outside)
        if (present == self.present).all():
            return self
        lines = self._described(unlikely)
        remedy = ("If they rest, give a longer ", Setting("longest_rest_s"), ".")
        rule = "be of somebody who moves"
        require(present.any(), "positions", rule, lines[0], remedy, place=self.source)
        arrays = {
            "present": present,
            "positions": np.where(present[..., None], self.positions, 0.0),
        }
        remarks = [f"{line}; all count as missing" for line in lines]
        return replace(self, **arrays, remarks=(*self.remarks, *remarks))

    def bridged(self, max_gap: int) -> "Trajectories":
        """Return a copy in which gaps of up to `max_gap` frames, >= 1, are filled by straight motion at even speed.

        Longer gaps, and those at the beginning and the end, stay. `interpolated` says what was filled;
        headings turn the shorter way.
        """
        max_gap = integer("max_gap", max_gap, 1)
        before = last_true(self.present)
        after = next_true(self.present)
        between = (before >= 0) & (after < len(before))
        filled = ~self.present & between & (after - before - 1 <= max_gap)
        frame, who = np.nonzero(filled)
        start_frame = before[filled]
        end_frame = after[filled]
        share = (frame - start_frame) / (end_frame - start_frame)
        arrays = {
            "positions": self.positions.copy(),
            "present": self.present | filled,
            "interpolated": filled,
        }
        begun = (1 - share)[:, None] * self.positions[start_frame, who]
        arrays["positions"][filled] = begun + share[:, None] * self.positions[end_frame, who]
        if self.interpolated is not None:
            arrays["interpolated"] = self.interpolated | filled
        if self.headings is not None:
            start = self.headings[start_frame, who]
            turn = wrap(self.headings[end_frame, who] - start)
            arrays["headings"] = self.headings.copy()
            arrays["headings"][filled] = start + share * turn
        remark = f"{len(frame)} positions in gaps of up to {max_gap} frames were interpolated"
        reading = self.reading.followed_by(bridge=max_gap)
        return replace(self, **arrays, remarks=(*self.remarks, remark), reading=reading)

    def thinned(self, every: int) -> "Trajectories":
        """Return a copy of one frame in `every`, at the lower frame rate that follows; the first with anybody is one of them."""
        every = integer("every", every, 1, len(self.positions))
        start = int(np.argmax(self.present.any(axis=1))) % every
        remark = f"one frame in {every} was kept, frame numbers count those"
        arrays: dict[str, Any] = self._arrays(slice(start, None, every))
        arrays["reading"] = self.reading.followed_by(
            every=every * self.reading.options.get("every", 1)
        )
        return replace(
            self, **arrays, fps=self.fps / every, first_frame=0, remarks=(*self.remarks, remark)
        )

    def split(self, longest_gap_s: float) -> "Trajectories":
        """Return a copy in which who is away for longer than so many s (above 0) is another individual after that.

        The parts of fish 1 are called fish 1, fish 1 (2), fish 1 (3); `at_once` counts who is there together.
        """
        number("longest_gap_s", longest_gap_s, above=0)
        longest = longest_gap_s * self.fps
        names = []
        owners = []
        inside = []
        frame = np.arange(len(self.positions))
        for who, name in enumerate(self.individuals):
            frames = np.flatnonzero(self.present[:, who])
            stretches = np.split(frames, np.flatnonzero(np.diff(frames) - 1 > longest) + 1)
            for number_of_part, stretch in enumerate(filter(len, stretches), 1):
                names.append(name if number_of_part == 1 else f"{name} ({number_of_part})")
                owners.append(who)
                inside.append((frame >= stretch[0]) & (frame <= stretch[-1]))
        if len(names) == len(self.individuals):
            return self
        arrays = self._arrays((slice(None), owners))
        arrays["present"] = arrays["present"] & np.stack(inside, axis=1)
        arrays["positions"] = np.where(arrays["present"][..., None], arrays["positions"], 0.0)
        gaps = len(names) - len(self.individuals)
        remark = f"{counted(gaps, 'gap')} of more than {longest_gap_s:g} s: individuals count as others after them"
        arrays["reading"] = self.reading.followed_by(split_gaps=longest_gap_s)
        return replace(self, **arrays, individuals=tuple(names), remarks=(*self.remarks, remark))

    def selected(self, individuals: Sequence[str]) -> "Trajectories":
        """Return a copy with some of the individuals, by name and in this order; the others are no neighbors any more."""
        arrays = self._arrays((slice(None), list(map(self._place, individuals))))
        return replace(self, **arrays, individuals=tuple(individuals))

    def _arrays(self, index: Any) -> dict[str, Any]:
        """Return parts of all arrays (F, A, ...) by name."""
        arrays = {}
        for name in _ARRAYS:
            array = getattr(self, name)
            if array is not None:
                arrays[name] = array[index]
        return arrays

    def _place(self, name: str) -> int:
        if name not in self.individuals:
            refuse("individuals", f"be among {', '.join(self.individuals)}", brief(name))
        return self.individuals.index(name)

    def speeds(self, *, smooth_frames: int = 1) -> Signals:
        """Compute linear (cm/s) and angular speed (rad/s), (F - 1, A, 2): `signals` with its default names."""
        return self.signals(("speed", "turn"), smooth_frames=smooth_frames)

    def signals(
        self, names: Sequence[str] = ("speed", "turn"), *, smooth_frames: int = 1
    ) -> Signals:
        """Compute D signals of each individual at each step; see `compute_signals`, also for `names` and `smooth_frames`.

        Returns
        -------
        Signals
            `values` (F - 1, A, D) in the units that `SIGNALS` names; with px instead of cm where the scale is
            unknown.
        """
        measurements = {"present": self.present, "headings": self.headings}
        return compute_signals(
            self.positions, fps=self.fps, names=names, smooth_frames=smooth_frames, **measurements
        )

    def windows(
        self, steps: int | None = None, *, length_s: float | None = None, stride: int | None = None,
        signals: Sequence[str] = ("speed", "turn"), individuals: Sequence[str] | None = None, hold_out: float = 0.2,
        hold_out_individuals: Sequence[str] = (), gap: int = 0, smooth_frames: int = 1,
        jump_factor: float | None = JUMP_FACTOR, longest_rest_s: float | None = LONGEST_REST_S,
    ) -> Windows:  # fmt: skip
        """Cut samples (K, T, D) for learning and for testing, with no frame in common.

        Time is cut into blocks, the same for all individuals, because neighbors move together. Held-out
        blocks are spread over the recording: each of up to five equal parts ends with one. A window lies
        within a block, with every frame that enters its signals, and contains no gap and no jump.

        Parameters
        ----------
        steps, length_s
            Length of a window: time steps T, or s, to the nearest whole number of steps. One of the two.
        stride
            Steps from a window to the next one of the same individual; None takes T: no overlap.
        signals
            Names from `SIGNALS`, D of them; "speed" and "turn" by default.
        individuals
            Whose windows; None takes all. The others stay neighbors.
        hold_out
            Share of the frames kept for testing, from 0 to 0.9; 0.2 by default.
        hold_out_individuals
            Who is kept for testing: held-out windows are theirs, windows for learning those of all others.
            Beside a share of 0, at the same times. None named: all are in both.
        gap
            Frames left out wherever learning and testing meet; 0, the default, for none.
        smooth_frames
            As in `compute_signals`; 1, the default, smooths nothing.
        jump_factor
            Steps longer than this many typical steps, 20 by default, are cut out, see `check`; None keeps them.
        longest_rest_s
            Positions that can hardly be true are missing, see `cleared`; None keeps rests of any length.

        Returns
        -------
        Windows
            `learning` and `held_out` (K, T, D), where they are from, and what was cut out.
        """
        if self.every > 1:
            got = f"{self.fps:g} per second, of which only one in {self.every} is there: {self.fps / self.every:g} per second"
            ahead = f"If that is the rate of what was tracked, keep those by {thinning(self.every)}"
            times = Setting("columns", {"time": "frame"})
            remedy = (ahead, ". If frame numbers are times, give ", times, ".")
            refuse("fps", "be the rate of the frames that are there", got, remedy)
        names = self.individuals if individuals is None else individuals
        if len(set(names)) < len(names):
            refuse("individuals", "be different names", str(list(names)), "Name each once.")
        chosen = list(map(self._place, names))
        apart = hold_out_individuals
        # A text is a sequence of names, too: those of one letter.
        fits = not isinstance(apart, str) and set(apart) <= set(names)
        fits = fits and not (apart and set(apart) >= set(names))
        rule = f"be a list of names, some of {', '.join(names)} but not all"
        require(fits, "hold_out_individuals", rule, brief(apart))
        if (steps is None) == (length_s is None):
            refuse("steps", "be given, or `length_s`, one of them", f"{steps} and {length_s}")
        if length_s is not None:
            fits = math.isfinite(length_s) and round(length_s * self.fps) >= 1
            require(fits, "length_s", f"be at least one frame of {1 / self.fps:.4g} s", length_s)
            steps = round(length_s * self.fps)
        steps = integer("steps", steps, 1, remedy="A length in s is given as `length_s`.")
        likely = self.cleared(jump_factor, longest_rest_s)
        usable = likely.signals(signals, smooth_frames=smooth_frames)
        jumps = np.zeros_like(usable.valid)
        if jump_factor is not None:
            unlikely = likely._unlikely(jump_factor, LONGEST_REST_S)
            jumps = likely._steps(jump_factor, ~(unlikely.stand_ins | unlikely.outside))[1]
        excerpt_frames = slice(int(EXCERPT_S * self.fps) + 1)
        cut = {
            "steps": steps, "stride": stride, "signals": list(signals), "hold_out": hold_out,
            "individuals": None if individuals is None else list(individuals),
            "hold_out_individuals": list(apart), "gap": gap, "smooth_frames": smooth_frames,
            "jump_factor": jump_factor, "longest_rest_s": longest_rest_s,
        }  # fmt: skip
        return cut_windows(
            usable, chosen, jumps, steps=steps, stride=stride, hold_out=hold_out, gap=gap, half=smooth_frames // 2,
            lead=int(self.headings is None and bool({"turn", "neighbor_bearing"} & set(signals))),
            apart=list(map(self._place, apart)), interval_s=1 / self.fps, headings=self.headings is not None,
            smooth_frames=smooth_frames, sources=(self,), cut=cut,
            excerpt=np.where(likely.present[excerpt_frames, :, None], likely.positions[excerpt_frames], np.nan),
        )  # fmt: skip

    def to_pandas(self) -> "pd.DataFrame":
        """Return a long table: frame, time (s), id, x, y of everybody who is present, and heading and confidence if known.

        Its attributes say the frame rate, the unit, and that y points upwards, so that `load_trajectories`
        reads it back.
        """
        import pandas as pd

        frame, who = np.nonzero(self.present)
        columns = {
            "frame": frame + self.first_frame,
            "time": frame / self.fps,
            "id": np.array(self.individuals, dtype=object)[who],
            "x": self.positions[frame, who, 0],
            "y": self.positions[frame, who, 1],
        }
        if self.headings is not None:
            columns["heading"] = self.headings[frame, who]
        if self.confidence is not None:
            columns["confidence"] = self.confidence[frame, who]
        table = pd.DataFrame(columns)
        table.attrs = {"fps": self.fps, "unit": self.unit, "y_axis": "up"}
        return table

    to_dataframe = to_pandas

    def to_xarray(self) -> "xr.Dataset":
        """Return a dataset in the conventions of the `movement` package; missing positions are NaN there.

        `position` (time, space, keypoints, individuals) and `confidence` (time, keypoints, individuals), NaN
        where it is not known, as movement's writers want it; time in s; `fps` and what else is known in the
        attributes. y stays upwards, as the attribute `y_axis` says.

        Source: the documentation of movement, neuroinformatics.dev, "movement datasets".
        """
        import xarray as xr

        positions = np.where(self.present[..., None], self.positions, np.nan)
        positions = positions.transpose(0, 2, 1)[:, :, None]
        planes: dict[str, Any] = {"confidence": np.nan}
        if self.confidence is not None:
            planes["confidence"] = self.confidence
        if self.headings is not None:
            planes["heading"] = self.headings
        variables: dict[str, Any] = {}
        axes = ("time", "keypoints", "individuals")
        for name, values in planes.items():
            variables[name] = (axes, np.where(self.present, values, np.nan)[:, None])
        return xr.Dataset(
            {"position": (("time", "space", "keypoints", "individuals"), positions)} | variables,
            coords={
                "time": (np.arange(len(positions)) + self.first_frame) / self.fps,
                "space": ["x", "y"],
                "keypoints": ["centroid"],
                "individuals": list(self.individuals),
            },
            attrs={
                "fps": self.fps, "time_unit": "seconds", "ds_type": "poses", "source_software": self.format,
                "source_file": self.source, "length_unit": self.unit, "y_axis": "up", "first_frame": self.first_frame,
            },
        )  # fmt: skip


def pooled_windows(
    recordings: Sequence[Trajectories], *, hold_out_recordings: Sequence[int] = (), **options: Any
) -> Windows:
    """Cut windows of several recordings, each with individuals of its own, for one run.

    Parameters
    ----------
    recordings
        At one frame rate, in the same unit.
    hold_out_recordings
        Which of them, from 0, are for testing alone; the others are for learning alone then. Without any,
        times of each recording are held out.
    **options
        As for `Trajectories.windows`.

    Returns
    -------
    Windows
        `learning_recording` and `held_out_recording` say of which recording each is.
    """
    require(len(recordings), "recordings", "be one or more", "none")
    apart = {"hold_out": 0.0} if hold_out_recordings else {}
    pieces = []
    for k, recording in enumerate(recordings):
        where = recording.source or f"recording {k + 1}"
        same = recording.unit == recordings[0].unit
        rule = f"be in {recordings[0].unit}, as the first recording"
        require(same, "recordings", rule, recording.unit, place=where)
        with refusing_as(RefusedError, place=where if len(recordings) > 1 else ""):
            pieces.append(recording.windows(**options | apart))
    return join_windows(pieces, hold_out_recordings)
