"""Systems on which inference from simulations is often tried, and nothing was tuned: models (M, P) give samples (M, T, D).

Sources: moving averages, Marin and others (2012), Statistics and Computing 22; g-and-k, Rayner and MacGillivray (2002), Statistics
and Computing 12; predators and prey, Wilkinson (2011), Stochastic Modelling for Systems Biology; a queue, Blum and Francois (2010),
Statistics and Computing 20; an epidemic, Lueckmann and others (2021), AISTATS.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np


class System(NamedTuple):
    """A simulator, the ranges of its parameters, and the narrower ones that truths are drawn from."""

    simulate: Callable[[np.ndarray, np.random.Generator], np.ndarray]
    ranges: dict[str, tuple[float, float]]
    truths: tuple[tuple[float, float], ...]

    def truth(self, rng: np.random.Generator) -> dict[str, float]:
        """Draw a truth."""
        return {
            name: rng.uniform(low, high)
            for name, (low, high) in zip(self.ranges, self.truths, strict=True)
        }


def moving_average(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return series (M, 60, 1) of normal shocks and of shares of the last two."""
    first, second = parameters.T[..., None]
    shocks = rng.standard_normal((len(parameters), 62))
    return (shocks[:, 2:] + first * shocks[:, 1:-1] + second * shocks[:, :-2])[..., None]


def g_and_k(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return independent draws (M, 50, 1) by quantiles of location, scale, skewness g and kurtosis k."""
    location, scale, g, k = parameters.T[..., None]
    normal = rng.standard_normal((len(parameters), 50))
    return (location + scale * (1 + 0.8 * np.tanh(g * normal / 2)) * (1 + normal**2) ** k * normal)[
        ..., None
    ]


def coupled(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return two values (M, 60, 2) that return to a mean and to each other, 0.1 s a step (Ornstein and Uhlenbeck)."""
    rate, noise, coupling, mean = parameters.T[..., None]
    values, steps = np.repeat(mean, 2, axis=1), []
    for _ in range(60):
        drift = rate * (mean - values) + coupling * (values[:, ::-1] - values)
        values = values + 0.1 * drift + np.sqrt(0.1) * noise * rng.standard_normal(values.shape)
        steps.append(values)
    return np.stack(steps, axis=1)


def epidemic(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the logarithm of daily cases (M, 40, 1), half of which are reported, among 500."""
    contact, recovery, start = parameters.T
    infected = np.maximum(np.round(start), 1).astype(int)
    susceptible, days = 500 - infected, []
    for _ in range(40):
        new = rng.binomial(susceptible, 1 - np.exp(-contact * infected / 500))
        susceptible, infected = (
            susceptible - new,
            infected + new - rng.binomial(infected, 1 - np.exp(-recovery)),
        )
        days.append(np.log1p(rng.poisson(0.5 * new)))
    return np.stack(days, axis=1)[..., None]


def prey(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return logarithms of prey and predators (M, 40, 2), every 0.5; births, meals and deaths are counted each 0.1."""
    birth, meal, death = parameters.T
    there, hunters, steps = np.full(len(birth), 50.0), np.full(len(birth), 100.0), []
    for step in range(200):
        rates = birth * there, meal / 100 * there * hunters, death * hunters
        born, eaten, died = (rng.poisson(np.clip(0.1 * each, 0, 1e6)) for each in rates)
        there, hunters = (
            np.clip(there + born - eaten, 0, 1e5),
            np.clip(hunters + eaten - died, 0, 1e5),
        )
        if step % 5 == 4:
            steps.append(np.log1p(np.stack([there, hunters], axis=1)))
    return np.stack(steps, axis=1)


def queue(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return logarithms of the times between 50 departures (M, 50, 1): exponential arrivals, uniform service."""
    least, more, rate = parameters.T[..., None]
    service = least + more * rng.random((len(parameters), 50))
    arrivals = np.cumsum(rng.standard_exponential((len(parameters), 50)) / rate, axis=1)
    last, steps = np.zeros(len(parameters)), []
    for arrival, needed in zip(arrivals.T, service.T, strict=True):
        done = np.maximum(arrival, last) + needed
        steps.append(done - last)
        last = done
    return np.log(np.stack(steps, axis=1))[..., None]


SYSTEMS = {
    "moving-average": System(
        moving_average, {"first": (-2, 2), "second": (-1, 1)}, ((-1.2, 1.2), (-0.7, 0.9))
    ),
    "g-and-k": System(
        g_and_k,
        {"location": (0, 10), "scale": (0.1, 5), "g": (-3, 3), "k": (0, 1.5)},
        ((2, 8), (0.5, 4), (-2.5, 2.5), (0.1, 1)),
    ),
    "coupled": System(
        coupled,
        {"rate": (0.05, 5), "noise": (0.1, 3), "coupling": (0, 5), "mean": (-5, 5)},
        ((0.3, 4), (0.3, 2.5), (0.3, 4), (-4, 4)),
    ),
    "epidemic": System(
        epidemic,
        {"contact": (0.05, 2), "recovery": (0.02, 1), "start": (1, 50)},
        ((0.3, 1.2), (0.05, 0.25), (3, 40)),
    ),
    "prey": System(
        prey,
        {"birth": (0.05, 2), "meal": (0.1, 2), "death": (0.05, 2)},
        ((0.4, 1.2), (0.4, 1.2), (0.3, 1)),
    ),
    "queue": System(
        queue,
        {"least": (0, 5), "more": (0.1, 8), "rate": (0.05, 1)},
        ((0.5, 4), (1, 6), (0.08, 0.5)),
    ),
}
