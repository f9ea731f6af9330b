"""CMA-ES behind the protocol: any population-based optimizer can be used."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..arrays import array
from ..errors import integer, optional, require
from ._checks import (
    PARAMETER_LIMIT,
    Seed,
    Turns,
    check_generation,
    check_range,
    check_seed,
    check_vector,
    generation_rng,
    state_arrays,
)

SPREAD_LIMIT = 1e6
"""Largest standard deviation, in units of the initial one."""


class CMAEvolutionStrategy(Turns):
    """Covariance matrix adaptation evolution strategy: an adapter for ``cma.CMAEvolutionStrategy``.

    The first population is normal, with the mean and the standard deviation of the uniform distribution between
    `initial_low` and `initial_high`. CMA-ES keeps a distribution, no parents: every candidate is new.

    The state is the distribution: mean, covariances, paths and counts, a few arrays however long the run is.
    Random numbers come from this object alone: numpy's global random state is neither read nor changed. `cma`
    writes no files here and prints nothing.

    Source: N. Hansen, "The CMA evolution strategy: a tutorial", arXiv 1604.00772.

    Parameters
    ----------
    dimension
        Number of parameters, >= 2 (what `cma` supports).
    size
        Candidates in each generation, >= 4.
    seed
        Entropy: a non-negative integer or a sequence of them.
    initial_low, initial_high : () or (dimension,)
        The range that the first distribution is made for.
    minimum_step_size : () or (dimension,)
        The distribution shrinks no further once all its standard deviations are down to it; >= 0. Fitness is
        subjective: a distribution that has collapsed cannot follow when the opponents move.

    Raises
    ------
    ImportError
        If `cma` is not installed.
    """

    def __init__(
        self, dimension: int, *, size: int = 100, seed: Seed = 0, initial_low: np.typing.ArrayLike = -1.0,
        initial_high: np.typing.ArrayLike = 1.0, minimum_step_size: np.typing.ArrayLike = 0.01,
    ) -> None:  # fmt: skip
        self.dimension = integer("dimension", dimension, 2)
        self.size = integer("size", size, 4)
        self._seed = check_seed(seed)
        low, high = check_range(initial_low, initial_high, dimension)
        minimum = check_vector("minimum_step_size", minimum_step_size, dimension)
        require((minimum >= 0).all(), "minimum_step_size", "not be negative", minimum.min())
        self._center = low / 2 + high / 2
        # Standard deviation of a uniform distribution
        self._scale = high / np.sqrt(12) - low / np.sqrt(12)
        self._minimum = minimum / self._scale
        self._distribution = self._new_distribution()
        self._asked_steps = self._next_steps()

    def ask(self) -> np.ndarray:
        """Return the population (size, dimension) to be scored; see `Optimizer.ask`."""
        self._turn("ask")
        self._awaits_fitness, self._asked_steps = True, self._next_steps()
        population = self._center + self._scale * np.array(self._distribution.solutions)
        return np.clip(population, -PARAMETER_LIMIT, PARAMETER_LIMIT)

    def tell(self, fitness: np.ndarray) -> np.ndarray:
        """Adapt the distribution and sample the next population; return the fitness (size,). See `Optimizer.tell`."""
        self._turn("tell")
        fitness = array("fitness", fitness, "size", size=self.size)
        self._distribution.tell(fitness)
        self._awaits_fitness = False
        return fitness.copy()

    def state(self) -> dict[str, np.ndarray]:
        """Return the distribution before the next population is drawn, name -> array, and the number of generations."""
        self._turn("state")
        return self._distribution.state | {"generation": np.array(self._distribution.generation)}

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Return to what `state` returned, from a strategy with the same settings; see `Optimizer.restore`.

        A state that lacks an array, or does not fit the settings, is rejected; the strategy is then what it was
        before.
        """
        generation = check_generation(state)
        distribution = self._new_distribution()
        shapes = {name: " ".join(map(str, old.shape)) for name, old in distribution.state.items()}
        distribution.restore(state_arrays(state, shapes), generation)
        self._distribution = distribution
        self._awaits_fitness, self._asked_steps = False, self._next_steps()

    def _new_distribution(self) -> "_Distribution":
        return _Distribution(self.dimension, self.size, self._seed, self._minimum)

    def _next_steps(self) -> np.ndarray:
        return np.tile(self._scale * self._distribution.standard_deviations, (self.size, 1))


_INSIDE = {
    "": ("mean", "sigma", "pc", "countiter", "countevals", "itereigenupdated"),
    "sm": ("C", "B", "D", "last_update", "count_tell", "count_eigen"),
    "adapt_sigma": ("ps", "_ps_updated_iteration"),
}
"""What of `cma.CMAEvolutionStrategy` and of its parts one generation leaves for the next."""


class _Distribution:
    """The distribution of `cma` in units of the initial one, and the population drawn from it."""

    def __init__(self, dimension: int, size: int, seed: Seed, minimum: np.ndarray) -> None:
        self.generation = 0
        self._seed = seed
        self._minimum = np.minimum(minimum, SPREAD_LIMIT)
        options = {
            "popsize": size,
            "randn": lambda *shape: self._rng.standard_normal(shape),
            "seed": np.nan,  # leaves the global random state of numpy alone
            "verbose": -10,  # no print, no log file
            "signals_filename": "",  # no options from a file in the working directory
        }
        self._strategy = optional("cma", "The package cma", "optimizers").CMAEvolutionStrategy(
            np.zeros(dimension), 1.0, options
        )
        self._draw()

    def _draw(self) -> None:
        self.state = {
            name: np.array(getattr(holder, field)) for name, holder, field in self._inside()
        }
        self._rng = generation_rng(self._seed, self.generation)
        self.solutions: list[np.ndarray] = self._strategy.ask()

    def _inside(self) -> list[tuple[str, Any, str]]:
        holders = [
            (name, getattr(self._strategy, name) if name else self._strategy) for name in _INSIDE
        ]
        return [
            (f"{name}.{field}".lstrip("."), holder, field)
            for name, holder in holders
            for field in _INSIDE[name]
        ]

    def restore(self, state: Mapping[str, np.ndarray], generation: int) -> None:
        self.generation = generation
        for name, holder, field in self._inside():
            convert = type(getattr(holder, field))
            setattr(holder, field, state[name] if convert is np.ndarray else convert(state[name]))
        # Which it reads before it writes
        self._strategy.mean_old = self._strategy.mean
        self._draw()

    @property
    def standard_deviations(self) -> np.ndarray:
        return np.array(self._strategy.stds)

    def tell(self, fitness: np.ndarray) -> None:
        # Of a record that cma keeps of all past changes of the step size
        with np.errstate(over="ignore"):
            # `cma` minimizes.
            self._strategy.tell(self.solutions, (-fitness).tolist())
        deviations = self.standard_deviations
        widen = (self._minimum / deviations).min()
        narrow = SPREAD_LIMIT / deviations.max()
        # The shape stays what `cma` made it
        self._strategy.sigma *= float(min(max(1.0, widen), narrow))
        self.generation += 1
        self._draw()
