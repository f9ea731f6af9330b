"""Draws in proportion to a likelihood: an ensemble of points that move along lines through one another."""

from collections.abc import Callable

import numpy as np

LogLikelihood = Callable[..., np.ndarray]
"""From points (S, P) to the logarithm (S,) of their likelihood, minus infinity where there is none.

With `least` (S,), anything below may be minus infinity: then the point is not taken, whatever the exact value.
"""


def draw(
    log_likelihood: LogLikelihood, start: np.ndarray, count: int, rng: np.random.Generator, power: float = 1.0
) -> np.ndarray:
    """Draw points in proportion to a power of the likelihood, uniform on [-1, 1] beforehand.

    Points to start from (S, P) are moved by stretches while the power of the likelihood grows. Stretches stay
    within what the starting points span, so that there should be many.
    """
    values = log_likelihood(start)
    chosen = np.resize(rng.permutation(np.flatnonzero(np.isfinite(values))), count)
    ensemble, reached = _Ensemble(log_likelihood, start[chosen], values[chosen], rng), 0.0
    for _ in range(10):
        ensemble.move(reached)
    while reached < power:
        reached = ensemble.temper(reached, power)
        for _ in range(6):
            ensemble.move(reached)
    for _ in range(30):
        ensemble.move(power)
    return ensemble.points


class _Ensemble:
    """Points (D, P) and their log-likelihoods (D,). Source: Goodman and Weare (2010)."""

    def __init__(
        self, log_likelihood: LogLikelihood, points: np.ndarray, values: np.ndarray, rng: np.random.Generator
    ) -> None:
        self.log_likelihood, self.points, self.values, self.rng = log_likelihood, points, values, rng

    def move(self, power: float) -> None:
        """Move one half of the points along lines through points of the other half and vice versa; redraw one parameter of each."""
        rng, (count, parameters) = self.rng, self.points.shape
        order = rng.permutation(count)
        self.points, self.values = self.points[order], self.values[order]
        halves = slice(0, count // 2), slice(count // 2, None)
        for mine, theirs in (halves, halves[::-1]):
            points, others = self.points[mine], self.points[theirs]
            partners = others[rng.integers(len(others), size=len(points))]
            stretch = (1 + rng.random(len(points))) ** 2 / 2
            proposal = partners + stretch[:, None] * (points - partners)
            self._accept(mine, proposal, (parameters - 1) * np.log(stretch), power)
        proposal, rows = self.points.copy(), np.arange(count)
        proposal[rows, rng.integers(parameters, size=count)] = rng.uniform(-1, 1, count)
        self._accept(slice(None), proposal, np.zeros(count), power)

    def _accept(self, some: slice, proposal: np.ndarray, bonus: np.ndarray, power: float) -> None:
        """Put what is proposed in place of some points, or not, by the rule of Metropolis and Hastings."""
        values = self.values[some]
        chance = np.log(self.rng.random(len(proposal))) - bonus
        # from which likelihood on a point is taken
        least = values + chance / power if power > 0 else np.where(chance < 0, -np.inf, np.inf)
        proposed = self.log_likelihood(proposal, least=least)
        accepted = proposed > least
        self.points[some] = np.where(accepted[:, None], proposal, self.points[some])
        self.values[some] = np.where(accepted, proposed, values)

    def temper(self, power: float, end: float) -> float:
        """Return the next power of the likelihood, at most `end`, at which half of the points count; draw the points by it."""
        values = self.values

        def weights(above: float) -> np.ndarray:
            likely: np.ndarray = np.exp((above - power) * (values - values.max()))
            return likely

        def counts(above: float) -> bool:
            likely = weights(above)
            return bool(likely.sum() ** 2 > 0.5 * len(values) * (likely**2).sum())

        low, high = (end, end) if counts(end) else (power, end)
        for _ in range(40):
            middle = (low + high) / 2
            low, high = (middle, high) if counts(middle) else (low, middle)
        cumulated = np.cumsum(weights(low))
        places = (np.arange(len(values)) + self.rng.random()) / len(values) * cumulated[-1]
        chosen = np.minimum(np.searchsorted(cumulated, places), len(values) - 1)
        self.points, self.values = self.points[chosen], values[chosen]
        return max(low, power + 1e-6)
