"""Positions that can hardly be true: those that stand for missing ones, and those far outside."""

from dataclasses import dataclass

import numpy as np

LONGEST_REST_S = 10.0
"""Time at exactly one point (s) from which on nobody rests: a lost track, or a tracker that repeats
the last position. In the termite recordings of the tests the longest such rest has 2.5 s."""
LONGEST_REST_FRAMES = 50
"""The same in frames, where there are few per second."""
REST_SHARE = 0.9
REST_FACTOR = 4.0
FEWEST_RESTS = 10
"""Where there are so many shorter rests, one may last four times as long as nine of ten of them."""
STAY_S = 0.5
STAY_FRAMES = 5
"""What counts as a stay at a point, in s and in frames, whichever is longer."""
RELEASE = 5.0
"""Typical steps from which on a step to or from a stay is none of an animal that rests. Of 400 stays
in the recordings of the tests, the fastest one ends with 1.1."""
MARKS = 5
"""Stays at exactly one point for missing positions from which on all stays there are such."""
COMMON = 0.05
"""Share of all positions from which on those at one point do not tell what is typical."""
SAMPLED = 5000
"""Positions in which such points are looked for."""
MIDDLE = 0.9
FAR_OUTSIDE = 2.0
"""Far outside: beyond the middle 90 % of all coordinates by so many times the extent of these."""
GHOST_S = 1.0
"""Time (s) up to which somebody who only is far outside is nobody."""


@dataclass(frozen=True, eq=False)
class Unlikely:
    """Which positions can hardly be true."""

    stand_ins: np.ndarray  #: (F, A): At one exact point, as those that stand for missing ones
    outside: np.ndarray  #: (F, A): Far outside all others


