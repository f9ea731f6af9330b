"""What the settings of the world do to motion and to what is measured of it; tests/reference has the slow twin."""

from dataclasses import replace

import numpy as np
import pytest

from turing_learning.swarm import (
    AGGREGATION,
    OBJECT_CLUSTERING,
    Robot,
    Tracking,
    Trials,
    alone,
    initial_poses,
    simulate,
)

STEPS = 60


def moved(scenario, *, trials=4, steps=STEPS, side_cm=None):
    poses = initial_poses(scenario, trials, np.random.default_rng(3), side_cm=side_cm)
    controllers = np.broadcast_to(
        scenario.controller, (trials, scenario.individuals, len(scenario.controller))
    )
    return simulate(scenario, controllers, poses, control_steps=steps, seed=5, threads=1)


def seen(scenario, rng=7):
    return Trials.draw(scenario, alone(scenario, 3), np.random.default_rng(rng)).observe(threads=1)


def with_robot(scenario, **settings):
    return replace(scenario, robot=replace(scenario.robot, **settings))


@pytest.mark.parametrize(
    "scenario", [AGGREGATION, OBJECT_CLUSTERING], ids=lambda scenario: scenario.name
)
@pytest.mark.parametrize("setting", ["wheel_scale_spread", "slip"])
def test_an_imperfection_that_vanishes_changes_no_bit(scenario, setting):
    plain, other = moved(scenario), moved(with_robot(scenario, **{setting: 1e-300}))
    np.testing.assert_array_equal(other.poses, plain.poses)
    np.testing.assert_array_equal(other.sensors, plain.sensors)
    np.testing.assert_array_equal(other.speeds, plain.speeds)


def test_robots_rest_until_the_first_reading_acts_and_then_do_what_they_were_told():
    lag = 3
    late = moved(with_robot(AGGREGATION, actuation_lag_cycles=lag, wheel_noise=0.0))
    assert not late.speeds[:, :, :lag].any()
    told = np.array(AGGREGATION.controller).reshape(2, 2)[late.sensors[:, : -1 - lag]]
    turn = (told[..., 1] - told[..., 0]) * 12.8 / 5.1
    np.testing.assert_allclose(late.speeds[:, :, lag:, 1], turn.transpose(0, 2, 1), atol=1e-12)


def test_under_the_gravity_of_the_earth_a_pushed_object_stops_at_once():
    # A robot drives straight at an object. It passes on 18 cm/s: at 5.7 cm/s^2 the object is far ahead after a second.
    poses = np.array([[[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]]])
    gap = {}
    for world in ("enki", "paper"):
        scenario = with_robot(OBJECT_CLUSTERING.in_world(world), actuation_lag_cycles=0)
        end = simulate(
            scenario, np.ones((1, 1, 6)), poses, control_steps=13, wheel_noise=0.0
        ).poses[0, -1]
        gap[world] = end[1, 0] - end[0, 0] - 8.5
    assert gap["enki"] > 2
    assert 0 <= gap["paper"] < 0.5


def test_each_wheel_keeps_its_own_scale_throughout_a_trial():
    scenario = with_robot(AGGREGATION, wheel_scale_spread=0.2, wheel_noise=0.0)
    scenario = replace(scenario, controller=(0.5, 0.8, 0.5, 0.8))
    turns = moved(scenario, trials=40, steps=5).speeds[..., 1] / (12.8 / 5.1)
    assert np.ptp(turns, axis=2).max() < 1e-12
    # The mean of 440 numbers: the standard error of 0.8 r - 0.5 l is 0.94 * 0.2 / sqrt(3 * 440) = 0.0052.
    assert turns.mean() == pytest.approx(0.3, abs=5 * 0.0052)
    assert turns.min() > 0.8 * 0.8 - 0.5 * 1.2
    assert turns.std() > 0.08


def test_slip_loses_half_of_its_share_in_the_mean():
    scenario = replace(
        with_robot(AGGREGATION, slip=0.4, wheel_noise=0.0), controller=(0.5, 0.5, 0.5, 0.5)
    )
    speeds = moved(scenario, trials=20, steps=50, side_cm=5000.0).speeds[..., 0]
    # 20 trials of 11 robots and 50 cycles, two wheels each: the standard error is 6.4 * 0.4 / sqrt(12 * 22000) = 0.005 cm/s.
    assert speeds.mean() == pytest.approx(6.4 * 0.8, abs=5 * 0.005)


