"""Five small stochastic simulators whose parameters lie along a ridge, written before they were tried.

They are as those of `awkward_systems`: parameters (M, P) and a numpy Generator in, (M, T, D) out.
Of each only a ratio, a sum or a product shows. All of their solutions lie in one region.
"""

import numpy as np
from awkward_systems import System, columns, registrar
from logarithm_systems import enzyme_speeds

SYSTEMS: dict[str, System] = {}
system = registrar(SYSTEMS)


@system("ridges", fastest=(0.5, 50, 5, 25), half=(2, 100, 15, 60), noise=(0.01, 1, 0.06, 0.25))
def ridge_dilute(parameters, rng):
    """Speeds of an enzyme where there is little to work on: fastest / half shows; biochemistry."""
    return enzyme_speeds(parameters, np.geomspace(0.01, 0.2, 15), rng)


@system("ridges", leak=(0, 3, 0.3, 1.5), decay=(0, 2, 0.3, 1.2), noise=(0.01, 1, 0.05, 0.3))
def ridge_two_losses(parameters, rng):
    """A level that falls for two reasons: leak + decay shows; physics."""
    leak, decay, noise = columns(parameters)
    level = np.exp(-(leak + decay) * np.linspace(0, 2, 25))
    return (level + noise * rng.standard_normal(level.shape))[..., None]


@system("ridges", density=(0.2, 8, 0.7, 3), radius=(0.3, 3, 0.7, 1.6), spread=(0.01, 1, 0.05, 0.3))
def ridge_drops(parameters, rng):
    """Weights of 30 drops: density x radius^3 shows; physics."""
    density, radius, spread = columns(parameters)
    shape = len(density), 30
    return (density * radius**3 * np.exp(spread * rng.standard_normal(shape)))[..., None]


@system("ridges", amount=(0.2, 20, 2, 8), rate=(0.002, 0.5, 0.02, 0.12), noise=(0.01, 1, 0.02, 0.1))
def ridge_early(parameters, rng):
    """The beginning of a rise: amount x rate shows, and a little of the rate; chemistry."""
    amount, rate, noise = columns(parameters)
    risen = amount * (1 - np.exp(-rate * np.linspace(0.1, 3, 30)))
    return (risen + noise * rng.standard_normal(risen.shape))[..., None]


@system("ridges", callers=(0.1, 10, 0.8, 4), reach=(0.2, 5, 0.6, 2), rate=(0.1, 8, 0.8, 3))
def ridge_calls(parameters, rng):
    """Calls that are heard in 40 nights: callers x reach^2 x rate shows, a surface; ecology."""
    callers, reach, rate = columns(parameters)
    return rng.poisson(np.broadcast_to(3 * callers * reach**2 * rate, (len(rate), 40)))[..., None]
