"""Random convolution kernels: features of windows that need no idea of what motion consists of."""

from itertools import combinations

import numpy as np

LENGTH = 9
"""Values under a kernel."""

HIGH = 3
"""Of them weigh 2, the others -1: the sum is 0, so that a kernel sees changes, not levels."""

KERNEL_THRESHOLDS = 4
"""Thresholds of each kernel at each dilation."""

MOST_DILATIONS = 5
"""Distances between the values under a kernel, evenly spread on a logarithmic scale."""

FEATURES = 1000
"""Features of a window, about."""

AT_ONCE = 2**17
"""Values of responses that are computed together: so many stay in a processor's cache."""


def convolution_features(windows: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Describe windows by how often random kernels exceed a threshold in them.

    The kernels are those of MiniRocket: nine values, three of which weigh 2 and six -1. A kernel acts at a dilation upon
    the sum of some signals, or of their changes. Thresholds are values that the same kernel yields in a window drawn
    at random. The labels of the windows are not used.

    Parameters
    ----------
    windows : (K, T, D)
        Windows, in any units.
    rng
        Draws kernels, signals and thresholds.

    Returns
    -------
    (K, F)
        Shares of the steps in which a kernel exceeds a threshold, 0 to 1. F is about `FEATURES`.

    Source
    ------
    A. Dempster, D. F. Schmidt, G. I. Webb, MiniRocket: a very fast (almost) deterministic transform for time series
    classification, KDD 2021; changes beside values: C. W. Tan and others, MultiRocket, 2022.
    """
    center = np.median(windows, axis=(0, 1))
    scale = windows.std(axis=(0, 1))
    values = ((windows - center) / np.where(scale > 0, scale, 1.0)).astype(np.float32)
    series = [values]
    if values.shape[1] > LENGTH:
        changes = np.diff(values, axis=1)
        spread = changes.std(axis=(0, 1))
        series.append(changes / np.where(spread > 0, spread, 1.0))
    kernels = np.array(list(combinations(range(LENGTH), HIGH)))
    wanted = max(1, FEATURES // (KERNEL_THRESHOLDS * len(series)))
    columns = []
    for signal in series:
        # distances between the values under a kernel
        widest = max(1.0, (signal.shape[1] - 1) / (LENGTH - 1))
        dilations = np.unique(np.geomspace(1, widest, MOST_DILATIONS).astype(int))
        drawn = np.sort(rng.permutation(len(kernels) * len(dilations))[:wanted])
        together = max(1, AT_ONCE // signal[..., 0].size)
        for number, dilation in enumerate(dilations):
            same = kernels[drawn[drawn // len(kernels) == number] % len(kernels)]
            for begin in range(0, len(same), together):
                group = same[begin : begin + together]
                columns.append(_shares(signal, group, int(dilation), rng))
    return np.concatenate(columns, axis=1)


def _shares(
    series: np.ndarray, kernels: np.ndarray, dilation: int, rng: np.random.Generator
) -> np.ndarray:
    """Return how often each kernel (G, HIGH) exceeds its thresholds in series (K, T, D): (K, G times KERNEL_THRESHOLDS)."""
    mixtures = []
    drawn = []
    ranks = []
    for _ in kernels:
        mixtures.append(_mixture(series, rng))
        drawn.append(rng.integers(len(series)))
        ranks.append(rng.uniform(0.05, 0.95, KERNEL_THRESHOLDS))
    responses = _responses(np.stack(mixtures), kernels, dilation)
    number = np.arange(len(kernels))
    # all ranks in all responses, of which each kernel takes its own: one call is faster than many
    quantiles = np.quantile(responses[number, drawn], np.stack(ranks), axis=1)
    thresholds = quantiles[number, :, number].astype(np.float32)
    exceeded = []
    # A product with ones counts fastest, and exactly
    ones = np.ones(responses.shape[2], np.float32)
    # level by level, because all at once take as many times the memory
    for level in range(KERNEL_THRESHOLDS):
        above = responses > thresholds[:, level, None, None]
        exceeded.append((above.astype(np.float32) @ ones).astype(float) / len(ones))
    return np.stack(exceeded, axis=2).transpose(1, 0, 2).reshape(len(series), -1)


def _mixture(series: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the sum (K, T) of some of the signals, drawn at random."""
    signals = series.shape[2]
    count = int(2 ** rng.uniform(0, np.log2(min(signals, LENGTH) + 1)))
    chosen = rng.choice(signals, count, replace=False)
    return series[..., chosen].sum(axis=2)


def _responses(series: np.ndarray, kernels: np.ndarray, dilation: int) -> np.ndarray:
    """Return what each kernel (G, HIGH) yields of its series (G, K, T), which zeros continue at both ends."""
    reach = (LENGTH // 2) * dilation
    padded = np.pad(series, ((0, 0), (0, 0), (reach, reach)))
    weights = np.full((len(kernels), LENGTH), -1, series.dtype)
    np.put_along_axis(weights, kernels, 2, axis=1)
    steps = series.shape[2]
    responses = np.zeros_like(series)
    for tap in range(LENGTH):
        shifted = padded[..., tap * dilation : tap * dilation + steps]
        responses += weights[:, tap, None, None] * shifted
    return responses
