"""What the individuals of a recording do beside each other, at each step."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from turing_learning.trajectories import Trajectories, filled, smooth, wrap

LAGS_S = (0.3, 6.0)
STRETCH_S = 30.0
"""In each stretch of about this length an individual may follow somebody else, at another distance in time."""
SIZES = [1, 2, 3, 5, 10]
"""Columns of `_moved` that are compared with what is usual: turn, acceleration, and distances of the nearest other, of
the middle of all others and of where another was earlier."""


def paths_of(recording: Trajectories, smooth_frames: int = 1) -> np.ndarray:
    """Return positions (F, A, 2) with all gaps filled by straight motion."""
    paths = filled(recording.positions, recording.present)
    return paths if smooth_frames == 1 else smooth(paths, np.ones(paths.shape[:2], dtype=bool), smooth_frames)


class Usual(NamedTuple):
    """How much all individuals of a recording turn and accelerate, and how far others are, at each time."""

    least: np.ndarray  # (5,), added to each size before its logarithm is taken: a hundredth of its median
    logarithms: np.ndarray  # (F - 1, 5), medians over individuals


def usual_motion(paths: np.ndarray, fps: float) -> Usual:
    """Return what is usual in a recording whose paths (F, A, 2) are in cm and without gaps."""
    return _usual(_moved(paths, range(paths.shape[1]), fps))


def company(paths: np.ndarray, whose: Sequence[int], fps: float, usual: Usual | None = None) -> list[np.ndarray]:
    """Return what some of two or more individuals do at each step, for each an array (F - 1, 16).

    Its columns are

    * 0 to 2: speed (cm/s), turn (rad/s), acceleration (cm/s^2);
    * 3, 4: logarithms of turn and acceleration, relative to what is usual;
    * 5, 6: distance (cm) and bearing (rad) of the nearest other;
    * 7, 8: distance (cm) of the middle of all others, and the cosine of its bearing;
    * 9, 10: distances (cm) from the border and from the middle of the space that all move in;
    * 11, 12: logarithms of the distances in columns 5 and 7, relative to what is usual;
    * 13: the share of each step in the correlation of its velocity with an earlier one of another;
    * 14, 15: logarithm of the distance (cm) from where another was earlier, and the same relative to what is usual.

    By default, what is usual is the median over all individuals at the same time. Paths (F, A, 2) are in cm and without
    gaps.
    """
    if usual is None:
        every = _moved(paths, range(paths.shape[1]), fps)
        usual, moved = _usual(every), [every[k] for k in whose]
    else:
        moved = _moved(paths, whose, fps)
    found = []
    for own in moved:
        logarithms = np.log(np.abs(own[:, SIZES]) + usual.least)
        relative = logarithms - usual.logarithms
        parts = own[:, :3], relative[:, :2], own[:, 3:9], relative[:, 2:4], own[:, 9], logarithms[:, 4], relative[:, 4]
        found.append(np.column_stack(parts))
    return found


def _moved(paths: np.ndarray, whose: Sequence[int], fps: float) -> list[np.ndarray]:
    """Return for each of some individuals what it does at each step (F - 1, 11), before it is compared with what is usual."""
    after = _after_others(paths, whose, fps)
    return [np.column_stack((_beside(paths, k, fps), each)) for k, each in zip(whose, after, strict=True)]


def _beside(paths: np.ndarray, k: int, fps: float) -> np.ndarray:
    """Return how an individual moves, and where others and the border are, at each step (F - 1, 9)."""
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
    """Return what is usual for all individuals of a recording, of each what `_moved` finds."""
    sizes = np.abs(np.stack(moved)[..., SIZES])
    least = 0.01 * np.median(sizes, axis=(0, 1)) + 1e-9
    return Usual(least, np.median(np.log(sizes + least), axis=0))


def _after_others(paths: np.ndarray, whose: Sequence[int], fps: float) -> np.ndarray:
    """Return how much individuals do what another did earlier, and how far they are from where another was (N, F - 1, 2).

    The mean of the first over a stretch is the correlation of two velocities; the second is a distance (cm). In each
    stretch, the other and the delay are those of the highest correlation, and those of the least mean square distance.
    """
    places, velocities = paths[:-1] - paths.mean(axis=(0, 1)), np.diff(paths, axis=0) * fps
    after = np.zeros((len(whose), len(places), 2))
    least, most = max(1, int(LAGS_S[0] * fps)), int(LAGS_S[1] * fps)
    for stretch in np.array_split(np.arange(len(places)), max(1, round(len(places) / (STRETCH_S * fps)))):
        begin, count = int(stretch[0]), len(stretch)
        early = max(0, begin - most)
        lags = np.arange(least, min(most, begin - early + count // 2) + 1)
        if not len(lags):
            continue
        first = begin - early - lags  # in what is known of others; below 0 before the recording
        steps = np.arange(count)
        missing = np.maximum(-first, 0)[:, None]
        known = velocities[early : begin + count]
        for one, k, (products, squares) in zip(after, whose, _products(known, count, whose, first), strict=True):
            mine = velocities[stretch, k]
            scale = np.sqrt((mine**2).sum() * squares) + 1e-12
            lag, who = np.unravel_index((products / scale).argmax(), scale.shape)
            back = first[lag] + steps
            before = np.where((back >= 0)[:, None], known[np.maximum(back, 0), who + (who >= k)], 0.0)
            one[stretch, 0] = count * (mine * before).sum(axis=1) / scale[lag, who]
        known = places[early : begin + count]
        for one, k, (products, squares) in zip(after, whose, _products(known, count, whose, first), strict=True):
            mine = places[stretch, k]
            left = np.cumsum((mine**2).sum(axis=1)[::-1])[::-1]  # of each step and those after it
            apart = (left[missing] + squares - 2 * products) / (count - missing)
            lag, who = np.unravel_index(apart.argmin(), apart.shape)
            back = first[lag] + steps
            found = np.hypot(*(mine - known[np.maximum(back, 0), who + (who >= k)]).T)
            one[stretch, 1] = np.where(back >= 0, found, found[back >= 0].mean())
    return after


def _products(
    known: np.ndarray, count: int, whose: Sequence[int], first: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield for each of some individuals how its last vectors go together with earlier ones of the B others.

    `known` holds the vectors of all (F, A, 2). The last `count` of an individual are multiplied by as many of another,
    from each step of `first` (L,) on; before step 0 these are 0. Yield the sums of the products (L, B), and the sums of
    the squares of the others' vectors (L, B).
    """
    size = 1 << (count + len(known) - 1).bit_length()
    mine, theirs = np.conj(np.fft.rfft(known[-count:], size, axis=0)), np.fft.rfft(known, size, axis=0)
    sums = np.cumsum(np.concatenate((np.zeros((1, known.shape[1])), (known**2).sum(axis=2))), axis=0)
    squares = sums[first + count] - sums[np.maximum(first, 0)]
    for k in whose:
        spectrum = (mine[:, k, None] * np.delete(theirs, k, axis=1)).sum(axis=2)
        yield np.fft.irfft(spectrum, size, axis=0)[first], np.delete(squares, k, axis=1)
