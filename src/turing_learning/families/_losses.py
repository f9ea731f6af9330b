"""Individuals that a tracker loses where others are near: how often, and for how long."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from turing_learning.trajectories import Trajectories, nearest_others, next_true

from ._family import draw

LOSSES_A_CHANCE = 20
"""Losses, at least, by which it is estimated how often individuals are lost within a range of distances."""
FEWEST_SEEN = 2
"""Individuals that are seen in every frame of a sample, as it is of somebody with a nearest other.

So of two individuals none is lost, and of three no more than one at a time.
"""


class Losses(NamedTuple):
    """How a tracker loses individuals: N losses that ended, by the distance of the nearest other."""

    distances: np.ndarray  # (B - 1,): borders (cm) of the distances between which chances differ
    chances: np.ndarray  # (B,): of being lost in the next frame
    gaps: np.ndarray  # (N,): frames until each was found again
    #: (1,): share of the losses of one of two, nearest to each other, that are of both
    joint: np.ndarray


NO_LOSSES = Losses(np.zeros(0), np.zeros(1), np.zeros(0, dtype=np.int64), np.zeros(1))
"""Those of a tracker that loses nobody."""


def losses_of(recordings: Sequence[Trajectories], learned: Sequence[np.ndarray]) -> Losses:
    """Return how individuals are lost in recordings, by frames (F, A) of each that may be learned from.

    Whoever is not found again may have left.
    """
    distances = []
    lost = []
    gaps = []
    both: list[bool] = []
    for recording, may_be_learned in zip(recordings, learned, strict=True):
        present = recording.present & may_be_learned
        offset, has_neighbor = nearest_others(recording.positions, recording.present)
        observed = present[:-1] & may_be_learned[1:] & has_neighbor[:-1]
        gap = _gaps(recording.present)
        observed &= gap >= 0
        distances.append(np.hypot(offset[:-1, :, 0], offset[:-1, :, 1])[observed])
        lost.append(gap[observed] > 0)
        gaps.append(gap[observed & (gap > 0)])
        both += _both_lost(recording, offset, np.where(observed, gap, 0))
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
    return Losses(borders, chances, all_gaps, np.array([np.mean(both) if both else 0.0]))


def _both_lost(recording: Trajectories, offset: np.ndarray, gap: np.ndarray) -> list[bool]:
    """Return for each loss of one of two, nearest to each other, whether the other was lost meanwhile.

    `offset` (F, A, 2) leads to the nearest other. Somebody is lost where `gap` (F - 1, A) is not 0.
    """
    positions = recording.positions
    present = recording.present
    both = []
    for frame, individual in np.argwhere(gap):
        nearest_place = positions[frame, individual] + offset[frame, individual]
        distances = np.abs(positions[frame] - nearest_place).sum(axis=1)
        distances[~present[frame]] = np.inf
        distances[individual] = np.inf
        nearest = distances.argmin()
        if np.allclose(offset[frame, nearest], -offset[frame, individual]):
            until = frame + 1 + gap[frame, individual]
            both.append(not present[frame + 1 : until, nearest].all())
    return both


def _gaps(present: np.ndarray) -> np.ndarray:
    """Return for how many frames individuals are gone after a frame (F - 1, A); -1 where they do not come back."""
    frames = len(present)
    return_frame = next_true(present)[1:]
    gaps = return_frame - np.arange(1, frames)[:, None]
    return np.where(return_frame == frames, -1, gaps)


def lose(
    positions: np.ndarray,
    losses: Losses,
    rngs: Sequence[np.random.Generator],
    fewest: int = FEWEST_SEEN,
) -> np.ndarray:
    """Return positions (M, F, A, 2) with NaN where a tracker would have lost somebody; each group has its own generator.

    Two who are each other's nearest are lost together, and found together, as often as recorded ones.
    Nobody is lost in frames in which fewer than `fewest` would be left.
    """
    groups, frames, individuals, _ = positions.shape
    shape = frames, individuals
    shared_lots = draw(rngs, lambda rng: rng.random(shape))
    own_lots = draw(rngs, lambda rng: rng.random(shape))
    chosen = draw(rngs, lambda rng: rng.integers(len(losses.gaps), size=shape))
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
        has_other = np.isfinite(distance)
        mutual = has_other & (np.take_along_axis(nearest, nearest, axis=1) == everybody)
        pair = np.where(mutual, np.minimum(nearest, everybody), everybody)
        chance = losses.chances[np.searchsorted(losses.distances, distance)]
        # of both and of one alone, so that together they are as likely as recorded
        chance_of_both = np.where(mutual, losses.joint * chance, 0.0)
        together = np.take_along_axis(shared_lots[:, frame], pair, axis=1) < chance_of_both
        alone = own_lots[:, frame] < chance - chance_of_both
        loss = np.where(together, pair, everybody)
        gap = losses.gaps[np.take_along_axis(chosen[:, frame], loss, axis=1)]
        gone = has_other & (together | alone)
        return_frame = np.where(gone, frame + 1 + gap, return_frame)
    few = np.isfinite(tracked[..., 0]).sum(axis=2) < fewest
    tracked[few] = positions[few]
    return tracked
