"""From poses to what classifiers see."""

import math

import numpy as np

from turing_learning.trajectories import compute_signals


def signed_speeds(poses: np.ndarray, interval_s: float) -> np.ndarray:
    """Compute signed linear and angular speeds, as of recorded motion with headings, see `trajectories.compute_signals`.

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
    signals = compute_signals(poses[..., :2], fps=1 / interval_s, names=("speed", "turn"), headings=poses[..., 2])
    return signals.values.transpose(1, 0, 2)
