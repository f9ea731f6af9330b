"""One generator for each generation: how everything random is drawn in a coevolution."""

from collections.abc import Sequence

import numpy as np

from ..errors import brief, is_integer, refuse

Seed = int | Sequence[int]
"""Entropy for `numpy.random.SeedSequence`: a non-negative integer, or several."""


def check_seed(seed: Seed) -> Seed:
    """Return `seed` if it is a non-negative integer or a sequence of them."""
    numbers = seed if isinstance(seed, Sequence) else (seed,)
    if not numbers or not all(is_integer(n) and n >= 0 for n in numbers):
        refuse("seed", "be a non-negative integer or a sequence of them", brief(seed))
    return seed


def generation_rng(seed: Seed, generation: int) -> np.random.Generator:
    """Return the random generator of one generation.

    Generators of different generations, and of different seeds, are independent. Nothing of a generator has
    to be stored: a run that is resumed makes the same one again.

    Parameters
    ----------
    seed
        Entropy: a non-negative integer or a sequence of them.
    generation
        >= 0. For optimizers, 0 is the initialization and g + 1 what follows the fitness of generation g.
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(generation,)))
