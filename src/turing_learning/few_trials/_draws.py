"""Draws in proportion to a likelihood.

An ensemble of points that move along lines through one another.

Source: Goodman and Weare, Ensemble samplers with affine invariance (2010); Del Moral, Doucet and
Jasra, Sequential Monte Carlo samplers (2006), for the powers. Unlike the walkers of the loop
(`_design`), which follow a density from batch to batch, these begin anew and have to end as draws.
"""

from collections.abc import Callable

import numpy as np

LogLikelihood = Callable[..., np.ndarray]
"""From points (S, P) to the logarithm (S,) of their likelihood, minus infinity where there is none.

With `least` (S,), anything below may be minus infinity: then the point is not taken, whatever the
exact value.
"""


FIRST_MOVES = 10
"""Moves of all points before the likelihood counts."""

MOVES_PER_POWER = 6
"""Moves of all points at each power of the likelihood."""

LAST_MOVES = 30
"""Moves of all points at the last power."""

COUNTING_SHARE = 0.5
"""Share of the points that still count when the power grows."""

BISECTIONS = 40
"""Halvings of the interval in which the next power is sought: beyond the precision of numbers."""


def draw(
    log_likelihood: LogLikelihood,
    start: np.ndarray,
    count: int,
    rng: np.random.Generator,
    power: float = 0.0,
) -> np.ndarray:
    """Draw points in proportion to the likelihood, uniform on [-1, 1] beforehand.

    Points to start from (S, P) are moved by stretches while the power of the likelihood grows from
    `power`. With 0 they need not be likely. With 1 they are moved by the full likelihood alone, so
    that they should be near draws from it already, such as those of a similar likelihood.
    Stretches stay within what the starting points span, so that there should be many.
    """
    values = log_likelihood(start)
    chosen = np.resize(rng.permutation(np.flatnonzero(np.isfinite(values))), count)
    ensemble = _Ensemble(log_likelihood, start[chosen], values[chosen], rng)
    if power == 0:
        for _ in range(FIRST_MOVES):
            ensemble.move(power)
    while power < 1:
        power = ensemble.temper(power)
        for _ in range(MOVES_PER_POWER):
            ensemble.move(power)
    for _ in range(LAST_MOVES):
        ensemble.move(power)
    return ensemble.points


class _Ensemble:
    """Points (D, P) and their log-likelihoods (D,)."""

    def __init__(
        self,
        log_likelihood: LogLikelihood,
        points: np.ndarray,
        values: np.ndarray,
        rng: np.random.Generator,
    ) -> None:
        self.log_likelihood = log_likelihood
        self.points = points
        self.values = values
        self.rng = rng

    def move(self, power: float) -> None:
        """Move each half of the points along lines through the other.

        Redraw one parameter of each.
        """
        rng = self.rng
        count, parameters = self.points.shape
        order = rng.permutation(count)
        self.points = self.points[order]
        self.values = self.values[order]
        lower = slice(0, count // 2)
        second = slice(count // 2, None)
        for mine, theirs in ((lower, second), (second, lower)):
            points = self.points[mine]
            companions = self.points[theirs]
            partners = companions[rng.integers(len(companions), size=len(points))]
            stretch = (1 + rng.random(len(points))) ** 2 / 2
            proposal = partners + stretch[:, None] * (points - partners)
            self._accept(mine, proposal, (parameters - 1) * np.log(stretch), power)
        proposal = self.points.copy()
        rows = np.arange(count)
        proposal[rows, rng.integers(parameters, size=count)] = rng.uniform(-1, 1, count)
        self._accept(slice(None), proposal, np.zeros(count), power)

    def _accept(self, half: slice, proposal: np.ndarray, bonus: np.ndarray, power: float) -> None:
        """Let some points move or stay, by the rule of Metropolis and Hastings."""
        values = self.values[half]
        chance = np.log(self.rng.random(len(proposal))) - bonus
        # from which likelihood on a point is taken
        if power > 0:
            threshold = values + chance / power
        else:
            threshold = np.where(chance < 0, -np.inf, np.inf)
        proposed = self.log_likelihood(proposal, least=threshold)
        accepted = proposed > threshold
        self.points[half] = np.where(accepted[:, None], proposal, self.points[half])
        self.values[half] = np.where(accepted, proposed, values)

    def temper(self, power: float) -> float:
        """Return the next power of the likelihood, at most 1; draw the points by it.

        At that power half of the points count.
        """
        values = self.values

        def weights(next_power: float) -> np.ndarray:
            likely: np.ndarray = np.exp((next_power - power) * (values - values.max()))
            return likely

        def enough(next_power: float) -> bool:
            likely = weights(next_power)
            return bool(likely.sum() ** 2 > COUNTING_SHARE * len(values) * (likely**2).sum())

        low = 1.0 if enough(1.0) else power
        high = 1.0
        for _ in range(BISECTIONS):
            middle = (low + high) / 2
            if enough(middle):
                low = middle
            else:
                high = middle
        # points are drawn evenly by their weights (systematic resampling)
        cumulated = np.cumsum(weights(low))
        positions = (np.arange(len(values)) + self.rng.random()) / len(values) * cumulated[-1]
        chosen = np.minimum(np.searchsorted(cumulated, positions), len(values) - 1)
        self.points = self.points[chosen]
        self.values = values[chosen]
        return max(low, power + 1e-6)
