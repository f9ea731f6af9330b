"""From poses to what classifiers see."""

import math

import numpy as np


def signed_speeds(poses: np.ndarray, interval_s: float) -> np.ndarray:
    """Compute signed linear and angular speeds.

    Parameters
    ----------
    poses : (T + 1, A, 3)
        x, y (cm), heading (rad, anticlockwise).
    interval_s
        Time between poses (s), > 0.

    Returns
    -------
    (A, T, 2)
        Linear speed (cm/s), the length of the displacement over the interval, negative when the displacement is more than
        pi / 2 away from the heading at its start; angular speed (rad/s), of the turn that is shorter than pi.

    Raises
    ------
    ValueError
        If the shape, a value or the interval does not fit.

    Source
    ------
    Paper, the footnote of section 3.2.3 on the sign.
    """
    poses = np.asarray(poses, dtype=np.float64)
    if poses.ndim != 3 or poses.shape[0] < 2 or poses.shape[2] != 3 or not np.isfinite(poses).all():
        raise ValueError(f"`poses` must be finite and of shape (T + 1, A, 3) with T >= 1; got {poses.shape}.")
    if not (math.isfinite(interval_s) and interval_s > 0):
        raise ValueError(f"`interval_s` must be a finite number above 0; got {interval_s}.")
    steps = np.diff(poses[..., :2], axis=0)
    headings = poses[:-1, :, 2]
    ahead = steps[..., 0] * np.cos(headings) + steps[..., 1] * np.sin(headings)
    speeds = np.where(ahead < 0, -1.0, 1.0) * np.hypot(steps[..., 0], steps[..., 1]) / interval_s
    turns = (np.diff(poses[..., 2], axis=0) + math.pi) % (2 * math.pi) - math.pi
    return np.stack([speeds, turns / interval_s], axis=-1).transpose(1, 0, 2)
