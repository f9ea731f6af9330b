"""What went wrong in a run whose truth is known, by name."""

from itertools import permutations

import numpy as np

from ._errors import mean_absolute_error

GOOD = "good"
LIMIT = 0.1
"""Mean absolute error from which on a run has failed."""
_CLOSE = 0.2
_RUNAWAY = 3.0


def name_failure(estimate: np.ndarray, truth: np.ndarray) -> str:
    """Name how a model, two wheel speeds for each of n sensor states and perhaps a field of view, misses the truth.

    Parameters
    ----------
    estimate, truth : (2 n,) or (2 n + 1,)
        Wheel speeds as fractions of the maximum, field of view (rad).

    Returns
    -------
    str
        "good" (MAE below 0.1); "runaway" (a wheel speed beyond +-3); "states exchanged" (the truth's states in another
        order); "I = 2 as I = 1", and so on (one state has the values of another); "field of view" (MAE of the wheel speeds
        below 0.1); "other".

    Raises
    ------
    ValueError
        If the two do not have the same length, 2 or more.
    """
    estimate, truth = np.asarray(estimate, dtype=float), np.asarray(truth, dtype=float)
    if estimate.shape != truth.shape or estimate.ndim != 1 or estimate.size < 2:
        raise ValueError(
            f"`estimate` and `truth` must have the same shape (2 n,) or (2 n + 1,); got {estimate.shape} and {truth.shape}."
        )
    if float(mean_absolute_error(estimate, truth)) < LIMIT:
        return GOOD
    wheels = estimate.size - estimate.size % 2
    speeds, true = estimate[:wheels], truth[:wheels]
    if wheels < estimate.size and float(mean_absolute_error(speeds, true)) < LIMIT:
        return "field of view"
    if np.abs(speeds).max() > _RUNAWAY:
        return "runaway"
    return _name_assignment(speeds.reshape(-1, 2), true.reshape(-1, 2))


def _name_assignment(estimate: np.ndarray, truth: np.ndarray) -> str:
    """Compare the wheel speeds (n, 2) of the states with those of other states."""
    distance = np.abs(estimate[:, None] - truth[None]).max(axis=2)
    orders = [order for order in permutations(range(len(truth))) if list(order) != sorted(order)]
    if any(all(distance[state, other] < _CLOSE for state, other in enumerate(order)) for order in orders):
        return "states exchanged"
    for state, other in np.argwhere(distance < _CLOSE):
        if state != other and distance[state, state] >= _CLOSE:
            return f"I = {state} as I = {other}"
    return "other"
