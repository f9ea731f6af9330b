import numpy as np
import pytest
from family_motion import order, steps, turns

from turing_learning.families import Vicsek

CROWD = Vicsek(individuals=30, steps=60, start_side_cm=10.0, period_cm=10.0)


def crowd(noise, radius=3.0, speed=3.0):
    return CROWD.simulate(np.tile([speed, noise, radius], (10, 1)), np.random.default_rng(1))


def test_a_dense_crowd_without_noise_goes_one_way():
    assert (order(crowd(noise=0.0)) > 0.99).all()


def test_with_full_noise_directions_are_random():
    # of 30 random directions the mean resultant has a root mean square of 1 / sqrt(30) = 0.18
    assert order(crowd(noise=2 * np.pi)).mean() < 0.3


def test_everybody_moves_at_the_given_speed():
    lengths = np.linalg.norm(steps(crowd(noise=1.0, speed=7.0)), axis=-1)
    np.testing.assert_allclose(lengths, 7.0 * CROWD.interval_s)


def test_who_has_nobody_near_turns_by_half_the_noise_at_most():
    angles = turns(crowd(noise=0.8, radius=0.0))
    assert np.abs(angles).max() <= 0.4 + 1e-9
    assert np.abs(angles).max() > 0.39


def test_a_step_takes_the_mean_direction_of_the_step_before():
    pair = Vicsek(individuals=2, steps=1, start_side_cm=1.0, period_cm=None)
    first, second = np.moveaxis(
        steps(pair.simulate(np.array([[2.0, 0.0, 5.0]]), np.random.default_rng(4)))[0], 0, 0
    )
    mean = first.sum(axis=0) / np.linalg.norm(first.sum(axis=0))
    np.testing.assert_allclose(second, np.tile(0.2 * mean, (2, 1)))


def test_who_is_beyond_the_border_of_the_square_is_near():
    # the square is so small that everybody is near everybody in it, and in none of the groups without it
    lost = {"individuals": 5, "steps": 1, "start_side_cm": 1000.0}
    model, rng = np.tile([1.0, 0.0, 5.0], (3, 1)), np.random.default_rng
    assert (order(Vicsek(**lost, period_cm=7.0).simulate(model, rng(1))) > 0.999).all()
    assert (order(Vicsek(**lost, period_cm=None).simulate(model, rng(1))) < 0.999).all()


def test_neighbor_signals_in_a_periodic_square_are_refused():
    with pytest.raises(
        ValueError,
        match=r"`signals` must be speed and turn in a periodic square; .* Set period_cm=None",
    ):
        Vicsek(signals=("speed", "neighbor_distance"))


def test_a_square_without_extent_is_refused():
    with pytest.raises(ValueError, match="`period_cm` must be a finite number above 0; got 0"):
        Vicsek(period_cm=0)


def test_a_tank_and_a_periodic_square_exclude_each_other():
    with pytest.raises(
        ValueError,
        match=r"`tank_cm` must be None in a periodic square; got \(9, 9\). Set period_cm=None",
    ):
        Vicsek(tank_cm=(9, 9))
