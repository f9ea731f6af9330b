"""Parts of an evolution strategy: who mates, who jumps, what is remembered of fitness. The paper needs the first only."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import integer, number, refuse, require
from ._checks import check_vector

PRIOR = 1.0
"""Generations that an average individual counts in a remembered fitness: a newcomer is half believed."""


@dataclass(frozen=True)
class PhasedMating:
    """Which parents a child has, and what it inherits before it mutates: first some have one parent, later all the means of two.

    By default it is the paper's: two parents, drawn uniformly with replacement, and each parameter from either
    of the two.

    Two good parents from different regions have bad children: a few good individuals are lost in a majority
    that has settled elsewhere. In the means of the refinement noise averages out, and the population stays
    close together.

    Source: docs/decisions/0011.

    Parameters
    ----------
    recombination
        Before the generation `refinement`, the probability that a child has two parents; 0 to 1.
    intermediate
        Whether from then on a child has the means of its parents' parameters.
    refinement
        Generation that ends the search for the right region, >= 0.
    """

    recombination: float = 1.0
    intermediate: bool = False
    refinement: int = 0

    def __post_init__(self) -> None:
        number("recombination", self.recombination, least=0, most=1)
        integer("refinement", self.refinement)

    def pair(
        self, generation: int, parents: int, children: int, rng: np.random.Generator
    ) -> np.ndarray:
        """Return the indices (2, children) of the parents of each child."""
        pairs = rng.integers(parents, size=(2, children))
        if generation < self.refinement and self.recombination < 1:
            alone = rng.random(children) >= self.recombination
            pairs[1, alone] = pairs[0, alone]
        return pairs

    def mix(
        self, generation: int, parents: np.ndarray, pairs: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray:
        """Return the parameters (children, n) that children of pairs (2, children) of the parents (mu, n) inherit."""
        first, second = parents[pairs[0]], parents[pairs[1]]
        if self.intermediate and generation >= self.refinement:
            return 0.5 * (first + second)
        return np.where(rng.integers(2, size=first.shape, dtype=np.bool_), first, second)


class Jumper:
    """Jumps of children out of a local optimum, which small steps do not leave.

    Source: docs/decisions/0011.

    Parameters
    ----------
    low, high : (n,)
        Range of the first individuals.
    redraw
        Probability that one parameter of a child, any, is drawn anew.
    reach : () or (n,)
        How many times wider than the initial range, about its middle, that is from which parameters are drawn
        anew; > 0.
    exchange
        Probability that two of the `groups` of a child, any, exchange their values.
    groups
        Parameters that can stand for each other: two or more lists of indices, all of the same length,
        without a common index. Empty if there are none.
    dependent
        Indices, in no group, of parameters that mean nothing any more when groups have exchanged their values:
        they are drawn anew.
    refinement, settled
        Up to the generation `refinement` jumps are as frequent as that; then they become rarer, until they end
        at `settled`.
    """

    def __init__(
        self, low: np.ndarray, high: np.ndarray, *, redraw: float = 0.0, reach: np.typing.ArrayLike = 1.0,
        exchange: float = 0.0, groups: Sequence[Sequence[int]] = (), dependent: Sequence[int] = (),
        refinement: int = 0, settled: int | None = None,
    ) -> None:  # fmt: skip
        self._dimension = len(low)
        wider = check_vector("reach", reach, self._dimension)
        require((wider > 0).all(), "reach", "be above 0", wider.min())
        # 0 to the last bit where the reach is 1
        added = 0.5 * (wider - 1) * (high - low)
        self._low = low - added
        self._high = high + added
        self._redraw = number("redraw", redraw, least=0, most=1)
        self._exchange = number("exchange", exchange, least=0, most=1)
        self._refinement = integer("refinement", refinement)
        self._settled = integer(
            "settled", refinement if settled is None else settled, self._refinement
        )
        indices = [int(index) for group in groups for index in group]
        if len(set(map(len, groups))) > 1 or len(set(indices)) < len(indices) or len(groups) == 1:
            rule = "be two or more of one length and have no index in common"
            refuse("groups", rule, str(groups))
        for name, indices_given in (("groups", indices), ("dependent", list(map(int, dependent)))):
            fits = all(0 <= index < self._dimension for index in indices_given)
            got = str(groups if name == "groups" else dependent)
            require(fits, name, f"hold indices from 0 to {self._dimension - 1}", got)
        rule = "hold no index of a group"
        require(not {*map(int, dependent)} & {*indices}, "dependent", rule, str(dependent))
        self._groups = np.array(indices, dtype=np.int64).reshape(len(groups), -1 if indices else 0)
        self._dependent = np.array(list(map(int, dependent)), dtype=np.int64)

    def jump(self, generation: int, children: np.ndarray, rng: np.random.Generator) -> None:
        """Let children (lambda, n) jump, in place."""
        low, high, dependent, rate = self._low, self._high, self._dependent, 1.0
        if generation >= self._refinement:
            generations_left = self._settled - generation
            rate = 0.0
            if generations_left > 0:
                rate = generations_left / (self._settled - self._refinement)
        if self._redraw * rate > 0:
            chosen = np.flatnonzero(rng.random(len(children)) < self._redraw * rate)
            parameter = rng.integers(self._dimension, size=len(chosen))
            children[chosen, parameter] = rng.uniform(low[parameter], high[parameter])
        if self._exchange * rate > 0 and len(self._groups) > 1:
            for k in np.flatnonzero(rng.random(len(children)) < self._exchange * rate):
                first, second = self._groups[rng.permutation(len(self._groups))[:2]]
                children[k, first], children[k, second] = children[k, second], children[k, first]
                children[k, dependent] = rng.uniform(low[dependent], high[dependent])


class FitnessMemory:
    """Average the fitness of an individual over the generations it has lived.

    Where fitness is noisy, the fittest of one generation are the lucky ones. What counts is the difference from
    the mean of the population, because the opponents change. With the difference d_a that an individual had a
    generations ago, its score is::

        sum_a decay^a d_a / (1 + sum_a decay^a)

    that is, a weighted mean with the difference 0 as one more observation. Where nothing is remembered, it
    ranks as the fitness does. In a population that improves, the past flatters the old, who were compared with
    worse. That slows the search down, and against opponents that change all the time the steadiness is wanted;
    shifting the past to make up for it was worse.

    Source: docs/decisions/0011, where the variants were compared.

    Parameters
    ----------
    size
        Number of individuals.
    decay
        Weight of a generation relative to the next one, from 0 (nothing is remembered) to 1.
    start
        Generation from which on fitness is remembered, >= 0.
    """

    def __init__(self, size: int, decay: float, start: int = 0) -> None:
        self.decay = number("decay", decay, least=0, most=1)
        self.start = integer("start", start)
        self.totals = np.zeros(size)
        self.weights = np.zeros(size)

    def score(self, generation: int, fitness: np.ndarray) -> np.ndarray:
        """Take in the fitness (size,) of a generation and return the scores (size,)."""
        decay = self.decay if generation >= self.start else 0.0
        self.totals = decay * self.totals + (fitness - fitness.mean())
        self.weights = decay * self.weights + 1.0
        return self.totals / (self.weights + PRIOR)

    def keep(self, survivors: np.ndarray) -> None:
        """Move the survivors (indices) to the front; behind them come individuals of which nothing is known."""
        totals = self.totals[survivors]
        weights = self.weights[survivors]
        self.totals = np.zeros_like(self.totals)
        self.weights = np.zeros_like(self.weights)
        self.totals[: len(survivors)] = totals
        self.weights[: len(survivors)] = weights
