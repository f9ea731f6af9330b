"""A custom system for tests, importable by worker processes."""

import numpy as np

STEPS = 50
RANGES = {"speed": (0, 20), "turn_noise": (0, 3)}


def walk(parameters, rng):
    """A persistent random walk: linear and angular speed, of many models at once."""
    speed, noise = parameters.T[:, :, None]
    shape = (len(parameters), STEPS)
    return np.stack(
        [speed + rng.standard_normal(shape), noise * rng.standard_normal(shape)], axis=-1
    )


def walk_of_one(parameters, rng):
    """The same of one model."""
    return walk(parameters[None], rng)[0]


def recorded(speed=6.0, noise=0.6, count=40, seed=3):
    """Samples of a walk."""
    return walk(np.tile([speed, noise], (count, 1)), np.random.default_rng(seed))


def herd(rng):
    """The same, observed anew."""
    return recorded(seed=int(rng.integers(1000)))


def stumbling(parameters, rng):
    """The walk, which is lost where it is fast."""
    samples = walk(parameters, rng)
    samples[parameters[:, 0] > 12, 7, 0] = np.nan
    return samples


class Breaking:
    """The walk, until it has been called some times."""

    def __init__(self, calls):
        self.calls = calls

    def __call__(self, parameters, rng):
        self.calls -= 1
        if self.calls < 0:
            raise OSError("license expired")
        return walk(parameters, rng)
