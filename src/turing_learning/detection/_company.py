"""What the individuals of a recording do beside each other, at each step."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from turing_learning.trajectories import Trajectories, filled, smooth, wrap

SHORTEST_DELAY_S = 0.3
"""Least time (s) by which an individual may follow another: at once, all that move alike would."""
LONGEST_DELAY_S = 6.0
STRETCH_S = 30.0
"""In each stretch of about this length (s) an individual may follow another one, with another delay."""
SIZE_COLUMNS = [1, 2, 3, 5, 10]
"""Columns of `_absolute` that are compared with what is usual: turn, acceleration, and distances of the nearest other,
of the middle of all others and of where another was earlier."""


def paths_of(recording: Trajectories, smooth_frames: int = 1) -> np.ndarray:
    """Return positions (F, A, 2) with all gaps filled by straight motion."""
    paths = filled(recording.positions, recording.present)
    if smooth_frames == 1:
        return paths
    return smooth(paths, np.ones(paths.shape[:2], dtype=bool), smooth_frames)


class Usual(NamedTuple):
    """How much the individuals of a recording turn and accelerate, and how far others are."""

    # (5,), added to each size before its logarithm is taken: a hundredth of its median
    offset: np.ndarray
    logarithms: np.ndarray  # (F - 1, 5), medians over individuals


def usual_motion(paths: np.ndarray, fps: float) -> Usual:
    """Return what is usual in a recording whose paths (F, A, 2) are in cm and without gaps."""
    return _usual(_absolute(paths, range(paths.shape[1]), fps))


def company(
    paths: np.ndarray, individuals: Sequence[int], fps: float, usual: Usual | None = None
) -> list[np.ndarray]:
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

    By default, what is usual is the median over all individuals at the same time. Paths (F, A, 2)
    are in cm and without gaps.
    """
    if usual is None:
        everybody = _absolute(paths, range(paths.shape[1]), fps)
        usual = _usual(everybody)
        absolute = [everybody[k] for k in individuals]
    else:
        absolute = _absolute(paths, individuals, fps)
    related = []
    for features in absolute:
        logarithms = np.log(np.abs(features[:, SIZE_COLUMNS]) + usual.offset)
        relative = logarithms - usual.logarithms
        columns = (
            features[:, :3],
            relative[:, :2],
            features[:, 3:9],
            relative[:, 2:4],
            features[:, 9],
            logarithms[:, 4],
            relative[:, 4],
        )
        related.append(np.column_stack(columns))
    return related


def _absolute(paths: np.ndarray, individuals: Sequence[int], fps: float) -> list[np.ndarray]:
    """Return what each individual does at each step (F - 1, 11), not yet beside what is usual."""
    following = _following(paths, individuals, fps)
    pairs = zip(individuals, following, strict=True)
    return [np.column_stack((_beside_others(paths, k, fps), features)) for k, features in pairs]


def _beside_others(paths: np.ndarray, k: int, fps: float) -> np.ndarray:
    """Return how one moves, and where others and the border are, at each step (F - 1, 9)."""
    positions = paths[:-1]
    velocity = np.diff(paths[:, k], axis=0) * fps
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    steps = np.arange(len(positions))
    # One that rests keeps the direction of its last motion.
    last_moving = np.maximum.accumulate(np.where(speed > 1e-9, steps, 0))
    course = np.arctan2(velocity[last_moving, 1], velocity[last_moving, 0])
    fellows = np.delete(np.arange(paths.shape[1]), k)
    to_others = positions[:, fellows] - positions[:, k, None]
    distances = np.hypot(to_others[..., 0], to_others[..., 1])
    nearest = distances.argmin(axis=1)
    to_nearest = to_others[steps, nearest]
    to_middle = to_others.mean(axis=1)
    low = paths.min(axis=(0, 1))
    high = paths.max(axis=(0, 1))
    columns = (
        speed,
        wrap(np.diff(course, prepend=course[0])) * fps,
        np.diff(speed, prepend=speed[0]) * fps,
        distances[steps, nearest],
        wrap(np.arctan2(to_nearest[:, 1], to_nearest[:, 0]) - course),
        np.hypot(to_middle[:, 0], to_middle[:, 1]),
        np.cos(np.arctan2(to_middle[:, 1], to_middle[:, 0]) - course),
        np.minimum(positions[:, k] - low, high - positions[:, k]).min(axis=1),
        np.hypot(*(positions[:, k] - (low + high) / 2).T),
    )
    return np.stack(columns, axis=1)


def _usual(absolute: Sequence[np.ndarray]) -> Usual:
    """Return what is usual in a recording, from what `_absolute` finds of each individual."""
    sizes = np.abs(np.stack(absolute)[..., SIZE_COLUMNS])
    offset = 0.01 * np.median(sizes, axis=(0, 1)) + 1e-9
    return Usual(offset, np.median(np.log(sizes + offset), axis=0))


