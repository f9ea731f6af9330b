"""What is remembered of the fitness of those that survive."""

import numpy as np

PRIOR = 1.0
"""Generations that an average individual counts in a remembered fitness: a newcomer is half believed."""


class FitnessMemory:
    """Average the fitness of an individual over the generations it has lived.

    Where fitness is noisy, the fittest of one generation are the lucky ones. What counts is the difference from the mean of the
    population, because the opponents change. With the difference d_a that an individual had a generations ago, its score is::

        sum_a decay^a d_a / (1 + sum_a decay^a)

    that is, a weighted mean with the difference 0 as one more observation. Where nothing is remembered, it ranks as the fitness
    does. In a population that improves, the past flatters the old, who were compared with worse. That slows the search down, and
    against opponents that change all the time the steadiness is wanted; shifting the past to make up for it was worse.

    Parameters
    ----------
    size
        Number of individuals.
    decay
        Weight of a generation relative to the next one, from 0 (nothing is remembered) to 1.

    Source
    ------
    docs/decisions/0011, where the variants were compared.
    """

    def __init__(self, size: int, decay: float) -> None:
        self.decay = decay
        self.totals = np.zeros(size)
        self.weights = np.zeros(size)

    def observe(self, fitness: np.ndarray, *, remember: bool) -> np.ndarray:
        """Take in the fitness (size,) of a generation and return the scores (size,)."""
        decay = self.decay if remember else 0.0
        self.totals = decay * self.totals + (fitness - fitness.mean())
        self.weights = decay * self.weights + 1.0
        return self.totals / (self.weights + PRIOR)

    def keep(self, survivors: np.ndarray) -> None:
        """Move the survivors (indices) to the front; behind them come individuals of which nothing is known."""
        totals, weights = self.totals[survivors], self.weights[survivors]
        self.totals, self.weights = np.zeros_like(self.totals), np.zeros_like(self.weights)
        self.totals[: len(survivors)], self.weights[: len(survivors)] = totals, weights
