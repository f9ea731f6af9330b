import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from standalone import standalone

from turing_learning.kernels.motion import sines_and_cosines, uniform, wrapped

sines_and_cosines = standalone(sines_and_cosines)
uniform = standalone(uniform)
wrapped = standalone(wrapped)


def evaluate(angles):
    angles = np.asarray(angles, dtype=float)
    sines, cosines = np.empty_like(angles), np.empty_like(angles)
    sines_and_cosines(angles, sines, cosines)
    return sines, cosines


def test_sines_and_cosines_are_good_to_the_last_place():
    angles = np.concatenate(
        [np.linspace(-10, 10, 100_001), np.random.default_rng(0).uniform(-1e6, 1e6, 10_000)]
    )
    sines, cosines = evaluate(angles)
    # Two units in the last place of 1.
    assert np.abs(sines - np.sin(angles)).max() < 5e-16
    assert np.abs(cosines - np.cos(angles)).max() < 5e-16


def test_huge_angles_fall_back_on_the_c_library():
    sines, cosines = evaluate([1e7, -3e12, 1e300, 0.5])
    np.testing.assert_array_equal(sines[:3], [math.sin(1e7), math.sin(-3e12), math.sin(1e300)])
    np.testing.assert_array_equal(cosines[:3], [math.cos(1e7), math.cos(-3e12), math.cos(1e300)])


@given(st.floats(-1e4, 1e4))
def test_wrapped_angles_are_the_same_direction_in_one_turn(angle):
    result = wrapped(angle)
    assert -math.pi <= result < math.pi
    assert math.cos(result - angle) == pytest.approx(1.0, abs=1e-12)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_wrapped_is_in_range_for_any_float(angle):
    assert -math.pi <= wrapped(angle) < math.pi


def test_angles_in_range_are_left_as_they_are():
    for angle in (-math.pi, -1.0, 0.0, 3.0):
        assert wrapped(angle) == angle


def test_random_numbers_follow_the_published_generator():
    # SplitMix64 from state 1234567: first outputs published with the generator's reference (Vigna 2015).
    expected = [6457827717110365317, 3203168211198807973, 9817491932198370423]
    draws = [uniform(np.uint64(1234567), np.uint64(k)) for k in range(3)]
    assert draws == [((value >> 11) + 0.5) * 2.0**-53 for value in expected]
