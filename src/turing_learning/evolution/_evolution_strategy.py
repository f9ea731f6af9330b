"""The (mu + lambda) evolution strategy of the paper."""

from collections.abc import Mapping, Sequence

import numpy as np

from ._checks import (
    check_count,
    check_fitness,
    check_generation,
    check_range,
    check_share,
    check_state_array,
    check_vector,
)
from ._jumper import Jumper
from ._memory import FitnessMemory
from ._randomness import Seed, check_seed, generation_rng
from ._turns import Turns

PARAMETER_LIMIT = 1e12
"""Largest magnitude of a parameter: nothing becomes infinite where selection has stopped or rewards growth."""

STEP_SIZE_LIMIT = 1e6
"""Largest step size, for the same reason; far above all that a useful search reaches."""


class EvolutionStrategy:
    """(mu + lambda) evolution strategy with self-adaptive mutation strengths, one for each parameter.

    In each generation all mu + lambda individuals are scored, parents too, because fitness is subjective. The mu best
    are the parents of lambda children. A child has two parents, drawn uniformly with replacement; each of its
    parameters comes from one of the two with equal probability, and its step sizes are the means of theirs. Then::

        sigma_i <- max(sigma_i exp(tau' N(0, 1) + tau N_i(0, 1)), minimum step size)      tau' = 1 / (2 sqrt(2 n))
        x_i     <- x_i + sigma_i N_i(0, 1)                                                tau  = 1 / (2 sqrt(2 sqrt(n)))

    with n parameters, one N(0, 1) for all parameters of a child and one N_i(0, 1) for each. Among equally fit
    individuals the older come first; a population in which all are equally fit keeps its parents and does not drift.

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
    recombination
        Before the generation `refinement`, the probability that a child has two parents; otherwise it has one. Two good
        parents from different regions have bad children: a few good individuals are lost in a majority that has settled elsewhere.
    redraw
        Before the generation `refinement`, the probability that one parameter of a child, any, is drawn anew: a jump out of a
        local optimum, which small steps do not leave. From then on jumps become rarer, until they end at the generation `settled`.
    jump_reach : () or (dimension,)
        How many times wider than the initial range, about its middle, that is from which jumps draw; > 0.
    exchange
        In the same way, the probability that two of the `groups` of a child, any, exchange their values.
    groups
        Parameters that can stand for each other, for `exchange`: two or more lists of indices, all of the same length, without
        a common index. Empty if there are none.
    dependent
        Indices, in no group, of parameters that mean nothing any more when groups have exchanged their values: they are drawn anew.
    intermediate
        Whether from the generation `refinement` on a child has the means of its parents' parameters rather than one or the other's.
        The noise in them averages out, and the population stays close together.
    memory
        From the generation `refinement` on, selection goes by the fitness that an individual had in the mean over the
        generations it has lived, each weighing `memory` times the next one, see `FitnessMemory`; 0 to 1, 0 for the present alone.
    refinement
        Generation that ends the search for the right region and begins that for the right point, >= 0.
    settled
        Generation from which on nothing jumps, at least `refinement`; None: `refinement`.

    Raises
    ------
    ValueError
        If an argument breaks the rules above.

    Source
    ------
    Paper, section 3.2.4. The paper leaves recombination, learning rates and initial values open; those used here are
    the ones published in follow-up work. The two phases are not in the paper, see docs/decisions/0011.
    """

    def __init__(
        self,
        dimension: int,
        *,
        parents: int = 50,
        offspring: int = 50,
        seed: Seed = 0,
        initial_low: np.typing.ArrayLike = -1.0,
        initial_high: np.typing.ArrayLike = 1.0,
        initial_step_size: np.typing.ArrayLike = 1.0,
        minimum_step_size: np.typing.ArrayLike = 0.01,
        recombination: float = 1.0,
        redraw: float = 0.0,
        jump_reach: np.typing.ArrayLike = 1.0,
        exchange: float = 0.0,
        groups: Sequence[Sequence[int]] = (),
        dependent: Sequence[int] = (),
        intermediate: bool = False,
        memory: float = 0.0,
        refinement: int = 0,
        settled: int | None = None,
    ) -> None:
        self.dimension = check_count("dimension", dimension, 1)
        self.parents = check_count("parents", parents, 1)
        self.offspring = check_count("offspring", offspring, 1)
        self.size = self.parents + self.offspring
        self._seed = check_seed(seed)
        self._minimum = check_vector("minimum_step_size", minimum_step_size, dimension)
        steps = check_vector("initial_step_size", initial_step_size, dimension)
        _check_step_sizes(self._minimum, steps)
        low = check_vector("initial_low", initial_low, dimension)
        high = check_vector("initial_high", initial_high, dimension)
        check_range(low, high)
        self._common_rate = 1 / (2 * np.sqrt(2 * dimension))
        self._own_rate = 1 / (2 * np.sqrt(2 * np.sqrt(dimension)))
        self._population = generation_rng(self._seed, 0).uniform(low, high, (self.size, dimension))
        self._steps = np.tile(steps, (self.size, 1))
        self._asked_steps = self._steps
        self._recombination = check_share("recombination", recombination)
        self._jumper = Jumper(low, high, jump_reach, redraw, exchange, groups, dependent)
        self._intermediate = bool(intermediate)
        self._memory = FitnessMemory(self.size, check_share("memory", memory))
        self._refinement = check_count("refinement", refinement, 0)
        self._settled = check_count("settled", refinement if settled is None else settled, self._refinement)
        self._generation = 0
        self._turns = Turns()

    @property
    def step_sizes(self) -> np.ndarray:
        """Step sizes (size, dimension) of the population last asked for; before that, of the one to come."""
        return self._asked_steps.copy()

    def ask(self) -> np.ndarray:
        """Return the population (size, dimension) to be scored: the parents, the fittest first, then the children.

        Raises
        ------
        RuntimeError
            If the population asked for before has not been told its fitness.
        """
        self._turns.ask()
        self._asked_steps = self._steps
        return self._population.copy()

    def tell(self, fitness: np.ndarray) -> np.ndarray:
        """Keep the mu fittest as parents and let them have lambda children.

        Parameters
        ----------
        fitness : (size,)
            Larger is better.

        Returns
        -------
        (size,)
            What the population was ranked by: the fitness, or with a memory what is known of it, see `FitnessMemory`.

        Raises
        ------
        RuntimeError
            If no population has been asked for since the last call.
        ValueError
            If `fitness` has another shape or is not finite.
        """
        self._turns.tell()
        scores = self._scores(check_fitness(fitness, self.size))
        best = fittest(scores, self.parents)
        self._memory.keep(best)
        rng = generation_rng(self._seed, self._generation + 1)
        parents, steps = self._population[best], self._steps[best]
        pairs = rng.integers(self.parents, size=(2, self.offspring))
        searching = self._generation < self._refinement
        if searching and self._recombination < 1:
            alone = rng.random(self.offspring) >= self._recombination
            pairs[1, alone] = pairs[0, alone]
        child_steps = self._mutate_steps((steps[pairs[0]] + steps[pairs[1]]) / 2, rng)
        mixed = _blend(parents, pairs) if self._intermediate and not searching else _recombine(parents, pairs, rng)
        children = self._mutate(mixed, child_steps, rng)
        self._jumper.jump(children, rng, 1.0 if searching else self._unrest())
        self._population = np.concatenate((parents, children))
        self._steps = np.concatenate((steps, child_steps))
        self._generation += 1
        self._turns.reset()
        return scores

    def _scores(self, fitness: np.ndarray) -> np.ndarray:
        if self._memory.decay == 0:
            return fitness.copy()
        return self._memory.observe(fitness, remember=self._generation >= self._refinement)

    def state(self) -> dict[str, np.ndarray]:
        """Return the number of completed generations, the population to be asked for next, its step sizes and its past.

        Raises
        ------
        RuntimeError
            If a population has been asked for and not been told its fitness.
        """
        self._turns.pause()
        return {
            "generation": np.array(self._generation, dtype=np.int64),
            "population": self._population.copy(),
            "step_sizes": self._steps.copy(),
            "totals": self._memory.totals.copy(),
            "weights": self._memory.weights.copy(),
        }

    def restore(self, state: Mapping[str, np.ndarray]) -> None:
        """Take over a state; allowed at any time, also between `ask` and `tell`.

        Parameters
        ----------
        state
            What `state` returned, from a strategy with the same settings.

        Raises
        ------
        ValueError
            If the state lacks an array, or does not fit the settings of this strategy.
        """
        shape = (self.size, self.dimension)
        generation = check_generation(state)
        population = check_state_array(state, "population", shape)
        steps = check_state_array(state, "step_sizes", shape)
        totals, weights = (check_state_array(state, name, (self.size,)) for name in ("totals", "weights"))
        self._memory.totals, self._memory.weights = totals, weights
        self._generation, self._population, self._steps = generation, population, steps
        self._asked_steps = steps
        self._turns.reset()

    def _mutate_steps(self, steps: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        common = self._common_rate * rng.standard_normal((self.offspring, 1))
        own = self._own_rate * rng.standard_normal(steps.shape)
        mutated = steps * np.exp(common + own)
        return np.minimum(np.maximum(mutated, self._minimum), STEP_SIZE_LIMIT)

    def _mutate(self, parameters: np.ndarray, steps: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        mutated = parameters + steps * rng.standard_normal(steps.shape)
        return np.minimum(np.maximum(mutated, -PARAMETER_LIMIT), PARAMETER_LIMIT)

    def _unrest(self) -> float:
        """Return how often there are jumps in the refinement, from 1 at its beginning to 0 where they end."""
        left = self._settled - self._generation
        return left / (self._settled - self._refinement) if left > 0 else 0.0


def fittest(fitness: np.ndarray, count: int) -> np.ndarray:
    """Return the indices (count,) of the fittest, the fittest first; of equals the first come first."""
    return np.argsort(-fitness, kind="stable")[:count]


def _recombine(parents: np.ndarray, pairs: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    first, second = parents[pairs[0]], parents[pairs[1]]
    return np.where(rng.integers(2, size=first.shape, dtype=np.bool_), first, second)


def _blend(parents: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    return 0.5 * (parents[pairs[0]] + parents[pairs[1]])


def _check_step_sizes(minimum: np.ndarray, initial: np.ndarray) -> None:
    if not (minimum >= 0).all():
        raise ValueError(f"`minimum_step_size` must not be negative; got {minimum.min()}.")
    if not ((initial >= minimum) & (initial > 0) & (initial <= STEP_SIZE_LIMIT)).all():
        raise ValueError(
            "`initial_step_size` must be above 0, at least `minimum_step_size`, and at most "
            f"{STEP_SIZE_LIMIT:g}; got {initial.min()} to {initial.max()}."
        )
