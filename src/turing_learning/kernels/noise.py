"""Counter-based random numbers: every draw is a function of (key, counter), so threads cannot change it."""

import numpy as np

from .compile import inlined

_INCREMENT = np.uint64(0x9E3779B97F4A7C15)
_FIRST = np.uint64(0xBF58476D1CE4E5B9)
_SECOND = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_STEP = 2.0**-53


@inlined
def uniform(key: np.uint64, counter: np.uint64) -> float:
    """Return the draw number `counter` of the stream `key`, uniform in (0, 1).

    Source: SplitMix64, Steele, Lea and Flood, Fast splittable pseudorandom number generators (2014).
    """
    z = key + (counter + np.uint64(1)) * _INCREMENT
    z = (z ^ (z >> _S30)) * _FIRST
    z = (z ^ (z >> _S27)) * _SECOND
    z = z ^ (z >> _S31)
    return (np.float64(z >> _S11) + 0.5) * _STEP


@inlined
def noise_factor(key: np.uint64, counter: np.uint64, noise: float) -> float:
    """Return a factor uniform in (1 - noise, 1 + noise)."""
    return 1.0 + noise * (2.0 * uniform(key, counter) - 1.0)
