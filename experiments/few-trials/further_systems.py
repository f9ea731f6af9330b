"""Eight more small stochastic simulators, written before their writer had read the method.

They are as those of `awkward_systems`: parameters (M, P) and a numpy Generator in, (M, T, D) out.
"""

import numpy as np
from awkward_systems import System, columns, registrar, swapped

SYSTEMS: dict[str, System] = {}
system = registrar(SYSTEMS)


@system(
    "counts",
    arrival=(0.1, 6.0, 1.0, 4.0),
    service=(0.1, 6.0, 1.5, 5.0),
    patience=(0.01, 2.0, 0.1, 1.0),
)
def counts_queue(parameters, rng):
    """One server and customers who give up: the length of the queue and how many were served."""
    arrival, service, patience = columns(parameters)
    queue = np.zeros(arrival.shape, dtype=np.int64)
    steps = []
    for _ in range(40):
        served = np.zeros_like(queue)
        for _ in range(10):
            queue = queue + rng.poisson(arrival * 0.1)
            done = (rng.random(queue.shape) < 1.0 - np.exp(-service * 0.1)) & (queue > 0)
            queue = queue - done
            served = served + done
            waiting = np.maximum(queue - 1, 0)
            queue = queue - rng.binomial(waiting, 1.0 - np.exp(-patience * 0.1))
        steps.append(np.concatenate([queue, served], axis=1))
    return np.stack(steps, axis=1)


@system(
    "counts",
    infection=(0.05, 2.0, 0.3, 1.2),
    recovery=(0.02, 1.0, 0.1, 0.5),
    waning=(0.001, 0.3, 0.01, 0.15),
    reported=(0.05, 1.0, 0.2, 0.9),
)
def counts_returning_epidemic(parameters, rng):
    """Immunity that wanes in a town of 300; only a part of the new cases is reported."""
    infection, recovery, waning, reported = columns(parameters)
    infected = np.full(infection.shape, 6, dtype=np.int64)
    susceptible = np.full(infection.shape, 294, dtype=np.int64)
    steps = []
    for _ in range(50):
        immune = 300 - infected - susceptible
        force = infection * (infected + 0.1) / 300.0
        new = rng.binomial(susceptible, 1.0 - np.exp(-force))
        cured = rng.binomial(infected, 1.0 - np.exp(-recovery))
        lost = rng.binomial(immune, 1.0 - np.exp(-waning))
        infected = infected + new - cured
        susceptible = susceptible - new + lost
        steps.append(rng.binomial(new, reported))
    return np.stack(steps, axis=1)


@system("renewal", mean=(0.1, 5.0, 0.4, 2.0), shape=(0.2, 12.0, 0.5, 6.0))
def renewal_counts(parameters, rng):
    """Events with gamma waiting times, counted in 30 windows of one second each."""
    mean, shape = columns(parameters)
    events = 600
    waits = rng.gamma(np.broadcast_to(shape, (len(mean), events))) * mean / shape
    times = np.cumsum(waits, axis=1)
    counts = [((times >= t) & (times < t + 1.0)).sum(axis=1) for t in range(5, 35)]
    return np.stack(counts, axis=1)[:, :, None]


@system(
    "short",
    first=(0.5, 20.0, 2.0, 12.0),
    second=(0.5, 20.0, 2.0, 12.0),
    third=(0.5, 20.0, 2.0, 12.0),
    shape=(0.4, 5.0, 0.7, 3.0),
)
def short_competing_risks(parameters, rng):
    """Ten patients, each with the time and one column a cause; observation ends after 10 years."""
    scales = np.asarray(parameters)[:, None, :3]
    shape = np.asarray(parameters)[:, None, 3:]
    times = scales * rng.weibull(np.broadcast_to(shape, (len(scales), 10, 3)))
    earliest = times.min(axis=2, keepdims=True)
    cause = (times == earliest) & (earliest < 10.0)
    return np.concatenate([np.minimum(earliest, 10.0), cause], axis=2)


@system(
    "angles", drift=(-1.5, 1.5, -1.0, 1.0), spread=(0.02, 2.0, 0.1, 1.0), pull=(0.0, 1.5, 0.1, 1.0)
)
def angles_ring(parameters, rng):
    """Walk on a ring that drifts and is pulled to the angle 0; the angle is given in [0, 2 pi)."""
    drift, spread, pull = columns(parameters)
    angle = rng.uniform(0.0, 2.0 * np.pi, drift.shape)
    steps = []
    for _ in range(40):
        angle = angle + drift - pull * np.sin(angle) + spread * rng.normal(size=angle.shape)
        angle = angle % (2.0 * np.pi)
        steps.append(angle)
    return np.stack(steps, axis=1)


WEIGHTS = {f"weight{i}": (-3.0, 3.0, -1.5, 1.5) for i in range(1, 11)}
_rng = np.random.default_rng(77)
DESIGN = 0.6 * _rng.normal(size=(30, 1)) + 0.8 * _rng.normal(size=(30, 10))


@system("correlated", **WEIGHTS, noise=(0.05, 3.0, 0.3, 1.5))
def correlated_regression(parameters, rng):
    """A regression of ten weights on columns that are alike, with noise: 30 values a sample."""
    parameters = np.asarray(parameters)
    means = parameters[:, :10] @ DESIGN.T
    noise = rng.normal(size=means.shape) * parameters[:, 10:]
    return (means + noise)[:, :, None]


@system(
    "exchangeable",
    swapped((("first_life",), ("second_life",))),
    first_life=(0.1, 10.0, 0.5, 3.0),
    second_life=(0.1, 10.0, 4.0, 8.0),
)
def exchangeable_bulbs(parameters, rng):
    """Twenty bulbs, each of one of two makes at random: how long each has burnt."""
    lives = np.asarray(parameters)
    make = rng.integers(0, 2, (len(lives), 20))
    return np.take_along_axis(lives, make, axis=1)[:, :, None] * rng.gamma(
        2.0, 0.5, (len(lives), 20, 1)
    )


PLAYERS = {f"player{i}": (-3.0, 3.0, -1.5, 1.5) for i in range(2, 9)}


@system("many", **PLAYERS, home=(-2.0, 2.0, -0.5, 1.0))
def many_league(parameters, rng):
    """Eight players, the first of strength 0, each at home to each: points of a season, home and away."""
    parameters = np.asarray(parameters)
    strength = np.concatenate([np.zeros((len(parameters), 1)), parameters[:, :7]], axis=1)
    odds = strength[:, :, None] - strength[:, None, :] + parameters[:, 7][:, None, None]
    won = rng.random((len(parameters), 8, 8)) < 1.0 / (1.0 + np.exp(-odds))
    played = ~np.eye(8, dtype=bool)
    home = (won & played).sum(axis=2)
    away = (~won & played).sum(axis=1)
    return np.stack([home, away], axis=2)
