"""Positions to signals: what the classifiers get to see of motion."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from turing_learning.errors import brief, integer, number, require

SIGNALS = {"speed": "cm/s", "turn": "rad/s", "neighbor_distance": "cm", "neighbor_bearing": "rad"}
"""Signals and their units (px instead of cm where the scale is unknown)."""

DIRECTED = ("speed", "turn", "neighbor_bearing")
"""Signals that are others where headings are known."""


@dataclass(frozen=True, eq=False)
class Signals:
    """Signals of individuals over time: step s leads from frame s to frame s + 1."""

    values: np.ndarray  #: (..., F - 1, A, D): In the units that `SIGNALS` names; 0 where not valid
    valid: np.ndarray  #: (..., F - 1, A): Whether all D signals of the step exist
    names: tuple[str, ...]  #: Of the D signals


def compute_signals(
    positions: np.ndarray, *, fps: float, names: Sequence[str] = ("speed", "turn"), present: np.ndarray | None = None,
    headings: np.ndarray | None = None, smooth_frames: int = 1,
) -> Signals:  # fmt: skip
    """Compute signals from positions, recorded or simulated; speed and turn with headings: paper, section 3.2.3.

    "speed"
        Displacement over a frame divided by its duration; with headings negative if it goes against the heading
        at its start.
    "turn"
        Change of heading over a frame divided by its duration, the shorter way round. Without headings, the
        angle between the displacement before the step's first frame and the one after; no displacement keeps
        the direction of the last one since the individual appeared, and counts as no turn if there was none.
    "neighbor_distance", "neighbor_bearing"
        Distance of the nearest other individual present at the step's first frame, and its direction relative
        to the heading, in [-pi, pi), positive to the left. Without headings, relative to the direction in which
        the individual came.

    A step is valid if every frame that it needs is there: its own two, for "turn" and "neighbor_bearing"
    without headings also the one before, and for the neighbor's signals another individual.

    Parameters
    ----------
    positions : (..., F, A, 2)
        x, y (cm), at least 2 frames.
    fps
        Frames per second.
    names
        From `SIGNALS`, D of them.
    present, headings : (..., F, A)
        None if everybody is always present; None if headings (rad) are not known.
    smooth_frames
        Positions are averaged over so many frames (odd, centered, narrower toward gaps) before anything else; 1
        leaves them.

    Returns
    -------
    Signals
        Values (..., F - 1, A, D), and where they are valid.
    """
    positions = np.asarray(positions, dtype=np.float64)
    shape = positions.shape[:-1]
    fits = positions.ndim > 2 and positions.shape[-1] == 2 and positions.shape[-3] > 1
    rule = "be of shape (..., F, A, 2) with 2 frames or more"
    require(fits, "positions", rule, str(positions.shape))
    if present is None:
        present = np.ones(shape, dtype=bool)
    rule = f"be of shape (..., F, A) = {shape}"
    require(present.shape == shape, "present", rule, str(present.shape))
    if headings is not None:
        require(headings.shape == shape, "headings", rule, str(headings.shape))
    finite = np.isfinite(positions[present]).all()
    require(finite, "positions", "be finite wherever `present`", "a value that is not")
    number("fps", fps, above=0)
    fits = bool(names) and not isinstance(names, str)
    fits = fits and set(names) <= set(SIGNALS) and len(set(names)) == len(names)
    require(fits, "names", f"be some of {', '.join(SIGNALS)}, each once", brief(names))
    odd = integer("smooth_frames", smooth_frames, 1) % 2
    require(odd, "smooth_frames", "be odd and 1 or more", smooth_frames)
    if smooth_frames > 1:
        positions = smooth(positions, present, smooth_frames)
    # A step needs both of its frames
    consecutive = present[..., 1:, :] & present[..., :-1, :]
    step = np.where(consecutive[..., None], np.diff(positions, axis=-3), 0.0)
    length = np.hypot(step[..., 0], step[..., 1])
    heading, heading_known, turned, turn_known = _course(step, consecutive, headings)
    if headings is not None:
        # Somebody who moves against the heading goes backward
        against = step[..., 0] * np.cos(heading) + step[..., 1] * np.sin(heading) < 0
        length = np.where(against, -length, length)
    measured = {"speed": (length * fps, consecutive), "turn": (turned * fps, turn_known)}
    if {"neighbor_distance", "neighbor_bearing"} & set(names):
        offset, has_neighbor = nearest_others(positions[..., :-1, :, :], present[..., :-1, :])
        measured["neighbor_distance"] = (np.hypot(offset[..., 0], offset[..., 1]), has_neighbor)
        bearing = wrap(np.arctan2(offset[..., 1], offset[..., 0]) - heading)
        measured["neighbor_bearing"] = (bearing, has_neighbor & heading_known)
    columns = []
    # A step lacks all signals where it lacks one: classifiers see them together.
    valid = consecutive
    for name in names:
        column, exists = measured[name]
        columns.append(column)
        valid = valid & exists
    values = np.where(valid[..., None], np.stack(columns, axis=-1), 0.0)
    return Signals(values, valid, tuple(names))


def _course(
    step: np.ndarray, consecutive: np.ndarray, headings: np.ndarray | None
) -> tuple[np.ndarray, ...]:
    """Return heading at each step's first frame, where it exists, turn over the step, and where that exists."""
    if headings is not None:
        return headings[..., :-1, :], consecutive, wrap(np.diff(headings, axis=-2)), consecutive
    # The direction is that of the last displacement
    last_move = last_true(consecutive & (step != 0).any(axis=-1), -2)
    angle = np.arctan2(step[..., 1], step[..., 0])
    direction = np.take_along_axis(angle, np.maximum(last_move, 0), axis=-2)
    # since the last gap
    course_known = last_move > last_true(~consecutive, -2)
    came = _delayed(direction)
    came_known = _delayed(course_known)
    turned = np.where(course_known & came_known, wrap(direction - came), 0.0)
    return came, came_known, turned, consecutive & _delayed(consecutive)


