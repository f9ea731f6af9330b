"""The judge of networks without memory that look at short windows and answer with the mean of what they think of each."""

import numpy as np

from .compile import compile_cached
from .elman_source import DENOMINATOR, LANES, NUMERATOR, SATURATION

_P0, _P1, _P2 = (np.float32(value) for value in NUMERATOR)
_Q0, _Q1, _Q2 = (np.float32(value) for value in DENOMINATOR[:3])
_LARGEST = np.float32(SATURATION**2)
_ZERO, _HALF, _ONE = np.float32(0), np.float32(0.5), np.float32(1)


def _judge_range(
    start: int, stop: int, samples: np.ndarray, windows: np.ndarray, weights: np.ndarray, outputs: np.ndarray
) -> None:
    """Fill `outputs` (S, N) float32 for the blocks `start` to `stop` of `LANES` samples each.

    `samples` (S, T, D) float32 are divided by their scale; `windows` (N, 2) int64 are taps and steps between
    them, none longer than T; `weights` (N, 1 + taps D) float32 the threshold, then the weights of each tap. The
    logistic function is that of `elman_source`.
    """
    steps, signals = samples.shape[1], samples.shape[2]
    block = np.empty((steps, signals, LANES), np.float32)
    z = np.empty(LANES, np.float32)
    total = np.empty(LANES, np.float32)
    for unit in range(start, stop):
        first = unit * LANES
        filled = min(LANES, samples.shape[0] - first)
        block[:] = _ZERO
        for lane in range(filled):
            for t in range(steps):
                for d in range(signals):
                    block[t, d, lane] = samples[first + lane, t, d]
        for n in range(windows.shape[0]):
            taps, gap = windows[n, 0], windows[n, 1]
            places = steps - (taps - 1) * gap
            for lane in range(LANES):
                total[lane] = _ZERO
            for t in range(places):
                for lane in range(LANES):
                    z[lane] = weights[n, 0]
                for tap in range(taps):
                    for d in range(signals):
                        weight = weights[n, 1 + tap * signals + d]
                        for lane in range(LANES):
                            z[lane] += weight * block[t + tap * gap, d, lane]
                for lane in range(LANES):
                    u = min(z[lane] * z[lane], _LARGEST)
                    p = (_P2 * u + _P1) * u + _P0
                    q = ((u + _Q2) * u + _Q1) * u + _Q0
                    y = _HALF + z[lane] * p / q
                    total[lane] += min(max(y, _ZERO), _ONE)
            for lane in range(filled):
                outputs[first + lane, n] = total[lane] / np.float32(places)


judge_range = compile_cached(_judge_range, fastmath={"nnan", "ninf", "nsz", "arcp", "contract"})
