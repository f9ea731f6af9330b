import numpy as np
import pytest

from turing_learning import swarm
from turing_learning.robots.tracking import signed_speeds


def test_speeds_of_simulated_poses_are_those_of_the_simulation():
    rng = np.random.default_rng(2)
    poses = swarm.initial_poses(swarm.AGGREGATION, 1, rng)
    controllers = np.broadcast_to(swarm.AGGREGATION.controller, (1, poses.shape[1], 4))
    motion = swarm.simulate(swarm.AGGREGATION, controllers, poses, control_steps=40, threads=1)
    np.testing.assert_allclose(signed_speeds(motion.poses[0], 0.1), motion.speeds[0], atol=1e-9)


def test_a_turn_across_pi_is_short():
    poses = np.array([[[0, 0, 3.1]], [[0, 0, -3.1]]])
    assert signed_speeds(poses, 0.1)[0, 0, 1] == pytest.approx((2 * np.pi - 6.2) / 0.1)


def test_motion_against_the_heading_is_negative():
    poses = np.array([[[0, 0, 0.2]], [[-1, 0, 0.2]]])
    assert signed_speeds(poses, 0.5)[0, 0, 0] == pytest.approx(-2.0)


def test_poses_of_a_wrong_shape_are_refused():
    with pytest.raises(
        ValueError, match=r"`poses` must be of shape \(T \+ 1, A, 3\) with T >= 1; got \(1, 2, 3\)"
    ):
        signed_speeds(np.zeros((1, 2, 3)), 0.1)


def test_an_interval_of_no_length_is_refused():
    with pytest.raises(ValueError, match=r"`interval_s` must be a finite number above 0; got 0"):
        signed_speeds(np.zeros((2, 2, 3)), 0)
