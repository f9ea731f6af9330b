"""What examiners see of windows of motion, with names."""

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from turing_learning.analysis.statistics import (
    delayed_product,
    delays,
    rhythm_statistic_names,
    rhythm_statistics,
    signal_statistic_names,
    signal_statistics,
    signal_trends,
    standardized,
    time_in_words,
    together,
)

NEAR_ZERO_SHARE = 0.05
"""A value is near 0 if it is smaller than this share of the large values (95 %) of its signal."""

RHYTHMS = 6
"""Signals whose rhythms and pairs are looked at, the first ones: pairs of more would outnumber the windows."""

NEAR_ZERO = {"speed": "share of steps at rest", "turn": "share of straight steps"}
"""What it is called where a signal is near 0; of others "share of steps with NAME near 0"."""


def extreme_names(names: Sequence[str]) -> list[str]:
    """Return the names (2 D,) of the least and the largest values of signals with names (D,).

    Limits, such as how fast anybody can turn or how near another is let, stand in few steps of a window.
    """
    return [f"least {name}" for name in names] + [f"largest {name}" for name in names]


def moderate(statistics: Sequence[str], names: Sequence[str]) -> np.ndarray:
    """Return which statistics (F,) of signals with names (D,) are no extremes.

    One jump of a tracker would outweigh all other values of a regression on extremes. Their ranks do not mind it.
    """
    return ~np.isin(statistics, extreme_names(names))


def named_statistics(
    windows: np.ndarray, names: Sequence[str], interval_s: float
) -> tuple[list[str], np.ndarray]:
    """Return names (F,) and values (K, F) of statistics of windows (K, T, D) of signals with names (D,).

    `interval_s` is the duration of a step (s), which the names of rhythms state; 0 if it is not known.
    """
    if windows.shape[1] < 2:
        return list(names), windows[:, 0]
    rhythmic, length = names[:RHYTHMS], windows.shape[1]
    rhythmic_windows = windows[..., : len(rhythmic)]
    # what is constant in a window has no rhythm, not even that of its rounding
    constant = np.ptp(rhythmic_windows, axis=1, keepdims=True) == 0
    rhythmic_windows = np.where(constant, 0.0, rhythmic_windows)
    labels = signal_statistic_names(names) + [f"trend of {name}" for name in names]
    columns = [signal_statistics(windows), signal_trends(windows)]
    labels += extreme_names(names)
    columns += [windows.min(axis=1), windows.max(axis=1)]
    large = np.quantile(np.abs(windows), 0.95, axis=(0, 1))
    labels += [NEAR_ZERO.get(name, f"share of steps with {name} near 0") for name in names]
    columns.append((np.abs(windows) <= NEAR_ZERO_SHARE * large).mean(axis=1))
    labels += rhythm_statistic_names(rhythmic, length, interval_s)
    columns.append(rhythm_statistics(rhythmic_windows))
    unit = np.moveaxis(standardized(rhythmic_windows), 2, 0)
    for first_signal, second_signal in permutations(range(len(rhythmic)), 2):
        for lag in delays(length):
            if lag < 0 or (lag == 0 and first_signal > second_signal):
                continue
            labels.append(
                together(rhythmic[first_signal], rhythmic[second_signal], lag, interval_s)
            )
            columns.append(delayed_product(unit[first_signal], unit[second_signal], lag)[:, None])
    for signal, name in enumerate(rhythmic):
        for steps in (2, 4, 8, 16):
            if 2 * steps < length:
                labels.append(f"persistence of {name} over {time_in_words(steps, interval_s)}")
                columns.append(delayed_product(unit[signal], unit[signal], steps)[:, None])
    return labels, np.concatenate(columns, axis=1)
