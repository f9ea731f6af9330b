"""Reactive controllers on a grid."""

import numpy as np


def mirrored(controllers: np.ndarray) -> np.ndarray:
    """Return controllers (..., 2 n) with left and right exchanged: their swarms do the same, seen in a mirror."""
    return controllers.reshape(*controllers.shape[:-1], -1, 2)[..., ::-1].reshape(controllers.shape)


def grid_controllers(states: int, steps: int) -> np.ndarray:
    """Return every controller whose wheel speeds are on a grid from -1 to 1, one of each mirror pair.

    Of a pair it is the one that is larger at the first wheel speed in which the two differ.

    Parameters
    ----------
    states
        Number of sensor states n.
    steps
        Settings of each wheel speed.

    Returns
    -------
    (about steps^(2 n) / 2, 2 n)
        The last wheel speed changes fastest.

    Source
    ------
    Paper, section 4.6.1, after Gauci et al. 2014.
    """
    places = np.indices((steps,) * (2 * states)).reshape(2 * states, -1).T
    number = steps ** np.arange(2 * states)[::-1]
    kept = places[places @ number >= mirrored(places) @ number]
    return np.linspace(-1, 1, steps).round(12)[kept]
