"""What is wrong with a recording."""

import math
from dataclasses import dataclass

import numpy as np

from turing_learning.errors import refuse

from ._signals import every, next_true, wrap

JUMP_FACTOR = 20.0
"""Typical steps from which on a step is a jump: in the zebrafish recording of the tests this is 61 pixels in a
frame, which two steps exceed, both of more than 230."""


@dataclass(frozen=True)
class Jump:
    """A step that is too long: perhaps two identities exchanged.

    `frame` is the number of the frame before it; `distance` is in the unit of the recording, `times_typical` in typical steps.
    """

    individual: str
    frame: int
    distance: float
    times_typical: float


@dataclass(frozen=True)
class Problems:
    """What `Trajectories.check` finds.

    Attributes
    ----------
    missing, gaps, longest_gap
        For each individual: frames without a position, runs of such frames, frames in the longest.
    jumps
        Steps that are too long, in order of time. Displacements over a gap are no steps.
    repeated_frames
        Numbers of frames in which everybody is exactly where everybody was in the frame before: the video stood still.
    empty_frames
        Numbers of frames without anybody, whether the file has them or not.
    typical_step
        Median length of the steps that are not 0, in the unit of the recording.
    remarks
        What the reader and later steps have to say, among it the direction of y.
    still
        Names of the individuals that are in the same place in all of their frames, two or more: a track that
        was lost, a dead animal, or a mark on the ground.
    every
        Only one frame in so many is there, evenly; 1 otherwise.
    unit
        Of lengths, that of the recording.
    headings
        Why headings may not be in rad or not of the head, in words: in much of the motion they point
        backwards, or they look like degrees.
    """

    missing: dict[str, int]
    gaps: dict[str, int]
    longest_gap: dict[str, int]
    jumps: tuple[Jump, ...]
    repeated_frames: tuple[int, ...]
    empty_frames: tuple[int, ...]
    typical_step: float
    frames: int
    remarks: tuple[str, ...] = ()
    still: tuple[str, ...] = ()
    every: int = 1
    unit: str = "cm"
    headings: tuple[str, ...] = ()

    @property
    def found(self) -> bool:
        """Whether there is anything: a missing value, a jump, somebody who never moves, a repeated or empty frame, odd headings."""
        return bool(
            any(self.missing.values())
            or self.jumps
            or self.still
            or self.repeated_frames
            or self.empty_frames
            or self.headings
        )

    def __str__(self) -> str:
        lines = (
            [f"only one frame in {self.every} is there: `thinned({self.every})` keeps those"] if self.every > 1 else []
        )
        lines += self.headings
        lines += [
            f"{name}: {count} of {counted(self.frames)} missing, in {counted(self.gaps[name], 'gap')} of up to "
            f"{self.longest_gap[name]}"
            for name, count in self.missing.items()
            if count
        ]
        lines += [
            f"{jump.individual}: jump of {jump.distance:.3g} {self.unit} after frame {jump.frame} "
            f"({jump.times_typical:.3g} typical steps)"
            for jump in self.jumps
        ]
        lines += [f"{name}: never moves, in {counted(self.frames - self.missing[name])}" for name in self.still]
        for what, frames in (("repeat the one before", self.repeated_frames), ("without anybody", self.empty_frames)):
            if frames:
                listed = ", ".join(map(str, frames[:10])) + (", ..." if len(frames) > 10 else "")
                lines.append(f"{counted(len(frames))} {what}: {listed}")
        return "\n".join([*lines, *self.remarks]) or "nothing found"


def counted(number: int, noun: str = "frame") -> str:
    """Return a number of things in words."""
    return f"{number} {noun}{'s' * (number != 1)}"


