import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import turing_learning as tl
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Arena


def alone(controller, cycles=10, heading=0.3, scenario=AGGREGATION):
    poses = np.array([[[5.0, -2.0, heading]]])
    return tl.swarm.simulate(
        scenario, np.array([[controller]]), poses, control_steps=cycles, wheel_noise=0.0
    )


def test_a_robot_with_equal_wheels_drives_straight_at_their_speed():
    result = alone([0.5, 0.5, 0, 0])
    np.testing.assert_allclose(result.speeds[0, 0], [[6.4, 0.0]] * 10, atol=1e-12)
    np.testing.assert_allclose(
        result.poses[0, -1, 0, :2], [5 + 6.4 * math.cos(0.3), -2 + 6.4 * math.sin(0.3)]
    )


def test_a_robot_driving_backwards_has_negative_speed():
    assert (alone([-0.7, -0.7, 0, 0]).speeds[0, 0, :, 0] < 0).all()


def test_opposite_wheels_turn_on_the_spot_clockwise_when_the_left_one_is_faster():
    result = alone([1.0, -1.0, 0, 0])
    np.testing.assert_allclose(result.speeds[0, 0, :, 1], -2 * 12.8 / 5.1)
    np.testing.assert_allclose(result.poses[0, :, 0, :2], [[5.0, -2.0]] * 11, atol=1e-12)


def test_angular_speed_is_unwrapped_for_a_replica_that_turns_more_than_pi_in_a_cycle():
    np.testing.assert_allclose(alone([20.0, -20.0, 0, 0]).speeds[0, 0, :, 1], -20 * 2 * 12.8 / 5.1)


def test_constant_wheels_drive_a_circle_of_the_expected_radius():
    result = alone([-0.7, -1.0, 0, 0], cycles=200)
    radius = 5.1 / 2 * (0.7 + 1.0) / (1.0 - 0.7)
    spread = np.ptp(result.poses[0, :, 0, :2], axis=0)
    np.testing.assert_allclose(spread, 2 * radius, rtol=0.01)


def test_motion_of_any_magnitude_stays_finite():
    for size in (1e3, 1e8, 1e15, 1e100):
        result = alone([size, -size, size, size], cycles=20)
        assert np.isfinite(result.poses).all()
        assert np.isfinite(result.speeds).all()


@settings(max_examples=20, deadline=None)
@given(angle=st.floats(-3, 3), seed=st.integers(0, 1000))
def test_a_rotated_start_gives_the_rotated_motion(angle, seed):
    rng = np.random.default_rng(seed)
    poses = tl.swarm.initial_poses(OBJECT_CLUSTERING, 1, rng)
    turned = poses.copy()
    c, s = math.cos(angle), math.sin(angle)
    turned[..., 0], turned[..., 1] = (
        c * poses[..., 0] - s * poses[..., 1],
        s * poses[..., 0] + c * poses[..., 1],
    )
    turned[..., 2] += angle
    controllers = np.broadcast_to(OBJECT_CLUSTERING.controller, (1, 5, 6))
    runs = [
        tl.swarm.simulate(OBJECT_CLUSTERING, controllers, p, control_steps=10, wheel_noise=0)
        for p in (poses, turned)
    ]
    # 10 cycles: contacts amplify rounding of 1e-14 by less than 1e5; a grazing ray could differ, which these seeds do not.
    np.testing.assert_allclose(runs[0].speeds, runs[1].speeds, atol=1e-7)


def test_wheel_noise_is_uniform_with_the_stated_width():
    poses = np.zeros((200, 1, 3))
    controllers = np.broadcast_to([1.0, 1.0, 1.0, 1.0], (200, 1, 4))
    result = tl.swarm.simulate(
        AGGREGATION, controllers, poses, control_steps=100, seed=3, wheel_noise=0.05
    )
    turn = result.speeds[..., 1] * 5.1 / 12.8  # difference of two draws in (0.95, 1.05)
    assert np.abs(turn).max() < 0.1
    # Variance of the difference: 2 * 0.1**2 / 12; its estimate over 20,000 draws has a relative standard error below 1 %.
    assert turn.var() == pytest.approx(2 * 0.1**2 / 12, rel=0.04)
    assert abs(turn.mean()) < 5 * turn.std() / math.sqrt(turn.size)