class _Paths:
    """The N positions that are there, one individual after the other, with the pace between them."""

    def __init__(self, positions: np.ndarray, present: np.ndarray) -> None:
        self.who, self.frame = np.nonzero(present.T)
        self.points = positions[self.frame, self.who]
        lengths = np.hypot(*np.diff(self.points, axis=0).T)
        paces = lengths / np.maximum(np.diff(self.frame), 1)
        #: Distance per frame to the next position (N - 1,), infinite where that is another's
        self.pace = np.where(np.diff(self.who) == 0, paces, np.inf)

    def pieces(self, breaks: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the piece of each position (N,), and where each piece begins and ends.

        A piece ends behind some of the positions (N - 1,).
        """
        begins = np.concatenate(([0], np.flatnonzero(breaks) + 1))
        stops = np.append(begins[1:] - 1, len(breaks))
        numbers = np.repeat(np.arange(len(begins)), stops - begins + 1)
        return numbers, begins, stops

    def suspects(self, jump: float, stay: int, individuals: int) -> np.ndarray:
        """Return who jumps, or does not move for as many frames as a stay has (A,)."""
        who = self.who[1:]
        jumping = np.bincount(who, (self.pace > jump) & np.isfinite(self.pace), individuals)
        resting = np.bincount(who, self.pace == 0, individuals)
        return (jumping > 0) | (resting >= stay - 1)

    def mark(self, mask: np.ndarray, chosen: np.ndarray) -> None:
        """Set a mask (F, A) at some of the positions (N,)."""
        mask[self.frame[chosen], self.who[chosen]] = True


class _Stays:
    """The S stays of individuals at exactly one point, most of them for one frame."""

    def __init__(self, paths: _Paths) -> None:
        self.of, begins, stops = paths.pieces(paths.pace > 0)
        self.frames = paths.frame[stops] - paths.frame[begins] + 1
        self.points = paths.points[begins]
        # a path begins and ends without a pace
        paces = np.concatenate(([np.inf], paths.pace, [np.inf]))
        paces[np.isinf(paces)] = 0.0
        self.before = paces[begins]
        self.after = paces[stops + 1]


def find_unlikely(
    positions: np.ndarray, present: np.ndarray, fps: float, jump_factor: float | None,
    longest_rest_s: float | None,
) -> Unlikely:  # fmt: skip
    """Return which positions (F, A, 2) can hardly be true.

    Without a `jump_factor` none is so for being reached by a jump, without `longest_rest_s` none for
    staying where it was.
    """
    stand_ins = np.zeros_like(present)
    outside = np.zeros_like(present)
    paths = _Paths(positions, present)
    typical = _typical_pace(paths)
    jump = np.inf if jump_factor is None else jump_factor * typical
    release = np.inf if jump_factor is None else RELEASE * typical
    longest = np.inf
    if longest_rest_s is not None:
        longest = max(LONGEST_REST_FRAMES, longest_rest_s * fps)
    stay = max(STAY_FRAMES, round(STAY_S * fps))
    doubted = present & paths.suspects(jump, stay, present.shape[1])
    if doubted.any():
        doubted &= ~_mark_markers(stand_ins, _Paths(positions, doubted), jump, stay)
    if doubted.any():
        _mark_stays(stand_ins, _Paths(positions, doubted), release, stay, longest)
    likely = present & ~stand_ins
    if jump_factor is not None and likely.any():
        _mark_outside(outside, _Paths(positions, likely), jump, GHOST_S * fps)
    return Unlikely(stand_ins, outside)


def _typical_pace(paths: _Paths) -> float:
    """Return the median pace, but for 0 and for those to and from points at which many are."""
    sampled = paths.points[:: len(paths.points) // SAMPLED + 1]
    common = (paths.points == 0).all(axis=1)
    for point in np.unique(sampled[_counts(sampled) > COMMON * len(sampled)], axis=0):
        common |= (paths.points == point).all(axis=1)
    moving = (paths.pace > 0) & np.isfinite(paths.pace)
    usual = moving & ~common[1:] & ~common[:-1]
    paces = paths.pace[usual if usual.any() else moving]
    return float(np.median(paces)) if len(paces) else 0.0


def _counts(points: np.ndarray) -> np.ndarray:
    """Return how often each of S points (S, 2) occurs among them (S,)."""
    _, numbers, counts = np.unique(points @ [1, 1j], return_inverse=True, return_counts=True)
    return counts[numbers]


def _mark_markers(mask: np.ndarray, paths: _Paths, jump: float, stay: int) -> np.ndarray:
    """Mark stays at points that a tracker writes for missing positions.

    Return all stays to which somebody jumps, and from there (F, A): who rests before and after one
    of them rests all the time.
    """
    stays = _Stays(paths)
    there_and_back = np.minimum(stays.before, stays.after) > jump
    at_origin = (stays.points == 0).all(axis=1) & (np.maximum(stays.before, stays.after) > jump)
    again = np.zeros_like(at_origin)
    again[there_and_back] = _counts(stays.points[there_and_back]) > 1
    markers = at_origin | (there_and_back & (again | (stays.frames >= stay)))
    # nobody is at exactly such a point, also where a path begins, or passes nearby
    places = stays.points @ [1, 1j]
    often = _counts(stays.points[markers]) >= MARKS
    markers |= np.isin(places, places[markers][often])
    paths.mark(mask, markers[stays.of])
    aside = np.zeros_like(mask)
    paths.mark(aside, (at_origin | there_and_back)[stays.of])
    return aside


def _mark_stays(mask: np.ndarray, paths: _Paths, release: float, stay: int, longest: float) -> None:
    """Mark stays that begin or end as no rest does, or are too long for one."""
    stays = _Stays(paths)
    abrupt = np.maximum(stays.before, stays.after) > release
    rests = stays.frames[(stays.frames >= stay) & (stays.frames < longest) & ~abrupt]
    if len(rests) >= FEWEST_RESTS:
        longest = max(longest, REST_FACTOR * float(np.quantile(rests, REST_SHARE)))
    false = (stays.frames >= longest) | ((stays.frames >= stay) & abrupt)
    paths.mark(mask, false[stays.of])


def _mark_outside(mask: np.ndarray, paths: _Paths, jump: float, ghost: float) -> None:
    """Mark pieces of paths, between jumps, that never come near the middle of all coordinates."""
    low, high = np.quantile(paths.points, [(1 - MIDDLE) / 2, (1 + MIDDLE) / 2], axis=0)
    extent = (high - low).max()
    beyond = (paths.points < low - FAR_OUTSIDE * extent) | (
        paths.points > high + FAR_OUTSIDE * extent
    )
    inside = ~beyond.any(axis=1)
    if inside.all() or not extent:
        return
    numbers, begins, stops = paths.pieces(paths.pace > max(jump, extent))
    away = np.bincount(numbers, inside) == 0
    elsewhere = np.bincount(paths.who, inside)[paths.who[begins]] > 0
    short = paths.frame[stops] - paths.frame[begins] < ghost
    paths.mark(mask, (away & (elsewhere | short))[numbers])
