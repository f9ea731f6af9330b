"""Gaps and the stretches between them."""

import numpy as np


def last_true(flags: np.ndarray, axis: int = 0) -> np.ndarray:
    """Return the place of the last true at or before each place, -1 if there is none."""
    shape = [1] * flags.ndim
    shape[axis] = flags.shape[axis]
    return np.maximum.accumulate(np.where(flags, np.arange(flags.shape[axis]).reshape(shape), -1), axis=axis)


def next_true(flags: np.ndarray, axis: int = 0) -> np.ndarray:
    """Return the place of the first true at or after each place, the length if there is none."""
    return flags.shape[axis] - 1 - np.flip(last_true(np.flip(flags, axis), axis), axis)


def bridge(
    positions: np.ndarray, present: np.ndarray, headings: np.ndarray | None, max_gap: int
) -> tuple[np.ndarray, np.ndarray | None, np.ndarray]:
    """Fill gaps of up to `max_gap` frames linearly; return positions, headings, and what was filled (F, A)."""
    frames = len(present)
    before, after = last_true(present), next_true(present)
    filled = ~present & (before >= 0) & (after < frames) & (after - before - 1 <= max_gap)
    frame, who = np.nonzero(filled)
    left, right = before[filled], after[filled]
    share = (frame - left) / (right - left)
    result = positions.copy()
    result[frame, who] = (1 - share)[:, None] * positions[left, who] + share[:, None] * positions[right, who]
    if headings is None:
        return result, None, filled
    turned = headings.copy()
    turned[frame, who] = headings[left, who] + share * wrap(headings[right, who] - headings[left, who])
    return result, turned, filled


def smooth(positions: np.ndarray, present: np.ndarray, frames: int) -> np.ndarray:
    """Return centered moving averages (..., F, A, 2) over `frames`, narrower toward gaps, never across them."""
    count = present.shape[-2]
    place = np.arange(count)[:, None]
    reach = np.minimum(place - last_true(~present, -2) - 1, next_true(~present, -2) - place - 1)
    reach = np.clip(reach, 0, frames // 2)
    total = np.zeros_like(positions)
    for offset in range(-(frames // 2), frames // 2 + 1):
        at = np.clip(place + offset, 0, count - 1)
        near = np.take_along_axis(positions, np.broadcast_to(at, present.shape)[..., None], axis=-3)
        total += np.where((abs(offset) <= reach)[..., None], near, 0.0)
    return np.where(present[..., None], total / (2 * reach + 1)[..., None], 0.0)


def wrap(angle: np.ndarray) -> np.ndarray:
    """Return angles (rad) in [-pi, pi)."""
    return (angle + np.pi) % (2 * np.pi) - np.pi


def every(present: np.ndarray) -> int:
    """Return k where only one frame in k has anybody (F, A), evenly, in three frames or more; else 1."""
    frames = np.flatnonzero(present.any(axis=1))
    return int(np.gcd.reduce(np.diff(frames))) if len(frames) > 2 else 1
