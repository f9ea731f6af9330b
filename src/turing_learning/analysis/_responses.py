"""What black-box models do: the outputs of networks for given sensor readings."""

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import array

if TYPE_CHECKING:
    from turing_learning.models import ElmanModel

DYNAMIC_READINGS = np.repeat((0, 1, 0), 10)
"""Sensor readings of the dynamic response: paper, section 4.6.2, figure 12."""


def steady_outputs(model: "ElmanModel", networks: np.ndarray) -> np.ndarray:
    """Return the outputs (..., 2 n) of networks (..., Q) in the 20th step of each constant reading, from the reset network.

    Source
    ------
    Paper, section 4.6.2, figure 11.
    """
    return model.described(networks)


def dynamic_outputs(model: "ElmanModel", networks: np.ndarray) -> np.ndarray:
    """Return the outputs (..., 30, 2) of networks (..., Q) for I = 0 (steps 1 to 10), 1 (11 to 20) and 0 (21 to 30).

    Source
    ------
    Paper, section 4.6.2, figure 12.
    """
    return model.respond(networks, DYNAMIC_READINGS)


def response_error(model: "ElmanModel", networks: np.ndarray, truth: np.typing.ArrayLike) -> np.ndarray:
    """Compute how far the outputs of networks are from the agents' parameters over 20 steps of each constant reading.

    Parameters
    ----------
    networks : (..., Q)
        Weights; finite.
    truth : (2 n,)
        Parameters of the agent.

    Returns
    -------
    (...)
        Sum of the squared differences over all parameters and steps.

    Source
    ------
    Paper, section 4.6.2: the metric by which the network of median performance is chosen.
    """
    true = array("truth", truth, "P", finite=False, P=2 * model.states)
    return np.square(model.constant_responses(networks) - true).sum(axis=(-2, -1))


def median_place(errors: np.typing.ArrayLike) -> int:
    """Return the place of the median among errors (R,), of two middle ones the smaller."""
    errors = array("errors", errors, "R")
    return int(np.argsort(errors, kind="stable")[(errors.size - 1) // 2])