def test_mistaken_readings_are_as_often_wrong_as_stated_and_any_other_state():
    scenario = with_robot(OBJECT_CLUSTERING, wheel_noise=0.0)
    scenario = replace(
        scenario, controller=(0.0,) * 6
    )  # nothing moves, so that right readings stay
    mistaken = replace(scenario, sensor=replace(scenario.sensor, mistakes=0.2))
    right, read = (moved(each, trials=10, steps=400).sensors for each in (scenario, mistaken))
    # Bodies that overlap are pushed apart first.
    shift = (read[:, 20:].astype(int) - right[:, 20:]) % 3
    # 19050 readings: the standard error of a share of 0.1 is 0.0022.
    assert (shift == 1).mean() == pytest.approx(0.1, abs=5 * 0.0022)
    assert (shift == 2).mean() == pytest.approx(0.1, abs=5 * 0.0022)


def test_a_tracker_that_is_almost_perfect_measures_the_speeds():
    almost = replace(AGGREGATION, tracker=Tracking(position_noise_cm=1e-12))
    np.testing.assert_allclose(seen(almost), seen(AGGREGATION), atol=1e-8)


def test_noise_of_the_tracker_changes_what_is_measured_and_not_how_robots_move():
    noisy = replace(AGGREGATION, tracker=Tracking(position_noise_cm=0.2, heading_noise_rad=0.1))
    plain, other = moved(AGGREGATION), moved(noisy)
    np.testing.assert_array_equal(other.poses, plain.poses)
    error = other.speeds[..., 1] - plain.speeds[..., 1]
    # Two images 0.1 s apart, each 0.1 rad off: sqrt(2) rad/s; 2640 of them, neighbors correlated, known to 3 %.
    assert error.std() == pytest.approx(2**0.5, rel=0.1)


def test_a_delay_of_the_tracker_by_whole_cycles_shows_what_was_before():
    late = replace(AGGREGATION, tracker=Tracking(delay_s=0.3))
    plain, delayed = seen(AGGREGATION), seen(late)
    np.testing.assert_allclose(delayed[:, :, 3:], plain[:, :, :-3], atol=1e-8)
    np.testing.assert_allclose(delayed[:, :, :3], 0, atol=1e-8)


def test_a_delay_of_half_a_cycle_shows_half_of_each():
    half = seen(replace(AGGREGATION, tracker=Tracking(delay_s=0.05)))
    plain = seen(AGGREGATION)
    expected = (plain[:, :, 1:, 1] + plain[:, :, :-1, 1]) / 2
    np.testing.assert_allclose(half[:, :, 1:, 1], expected, atol=1e-8)


def test_trackers_repeat_to_the_bit_and_differ_between_trials():
    noisy = replace(AGGREGATION, tracker=Tracking(heading_noise_rad=0.1))
    np.testing.assert_array_equal(seen(noisy), seen(noisy))
    still = replace(with_robot(noisy, wheel_noise=0.0), controller=(0.0, 0.0, 0.0, 0.0))
    turns = seen(still)[..., 1]
    assert not np.array_equal(turns[0], turns[1])


# Shares of the time that agents have each reading. The paper prints them in section 4.3, experiments/worlds has the tables.
SHARES = {
    ("aggregation", "enki"): (AGGREGATION, 10.0, (0.936, 0.064)),
    ("aggregation", "paper"): (AGGREGATION, 10.0, (0.9215, 0.0785)),
    ("object-clustering", "enki"): (OBJECT_CLUSTERING, 10.0, (0.467, 0.389, 0.145)),
    ("object-clustering", "paper"): (OBJECT_CLUSTERING, 300.0, (0.532, 0.342, 0.126)),
}


@pytest.mark.parametrize(("name", "world"), SHARES)
def test_agents_have_each_sensor_reading_as_often_as_measured(name, world):
    scenario, duration_s, expected = SHARES[name, world]
    trials = 40
    sensors = moved(scenario.in_world(world), trials=trials, steps=round(duration_s * 10)).sensors[
        :, :-1
    ]
    shares = [(sensors == state).mean(axis=(1, 2)) for state in range(len(expected))]
    for share, value in zip(shares, expected, strict=True):
        assert share.mean() == pytest.approx(value, abs=4 * share.std() / trials**0.5 + 0.002)


def test_robots_of_the_papers_world_are_what_they_were_but_for_the_lag():
    assert AGGREGATION.in_world("paper").robot == Robot(actuation_lag_cycles=1)
