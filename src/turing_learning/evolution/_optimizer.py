"""The protocol that every optimizer fits."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np


@runtime_checkable
class Optimizer(Protocol):
    """A population-based optimizer that is asked for candidates and told how fit they are.

    `ask` and `tell` alternate, starting with `ask`. Fitness is subjective in a coevolution: it holds against the
    present opponents only. So `ask` returns the whole population, survivors of earlier generations included, and
    no candidate is ranked by a fitness from an earlier generation alone.

    Everything random is drawn from ``default_rng(SeedSequence(seed, spawn_key=(generation,)))``, afresh in each
    generation (0 is the initialization). So the state holds no generator, and a restored optimizer goes on
    exactly as the one that was never interrupted.

    Attributes
    ----------
    size
        Number of candidates in each generation (M or N).
    dimension
        Number of parameters of a candidate (P or Q).
    """

    @property
    def size(self) -> int:
        """Number of candidates in each generation (M or N)."""

    @property
    def dimension(self) -> int:
        """Number of parameters of a candidate (P or Q)."""

    @property
    def step_sizes(self) -> np.ndarray:
        """Standard deviations of the mutations, of the population last asked for.

        Shape (size, dimension), in the units of the parameters. Before the first `ask`, and after `restore`,
        they belong to the population that the next `ask` returns.
        """

    def ask(self) -> np.ndarray:
        """Return the population to be scored.

        Returns
        -------
        (size, dimension)
            A copy, float64, finite.

        Raises
        ------
        RuntimeError
            If the population asked for before has not been told its fitness.
        """

    def tell(self, fitness: np.ndarray) -> np.ndarray:
        """Take the fitness of the population last asked for, and form the next one.

        Parameters
        ----------
        fitness : (size,)
            Larger is better.

        Returns
        -------
        (size,)
            What the candidates were ranked by, a new array: the fitness, or what the optimizer made of it.

        Raises
        ------
        RuntimeError
            If no population has been asked for since the last call.
        ValueError
            If `fitness` has another shape or is not finite.
        """

    def state(self) -> dict[str, np.ndarray]:
        """Return all that is needed to go on from here, as arrays.

        Raises
        ------
        RuntimeError
            If a population has been asked for and not been told its fitness.
        """

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state; allowed at any time, also between `ask` and `tell`.

        Parameters
        ----------
        state
            What `state` returned, from an optimizer with the same settings.
        """
