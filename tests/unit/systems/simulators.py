"""Simulators that worker processes can import."""

import os
import time

import numpy as np

STEPS, SIGNALS = 5, 2


def noise(parameters, rng):
    """Two signals around two parameters, of all models at once."""
    return parameters[:, None, :] + rng.normal(size=(len(parameters), STEPS, SIGNALS))


def noise_of_one(parameters, rng):
    """The same of one model."""
    return parameters + rng.normal(size=(STEPS, SIGNALS))


def spawning(parameters, rng):
    """Spawn generators of its own, and fail for several models of which one is above a half."""
    generators = rng.spawn(len(parameters))
    if len(parameters) > 1 and (parameters[:, 0] > 0.5).any():
        raise ArithmeticError("too fast")
    return np.stack(
        [noise_of_one(one, each) for one, each in zip(parameters, generators, strict=True)]
    )


def hang_above_half(parameters, rng):
    if parameters[0] > 0.5:
        time.sleep(600)
    return noise_of_one(parameters, rng)


def die_above_half(parameters, rng):
    if parameters[0] > 0.5:
        os._exit(7)
    return noise_of_one(parameters, rng)


class CannotBeLoaded:
    """A callable that can be sent, and not received."""

    def __reduce__(self):
        return (_refuse, ())

    def __call__(self, parameters, rng):
        return noise(parameters, rng)


def _refuse():
    raise ImportError("no such model")


def failing(simulate, reason, above=0.5):
    """Return a simulator of one model that fails where the first parameter is above a value."""

    def simulated(parameters, rng):
        sample = simulate(parameters, rng)
        if parameters[0] <= above:
            return sample
        if reason == "raise":
            raise ArithmeticError("too fast")
        if reason == "nan":
            sample[3, 1] = np.nan
            return sample
        if reason == "masked":
            mask = np.zeros(sample.shape, dtype=bool)
            mask[3, 1] = True
            return np.ma.masked_array(sample, mask)
        if reason == "complex":
            return sample + 1j
        return None if reason == "nothing" else sample[:-1]

    return simulated
