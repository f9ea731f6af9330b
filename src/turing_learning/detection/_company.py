"""What individuals of a recording do beside each other: signals beyond those of a run."""

import numpy as np

from turing_learning.trajectories import Trajectories
from turing_learning.trajectories._signals import smooth, wrap

LAGS_S = (0.3, 6.0)
STRETCH_S = 30.0
"""In each stretch of about this length an individual may follow somebody else, at another distance in time."""


def paths_of(recording: Trajectories, smooth_frames: int = 1) -> np.ndarray:
    """Return positions (F, A, 2) with all gaps filled by straight motion."""
    frames, paths = np.arange(len(recording.positions)), recording.positions.copy()
    for k in range(paths.shape[1]):
        known = recording.present[:, k]
        if known.any():
            for axis in range(2):
                paths[:, k, axis] = np.interp(frames, frames[known], paths[known, k, axis])
    return paths if smooth_frames == 1 else smooth(paths, np.ones(paths.shape[:2], dtype=bool), smooth_frames)


def company(paths: np.ndarray, k: int, fps: float) -> np.ndarray:
    """Return what one of two or more individuals does at each step, own motion and others beside it (F - 1, 9).

    Speed, turn, and acceleration; distance and bearing of the nearest other; distance of the middle of all others, and whether
    it is ahead (the cosine); distance from the border of the space that all move in; and how much its velocity is what that of
    another was some time ago (the share of their correlation).

    Parameters
    ----------
    paths : (F, A, 2)
        x, y (cm), without gaps.
    k
        Whose.
    fps
        Frames per second.
    """
    places, velocities = paths[:-1], np.diff(paths, axis=0) * fps
    steps, others = np.arange(len(places)), np.delete(np.arange(paths.shape[1]), k)
    own = velocities[:, k]
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
        _following(own, velocities[:, others], fps),
    )
    return np.stack(columns, axis=1)


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
