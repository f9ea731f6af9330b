"""Seeds, and what optimizers accept and refuse."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..arrays import array
from ..errors import brief, is_integer, refuse, require

Seed = int | Sequence[int]
"""Entropy for `numpy.random.SeedSequence`: a non-negative integer, or several."""


def check_seed(seed: Seed) -> Seed:
    """Return `seed` if it is a non-negative integer or a sequence of them."""
    numbers = seed if isinstance(seed, Sequence) else (seed,)
    if not numbers or not all(is_integer(n) and n >= 0 for n in numbers):
        refuse("seed", "be a non-negative integer or a sequence of them", brief(seed))
    return seed


def generation_rng(seed: Seed, generation: int) -> np.random.Generator:
    """Return the random generator of one generation, >= 0; see `check_seed` for seeds.

    Generators of different generations, and of different seeds, are independent. Nothing of a generator has to be
    stored: a run that is resumed makes the same one again. For optimizers, 0 is the initialization and g + 1 what
    follows the fitness of generation g.
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(generation,)))


class Turns:
    """Let `ask` and `tell` alternate, starting with `ask`."""

    def __init__(self) -> None:
        self._asked = False

    def ask(self) -> None:
        """Note that a population was asked for."""
        if self._asked:
            raise RuntimeError(
                "`ask` must be called after `tell`; got a second `ask`. Tell the fitness first, or restore a state."
            )
        self._asked = True

    def tell(self) -> None:
        """Check that a population awaits its fitness."""
        if not self._asked:
            raise RuntimeError("`tell` must be called after `ask`; got `tell` first. Ask for a population first.")

    def reset(self) -> None:
        """Begin anew: the next call is `ask`."""
        self._asked = False

    def pause(self) -> None:
        """Check that no population awaits its fitness."""
        if self._asked:
            raise RuntimeError(
                "`state` must be called after `tell` or before `ask`; got `state` between the two. "
                "Tell the fitness first."
            )


def check_vector(name: str, value: np.typing.ArrayLike, dimension: int) -> np.ndarray:
    """Return `value`, a number or one for each parameter, as a new (dimension,) array."""
    vector = array(name, value, "...")
    rule = f"be a number or of shape (dimension,) = ({dimension},)"
    require(vector.shape in ((), (dimension,)), name, rule, f"shape {vector.shape}")
    return np.broadcast_to(vector, dimension).copy()


def check_range(low: np.ndarray, high: np.ndarray) -> None:
    """Check that the initial range of every parameter has its bounds in order."""
    k = int(np.argmin(low < high))
    require((low < high).all(), "initial_low", "be below `initial_high`", f"{low[k]} and {high[k]} for parameter {k}")


def check_state_array(state: Mapping[str, np.ndarray], name: str, shape: tuple[int | None, ...]) -> np.ndarray:
    """Return a copy of an array of a state if it is there, finite, and of the given shape (None: any length)."""
    if name not in state:
        refuse("state", f"hold an array {name!r}", str(sorted(state)))
    given = np.array(state[name], dtype=np.float64)
    fits = len(given.shape) == len(shape) and all(n in (None, m) for n, m in zip(shape, given.shape, strict=True))
    expected = ", ".join("any" if n is None else str(n) for n in shape)
    require(fits, f"state[{name!r}]", f"be of shape ({expected})", str(given.shape))
    if not np.isfinite(given).all():
        refuse(f"state[{name!r}]", "be finite", str(given[~np.isfinite(given)].flat[0]))
    return given


def state_part(state: Mapping[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """Return the arrays of a state whose names begin with a prefix, without it."""
    return {name.removeprefix(prefix): value for name, value in state.items() if name.startswith(prefix)}


def check_generation(state: Mapping[str, np.ndarray]) -> int:
    """Return the number of completed generations that a state holds."""
    generation = float(check_state_array(state, "generation", ()))
    fits = generation >= 0 and generation == int(generation)
    require(fits, "state['generation']", "be a non-negative integer", str(generation))
    return int(generation)
