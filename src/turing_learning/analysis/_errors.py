"""Errors of inferred parameters, what went wrong in a run whose truth is known, by name, and what black-box models do."""

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import array
from ..errors import require

if TYPE_CHECKING:
    from turing_learning.models import ElmanModel

GOOD = "good"
FAILED_ERROR = 0.1
"""Mean absolute error from which on a run has failed."""
_CLOSE = 0.2
_RUNAWAY = 3.0

DYNAMIC_READINGS = np.repeat((0, 1, 0), 10)
"""Sensor readings of the dynamic response: paper, section 4.6.2, figure 12."""


def absolute_error(estimate: np.typing.ArrayLike, truth: np.typing.ArrayLike) -> np.ndarray:
    """Compute the absolute error (AE) in each parameter (..., P), in its units.

    Source: paper, section 4.3, equation 9.

    Parameters
    ----------
    estimate : (..., P)
        Inferred parameters, of one model or of many.
    truth : (P,)
        Parameters of the agent.
    """
    true = array("truth", truth, "P")
    return np.abs(array("estimate", estimate, "... P", empty=True, P=len(true)) - true)


def mean_absolute_error(estimate: np.typing.ArrayLike, truth: np.typing.ArrayLike) -> np.ndarray:
    """Compute the mean absolute error (MAE) over all parameters (...), in their units.

    Source: paper, section 4.3, equation 10.

    Parameters
    ----------
    estimate, truth
        As for `absolute_error`.
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
    truth = array("truth", truth, "P")
    estimate = array("estimate", estimate, "P", P=len(truth))
    require(estimate.size >= 2, "estimate", "be of shape (2 n,) or (2 n + 1,)", f"{estimate.shape}")
    if float(mean_absolute_error(estimate, truth)) < FAILED_ERROR:
        return GOOD
    wheels = estimate.size - estimate.size % 2
    speeds = estimate[:wheels]
    true = truth[:wheels]
    if wheels < estimate.size and float(mean_absolute_error(speeds, true)) < FAILED_ERROR:
        return "field of view"
    if np.abs(speeds).max() > _RUNAWAY:
        return "runaway"
    return _name_assignment(speeds.reshape(-1, 2), true.reshape(-1, 2))


def _name_assignment(estimate: np.ndarray, truth: np.ndarray) -> str:
    """Compare the wheel speeds (n, 2) of the states with those of other states."""
    # Few runs need it, and its import takes a tenth of a second
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import maximum_bipartite_matching

    distance = np.abs(estimate[:, None] - truth[None]).max(axis=2)
    for state in range(len(truth)):
        # Is there an order of all states in which this one is another?
        close = distance < _CLOSE
        close[state, state] = False
        if (maximum_bipartite_matching(csr_array(close)) >= 0).all():
            return "states exchanged"
    for state, twin in np.argwhere(distance < _CLOSE):
        if state != twin and distance[state, state] >= _CLOSE:
            return f"I = {state} as I = {twin}"
    return "other"


def dynamic_outputs(model: "ElmanModel", networks: np.ndarray) -> np.ndarray:
    """Return the outputs (..., 30, 2) of networks (..., Q) for I = 0 (steps 1 to 10), 1 (11 to 20) and 0 (21 to 30).

    Source: paper, section 4.6.2, figure 12.
    """
    return model.respond(networks, DYNAMIC_READINGS)


def response_error(
    model: "ElmanModel", networks: np.ndarray, truth: np.typing.ArrayLike
) -> np.ndarray:
    """Compute how far the outputs of networks are from the agents' parameters over 20 steps of each constant reading (...).

    It is the sum of the squared differences over all parameters and steps.

    Source: paper, section 4.6.2: the metric by which the network of median performance is chosen.

    Parameters
    ----------
    networks : (..., Q)
        Weights; finite.
    truth : (2 n,)
        Parameters of the agent.
    """
    true = array("truth", truth, "P", finite=False, P=2 * model.states)
    return np.square(model.constant_responses(networks) - true).sum(axis=(-2, -1))
