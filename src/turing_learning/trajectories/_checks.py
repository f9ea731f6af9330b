"""Numbers that must be whole."""

import numpy as np


def whole(name: str, value: object, *, least: int, most: int | None = None, remedy: str = "") -> int:
    """Return a number that must be whole, of Python or NumPy.

    Raises
    ------
    ValueError
        If it is not, or out of range; a share of a step would silently be lost.
    """
    fits = isinstance(value, int | np.integer) and not isinstance(value, bool) and value >= least
    if not fits or (most is not None and value > most):  # type: ignore[operator]
        bounds = f", {least} or more" if most is None else f" from {least} to {most}"
        raise ValueError(f"`{name}` must be a whole number{bounds}; got {value!r}.{remedy}")
    return int(value)  # type: ignore[call-overload]
