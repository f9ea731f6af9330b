"""What motion can tell of a parameter, before any run: which parameters simple statistics pin down, and which not.

A parameter that does not move the statistics of the signals, or moves them as others do together, cannot be told from them.
The statistics are simple: a classifier may see more, and may see less.
"""

import numpy as np

from turing_learning.families import Family

GROUPS = 400
"""Groups simulated of each of the compared parameters."""

STEP = 0.05
"""Distance at which they are compared, to each side, as a share of the range."""

FINEST = 1e-3
"""Share of its value to which a statistic is at most taken as known; a constant speed would be known perfectly."""


def statistics(samples: np.ndarray) -> np.ndarray:
    """Return simple statistics of each sample.

    Parameters
    ----------
    samples : (K, T, D)
        Motion samples.

    Returns
    -------
    (K, 6 D + D (D - 1))
        For each signal the mean, the standard deviation, the mean absolute value and change, the correlations of values one and
        five steps apart; for each pair of signals the correlations of values and of absolute values.
    """
    centered = samples - samples.mean(axis=1, keepdims=True)
    deviation = np.sqrt(np.square(centered).mean(axis=1))
    scaled = centered / (deviation[:, None] + 1e-9)
    change = np.abs(np.diff(samples, axis=1)).mean(axis=1)
    lagged = [(scaled[:, lag:] * scaled[:, :-lag]).mean(axis=1) for lag in (1, 5)]
    single = [samples.mean(axis=1), deviation, np.abs(samples).mean(axis=1), change, *lagged]
    return np.hstack([*single, products(scaled), products(np.abs(scaled))])


def products(signals: np.ndarray) -> np.ndarray:
    """Return the mean product (K, D (D - 1) / 2) of each pair of signals (K, T, D)."""
    first, second = np.triu_indices(signals.shape[2], 1)
    return (signals[..., first] * signals[..., second]).mean(axis=1)


def least_errors(
    family: Family, truth: dict[str, float], groups: int, seed: int = 1
) -> dict[str, float]:
    """Return the standard error that simple statistics leave of each parameter, as a share of its range.

    Parameters
    ----------
    family, truth
        What is observed.
    groups
        Number of recorded groups.
    seed
        Of the simulations.

    Returns
    -------
    dict
        Name -> error, from 0 to 0.29, the standard deviation of a parameter of which nothing is known but the range. All other
        parameters are taken as unknown too.

    Source
    ------
    The bound of Cramer and Rao for normally distributed statistics whose mean depends on the parameters, and a prior with the
    variance of the uniform distribution, 1 / 12.
    """
    known = observed(family, truth, seed)
    floor = FINEST * np.abs(known.mean(axis=0)) + 1e-9
    covariance = np.cov(known, rowvar=False) / groups + np.diag(floor**2)
    slopes = np.array([slope(family, truth, name, seed) for name in truth])
    information = slopes @ np.linalg.solve(covariance, slopes.T) + 12 * np.eye(len(truth))
    return dict(zip(truth, np.sqrt(np.diag(np.linalg.inv(information))).tolist(), strict=True))


def slope(family: Family, truth: dict[str, float], name: str, seed: int) -> np.ndarray:
    """Return the change of the mean statistics over the range of a parameter, at the rate near the truth."""
    parameter = family.parameters[name]
    width = parameter.high - parameter.low
    low, high = (
        max(parameter.low, truth[name] - STEP * width),
        min(parameter.high, truth[name] + STEP * width),
    )
    ends = [observed(family, truth | {name: value}, seed).mean(axis=0) for value in (low, high)]
    return (ends[1] - ends[0]) * width / (high - low)


def observed(family: Family, truth: dict[str, float], seed: int) -> np.ndarray:
    """Return the statistics of each group, means over its observed individuals; random numbers are the same for all parameters."""
    samples = family.observe(truth, groups=GROUPS, rng=np.random.default_rng(seed))
    return statistics(samples).reshape(GROUPS, family.observed, -1).mean(axis=1)