def find_problems(
    positions: np.ndarray,
    present: np.ndarray,
    individuals: tuple[str, ...],
    first_frame: int,
    jump_factor: float,
    headings: np.ndarray | None = None,
) -> Problems:
    """Return what is wrong with positions (F, A, 2) and headings (F, A)."""
    if not (math.isfinite(jump_factor) and jump_factor > 1):
        refuse("jump_factor", "be a finite number above 1", str(jump_factor))
    both = present[1:] & present[:-1]
    steps = np.where(both, np.hypot(*np.moveaxis(np.diff(positions, axis=0), -1, 0)), 0.0)
    typical = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    jumps = tuple(
        Jump(individuals[who], int(first_frame + frame), float(steps[frame, who]), float(steps[frame, who] / typical))
        for frame, who in np.argwhere(steps > jump_factor * typical)
    )
    same = (steps == 0).all(axis=1) & (present[1:] == present[:-1]).all(axis=1) & present[1:].any(axis=1)
    names = [(name, _gap_lengths(present[:, k])) for k, name in enumerate(individuals)]
    places = positions[present.argmax(axis=0), np.arange(present.shape[1])]
    moved = ((positions != places).any(axis=2) & present).any(axis=0)
    return Problems(
        missing={name: int(lengths.sum()) for name, lengths in names},
        gaps={name: len(lengths) for name, lengths in names},
        longest_gap={name: int(lengths.max(initial=0)) for name, lengths in names},
        jumps=jumps,
        repeated_frames=tuple(int(first_frame + 1 + frame) for frame in np.flatnonzero(same)),
        empty_frames=tuple(int(first_frame + frame) for frame in np.flatnonzero(~present.any(axis=1))),
        typical_step=typical,
        frames=len(present),
        still=tuple(individuals[who] for who in np.flatnonzero((present.sum(axis=0) > 1) & ~moved)),
        every=every(present),
        headings=() if headings is None else doubt_headings(positions, present, headings),
    )


def _gap_lengths(present: np.ndarray) -> np.ndarray:
    """Return the lengths of the runs of frames without a position."""
    starts = np.flatnonzero(~present & np.concatenate([[True], present[:-1]]))
    return next_true(present)[starts] - starts


BACKWARDS = 0.25
"""Share of steps against the heading from which on headings are doubted: where they are right it is close to 0,
where they are in other units or another sense of rotation a half, and of the tail 1. Some robots and animals do
drive backwards."""
BEYOND = 0.75
"""Share of headings beyond 2 pi from which on they may be in degrees, of which 97 % are where all directions are as frequent."""
LEAPS = 0.01
"""Share of changes of more than pi from which on headings beyond 2 pi may be in degrees; those in rad are
beyond 2 pi where they are counted on from turn to turn, and then never change by so much."""


def doubt_headings(positions: np.ndarray, present: np.ndarray, headings: np.ndarray) -> tuple[str, ...]:
    """Return in words why headings (F, A) of positions (F, A, 2) may not be in rad or not of the head."""
    both = present[1:] & present[:-1]
    if not both.any():
        return ()
    changes = np.abs(np.diff(headings, axis=0))[both]
    beyond, leaps = (np.abs(headings[present]) > 2 * math.pi).mean(), (changes > math.pi).mean()
    if beyond > BEYOND and leaps > LEAPS:
        return (
            f"headings may be in degrees: {beyond:.0%} are beyond 2 pi, and {leaps:.0%} of their changes between frames are of "
            "more than pi; they are taken as rad",
        )
    step = np.diff(positions, axis=0)[both]
    length = np.hypot(step[:, 0], step[:, 1])
    if not length.any():
        return ()
    long = length >= np.median(length[length > 0])
    away = np.abs(wrap(np.arctan2(step[:, 1], step[:, 0]) - headings[:-1][both]))[long]
    backwards = (away > math.pi / 2).mean()
    if backwards <= BACKWARDS:
        return ()
    return (
        f"{backwards:.0%} of the longer steps go backwards by the headings: if that is not how they move, see whether headings "
        "are in rad, counted from x towards y in the file, and of the head",
    )
