"""Statistics of single windows of motion: of each signal, of its rhythm, and of how signals go together."""

from collections.abc import Sequence
from itertools import combinations, pairwise

import numpy as np

BANDS = 8
"""Bands of frequencies whose shares of the power are statistics, at most."""

QUANTILES = (0.1, 0.5, 0.9)
"""Quantiles of the values in a window that are statistics."""

DELAYS = (-8, -20, 0, 20, 8)
"""Parts of a window by which one signal is later than another where they are correlated; 0 for no delay."""


def signal_statistics(windows: np.ndarray) -> np.ndarray:
    """Return seven statistics of each signal; `signal_statistic_names` has their names.

    Parameters
    ----------
    windows : (K, T, D)
        Windows of at least two steps, in any units.

    Returns
    -------
    (K, 7 D)
        Mean, standard deviation, three quantiles, the standard deviation of changes, and the correlation of each value
        with the next.
    """
    steps = np.diff(windows, axis=1)
    around = windows - windows.mean(axis=1, keepdims=True)
    variance = np.maximum((around**2).mean(axis=1), 1e-12)
    correlation = (around[:, 1:] * around[:, :-1]).mean(axis=1) / variance
    # Much faster than percentiles.
    ordered = np.sort(windows, axis=1)
    at = np.array(QUANTILES) * (windows.shape[1] - 1)
    low = at.astype(int)
    fraction = (at % 1)[:, None]
    quantiles = (1 - fraction) * ordered[:, low] + fraction * ordered[:, np.ceil(at).astype(int)]
    columns = (
        windows.mean(axis=1),
        windows.std(axis=1),
        *quantiles.swapaxes(0, 1),
        steps.std(axis=1),
        correlation,
    )
    return np.concatenate(columns, axis=1)


def signal_statistic_names(names: Sequence[str]) -> list[str]:
    """Return the names (7 D,) of what `signal_statistics` returns, for signals with names (D,)."""
    forms = (
        "mean {}",
        "spread of {}",
        "low {} (10 %)",
        "median {}",
        "high {} (90 %)",
        "change of {} per step",
        "persistence of {}",
    )
    return [form.format(name) for form in forms for name in names]


def signal_trends(windows: np.ndarray) -> np.ndarray:
    """Return how much each signal of windows (K, T, D) rises or falls in them (K, D), without its sign."""
    slope = np.linspace(-1.0, 1.0, windows.shape[1])
    return np.abs(np.einsum("ktd,t->kd", windows, slope)) / windows.shape[1]


def rhythm_statistics(windows: np.ndarray) -> np.ndarray:
    """Return statistics of the rhythm of signals; `rhythm_statistic_names` has their names.

    Parameters
    ----------
    windows : (K, T, D)
        Windows, in any units.

    Returns
    -------
    (K, F)
        Of each signal the shares of up to eight bands of frequencies in its power, and the skewness and kurtosis of its
        values and of its changes. Of each two signals the correlation of their magnitudes, at five delays.
    """
    length = windows.shape[1]
    count = windows.shape[2]
    around = windows - windows.mean(axis=1, keepdims=True)
    # Without a window of Hann the ends, which do not meet, would be seen at all frequencies.
    power = np.abs(np.fft.rfft(around * np.hanning(length)[:, None], axis=1))[:, 1:] ** 2
    power /= np.maximum(power.mean(axis=1, keepdims=True), 1e-12)
    columns = []
    for low, high in pairwise(_edges(length)):
        # powers are shares of the mean; one near 0 must not have a huge logarithm
        columns.append(np.log(power[:, low:high].mean(axis=1) + 1e-3))
    for values in (windows, np.diff(windows, axis=1)):
        unit = standardized(values)
        # Products are much faster than powers.
        squares = unit * unit
        skewness = (squares * unit).mean(axis=1)
        columns += [skewness / (1 + np.abs(skewness)), np.log(1 + (squares * squares).mean(axis=1))]
    size = np.ascontiguousarray(np.moveaxis(standardized(np.abs(windows)), 2, 0))
    for signal, partner in combinations(range(count), 2):
        for lag in delays(length):
            columns.append(delayed_product(size[signal], size[partner], lag)[:, None])
    return np.concatenate(columns, axis=1)


def rhythm_statistic_names(names: Sequence[str], length: int, interval_s: float) -> list[str]:
    """Return the names (F,) of what `rhythm_statistics` returns for windows of so many steps.

    `interval_s` is the duration of a step (s), 0 if it is not known.
    """
    titles = []
    for low, high in pairwise(_edges(length)):
        period = time_in_words(length / (low + 1), interval_s)
        if high > low + 1:
            fast = length / high * (interval_s or 1.0)
            period = f"{_in_short(fast)} to {period}"
        titles += [f"rhythm of {name}, {period}" for name in names]
    titles += [f"asymmetry of {name}" for name in names]
    titles += [f"rare large values of {name}" for name in names]
    titles += [f"asymmetry of rises and falls of {name}" for name in names]
    titles += [f"rare large changes of {name}" for name in names]
    for signal, partner in combinations(names, 2):
        for lag in delays(length):
            titles.append(f"magnitudes of {together(signal, partner, lag, interval_s)}")
    return titles


def delays(length: int) -> list[int]:
    """Return the delays (steps) at which signals of windows of so many steps are correlated."""
    steps = []
    for divisor in DELAYS:
        steps.append(int(np.sign(divisor)) * (length // max(abs(divisor), 1)))
    return steps


def time_in_words(steps: float, interval_s: float) -> str:
    """Return a number of steps of a duration (s) in seconds, in steps where that is 0, as it is not known."""
    if interval_s == 0:
        return f"{_in_short(steps)} steps"
    return f"{_in_short(steps * interval_s)} s"


def _in_short(number: float) -> str:
    """Return a number with two digits, or as a whole number where it has more."""
    if number >= 99.5:
        return f"{number:.0f}"
    return f"{number:.2g}"


def together(signal: str, partner: str, lag: int, interval_s: float) -> str:
    """Return in words which two signals go together; the first is later if the lag (steps) is above 0."""
    if lag == 0:
        return f"{signal} and {partner} together"
    later = f"{time_in_words(abs(lag), interval_s)} later"
    if lag > 0:
        return f"{partner} and {signal} {later}"
    return f"{signal} and {partner} {later}"


def delayed_product(signal: np.ndarray, partner: np.ndarray, lag: int) -> np.ndarray:
    """Return the mean product (K,) of two series (K, T), the first as many steps later as `lag` says, or earlier."""
    if lag < 0:
        return delayed_product(partner, signal, -lag)
    length = signal.shape[1] - lag
    product = np.einsum("kt,kt->k", signal[:, lag:], partner[:, :length])
    return np.asarray(product / length)


def standardized(values: np.ndarray) -> np.ndarray:
    """Return signals (K, T, D) in units of their standard deviation in each window, around their mean in it."""
    around = values - values.mean(axis=1, keepdims=True)
    return np.asarray(around / np.maximum(values.std(axis=1, keepdims=True), 1e-9))


def _edges(length: int) -> np.ndarray:
    """Return where the bands of frequencies of so many steps begin and end."""
    frequencies = length // 2
    return np.unique(np.geomspace(1, frequencies + 1, BANDS + 1).round().astype(int)) - 1
