"""Errors of inferred parameters, and what went wrong in a run whose truth is known, by name."""

from itertools import permutations

import numpy as np

from ..arrays import array
from ..errors import require

GOOD = "good"
LIMIT = 0.1
"""Mean absolute error from which on a run has failed."""
_CLOSE = 0.2
_RUNAWAY = 3.0


def absolute_error(estimate: np.typing.ArrayLike, truth: np.typing.ArrayLike) -> np.ndarray:
    """Compute the absolute error (AE) in each parameter.

    Parameters
    ----------
    estimate : (..., P)
        Inferred parameters, of one model or of many.
    truth : (P,)
        Parameters of the agent.

    Returns
    -------
    (..., P)
        In the units of the parameters.

    Source
    ------
    Paper, section 4.3, equation 9.
    """
    inferred, true = np.asarray(estimate, dtype=np.float64), np.asarray(truth, dtype=np.float64)
    fits = true.ndim == 1 and true.size > 0 and inferred.shape[-1:] == true.shape
    require(fits, "estimate", "be of shape (..., P) and `truth` of shape (P,)", f"{inferred.shape} and {true.shape}")
    return np.abs(array("estimate", inferred, "... P", empty=True) - array("truth", true, "P"))


def mean_absolute_error(estimate: np.typing.ArrayLike, truth: np.typing.ArrayLike) -> np.ndarray:
    """Compute the mean absolute error (MAE) over all parameters.

    Parameters
    ----------
    estimate : (..., P)
        Inferred parameters, of one model or of many.
    truth : (P,)
        Parameters of the agent.

    Returns
    -------
    (...)
        In the units of the parameters.

    Source
    ------
    Paper, section 4.3, equation 10.
    """
    return absolute_error(estimate, truth).mean(axis=-1)


def name_failure(estimate: np.ndarray, truth: np.ndarray) -> str:
    """Name how a model, two wheel speeds for each of n sensor states and perhaps a field of view, misses the truth.

    Parameters
    ----------
    estimate, truth : (2 n,) or (2 n + 1,)
        Wheel speeds as fractions of the maximum, field of view (rad).

    Returns
    -------
    str
        "good" (MAE below 0.1); "runaway" (a wheel speed beyond +-3); "states exchanged" (the truth's states
        in another order); "I = 2 as I = 1", and so on (one state has the values of another); "field of view"
        (MAE of the wheel speeds below 0.1); "other".
    """
    estimate, truth = np.asarray(estimate, dtype=float), np.asarray(truth, dtype=float)
    fits = estimate.shape == truth.shape and estimate.ndim == 1 and estimate.size >= 2
    rule = "have the same shape (2 n,) or (2 n + 1,) as `truth`"
    require(fits, "estimate", rule, f"{estimate.shape} and {truth.shape}")
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
