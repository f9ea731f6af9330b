"""Moments of recorded groups, at which groups of models begin."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from turing_learning.errors import require

from ..arrays import array
from ..trajectories import Trajectories

MOST_STARTS = 500
"""Moments that are kept of a recording, evenly over its time."""


@dataclass(frozen=True, eq=False)
class RecordedStarts:
    """Where the individuals of a group were at some moments, and in which direction they moved."""

    positions: np.ndarray  #: (S, A, 2): x, y (cm) of A individuals at S moments
    #: (S, A): their headings, or the directions of their last displacements (rad). Where they are NaN, as of those who
    #: rested, they are drawn by chance
    directions: np.ndarray

    def __post_init__(self) -> None:
        positions = array("positions", self.positions, "S A 2")
        sizes = {"S": positions.shape[0], "A": positions.shape[1]}
        array("directions", self.directions, "S A", finite=False, **sizes)
        require(len(positions) > 0, "positions", "be of one moment at least", 0)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RecordedStarts):
            return NotImplemented
        same_places = np.array_equal(self.positions, other.positions)
        return same_places and np.array_equal(self.directions, other.directions, equal_nan=True)

    def __hash__(self) -> int:
        return hash(self.positions.tobytes())

    def drawn(self, uniforms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return positions (M, A, 2) and directions (M, A) of one moment for each model.

        Individuals come in an order of their own for each model: the first ones are observed, and who was recorded first
        is nobody in particular. `uniforms` (M, 3, A) are random numbers from 0 to 1.
        """
        moments = (uniforms[:, 0, 0] * len(self.positions)).astype(int)
        order = uniforms[:, 1].argsort(axis=1)
        positions = np.take_along_axis(self.positions[moments], order[:, :, None], axis=1)
        directions = np.take_along_axis(self.directions[moments], order, axis=1)
        return positions, np.where(np.isnan(directions), 2 * np.pi * uniforms[:, 2], directions)


def without_jumps(recording: Trajectories) -> np.ndarray:
    """Return where everybody was (F, A, 2), NaN where they were not seen, or at both ends of a jump of the tracker."""
    path = np.where(recording.present[..., None], recording.positions, np.nan)
    for jump in recording.check().jumps:
        frame = jump.frame - recording.first_frame
        path[frame : frame + 2, recording.individuals.index(jump.individual)] = np.nan
    return path


def recorded_starts(
    recording: Trajectories,
    learned: np.ndarray,
    individuals: int,
    tank_cm: tuple[float, float] | None = None,
    *,
    headings: bool = False,
) -> RecordedStarts | None:
    """Return moments of a recording at which so many individuals were there at once, or None if there is none.

    Parameters
    ----------
    recording
        In cm. Positions that can hardly be true are left out.
    learned : (F,)
        Which of its frames may be learned from.
    individuals
        Number of individuals A.
    tank_cm
        Width and height of a tank (cm), one corner of which is the origin. What was recorded lies in its middle.
    headings
        Whether individuals have headings of their own, which may be against their motion.
    """
    likely = recording.cleared(longest_rest_s=None)
    path = without_jumps(likely)
    seen = np.isfinite(path).all(axis=-1)
    there = seen[1:] & seen[:-1]
    usable = learned[1:] & learned[:-1] & (there.sum(axis=1) >= individuals)
    steps = np.flatnonzero(usable)
    if not len(steps):
        return None
    count = min(MOST_STARTS, len(steps))
    steps = steps[np.linspace(0, len(steps) - 1, count).round().astype(int)]
    # of more than are asked for, the first ones
    who = np.argsort(~there[steps], axis=1, kind="stable")[:, :individuals]
    steps = steps[:, None]
    low, high = likely.reach
    corner = low
    if tank_cm is not None:
        corner = (low + high - tank_cm) / 2
    after = path[steps + 1, who]
    if not headings:
        moved = after - path[steps, who]
        directions = np.arctan2(moved[..., 1], moved[..., 0])
        directions[~moved.any(axis=-1)] = np.nan
    elif likely.headings is None:
        # who may drive backwards does not show its heading
        directions = np.full(after.shape[:-1], np.nan)
    else:
        directions = likely.headings[steps + 1, who]
    return RecordedStarts(after - corner, directions)


def joined_starts(starts: Sequence[RecordedStarts | None]) -> RecordedStarts | None:
    """Return the moments of several recordings of groups of one size together, or None if there are none."""
    recorded = [moments for moments in starts if moments is not None]
    if not recorded:
        return None
    positions = np.concatenate([moments.positions for moments in recorded])
    directions = np.concatenate([moments.directions for moments in recorded])
    return RecordedStarts(positions, directions)
