"""Positions that can hardly be true: those that stand for missing ones, and those far outside all others."""

from dataclasses import dataclass

import numpy as np

LONGEST_REST_S = 10.0
"""Time at exactly one point (s) from which on nobody rests: a lost track, or a tracker that repeats the last position.
In the termite recordings of the tests the longest such rest has 2.5 s."""
LONGEST_REST_FRAMES = 50
"""The same in frames, where there are few per second."""
STAY_S, STAY_FRAMES = 0.5, 5
"""What counts as a stay at a point, in s and in frames."""
RELEASE = 5.0
"""Typical steps from which on a step to or from a stay is none of an animal that rests. Of 400 stays in the recordings
of the tests, the fastest one ends with 1.1."""
COMMON = 0.05
"""Share of all positions from which on those at one point do not tell what is typical."""
MIDDLE, MARGIN = 0.9, 2.0
"""Far outside: beyond the middle 90 % of all coordinates by so many times the extent of these."""
GHOST_S = 1.0
"""Time (s) up to which somebody who only is far outside is nobody."""


@dataclass(frozen=True, eq=False)
class Unlikely:
    """Which positions can hardly be true."""

    stand_ins: np.ndarray  #: (F, A): At one exact point, as those that stand for missing ones
    outside: np.ndarray  #: (F, A): Far outside all others


class _Paths:
    """The N known ones of positions (F, A, 2), one individual after the other, with the pace between them."""

    def __init__(self, positions: np.ndarray, known: np.ndarray) -> None:
        self.who, self.frame = np.nonzero(known.T)
        self.places = positions[self.frame, self.who]
        lengths = np.hypot(*np.diff(self.places, axis=0).T)
        paces = lengths / np.maximum(np.diff(self.frame), 1)
        #: Distance per frame (N - 1,) to the next position, infinite where that is another individual's
        self.pace = np.where(np.diff(self.who) == 0, paces, np.inf)

    def parts(self, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the part of each position (N,), and of each part its first and last position; `ends` (N - 1,) are between parts."""
        first = np.concatenate(([0], np.flatnonzero(ends) + 1))
        last = np.append(first[1:] - 1, len(ends))
        return np.repeat(np.arange(len(first)), last - first + 1), first, last

    def mark(self, mask: np.ndarray, where: np.ndarray) -> None:
        """Set a mask (F, A) at some of the positions (N,)."""
        mask[self.frame[where], self.who[where]] = True


class _Stays:
    """Stays of S individuals at exactly one point, most of them for one frame."""

    def __init__(self, paths: _Paths) -> None:
        self.of, first, last = paths.parts(paths.pace > 0)
        self.frames = paths.frame[last] - paths.frame[first] + 1
        self.points = paths.places[first]
        # no pace where a path begins or ends
        paces = np.concatenate(([np.inf], paths.pace, [np.inf]))
        paces = np.where(np.isinf(paces), 0.0, paces)
        self.before, self.after = paces[first], paces[last + 1]


def find_unlikely(
    positions: np.ndarray, present: np.ndarray, fps: float, jump_factor: float | None, longest_rest_s: float | None
) -> Unlikely:
    """Return which positions (F, A, 2) can hardly be true.

    Without a `jump_factor` or a `longest_rest_s` none is so for being reached by a jump, or for staying for long.
    """
    stand_ins, outside = np.zeros_like(present), np.zeros_like(present)
    known, least = present.copy(), max(STAY_FRAMES, round(STAY_S * fps))
    typical = _typical_pace(_Paths(positions, present))
    if jump_factor is not None:
        paths = _Paths(positions, present)
        stays, jump = _Stays(paths), jump_factor * typical
        there_and_back = np.minimum(stays.before, stays.after) > jump
        at_origin = (stays.points == 0).all(axis=1) & (np.maximum(stays.before, stays.after) > jump)
        again = np.zeros_like(at_origin)
        again[there_and_back] = _counts(stays.points[there_and_back]) > 1
        false = at_origin | (there_and_back & (again | (stays.frames >= least)))
        paths.mark(stand_ins, false[stays.of])
        hidden = np.zeros_like(present)
        # somebody may rest before and after a position that is wrong
        paths.mark(hidden, (false | there_and_back)[stays.of])
        known &= ~hidden
    if known.any():
        paths = _Paths(positions, known)
        stays = _Stays(paths)
        false = np.zeros(len(stays.frames), dtype=bool)
        if jump_factor is not None:
            false |= (stays.frames >= least) & (np.maximum(stays.before, stays.after) > RELEASE * typical)
        if longest_rest_s is not None:
            false |= stays.frames >= max(LONGEST_REST_FRAMES, longest_rest_s * fps)
        paths.mark(stand_ins, false[stays.of])
    if jump_factor is not None and (present & ~stand_ins).any():
        _mark_outside(outside, _Paths(positions, present & ~stand_ins), jump_factor * typical, GHOST_S * fps)
    return Unlikely(stand_ins, outside)


def _typical_pace(paths: _Paths) -> float:
    """Return the median of the paces that are not 0, but for those to and from points at which much of all is."""
    common = (_counts(paths.places) > COMMON * len(paths.places)) | (paths.places == 0).all(axis=1)
    moving = (paths.pace > 0) & np.isfinite(paths.pace)
    usual = moving & ~common[1:] & ~common[:-1]
    paces = paths.pace[usual if usual.any() else moving]
    return float(np.median(paces)) if len(paces) else 0.0


def _counts(points: np.ndarray) -> np.ndarray:
    """Return how often each of S points (S, 2) occurs among them (S,)."""
    _, number, counts = np.unique(points @ [1, 1j], return_inverse=True, return_counts=True)
    return counts[number]


def _mark_outside(mask: np.ndarray, paths: _Paths, jump: float, ghost: float) -> None:
    """Mark the pieces of paths, between jumps, that never come near the middle of all coordinates."""
    low, high = np.quantile(paths.places, [(1 - MIDDLE) / 2, (1 + MIDDLE) / 2], axis=0)
    extent = (high - low).max()
    margin = MARGIN * extent
    inside = ((paths.places >= low - margin) & (paths.places <= high + margin)).all(axis=1)
    if inside.all() or not extent:
        return
    piece, first, last = paths.parts(paths.pace > max(jump, extent))
    away = np.bincount(piece, inside) == 0
    elsewhere = np.bincount(paths.who, inside)[paths.who[first]] > 0
    short = paths.frame[last] - paths.frame[first] < ghost
    paths.mark(mask, (away & (elsewhere | short))[piece])
