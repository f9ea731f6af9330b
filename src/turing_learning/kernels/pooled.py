"""The judge of networks without memory that look at short windows and answer with the mean of what they think of each."""

import numpy as np

from .compile import compile_cached
from .elman_source import DENOMINATOR, NUMERATOR, SATURATION

LANES = 16
"""Samples that are judged at once: as many as the numbers of a vector register, and few enough for the nearest cache."""

_P0, _P1, _P2 = (np.float32(value) for value in NUMERATOR)
_Q0, _Q1, _Q2 = (np.float32(value) for value in DENOMINATOR[:3])
_LARGEST = np.float32(SATURATION**2)
_ZERO, _HALF, _ONE = np.float32(0), np.float32(0.5), np.float32(1)


def _judge_range(
    start: int,
    stop: int,
    samples: np.ndarray,
    windows: np.ndarray,
    weights: np.ndarray,
    outputs: np.ndarray,
) -> None:
    """Fill `outputs` (S, N) float32 for the blocks `start` to `stop` of `LANES` samples each.

    `samples` (S, T, D) float32 are divided by their scale; `windows` (N, 2) int64 are taps and
    steps between them, none longer than T; `weights` (N, 1 + taps D) float32 the threshold, then
    the weights of each tap. The logistic function is that of `elman_source`.
    """
    steps, signals = samples.shape[1], samples.shape[2]
    # all moments of all lanes stand in a row, so that every inner loop is long and over neighbors
    block = np.empty((signals, steps * LANES), np.float32)
    activation = np.empty(steps * LANES, np.float32)
    total = np.empty(LANES, np.float32)
    for unit in range(start, stop):
        first = unit * LANES
        filled = min(LANES, samples.shape[0] - first)
        block[:] = _ZERO
        for d in range(signals):
            for t in range(steps):
                for lane in range(filled):
                    block[d, t * LANES + lane] = samples[first + lane, t, d]
        for n in range(windows.shape[0]):
            taps, gap = windows[n, 0], windows[n, 1]
            moments = steps - (taps - 1) * gap
            size = moments * LANES
            for i in range(size):
                activation[i] = weights[n, 0]
            for tap in range(taps):
                begin = tap * gap * LANES
                # two signals at once: the sums are loaded and stored half as often
                for d in range(0, signals - 1, 2):
                    weight = weights[n, 1 + tap * signals + d]
                    next_weight = weights[n, 2 + tap * signals + d]
                    signal = block[d, begin : begin + size]
                    next_signal = block[d + 1, begin : begin + size]
                    for i in range(size):
                        activation[i] += weight * signal[i] + next_weight * next_signal[i]
                if signals % 2 == 1:
                    weight = weights[n, (tap + 1) * signals]
                    signal = block[signals - 1, begin : begin + size]
                    for i in range(size):
                        activation[i] += weight * signal[i]
            for i in range(size):
                u = min(activation[i] * activation[i], _LARGEST)
                p = (_P2 * u + _P1) * u + _P0
                q = ((u + _Q2) * u + _Q1) * u + _Q0
                y = _HALF + activation[i] * p / q
                activation[i] = min(max(y, _ZERO), _ONE)
            for lane in range(LANES):
                total[lane] = _ZERO
            for t in range(moments):
                for lane in range(LANES):
                    total[lane] += activation[t * LANES + lane]
            for lane in range(filled):
                outputs[first + lane, n] = total[lane] / np.float32(moments)


judge_range = compile_cached(_judge_range, fastmath={"nnan", "ninf", "nsz", "arcp", "contract"})
