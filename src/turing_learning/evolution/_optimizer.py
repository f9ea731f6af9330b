"""The protocol of optimizers, and how one is renewed."""

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

import numpy as np

from ..errors import integer
from ._checks import check_generation


@runtime_checkable
class Optimizer(Protocol):
    """A population-based optimizer that is asked for candidates and told how fit they are.

    `ask` and `tell` alternate, starting with `ask`. Fitness is subjective in a coevolution: it holds against
    the present opponents only. So `ask` returns the whole population, survivors of earlier generations
    included, and no candidate is ranked by a fitness from an earlier generation alone.

    Everything random is drawn from ``default_rng(SeedSequence(seed, spawn_key=(generation,)))``, afresh in each
    generation (0 is the initialization). So the state holds no generator, and a restored optimizer goes on
    exactly as the one that was never interrupted.
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
        """Return the population to be scored (size, dimension): a copy, float64, finite.

        Raises
        ------
        RuntimeError
            If the population asked for before has not been told its fitness.
        """

    def tell(self, fitness: np.ndarray) -> np.ndarray:
        """Take the fitness of the population last asked for, and form the next one.

        Returns what the candidates were ranked by (size,), a new array: the fitness, or what the optimizer made
        of it.

        Parameters
        ----------
        fitness : (size,)
            Larger is better.

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


class RenewedOptimizer:
    """Replace an optimizer by a fresh one at regular intervals.

    A population can settle where no small step leads on. In a coevolution in which an archive remembers the
    past classifiers, the present ones may be replaced by random ones: they look for differences that the old
    ones could not see.

    Parameters
    ----------
    make
        Makes the optimizer number k = 0, 1, ...; all of the same size and dimension, with different seeds.
    interval
        Generations after which the optimizer is replaced, >= 1.
    last
        No replacement after this many generations; None: without end.
    """

    def __init__(
        self, make: Callable[[int], Optimizer], interval: int, *, last: int | None = None
    ) -> None:
        self._make = make
        self._interval = integer("interval", interval, 1)
        self._last = last
        self._generation = 0
        self._optimizer = make(0)
        self.size = self._optimizer.size
        self.dimension = self._optimizer.dimension

    @property
    def step_sizes(self) -> np.ndarray:
        """Step sizes (size, dimension) of the population last asked for."""
        return self._optimizer.step_sizes

    def ask(self) -> np.ndarray:
        """Return the population (size, dimension) to be scored."""
        return self._optimizer.ask()

    def tell(self, fitness: np.ndarray) -> np.ndarray:
        """Hand on the fitness (size,), larger being better; where the interval is over, a fresh optimizer takes over.

        Returns what the candidates were ranked by (size,).
        """
        scores = self._optimizer.tell(fitness)
        self._generation += 1
        number = self._number(self._generation)
        if number != self._number(self._generation - 1):
            self._optimizer = self._make(number)
        return scores

    def state(self) -> dict[str, np.ndarray]:
        """Return the state of the present optimizer and the number of completed generations ("renewal")."""
        return {"renewal": np.array(self._generation, dtype=np.int64), **self._optimizer.state()}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state of an optimizer with the same settings."""
        generation = check_generation(state, "renewal")
        optimizer = self._make(self._number(generation))
        optimizer.restore({name: array for name, array in state.items() if name != "renewal"})
        self._generation = generation
        self._optimizer = optimizer

    def _number(self, generation: int) -> int:
        """Return which optimizer a generation belongs to."""
        until = generation
        if self._last is not None:
            until = min(generation, self._last)
        return until // self._interval
