"""Estimates and intervals on the scale of each parameter, within its bounds."""

from collections.abc import Callable

import numpy as np

from turing_learning.config import Configuration, OwnConfiguration
from turing_learning.models import Parameter

LARGEST_DECADE = 300.0
"""What is told on a logarithmic scale is at most so many decades from 1."""


def on_own_scales(
    configuration: Configuration, typical: np.ndarray, told: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Return what is told of typical models (..., P), parameter by parameter.

    For a system of one's own, a parameter on a logarithmic scale is handed over in decades, and what comes back is within the
    bounds.
    """
    if not isinstance(configuration, OwnConfiguration):
        return told(typical)
    parameters = configuration.scenario.parameters.values()
    return np.concatenate(
        [_on_own_scale(parameter, typical[..., place, None], told) for place, parameter in enumerate(parameters)]
    )


def _on_own_scale(parameter: Parameter, values: np.ndarray, told: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    decades = parameter.scale == "log"
    found = told(np.log10(values) if decades else values)
    if decades:
        found = 10.0 ** np.clip(found, -LARGEST_DECADE, LARGEST_DECADE)
    low = -np.inf if parameter.low is None else parameter.low
    return np.clip(found, low, np.inf if parameter.high is None else parameter.high)
