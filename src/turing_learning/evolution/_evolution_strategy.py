"""The (mu + lambda) evolution strategy of the paper."""

from collections.abc import Mapping

import numpy as np

from ..arrays import array
from ..errors import integer, number, require
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
from ._parts import FitnessMemory, Jumper, PhasedMating

STEP_SIZE_LIMIT = 1e6
"""Largest step size, as of `PARAMETER_LIMIT`; far above all that a useful search reaches."""

FASTEST_ADAPTATION = 10.0
"""Largest `adaptation`; with more, step sizes are drawn rather than adapted."""


class EvolutionStrategy(Turns):
    """(mu + lambda) evolution strategy with self-adaptive mutation strengths, one for each parameter.

    In each generation all mu + lambda individuals are scored, parents too, because fitness is subjective. The
    mu best are the parents of lambda children. What a child inherits is up to the `mating`; its step sizes
    are the means of its parents'. Then::

        sigma_i <- max(sigma_i exp(tau' N(0, 1) + tau N_i(0, 1)), minimum step size)
        x_i     <- x_i + sigma_i N_i(0, 1)
        tau'     = adaptation / sqrt(2 n)
        tau      = adaptation / sqrt(2 sqrt(n))

    with n parameters, one N(0, 1) for all parameters of a child and one N_i(0, 1) for each. Among equally fit
    individuals the older come first; a population in which all are equally fit keeps its parents and does not
    drift.

    Source: paper, section 3.2.4. The paper leaves recombination, learning rates and initial values open; those
    used here are those of the group's public code (repository wawachen/Turing_learning, TL_source). With
    `adaptation` 1 the rates are those of Eiben and Smith, Introduction to Evolutionary Computing (2003).

    Parameters
    ----------
    dimension
        Number of parameters n, >= 1.
    parents, offspring
        mu and lambda, >= 1 each; `size` is their sum.
    seed
        Entropy: a non-negative integer or a sequence of them.
    initial_low, initial_high : () or (dimension,)
        The first mu + lambda individuals are drawn uniformly from this range.
    initial_step_size : () or (dimension,)
        Step sizes of the first individuals, from `minimum_step_size` to 1e6.
    minimum_step_size : () or (dimension,)
        No step size falls below it; >= 0.
    adaptation
        Learning rates of the step sizes, in units of the textbook's; above 0, at most 10.
    mating
        Who has which parents; None: two parents, and each parameter from one of them, as in the paper.
    jumper
        Lets some children jump; None: none.
    memory
        What selection remembers of fitness; None: only the present counts, as in the paper.
    """

    def __init__(
        self, dimension: int, *, parents: int = 50, offspring: int = 50, seed: Seed = 0,
        initial_low: np.typing.ArrayLike = -1.0, initial_high: np.typing.ArrayLike = 1.0,
        initial_step_size: np.typing.ArrayLike = 1.0, minimum_step_size: np.typing.ArrayLike = 0.01,
        adaptation: float = 0.5, mating: PhasedMating | None = None, jumper: Jumper | None = None,
        memory: FitnessMemory | None = None,
    ) -> None:  # fmt: skip
        self.dimension = integer("dimension", dimension, 1)
        self.parents = integer("parents", parents, 1)
        self.offspring = integer("offspring", offspring, 1)
        self.size = self.parents + self.offspring
        self._seed = check_seed(seed)
        self._minimum = check_vector("minimum_step_size", minimum_step_size, dimension)
        steps = check_vector("initial_step_size", initial_step_size, dimension)
        rule = "not be negative"
        require((self._minimum >= 0).all(), "minimum_step_size", rule, self._minimum.min())
        fits = ((steps >= self._minimum) & (steps > 0) & (steps <= STEP_SIZE_LIMIT)).all()
        rule = f"be above 0, at least `minimum_step_size`, and at most {STEP_SIZE_LIMIT:g}"
        require(fits, "initial_step_size", rule, f"{steps.min()} to {steps.max()}")
        low, high = check_range(initial_low, initial_high, dimension)
        adaptation = number("adaptation", adaptation, above=0, most=FASTEST_ADAPTATION)
        self._common_rate = adaptation / np.sqrt(2 * dimension)
        self._own_rate = adaptation / np.sqrt(2 * np.sqrt(dimension))
        self._population = generation_rng(self._seed, 0).uniform(low, high, (self.size, dimension))
        self._steps = np.tile(steps, (self.size, 1))
        self._asked_steps = self._steps
        self._mating = mating or PhasedMating()
        self._jumper = jumper
        self._memory = memory
        self._generation = 0

    def ask(self) -> np.ndarray:
        """Return the population (size, dimension): the parents, the fittest first, then the children; see `Optimizer.ask`."""
        self._turn("ask")
        self._awaits_fitness, self._asked_steps = True, self._steps
        return self._population.copy()

    def tell(self, fitness: np.ndarray) -> np.ndarray:
        """Keep the mu fittest as parents and let them have lambda children; see `Optimizer.tell`.

        Returns what the population was ranked by (size,): the fitness, or the scores of the `memory`.
        """
        self._turn("tell")
        generation = self._generation
        fitness = array("fitness", fitness, "size", size=self.size)
        if self._memory is None:
            scores = fitness.copy()
        else:
            scores = self._memory.score(generation, fitness)
        # The fittest first; of equals the older
        best = np.argsort(-scores, kind="stable")[: self.parents]
        if self._memory is not None:
            self._memory.keep(best)
        rng = generation_rng(self._seed, generation + 1)
        parents, steps = self._population[best], self._steps[best]
        # the order of draws is part of the method: another one gives other runs for the same seed
        pairs = self._mating.pair(generation, self.parents, self.offspring, rng)
        inherited = (steps[pairs[0]] + steps[pairs[1]]) / 2
        # one factor for all step sizes of a child, and one for each: Schwefel's self-adaptation
        common = self._common_rate * rng.standard_normal((self.offspring, 1))
        individual = self._own_rate * rng.standard_normal(inherited.shape)
        child_steps = inherited * np.exp(common + individual)
        child_steps = np.minimum(np.maximum(child_steps, self._minimum), STEP_SIZE_LIMIT)
        children = self._mating.mix(generation, parents, pairs, rng)
        children = children + child_steps * rng.standard_normal(children.shape)
        children = np.minimum(np.maximum(children, -PARAMETER_LIMIT), PARAMETER_LIMIT)
        # after the bounds, because a jump draws within the initial range
        if self._jumper is not None:
            self._jumper.jump(generation, children, rng)
        self._population = np.concatenate((parents, children))
        self._steps = np.concatenate((steps, child_steps))
        self._generation += 1
        self._awaits_fitness = False
        return scores

    def state(self) -> dict[str, np.ndarray]:
        """Return the number of completed generations, the population to be asked for next, its step sizes and its past."""
        self._turn("state")
        # without a memory the state has an empty one, so that its arrays are always the same
        memory = self._memory or FitnessMemory(self.size, 0.0)
        return {
            "generation": np.array(self._generation, dtype=np.int64),
            "population": self._population.copy(),
            "step_sizes": self._steps.copy(),
            "totals": memory.totals.copy(),
            "weights": memory.weights.copy(),
        }

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over what `state` returned, from a strategy with the same settings; allowed also between `ask` and `tell`."""
        shapes = {"population": "N P", "step_sizes": "N P", "totals": "N", "weights": "N"}
        generation = check_generation(state)
        arrays = state_arrays(state, shapes, N=self.size, P=self.dimension)
        if self._memory is not None:
            self._memory.totals = arrays["totals"]
            self._memory.weights = arrays["weights"]
        self._generation = generation
        self._population = arrays["population"]
        self._steps = arrays["step_sizes"]
        self._awaits_fitness, self._asked_steps = False, self._steps
