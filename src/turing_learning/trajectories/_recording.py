"""A recording as the file states it, before the user's scale and frame rate; and what is wrong with one."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from turing_learning.errors import Refusal, RefusedError, Text, brief, choice, number, require

from ._signals import wrap

YAxis = Literal["up", "down"]
LARGEST_COORDINATE = 1e9
"""Largest frame number, and largest coordinate in pixels or cm."""


@dataclass(frozen=True, eq=False)
class Recording:
    """Motion in the units and axes of the file, as far as the file states them."""

    positions: np.ndarray  #: x, y (F, A, 2), not a number where an individual is absent
    individuals: tuple[str, ...]
    first_frame: int = 0
    confidence: np.ndarray | None = None  #: The tracker's own (F, A)
    headings: np.ndarray | None = None  #: In rad (F, A)
    fps: float | None = None
    unit: str | None = None  #: "cm" or "px"
    y_axis: YAxis | None = "down"  #: None if the format has no direction of y by its definition
    numbered: bool = (
        True  #: Whether rows carry a frame number, so that their order in the file does not matter
    )
    remarks: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()  #: What was taken of a file that could be read otherwise
    #: Role -> column or array of the file that it was read from
    columns: Mapping[str, str] = field(default_factory=dict)
    unread: tuple[str, ...] = ()  #: Columns of the file that were not read

    @property
    def present(self) -> np.ndarray:
        """Whether the file has a position (F, A)."""
        return ~np.isnan(self.positions[..., 0])


@dataclass(frozen=True)
class Reading:
    """How a file was read, in words; empty where a recording comes from no file."""

    #: Role -> column or array of the file: "id" -> "TRACK_ID"
    columns: Mapping[str, str] = field(default_factory=dict)
    unread: tuple[str, ...] = ()  #: Columns of the file that were not read
    fps: str = ""  #: Where the frame rate comes from
    scale: str = ""  #: Where the scale comes from
    y_axis: str = ""  #: Where y points in the file, and who says so
    path: str = ""  #: Absolute, of the file or folder; empty of data in memory
    #: What was said of the file and done to the recording since, by the options of commands: "fps" -> 25.0
    options: Mapping[str, Any] = field(default_factory=dict)

    def followed_by(self, **options: Any) -> "Reading":
        """Return the reading of a recording to which something was done, by the options of commands."""
        return replace(self, options={**self.options, **options})


ROLES = (
    "frame",
    "time",
    "id",
    "x",
    "y",
    "heading",
    "confidence",
    "left",
    "top",
    "right",
    "bottom",
    "width",
    "height",
)
"""What a column of a table can be said to be; from left on of a box around an individual."""


@dataclass(frozen=True, kw_only=True)
class Options:
    """What the user says of a file, as in `load_trajectories`."""

    fps: float | None = None
    pixels_per_cm: float | Literal["unknown"] | None = None
    y_axis: YAxis | None = None
    keypoint: str | None = None
    min_confidence: float | None = None
    allow_pickle: bool = False
    columns: Mapping[str, str] | None = None
    resample: float | None = None
    project: bool = False
    heading: tuple[str, str] | None = None

    def __post_init__(self) -> None:
        for role in self.columns or ():
            choice("columns", role, ROLES)
        for name in ("fps", "pixels_per_cm", "resample"):
            value = getattr(self, name)
            if value is not None and (name, value) != ("pixels_per_cm", "unknown"):
                number(name, value, least=1 / LARGEST_COORDINATE, most=LARGEST_COORDINATE)
        rule = "be 'up' or 'down'"
        require(self.y_axis in (None, "up", "down"), "y_axis", rule, brief(self.y_axis))
        number("min_confidence", 0.0 if self.min_confidence is None else self.min_confidence)


@dataclass(frozen=True)
class Format:
    """A file format: its name, how it is told from others by its content, and its reader."""

    name: str
    recognizes: Callable[["Glance"], bool]
    read: Callable[[Path, Options], Recording]
    has_keypoints: bool = False
    has_columns: bool = False  #: Whether columns are told by their names
    has_times: bool = False  #: Whether rows may have times, which can be resampled


@dataclass(frozen=True)
class Glance:
    """A first look at a file, enough to tell the format.

    `container` is "text", "json", "hdf5", "npz" for archives and folders of them, "npy" or "netcdf3"; `lines` are the first
    ones of a text; `names` are those at the top of an HDF5 file, with "pandas_type" if there is a table of
    pandas, or the arrays in each archive.
    """

    container: str
    lines: tuple[str, ...] = ()
    names: tuple[frozenset[str], ...] = ()

    def cells(self, separator: str) -> list[str]:
        """Return the cells of the first line."""
        if self.lines:
            # spaces separate however many they are
            cells = self.lines[0].split(separator.strip(" ") or None)
            return [name.strip().strip('"') for name in cells]
        return []

    def holds(self, *names: str) -> bool:
        """Return whether an HDF5 file has all of these names."""
        return self.container == "hdf5" and set(names) <= self.names[0]


def refusal(rule: str, received: object, where: object, remedy: Text = "") -> RefusedError:
    """Return the error of a reader: what the file must be, what it is, and where."""
    return RefusedError(Refusal("path", rule, str(received), str(where), remedy))


MOST_CELLS = 100_000_000
"""Frames times individuals that are opened without asking; two thirds of a day of 10 individuals at 150 fps."""
SPARSEST = 100

Locator = Callable[[int], str]


def natural(name: str) -> tuple[list[tuple[int, str]], str]:
    """Return a sorting key by which fish10 comes after fish9."""
    pieces = re.split(r"([0-9]+)", name)
    # Every second piece is a number: the one with more digits is the larger one.
    key = []
    for k, piece in enumerate(pieces):
        key.append((len(piece.lstrip("0")) if k % 2 else 0, piece))
    return key, name


def check_positions(positions: np.ndarray, where: Locator, source: object) -> None:
    """Refuse positions (rows, 2) of which half is missing, absurd ones, and none at all; `source` is the name of all."""
    missing = np.isnan(positions)
    refuse_first(missing[:, 0] != missing[:, 1], where, "have both x and y or neither", positions)
    refuse_first(np.isinf(positions).any(axis=1), where, "have finite positions or NaN", positions)
    absurd = (np.abs(positions) > LARGEST_COORDINATE).any(axis=1)
    refuse_first(absurd, where, f"have coordinates within +-{LARGEST_COORDINATE:.0e}", positions)
    if missing.all():
        raise refusal("hold at least one position", "none", source)


def refuse_first(
    bad: np.ndarray, where: Locator, rule: str, values: np.ndarray | str, remedy: Text = ""
) -> None:
    """Refuse the first row that is bad, with its value."""
    for row in np.flatnonzero(bad)[:1].tolist():
        received = values if isinstance(values, str) else np.asarray(values[row]).tolist()
        raise refusal(rule, received, where(row), remedy)


def assemble(
    frames: np.ndarray, names: Sequence[str], positions: np.ndarray, where: Locator, *, twice: Text = "", sparse: Text = "",
    extras: Mapping[str, np.ndarray] = MappingProxyType({}), remarks: tuple[str, ...] = (), **stated: Any,
) -> Recording:  # fmt: skip
    """Sort rows, which may be in any order, into arrays by frame and individual.

    `frames` and `names` (rows,) are those of `positions` (rows, 2) and of `extras`, "confidence" and "headings"
    (rows,); `where` says where in the file a row is, `twice` what to do where rows contradict each other, `sparse`
    where hardly any frame has a row. Odd frame numbers are refused, too.
    """
    integral = (frames >= 0) & (frames <= LARGEST_COORDINATE) & (frames == np.floor(frames))
    rule = f"have frame numbers that are whole, from 0 to {LARGEST_COORDINATE:.0e}"
    refuse_first(~integral, where, rule, frames)
    labels = np.asarray(names, dtype=object)
    refuse_first(labels == "", where, "name the individual in each row", labels)
    check_positions(positions, where, where(0))
    # fish2 before fish10
    individuals = sorted(set(names), key=natural)
    order_of = {name: k for k, name in enumerate(individuals)}
    who = np.array([order_of[name] for name in names])
    numbers = frames.astype(np.int64)
    first_frame = int(numbers.min())
    last_frame = int(numbers.max())
    late = int(np.argmax(numbers))
    count = last_frame - first_frame + 1
    # Times that are taken for frame numbers leave most frames without a row.
    if count > SPARSEST * max(len(np.unique(numbers)), 100):
        rule = f"name at least one frame in {SPARSEST} between its first and its last"
        raise refusal(rule, f"frames {first_frame} to {last_frame}", where(late), sparse)
    if count * len(individuals) > MOST_CELLS:
        rule = f"hold at most {MOST_CELLS} frames times individuals"
        raise refusal(rule, f"{count} x {len(individuals)}", where(late), "Split the recording.")
    # Rows of one individual and frame stand beside each other then
    values = np.column_stack([positions, *extras.values()])
    order = np.lexsort((who, numbers))
    again = (np.diff(numbers[order]) == 0) & (np.diff(who[order]) == 0)
    row = order[:-1][again]
    repeat = order[1:][again]
    both_missing = np.isnan(values[row]) & np.isnan(values[repeat])
    differs = ~((values[row] == values[repeat]) | both_missing).all(axis=1)
    for early, late in np.sort(np.stack([row, repeat], axis=1)[differs], axis=1)[:1]:
        got = f"another one for frame {numbers[early]} than {where(early)}"
        raise refusal("give one position for each individual and frame", got, where(late), twice)
    if len(row):
        remarks += (f"{len(row)} rows said the same as another and were dropped",)
    dense = np.full((count, len(individuals), values.shape[1]), np.nan)
    dense[numbers - first_frame, who] = values
    for k, name in enumerate(extras):
        stated[name] = dense[..., 2 + k]
    return Recording(dense[..., :2], tuple(individuals), first_frame, remarks=remarks, **stated)


def directed(recording: Recording, front: Recording, back: Recording) -> Recording:
    """Return a recording whose headings lead from one point of the body to another; without both a position is missing."""
    # Who has no position in one of the files stands elsewhere in its order.
    in_front = list(map(front.individuals.index, recording.individuals))
    in_back = list(map(back.individuals.index, recording.individuals))
    ahead = front.positions[:, in_front] - back.positions[:, in_back]
    headings = np.arctan2(ahead[..., 1], ahead[..., 0])
    unknown = recording.present & (np.isnan(headings) | (ahead == 0).all(axis=2))
    remarks = recording.remarks
    if unknown.any():
        remarks += (f"{unknown.sum()} positions without a heading count as missing",)
    positions = np.where(unknown[..., None], np.nan, recording.positions)
    return replace(recording, positions=positions, headings=headings, remarks=remarks)


def from_array(
    positions: np.ndarray, names: tuple[str, ...], where: str | Locator, **stated: Any
) -> Recording:
    """Return the recording of positions (F, A, 2), NaN where missing; `where` is that of all, or says where a frame is."""
    count = positions.shape[1]
    at = where if callable(where) else lambda frame: f"{where}, frame {frame}"
    source = where(0) if callable(where) else where
    check_positions(positions.reshape(-1, 2), lambda row: at(row // count), source)
    return Recording(positions, names, **stated)


JUMP_FACTOR = 20.0
"""Typical steps from which on a step is a jump: in the zebrafish recording of the tests this is 61 pixels in a
frame, which two steps exceed, both of more than 230."""


@dataclass(frozen=True)
class Jump:
    """A step that is too long: perhaps two identities exchanged."""

    individual: str
    frame: int  #: Number of the frame before it
    distance: float  #: In the unit of the recording
    times_typical: float  #: The same in typical steps


MOST_LINES = 5
"""Lines about gaps, and about jumps, beyond which they are summed up in one."""


def thinning(every: int) -> str:
    """Return how one frame in so many is kept, in Python and on the command line."""
    return f"`thinned({every})` or --thin {every}"


@dataclass(frozen=True)
class Problems:
    """What `Trajectories.check` finds."""

    #: For each individual: frames without a position between its first and its last one
    missing: dict[str, int]
    gaps: dict[str, int]  #: Runs of such frames
    longest_gap: dict[str, int]  #: Frames in the longest
    away: dict[str, int]  #: Frames before its first position and after its last one
    #: Steps that are too long, in order of time; displacements over a gap are no steps
    jumps: tuple[Jump, ...]
    #: Numbers of frames in which everybody is exactly where they were in the one before: the video stood still
    repeated_frames: tuple[int, ...]
    #: Numbers of frames without anybody, whether the file has them or not
    empty_frames: tuple[int, ...]
    typical_step: float  #: Median length of the steps that are not 0, in the unit of the recording
    frames: int  #: Their number
    #: What the reader and later steps have to say, among it the direction of y
    remarks: tuple[str, ...] = ()
    #: Names of those in one place in all of their frames, two or more: a lost track, a dead animal, a mark
    still: tuple[str, ...] = ()
    every: int = 1  #: Only one frame in so many is there, evenly; 1 otherwise
    unit: str = "cm"  #: Of lengths, that of the recording
    #: Why headings may not be in rad or of the head: in much of the motion they point backwards, or look like degrees
    headings: tuple[str, ...] = ()
    #: What may have been read otherwise than it is meant, in words: which column names the individuals, missing positions
    doubts: tuple[str, ...] = ()

    @property
    def found(self) -> bool:
        """Whether there is anything: a missing value, a jump, somebody who never moves, a repeated or empty frame, a doubt."""
        problems = (
            self.jumps,
            self.still,
            self.repeated_frames,
            self.empty_frames,
            self.headings,
            self.doubts,
        )
        return any(self.missing.values()) or any(self.away.values()) or any(problems)

    def __str__(self) -> str:
        lines: list[str] = []
        if self.every > 1:
            lines.append(
                f"only one frame in {self.every} is there: keep those, by {thinning(self.every)}"
            )
        lines += self.headings + self.doubts
        gaps = [name for name, count in self.missing.items() if count or self.away[name]]
        if len(gaps) > MOST_LINES:
            lines.append(self.described_gaps)
        else:
            lines += map(self._gaps_of, gaps)
        if len(self.jumps) > MOST_LINES:
            lines.append(self.described_jumps)
        else:
            lines += map(self._described, self.jumps)
        for name in self.still:
            frames_there = counted(self._life(name) - self.missing[name])
            lines.append(f"{name}: never moves, in {frames_there}")
        for problem, frames in (
            ("repeat the one before", self.repeated_frames),
            ("without anybody", self.empty_frames),
        ):
            if frames:
                listed = ", ".join(map(str, frames[:10]))
                if len(frames) > 10:
                    listed += ", ..."
                lines.append(f"{counted(len(frames))} {problem}: {listed}")
        return "\n".join([*lines, *self.remarks]) or "no problems found"

    def _gaps_of(self, name: str) -> str:
        missing = f"{self.missing[name]} of {counted(self._life(name))} missing"
        if self.missing[name]:
            missing += f", in {counted(self.gaps[name], 'gap')} of up to {self.longest_gap[name]}"
        if self.away[name]:
            missing += f"; away for {counted(self.away[name])} before and after"
        return f"{name}: {missing}"

    def _life(self, name: str) -> int:
        """Return the number of frames from the first position of an individual to its last one."""
        return self.frames - self.away[name]

    def _described(self, jump: Jump) -> str:
        length = f"{jump.distance:.3g} {self.unit}"
        typical = f"{jump.times_typical:.3g} typical steps"
        return f"{jump.individual}: jump of {length} after frame {jump.frame} ({typical})"

    @property
    def described_gaps(self) -> str:
        """Missing positions of all individuals in one line; empty if none is missing.

        Before its first position and after its last one, an individual is away.
        """
        missing = sum(self.missing.values())
        parts = []
        if missing:
            share = missing / sum(map(self._life, self.missing))
            longest = max(self.longest_gap, key=self.longest_gap.__getitem__)
            gaps = f"{counted(sum(self.gaps.values()), 'gap')} of up to {self.longest_gap[longest]} frames ({longest})"
            parts.append(
                f"{counted(missing, 'position')} of all individuals missing ({share:.2%}), in {gaps}"
            )
        away = sum(count > 0 for count in self.away.values())
        if away:
            parts.append(
                f"{away} of {counted(len(self.away), 'individual')} come later or go earlier"
            )
        return "; ".join(parts)

    @property
    def described_jumps(self) -> str:
        """All jumps in one line; empty if there are none."""
        if not self.jumps:
            return ""
        largest = max(self.jumps, key=lambda jump: jump.distance)
        individuals = len({jump.individual for jump in self.jumps})
        return (
            f"{counted(len(self.jumps), 'jump')} of {counted(individuals, 'individual')}; "
            f"the largest: {self._described(largest)}"
        )


def counted(number: int, noun: str = "frame") -> str:
    """Return a number of things in words."""
    return f"{number} {noun}{'s' * (number != 1)}"


BACKWARDS = 0.25
"""Share of steps against the heading from which on headings are doubted: where they are right it is close to 0,
where they are in other units or another sense of rotation a half, and of the tail 1. Some robots and animals do
drive backwards."""
DEGREES_SHARE = 0.75
"""Share of headings beyond 2 pi from which on they may be in degrees, of which 97 % are where all directions are as frequent."""
LEAPS = 0.01
"""Share of changes of more than pi from which on headings beyond 2 pi may be in degrees; those in rad are
beyond 2 pi where they are counted on from turn to turn, and then never change by so much."""


def share_in_degrees(present: np.ndarray, headings: np.ndarray) -> float:
    """Return the share of headings (F, A) that are beyond 2 pi where they may be in degrees, else 0."""
    consecutive = present[1:] & present[:-1]
    changes = np.abs(np.diff(headings, axis=0))[consecutive]
    beyond = float((np.abs(headings[present]) > 2 * math.pi).mean())
    if beyond > DEGREES_SHARE and len(changes) and (changes > math.pi).mean() > LEAPS:
        return beyond
    return 0.0


def doubt_headings(
    positions: np.ndarray, present: np.ndarray, headings: np.ndarray
) -> tuple[str, ...]:
    """Return in words why headings (F, A) of positions (F, A, 2) may not be in rad or not of the head."""
    consecutive = present[1:] & present[:-1]
    if not consecutive.any():
        return ()
    if beyond := share_in_degrees(present, headings):
        return (
            f"headings may be in degrees, as {beyond:.0%} are beyond 2 pi; they are taken as rad",
        )
    step = np.diff(positions, axis=0)[consecutive]
    length = np.hypot(step[:, 0], step[:, 1])
    if not length.any():
        return ()
    long = length >= np.median(length[length > 0])
    away = np.abs(wrap(np.arctan2(step[:, 1], step[:, 0]) - headings[:-1][consecutive]))[long]
    backwards = (away > math.pi / 2).mean()
    if backwards <= BACKWARDS:
        return ()
    return (
        f"{backwards:.0%} of the longer steps go backwards by the headings: if that is not how they move, see whether headings "
        "are in rad, counted from x towards y in the file, and of the head",
    )