def _delayed(values: np.ndarray) -> np.ndarray:
    """Return the values of the step before; the first has none."""
    return np.concatenate([np.zeros_like(values[..., :1, :]), values[..., :-1, :]], axis=-2)


def nearest_others(positions: np.ndarray, present: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return offsets (..., A, 2) to the nearest other individual, and whether there is one (..., A).

    Parameters
    ----------
    positions : (..., A, 2)
        x, y, finite also where nobody is.
    present : (..., A)
        Who is there; only these are anybody's neighbors.
    """
    offset = np.zeros_like(positions)
    nearest = np.full(present.shape, np.inf)
    # One shift after the other takes less memory than all pairs at once.
    for shift in range(1, positions.shape[-2]):
        candidate = np.roll(positions, -shift, axis=-2) - positions
        distance = np.hypot(candidate[..., 0], candidate[..., 1])
        distance = np.where(np.roll(present, -shift, axis=-1), distance, np.inf)
        closer = distance < nearest
        offset = np.where(closer[..., None], candidate, offset)
        nearest = np.where(closer, distance, nearest)
    return offset, np.isfinite(nearest)


def last_true(flags: np.ndarray, axis: int = 0) -> np.ndarray:
    """Return the place of the last true at or before each place, -1 if there is none."""
    shape = [1] * flags.ndim
    shape[axis] = flags.shape[axis]
    index = np.arange(flags.shape[axis]).reshape(shape)
    return np.maximum.accumulate(np.where(flags, index, -1), axis=axis)


def next_true(flags: np.ndarray, axis: int = 0) -> np.ndarray:
    """Return the place of the first true at or after each place, the length if there is none."""
    return flags.shape[axis] - 1 - np.flip(last_true(np.flip(flags, axis), axis), axis)


def lives_of(present: np.ndarray) -> np.ndarray:
    """Return the frames from the first position of each individual to its last one (F, A)."""
    return (last_true(present) >= 0) & (next_true(present) < len(present))


def smooth(positions: np.ndarray, present: np.ndarray, frames: int) -> np.ndarray:
    """Return centered moving averages (..., F, A, 2) over `frames`, narrower toward gaps, never across them."""
    count = present.shape[-2]
    frame = np.arange(count)[:, None]
    reach = np.minimum(frame - last_true(~present, -2) - 1, next_true(~present, -2) - frame - 1)
    reach = np.clip(reach, 0, frames // 2)
    total = np.zeros_like(positions)
    for offset in range(-(frames // 2), frames // 2 + 1):
        at = np.broadcast_to(np.clip(frame + offset, 0, count - 1), present.shape)
        shifted = np.take_along_axis(positions, at[..., None], axis=-3)
        total += np.where((abs(offset) <= reach)[..., None], shifted, 0.0)
    return np.where(present[..., None], total / (2 * reach + 1)[..., None], 0.0)


def filled(positions: np.ndarray, present: np.ndarray) -> np.ndarray:
    """Return positions (F, A, 2) with gaps filled by straight motion, held before the first known one and after the last."""
    frames = np.arange(len(positions))
    paths = positions.copy()
    for k in np.flatnonzero(present.any(axis=0)):
        at = present[:, k]
        for axis in range(2):
            paths[:, k, axis] = np.interp(frames, frames[at], paths[at, k, axis])
    return paths


def wrap(angle: np.ndarray) -> np.ndarray:
    """Return angles (rad) in [-pi, pi)."""
    return (angle + np.pi) % (2 * np.pi) - np.pi
