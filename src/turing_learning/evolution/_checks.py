"""Seeds, and what optimizers accept and refuse."""

from collections.abc import Mapping, Sequence

import numpy as np

from ..arrays import array
from ..errors import brief, is_integer, refuse, require

PARAMETER_LIMIT = 1e12
"""Largest magnitude of a parameter: nothing becomes infinite where selection has stopped or rewards growth."""

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

    Generators of different generations, and of different seeds, are independent. Nothing of a generator has to
    be stored: a run that is resumed makes the same one again. For optimizers, 0 is the initialization and g + 1
    what follows the fitness of generation g.
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(generation,)))


OUT_OF_TURN = {
    "ask": "after `tell`; got a second `ask`. Tell the fitness first, or restore a state.",
    "tell": "after `ask`; got `tell` first. Ask for a population first.",
    "state": "after `tell` or before `ask`; got `state` between the two. Tell the fitness first.",
}


class Turns:
    """An optimizer whose `ask` and `tell` alternate, starting with `ask`."""

    _awaits_fitness = False
    _asked_steps: np.ndarray

    @property
    def step_sizes(self) -> np.ndarray:
        """Step sizes (size, dimension) of the population last asked for; before that, of the one to come."""
        # copies: whoever writes into them must not change the next generation
        return self._asked_steps.copy()

    def _turn(self, call: str) -> None:
        """Reject "ask", "tell" or "state" out of turn."""
        if self._awaits_fitness != (call == "tell"):
            raise RuntimeError(f"`{call}` must be called {OUT_OF_TURN[call]}")


def check_vector(name: str, value: np.typing.ArrayLike, dimension: int) -> np.ndarray:
    """Return `value`, a number or one for each parameter, as a new (dimension,) array."""
    vector = array(name, value, "...")
    rule = f"be a number or of shape (dimension,) = ({dimension},)"
    require(vector.shape in ((), (dimension,)), name, rule, f"shape {vector.shape}")
    return np.broadcast_to(vector, dimension).copy()


def check_range(
    low: np.typing.ArrayLike, high: np.typing.ArrayLike, dimension: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the initial range of every parameter, two (dimension,) arrays, if its bounds are in order."""
    low = check_vector("initial_low", low, dimension)
    high = check_vector("initial_high", high, dimension)
    k = int(np.argmin(low < high))
    rule = "be below `initial_high`"
    require((low < high).all(), "initial_low", rule, f"{low[k]} and {high[k]} for parameter {k}")
    return low, high


def state_arrays(
    state: Mapping[str, np.ndarray], shapes: Mapping[str, str], **sizes: int
) -> dict[str, np.ndarray]:
    """Return copies of arrays of a state if they are there, finite, and of shapes as for `array`, whose letters they share."""
    arrays = {}
    for name, shape in shapes.items():
        require(name in state, "state", f"hold an array {name!r}", str(sorted(state)))
        arrays[name] = array(f"state[{name!r}]", state[name], shape, empty=True, **sizes).copy()  # type: ignore[arg-type]
        sizes |= {
            axis: n
            for axis, n in zip(shape.split(), arrays[name].shape, strict=True)
            if not axis.isdigit()
        }
    return arrays


def join_states(states: Mapping[str, Mapping[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Return the states of parts as one, each array by the names of its part and its own."""
    return {
        f"{prefix}/{name}": value
        for prefix, state in states.items()
        for name, value in state.items()
    }


def state_part(state: Mapping[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """Return the arrays of a state whose names begin with a prefix, without it."""
    return {
        name.removeprefix(prefix): value for name, value in state.items() if name.startswith(prefix)
    }


def check_generation(state: Mapping[str, np.ndarray], name: str = "generation") -> int:
    """Return the number of completed generations that a state holds by a name."""
    generation = float(state_arrays(state, {name: ""})[name])
    fits = generation >= 0 and generation == int(generation)
    require(fits, f"state[{name!r}]", "be a non-negative integer", str(generation))
    return int(generation)
