"""Features of windows of motion, of single signals and of how they go together."""

import numpy as np

from turing_learning.analysis.statistics import rhythm_statistics, signal_statistics, signal_trends

OWN_SIGNALS = 5
"""In `company` the first signals describe own motion: speed, turn, acceleration, and two of them relative to what is usual."""
RHYTHM_SIGNALS = 3
"""Of the first signals, speed, turn and acceleration, rhythm and correlations are described, too."""
FIRST_FOLLOWING_SIGNAL = 13
"""Signals from this one on say how much an individual does what others did; only their means are used."""
STATISTICS_PER_SIGNAL = 8
"""Seven statistics of a signal, and its trend."""


def motion_statistics(windows: np.ndarray) -> np.ndarray:
    """Compute features (K, F) of windows (K, T, D) of motion.

    They are statistics and trends of signals, and the rhythm of the first three. Statistics of the
    signals that do not describe own motion come last: `learn_distance` tells them by that.
    """
    features = [rhythm_statistics(windows[..., :RHYTHM_SIGNALS])]
    trends = signal_trends(windows)
    for signals in (slice(OWN_SIGNALS), slice(OWN_SIGNALS, FIRST_FOLLOWING_SIGNAL)):
        features += [signal_statistics(windows[..., signals]), trends[:, signals]]
    features.append(windows[..., FIRST_FOLLOWING_SIGNAL:].mean(axis=1))
    return np.concatenate(features, axis=1)
