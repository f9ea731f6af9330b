"""What the individuals of a recording do beside each other, at each step."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from turing_learning.trajectories import Trajectories
from turing_learning.trajectories._signals import filled, smooth, wrap

LAGS_S = (0.3, 6.0)
STRETCH_S = 30.0
"""In each stretch of about this length an individual may follow somebody else, at another distance in time."""
SIZES = [1, 2, 3, 5]
"""Columns of `_beside` that are compared with what is usual: turn, acceleration, and distances of the nearest other and of
the middle of all others."""


def paths_of(recording: Trajectories, smooth_frames: int = 1) -> np.ndarray:
    """Return positions (F, A, 2) with all gaps filled by straight motion."""
    paths = filled(recording.positions, recording.present)
    return paths if smooth_frames == 1 else smooth(paths, np.ones(paths.shape[:2], dtype=bool), smooth_frames)


class Usual(NamedTuple):
    """How much all individuals of a recording turn and accelerate, and how far others are, at each time."""

    least: np.ndarray  # (4,), added to each size before its logarithm is taken: a hundredth of its median
    logarithms: np.ndarray  # (F - 1, 4), medians over individuals


def usual_motion(paths: np.ndarray, fps: float) -> Usual:
    """Return what is usual in a recording whose paths (F, A, 2) are in cm and without gaps."""
    return _usual([_beside(paths, k, fps) for k in range(paths.shape[1])])


def company(paths: np.ndarray, whose: Sequence[int], fps: float, usual: Usual | None = None) -> list[np.ndarray]:
    """Return what some of two or more individuals do at each step, for each an array (F - 1, 14).

    Its columns are

    * 0 to 2: speed (cm/s), turn (rad/s), acceleration (cm/s^2);
    * 3, 4: logarithms of turn and acceleration, relative to what is usual;
    * 5, 6: distance (cm) and bearing (rad) of the nearest other;
    * 7, 8: distance (cm) of the middle of all others, and the cosine of its bearing;
    * 9, 10: distances (cm) from the border and from the middle of the space that all move in;
    * 11: the share of each step in the correlation of its velocity with an earlier one of another;
    * 12, 13: logarithms of the distances in columns 5 and 7, relative to what is usual.

    By default, what is usual is the median over all individuals at the same time. Paths (F, A, 2) are in cm and without
    gaps.
    """
    moved = {k: _beside(paths, k, fps) for k in (whose if usual else range(paths.shape[1]))}
    usual = usual or _usual(list(moved.values()))
    velocities, found = np.diff(paths, axis=0) * fps, []
    for k in whose:
        followed = _following(velocities[:, k], np.delete(velocities, k, axis=1), fps)
        relative = np.log(np.abs(moved[k][:, SIZES]) + usual.least) - usual.logarithms
        found.append(np.column_stack((moved[k][:, :3], relative[:, :2], moved[k][:, 3:], followed, relative[:, 2:])))
    return found


def _beside(paths: np.ndarray, k: int, fps: float) -> np.ndarray:
    """Return the columns of `company` of an individual that take neither what is usual nor earlier times (F - 1, 9)."""
    places, own = paths[:-1], np.diff(paths[:, k], axis=0) * fps
    steps, others = np.arange(len(places)), np.delete(np.arange(paths.shape[1]), k)
    speed = np.hypot(own[:, 0], own[:, 1])
    moving = np.maximum.accumulate(np.where(speed > 1e-9, steps, 0))  # who rests keeps its direction
    course = np.arctan2(own[moving, 1], own[moving, 0])
    way = places[:, others] - places[:, k, None]
    distances = np.hypot(way[..., 0], way[..., 1])
    nearest = distances.argmin(axis=1)
    to, middle = way[steps, nearest], way.mean(axis=1)
    ahead = np.cos(np.arctan2(middle[:, 1], middle[:, 0]) - course)
    low, high = paths.min(axis=(0, 1)), paths.max(axis=(0, 1))
    columns = (
        speed,
        wrap(np.diff(course, prepend=course[0])) * fps,
        np.diff(speed, prepend=speed[0]) * fps,
        distances[steps, nearest],
        wrap(np.arctan2(to[:, 1], to[:, 0]) - course),
        np.hypot(middle[:, 0], middle[:, 1]),
        ahead,
        np.minimum(places[:, k] - low, high - places[:, k]).min(axis=1),
        np.hypot(*(places[:, k] - (low + high) / 2).T),
    )
    return np.stack(columns, axis=1)


def _usual(moved: Sequence[np.ndarray]) -> Usual:
    """Return what is usual for all individuals of a recording, of each what `_beside` finds."""
    sizes = np.abs(np.stack(moved)[..., SIZES])
    least = 0.01 * np.median(sizes, axis=(0, 1)) + 1e-9
    return Usual(least, np.median(np.log(sizes + least), axis=0))


def _following(own: np.ndarray, others: np.ndarray, fps: float) -> np.ndarray:
    """Return the parts (F,) whose mean is the highest correlation of a velocity (F, 2) with earlier ones of others (F, B, 2)."""
    found, least, most = np.zeros(len(own)), max(1, int(LAGS_S[0] * fps)), int(LAGS_S[1] * fps)
    for stretch in np.array_split(np.arange(len(own)), max(1, round(len(own) / (STRETCH_S * fps)))):
        begin, count = int(stretch[0]), len(stretch)
        early = max(0, begin - most)
        mine, theirs = own[stretch], others[early : begin + count]
        lags = np.arange(least, min(most, begin - early + count // 2) + 1)
        if not len(lags):
            continue
        size = 1 << (count + len(theirs) - 1).bit_length()
        spectrum = np.conj(np.fft.rfft(mine, size, axis=0))[:, None] * np.fft.rfft(theirs, size, axis=0)
        first = begin - early - lags  # in `theirs`; below 0 before the recording
        shared = np.fft.irfft(spectrum.sum(axis=2), size, axis=0)[first]
        sums = np.cumsum(np.concatenate((np.zeros((1, theirs.shape[1])), (theirs**2).sum(axis=2))), axis=0)
        scale = np.sqrt((mine**2).sum() * (sums[first + count] - sums[np.maximum(first, 0)])) + 1e-12
        lag, who = np.unravel_index((shared / scale).argmax(), shared.shape)
        back = first[lag] + np.arange(count)
        before = np.where((back >= 0)[:, None], theirs[np.maximum(back, 0), who], 0.0)
        found[stretch] = count * (mine * before).sum(axis=1) / scale[lag, who]
    return found
