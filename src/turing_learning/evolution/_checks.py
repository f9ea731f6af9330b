"""What all optimizers check at their doors."""

from collections.abc import Mapping
from numbers import Integral

import numpy as np


def check_count(name: str, value: int, minimum: int) -> int:
    """Return `value` if it is an integer of at least `minimum`."""
    if not isinstance(value, Integral) or isinstance(value, bool) or value < minimum:
        raise ValueError(f"`{name}` must be an integer of at least {minimum}; got {value!r}.")
    return int(value)


def check_share(name: str, value: float) -> float:
    """Return `value` if it is a number from 0 to 1."""
    if not 0 <= value <= 1:
        raise ValueError(f"`{name}` must be from 0 to 1; got {value}.")
    return float(value)


def check_vector(name: str, value: np.typing.ArrayLike, dimension: int) -> np.ndarray:
    """Return `value`, a number or one for each parameter, as a new (dimension,) array."""
    vector = np.array(value, dtype=np.float64)
    if vector.shape not in ((), (dimension,)):
        raise ValueError(
            f"`{name}` must be a number or of shape (dimension,) = ({dimension},); got shape {vector.shape}."
        )
    if not np.isfinite(vector).all():
        raise ValueError(f"`{name}` must be finite; got {value!r}.")
    return np.broadcast_to(vector, dimension).copy()


def check_range(low: np.ndarray, high: np.ndarray) -> None:
    """Check that the initial range of every parameter has its bounds in order."""
    if not (low < high).all():
        k = int(np.argmin(low < high))
        raise ValueError(f"`initial_low` must be below `initial_high`; got {low[k]} and {high[k]} for parameter {k}.")


def check_fitness(fitness: np.ndarray, size: int) -> np.ndarray:
    """Return `fitness` as a float64 array if it holds one finite number for each candidate."""
    fitness = np.asarray(fitness, dtype=np.float64)
    if fitness.shape != (size,):
        raise ValueError(f"`fitness` must be of shape (size,) = ({size},); got {fitness.shape}.")
    if not np.isfinite(fitness).all():
        k = int(np.argmin(np.isfinite(fitness)))
        raise ValueError(f"`fitness` must be finite; got {fitness[k]} for candidate {k}.")
    return fitness


def check_state_array(state: Mapping[str, np.ndarray], name: str, shape: tuple[int | None, ...]) -> np.ndarray:
    """Return a copy of an array of a state if it is there, finite, and of the given shape (None: any length)."""
    if name not in state:
        raise ValueError(f"`state` must hold an array {name!r}; got {sorted(state)}.")
    array = np.array(state[name], dtype=np.float64)
    if len(array.shape) != len(shape) or any(n not in (None, m) for n, m in zip(shape, array.shape, strict=True)):
        expected = ", ".join("any" if n is None else str(n) for n in shape)
        raise ValueError(f"`state[{name!r}]` must be of shape ({expected}); got {array.shape}.")
    if not np.isfinite(array).all():
        raise ValueError(f"`state[{name!r}]` must be finite; got {array[~np.isfinite(array)].flat[0]}.")
    return array


def check_generation(state: Mapping[str, np.ndarray]) -> int:
    """Return the number of completed generations that a state holds."""
    generation = float(check_state_array(state, "generation", ()))
    if generation < 0 or generation != int(generation):
        raise ValueError(f"`state['generation']` must be a non-negative integer; got {generation}.")
    return int(generation)
