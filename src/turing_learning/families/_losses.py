"""Individuals that a tracker loses where others are near: how often, and for how long."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from turing_learning.trajectories import Trajectories, nearest_others

from ._family import draw

LOSSES_A_CHANCE = 20
"""Losses, at least, by which it is estimated how often individuals are lost within a range of distances."""
FEWEST_SEEN = 2
"""Individuals that are seen in every frame: a sample is of somebody with a nearest other."""


class Losses(NamedTuple):
    """How a tracker loses individuals: N losses that ended, by the distance of the nearest other."""

    distances: np.ndarray  # (B - 1,): borders (cm) of the distances between which chances differ
    chances: np.ndarray  # (B,): of being lost in the next frame
    gaps: np.ndarray  # (N,): frames until each was found again


NO_LOSSES = Losses(np.zeros(0), np.zeros(1), np.zeros(0, dtype=np.int64))
"""Those of a tracker that loses nobody."""


def losses_of(recordings: Sequence[Trajectories], learned: Sequence[np.ndarray]) -> Losses:
    """Return how individuals are lost in recordings, by frames (F, A) of each that may be learned from.

    Whoever is not found again may have left.
    """
    distances = []
    lost = []
    gaps = []
    for recording, may_be_learned in zip(recordings, learned, strict=True):
        present = recording.present & may_be_learned
        offset, has_neighbor = nearest_others(recording.positions, recording.present)
        observed = present[:-1] & may_be_learned[1:] & has_neighbor[:-1]
        gap = _gaps(recording.present)
        observed &= gap >= 0
        distances.append(np.hypot(offset[:-1, :, 0], offset[:-1, :, 1])[observed])
        lost.append(gap[observed] > 0)
        gaps.append(gap[observed & (gap > 0)])
    all_gaps = np.concatenate(gaps)
    if not len(all_gaps):
        return NO_LOSSES
    is_lost = np.concatenate(lost)
    all_distances = np.concatenate(distances)
    ranges = max(len(all_gaps) // LOSSES_A_CHANCE, 1)
    shares = np.linspace(0, 1, ranges + 1)[1:-1]
    borders = np.unique(np.quantile(all_distances[is_lost], shares))
    which = np.searchsorted(borders, all_distances)
    at_risk = np.bincount(which, minlength=len(borders) + 1)
    chances = np.bincount(which, is_lost, len(borders) + 1) / np.maximum(at_risk, 1)
    return Losses(borders, chances, all_gaps)


def _gaps(present: np.ndarray) -> np.ndarray:
    """Return for how many frames individuals are gone after a frame (F - 1, A); -1 where they do not come back."""
    frames = len(present)
    at = np.where(present, np.arange(frames)[:, None], frames)
    return_frame = np.minimum.accumulate(at[::-1], axis=0)[::-1][1:]
    gaps = return_frame - np.arange(1, frames)[:, None]
    return np.where(return_frame == frames, -1, gaps)


def lose(positions: np.ndarray, losses: Losses, rngs: Sequence[np.random.Generator]) -> np.ndarray:
    """Return positions (M, F, A, 2) with NaN where a tracker would have lost somebody; each group has its own generator.

    Two who are each other's nearest are lost together, and found together.
    """
    groups, frames, individuals, _ = positions.shape
    lots = draw(rngs, lambda rng: rng.random((frames, individuals)))
    chosen = draw(rngs, lambda rng: rng.integers(len(losses.gaps), size=(frames, individuals)))
    tracked = positions.copy()
    everybody = np.arange(individuals)
    return_frame = np.zeros((groups, individuals), dtype=np.int64)
    for frame in range(frames):
        is_lost = return_frame > frame
        tracked[:, frame][is_lost] = np.nan
        positions_now = tracked[:, frame]
        squares = np.square(positions_now[:, :, None] - positions_now[:, None]).sum(axis=-1)
        squares[:, everybody, everybody] = np.inf
        squares[np.isnan(squares)] = np.inf
        nearest = squares.argmin(axis=2)
        distance = np.sqrt(squares.min(axis=2))
        mutual = np.take_along_axis(nearest, nearest, axis=1) == everybody
        pair = np.where(mutual, np.minimum(nearest, everybody), everybody)
        lot = np.take_along_axis(lots[:, frame], pair, axis=1)
        gap = losses.gaps[np.take_along_axis(chosen[:, frame], pair, axis=1)]
        gone = lot < losses.chances[np.searchsorted(losses.distances, distance)]
        gone &= np.isfinite(distance)
        return_frame = np.where(gone, frame + 1 + gap, return_frame)
    few = np.isfinite(tracked[..., 0]).sum(axis=2) < FEWEST_SEEN
    tracked[few] = positions[few]
    return tracked