def test_different_seeds_give_different_noise_and_equal_seeds_the_same():
    runs = [
        tl.swarm.simulate(
            AGGREGATION, np.ones((1, 1, 4)), np.zeros((1, 1, 3)), control_steps=5, seed=seed
        ).speeds
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(runs[0], runs[1])
    assert (runs[0] != runs[2]).all()


def test_inputs_are_not_modified():
    poses, controllers = np.full((1, 1, 3), 4.0), np.ones((1, 1, 4))
    tl.swarm.simulate(AGGREGATION, controllers, poses, control_steps=3)
    assert (poses == 4).all()
    assert (controllers == 1).all()


def test_walls_keep_everything_inside():
    scenario = replace(OBJECT_CLUSTERING, arena=Arena(100.0, 80.0))
    poses = tl.swarm.initial_poses(scenario, 5, np.random.default_rng(0))
    controllers = np.broadcast_to(scenario.controller, (5, 5, 6))
    result = tl.swarm.simulate(scenario, controllers, poses, control_steps=200)
    assert (result.poses[:, :, :5, :2] >= 3.5).all()
    assert (result.poses[:, :, :5, 0] <= 96.5).all()
    assert (result.poses[:, :, 5:, 1] <= 75.0).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"controllers": np.zeros((2, 11, 3))},
            r"`controllers` must be of shape .*4\); got \(2, 11, 3\)",
        ),
        (
            {"initial_poses": np.zeros((3, 11, 3))},
            r"`initial_poses` must be .*\(2, any, 3\); got \(3, 11, 3\)",
        ),
        (
            {"controllers": np.full((2, 11, 4), np.nan)},
            r"`controllers` must be finite; got nan at \(0, 0, 0\)",
        ),
        (
            {"initial_poses": np.zeros((2, 10, 3))},
            "`initial_poses` must hold a pose of each of the 11 robots.*got 10",
        ),
        ({"control_steps": 0}, "`control_steps` must be an integer from 1 to .*; got 0"),
        ({"seed": -1}, "`seed` must be .* at least 0; got -1"),
        ({"wheel_noise": 1.5}, "`wheel_noise` must be .* below 1; got 1.5"),
        ({"threads": 0}, "`threads` must be .* at least 1; got 0. None takes every processor"),
    ],
)
def test_arguments_that_do_not_fit_are_refused(change, message):
    arguments = {
        "controllers": np.zeros((2, 11, 4)),
        "initial_poses": np.zeros((2, 11, 3)),
        "control_steps": 1,
    } | change
    with pytest.raises(ValueError, match=message):
        tl.swarm.simulate(AGGREGATION, **arguments)


def test_a_start_outside_the_walls_is_refused():
    scenario = replace(AGGREGATION, arena=Arena(100.0, 100.0))
    poses = np.full((1, 2, 3), 50.0)
    poses[0, 1, 0] = 98.0
    with pytest.raises(
        ValueError, match=r"inside the arena of 100.0 x 100.0 cm; got .* \[body 1 of trial 0\]"
    ):
        tl.swarm.simulate(scenario, np.zeros((1, 2, 4)), poses, control_steps=1)


def test_initial_poses_fill_the_square_of_the_paper():
    poses = tl.swarm.initial_poses(AGGREGATION, 500, np.random.default_rng(0))
    assert poses.shape == (500, 11, 3)
    assert poses[..., :2].min() >= 0
    assert 331 < poses[..., :2].max() <= 331.66
    assert -math.pi <= poses[..., 2].min() < -3.1
    assert 3.1 < poses[..., 2].max() < math.pi


def test_more_robots_than_the_walls_have_room_for_are_refused():
    scenario = replace(AGGREGATION, arena=Arena(50.0, 50.0))
    with pytest.raises(
        ValueError,
        match=r"`robots` must have room .*; got 400, and at most 56 of 400 bodies of radius 3.5",
    ):
        tl.swarm.initial_poses(scenario, 1, np.random.default_rng(0), robots=400)


def test_more_robots_keep_the_density_and_the_share_of_objects():
    poses = tl.swarm.initial_poses(OBJECT_CLUSTERING, 400, np.random.default_rng(0), robots=25)
    assert poses.shape == (400, 75, 3)
    assert 223 < poses[..., :2].max() <= 100 * math.sqrt(5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"robots": 0}, "`robots` must be an integer from 1 to .*; got 0"),
        ({"side_cm": -1.0}, "`side_cm` must be .* above 0; got -1.0"),
        (
            {"trials": 2**63},
            "`trials` must be an integer from 1 to 1000000000000; got 9223372036854775808",
        ),
        (
            {"robots": 2**63},
            "`robots` must be an integer from 1 to 1000000000000; got 9223372036854775808",
        ),
        (
            {"trials": 10**12},
            "`trials` must have at most 1000000000000 bodies in all; got 1000000000000 with 11000000000000",
        ),
    ],
)
def test_impossible_placements_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        tl.swarm.initial_poses(
            AGGREGATION, **{"trials": 2, "rng": np.random.default_rng(0)} | arguments
        )


@pytest.mark.parametrize("trials", [1, 2])
def test_speeds_of_one_trial_are_laid_out_as_those_of_many(trials):
    poses = tl.swarm.initial_poses(AGGREGATION, trials, np.random.default_rng(1))
    controllers = np.broadcast_to(AGGREGATION.controller, (*poses.shape[:2], 4))
    assert not tl.swarm.simulate(
        AGGREGATION, controllers, poses, control_steps=2
    ).speeds.flags.c_contiguous
