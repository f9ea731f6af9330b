"""What functions of positions check at their doors."""

import math

import numpy as np


def check_positions(positions: np.typing.ArrayLike) -> np.ndarray:
    """Return positions (..., S, 2) as finite floats.

    Raises
    ------
    ValueError
        If they are not.
    """
    array = np.asarray(positions, dtype=np.float64)
    if array.ndim < 2 or array.shape[-1] != 2 or array.shape[-2] == 0:
        raise ValueError(f"`positions` must be of shape (..., S, 2) with S at least 1; got {array.shape}.")
    if not np.isfinite(array).all():
        place = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"`positions` must be finite; got {array[place]} at {place}.")
    return array


def check_radius(radius_cm: float) -> None:
    """Raise ValueError unless a radius is finite and positive."""
    if not (math.isfinite(radius_cm) and radius_cm > 0):
        raise ValueError(f"`radius_cm` must be a finite number above 0; got {radius_cm}.")
