import numpy as np
import pytest
from family_motion import steps, turns

from turing_learning.families import BurstAndCoast
from turing_learning.families._kinds import glided

WALK = BurstAndCoast(individuals=20, steps=200)


def walk(family=WALK, speed=10.0, kick_interval=0.5, glide_time=0.8, turn=0.5):
    return family.simulate(
        np.tile([speed, kick_interval, glide_time, turn], (5, 1)), np.random.default_rng(1)
    )


def test_without_turns_walkers_go_straight():
    assert np.abs(turns(walk(turn=0.0))).max() < 1e-6


def test_between_kicks_walkers_go_straight_and_slow_down_exponentially():
    rare = walk(BurstAndCoast(individuals=20, steps=20), kick_interval=1000.0, glide_time=500.0)
    lengths = np.linalg.norm(steps(rare), axis=-1)
    np.testing.assert_allclose(lengths[:, 1:], lengths[:, :-1] * np.exp(-0.1 / 500), rtol=1e-9)
    assert np.abs(turns(rare)).max() < 1e-6


def test_long_glides_keep_the_speed():
    steady = walk(BurstAndCoast(individuals=20, steps=50, variation=1e-6), glide_time=1e9, turn=0.0)
    np.testing.assert_allclose(np.linalg.norm(steps(steady), axis=-1), 1.0, rtol=1e-4)


def test_who_has_come_to_rest_stays_in_place_and_does_not_turn():
    glide = BurstAndCoast(individuals=20, observed=20, steps=200)
    samples = glide(np.array([[10.0, 1000.0, 0.1, 0.5]]), np.random.default_rng(1))
    np.testing.assert_array_equal(samples[samples[..., 0] < 1e-8], 0.0)
    assert (samples[..., 0] < 1e-8).any()


def test_walkers_turn_at_kicks_by_the_given_angle():
    # kicks of one step each, a share u of which lies before a frame: the direction of a displacement is about the mean of two
    # directions, weighted by u and 1 - u, so that it changes by u and 1 - u of two turns; E[u^2 + (1 - u)^2] = 2/3
    angles = turns(walk(kick_interval=0.0, glide_time=1e9, turn=0.3))
    assert angles.std() == pytest.approx(0.3 * np.sqrt(2 / 3), rel=0.15)


def test_the_mean_way_of_a_kick_is_that_of_the_formula():
    # one speed and one duration for all kicks: per kick of 0.5 s, 10 * 0.8 * (1 - exp(-0.5 / 0.8)) = 3.72 cm
    regular = walk(BurstAndCoast(individuals=20, steps=250, variation=1e-6), turn=0.0)
    mean_speed = np.linalg.norm(steps(regular)[:, :250], axis=-1).mean() / 0.1
    assert mean_speed == pytest.approx(10 * 0.8 * (1 - np.exp(-0.5 / 0.8)) / 0.5, rel=1e-3)


def test_durations_and_speeds_vary_by_the_given_share():
    durations, speeds, angles = BurstAndCoast(individuals=100, variation=0.4)._drawn(
        [np.random.default_rng(1)]
    )
    for drawn in (durations, speeds):
        assert drawn.mean() == pytest.approx(1, abs=0.02)
        assert drawn.std() == pytest.approx(0.4, abs=0.02)
    assert angles.std() == pytest.approx(1, abs=0.02)


def test_without_glides_nobody_moves():
    np.testing.assert_allclose(steps(walk(glide_time=0.0)), 0.0, atol=1e-12)


def test_a_glide_covers_the_integral_of_its_speed():
    times = np.linspace(0, 2, 20001)
    speed = 3 * np.exp(-times / 0.7)
    way, last = glided(np.array(3.0), np.array(2.0), np.array(0.7))
    assert way == pytest.approx(np.trapezoid(speed, times), rel=1e-6)
    assert last == pytest.approx(speed[-1])


def test_walkers_take_no_notice_of_each_other():
    spread_out = BurstAndCoast(individuals=20, steps=200, start_side_cm=1e4)
    np.testing.assert_allclose(steps(walk()), steps(walk(spread_out)), atol=1e-6)