def _following(paths: np.ndarray, individuals: Sequence[int], fps: float) -> np.ndarray:
    """Return how individuals follow others, at each step (N, F - 1, 2).

    The first column says how much each does what another did earlier: its mean over a stretch is
    the correlation of two velocities. The second is the distance (cm) from where another was
    earlier. In each stretch, the other and the delay are those of the highest correlation, and
    those of the least mean square distance.
    """
    positions = paths[:-1] - paths.mean(axis=(0, 1))
    velocities = np.diff(paths, axis=0) * fps
    following = np.zeros((len(individuals), len(positions), 2))
    shortest = max(1, int(SHORTEST_DELAY_S * fps))
    longest = int(LONGEST_DELAY_S * fps)
    stretches = max(1, round(len(positions) / (STRETCH_S * fps)))
    for stretch in np.array_split(np.arange(len(positions)), stretches):
        begin = int(stretch[0])
        stop = begin + len(stretch)
        earliest = max(0, begin - longest)
        # At least half of a stretch must have a counterpart in the recording at each delay.
        delays = np.arange(shortest, min(longest, begin - earliest + len(stretch) // 2) + 1)
        if len(delays):
            starts = begin - earliest - delays
            count = len(stretch)
            correlations = _highest_correlations(
                velocities[earliest:stop], count, individuals, starts
            )
            distances = _least_distances(positions[earliest:stop], count, individuals, starts)
            following[:, stretch, 0] = list(correlations)
            following[:, stretch, 1] = list(distances)
    return following


def _highest_correlations(
    velocities: np.ndarray, count: int, individuals: Sequence[int], starts: np.ndarray
) -> Iterator[np.ndarray]:
    """Yield for each individual the shares (count,) of steps in the highest correlation with another.

    Arguments are those of `_earlier_products`.
    """
    products_of = _earlier_products(velocities, count, individuals, starts)
    for k, (products, squares) in zip(individuals, products_of, strict=True):
        velocity = velocities[-count:, k]
        scale = np.sqrt((velocity**2).sum() * squares) + 1e-12
        delay, leader = np.unravel_index((products / scale).argmax(), scale.shape)
        frames = starts[delay] + np.arange(count)
        earlier = velocities[np.maximum(frames, 0), leader + (leader >= k)]
        # Before the recording velocities are 0.
        earlier = np.where((frames >= 0)[:, None], earlier, 0.0)
        yield count * (velocity * earlier).sum(axis=1) / scale[delay, leader]


def _least_distances(
    positions: np.ndarray, count: int, individuals: Sequence[int], starts: np.ndarray
) -> Iterator[np.ndarray]:
    """Yield for each individual the distances (count,) from where the nearest other was earlier.

    Arguments are those of `_earlier_products`.
    """
    products_of = _earlier_products(positions, count, individuals, starts)
    unknown = np.maximum(-starts, 0)[:, None]
    for k, (products, squares) in zip(individuals, products_of, strict=True):
        position = positions[-count:, k]
        # Of each step and those after it: the first steps may have no counterpart.
        own_squares = np.cumsum((position**2).sum(axis=1)[::-1])[::-1]
        mean_squares = (own_squares[unknown] + squares - 2 * products) / (count - unknown)
        delay, leader = np.unravel_index(mean_squares.argmin(), mean_squares.shape)
        frames = starts[delay] + np.arange(count)
        earlier = positions[np.maximum(frames, 0), leader + (leader >= k)]
        distances = np.hypot(*(position - earlier).T)
        yield np.where(frames >= 0, distances, distances[frames >= 0].mean())


def _earlier_products(
    vectors: np.ndarray, count: int, individuals: Sequence[int], starts: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Multiply the last vectors of each of some individuals with earlier ones of the B others.

    Parameters
    ----------
    vectors : (F, A, 2)
        Of all individuals.
    count
        The last ones of an individual are multiplied by as many of another.
    starts : (L,)
        Frames from which the other's vectors are taken. Before frame 0 these are 0.

    Yields
    ------
    (L, B), (L, B)
        Sums of the products, and sums of the squares of the others' vectors.
    """
    # All products at once: a correlation is a product of Fourier transforms.
    size = 1 << (count + len(vectors) - 1).bit_length()
    own_spectra = np.conj(np.fft.rfft(vectors[-count:], size, axis=0))
    spectra = np.fft.rfft(vectors, size, axis=0)
    sums = np.cumsum((vectors**2).sum(axis=2), axis=0)
    sums = np.concatenate((np.zeros((1, vectors.shape[1])), sums))
    squares = sums[starts + count] - sums[np.maximum(starts, 0)]
    for k in individuals:
        products = (own_spectra[:, k, None] * np.delete(spectra, k, axis=1)).sum(axis=2)
        yield np.fft.irfft(products, size, axis=0)[starts], np.delete(squares, k, axis=1)
