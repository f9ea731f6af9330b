"""Angles: trigonometry that vectorizes."""

import math

import numpy as np

from .compile import contracted, inlined

TWO_PI = 2 * math.pi
_BELOW_PI = math.nextafter(math.pi, 0)

# pi / 2 in three parts of 33 bits, so that multiples up to 2**20 are exact (Cody and Waite 1980).
_QUARTERS = 2 / math.pi
_QUARTER_HIGH = float.fromhex("0x1.921fb544p+0")
_QUARTER_MIDDLE = float.fromhex("0x1.0b4611a6p-34")
_QUARTER_LOW = float.fromhex("0x1.3198a2e037073p-69")
LARGEST_ANGLE = 1.0e6
"""Angles up to this (rad) are reduced exactly; larger ones take the C library's functions."""


@contracted
def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Return sin and cos of |angle| <= LARGEST_ANGLE to about one unit in the last place, without a branch.

    Taylor polynomials on [-pi/4, pi/4]: the first term left out is below 1e-16 of the result.
    """
    quadrant = np.floor(angle * _QUARTERS + 0.5)
    r = ((angle - quadrant * _QUARTER_HIGH) - quadrant * _QUARTER_MIDDLE) - quadrant * _QUARTER_LOW
    r2 = r * r
    p = -1 / 1307674368000.0
    p = p * r2 + 1 / 6227020800.0
    p = p * r2 - 1 / 39916800.0
    p = p * r2 + 1 / 362880.0
    p = p * r2 - 1 / 5040.0
    p = p * r2 + 1 / 120.0
    p = p * r2 - 1 / 6.0
    sine = r + r * r2 * p
    q = 1 / 20922789888000.0
    q = q * r2 - 1 / 87178291200.0
    q = q * r2 + 1 / 479001600.0
    q = q * r2 - 1 / 3628800.0
    q = q * r2 + 1 / 40320.0
    q = q * r2 - 1 / 720.0
    q = q * r2 + 1 / 24.0
    cosine = 1.0 - (0.5 * r2 - r2 * r2 * q)
    odd = quadrant - 2.0 * np.floor(quadrant * 0.5)
    half = quadrant - 4.0 * np.floor(quadrant * 0.25)
    swapped_sine = cosine if odd == 1.0 else sine
    swapped_cosine = sine if odd == 1.0 else cosine
    return (
        -swapped_sine if half >= 2.0 else swapped_sine,
        -swapped_cosine if half == 1.0 or half == 2.0 else swapped_cosine,
    )


@inlined
def sines_and_cosines(angles: np.ndarray, sines: np.ndarray, cosines: np.ndarray) -> None:
    """Fill `sines` and `cosines` of angles of any size."""
    for i in range(angles.shape[0]):
        sines[i], cosines[i] = sine_and_cosine(angles[i])
    large = 0
    for i in range(angles.shape[0]):
        large += abs(angles[i]) > LARGEST_ANGLE
    if large > 0:
        replace_large(angles, sines, cosines)


@inlined
def replace_large(angles: np.ndarray, sines: np.ndarray, cosines: np.ndarray) -> None:
    """Take the C library's functions where an angle is too large for the fast ones."""
    for i in range(angles.shape[0]):
        if abs(angles[i]) > LARGEST_ANGLE:
            sines[i] = math.sin(angles[i])
            cosines[i] = math.cos(angles[i])


@inlined
def wrapped(angle: float) -> float:
    """Return the angle in [-pi, pi)."""
    turns = np.floor((angle + math.pi) * (1 / TWO_PI))
    return min(max(angle - TWO_PI * turns, -math.pi), _BELOW_PI)
