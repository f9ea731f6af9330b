from dataclasses import replace

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.models import ElmanModel
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Arena, Drivers

HIDDEN = 3
MODEL = ElmanModel(hidden=HIDDEN)


def networks(count, seed=0, model=MODEL):
    return np.random.default_rng(seed).normal(0, 2, (count, len(model.parameter_names)))


def scattered(trials, robots, seed=0, side_cm=300.0):
    """Return poses near enough for robots to see each other now and then."""
    return tl.swarm.initial_poses(
        AGGREGATION, trials, np.random.default_rng(seed), robots=robots, side_cm=side_cm
    )


def turn_rates(weights, sensors):
    """Return the turn rates (T,) of a robot that a network drives, without noise (rad/s)."""
    left, right = 12.8 * MODEL.respond(weights, sensors[:-1]).T
    return (right - left) / 5.1


@pytest.mark.parametrize(
    "robots", [5, 44]
)  # more than 40 are advanced in tiles, one trial at a time
def test_a_driven_robot_does_what_its_network_says_of_its_readings(robots):
    driver = np.full((3, robots), -1)
    driver[:, -2:] = [[0, 1], [1, 2], [2, 2]]
    weights = networks(3)
    controllers = np.broadcast_to(AGGREGATION.controller, (3, robots, 4))
    result = tl.swarm.simulate(
        AGGREGATION,
        controllers,
        scattered(3, robots),
        control_steps=60,
        wheel_noise=0.0,
        drivers=Drivers(weights, HIDDEN, driver),
    )
    seen = 0
    for trial, robot in [(0, -2), (0, -1), (1, -2), (1, -1), (2, -2), (2, -1)]:
        sensors = result.sensors[trial, :, robot]
        expected = turn_rates(weights[driver[trial, robot]], sensors)
        np.testing.assert_allclose(result.speeds[trial, robot, :, 1], expected, atol=1e-9)
        seen += np.count_nonzero(np.diff(sensors))
    assert seen > 2  # readings have changed, so that memory and input have been at work


def test_agents_of_the_same_trial_stay_reactive():
    driver = np.full((2, 4), -1)
    driver[:, 3] = 0
    poses = scattered(2, 4)
    poses[:, :3, 2], poses[:, 3, :2] = (
        0.0,
        -9000.0,
    )  # nobody looks at the driven robot, which is far away
    controllers = np.broadcast_to(AGGREGATION.controller, (2, 4, 4))
    with_network = tl.swarm.simulate(
        AGGREGATION,
        controllers,
        poses,
        control_steps=20,
        drivers=Drivers(networks(1), HIDDEN, driver),
    )
    without = tl.swarm.simulate(AGGREGATION, controllers, poses, control_steps=20)
    np.testing.assert_array_equal(with_network.speeds[:, :3], without.speeds[:, :3])
    assert (with_network.speeds[:, 3] != without.speeds[:, 3]).any()


def test_drivers_of_no_robot_change_nothing():
    poses = tl.swarm.initial_poses(AGGREGATION, 3, np.random.default_rng(0), side_cm=60.0)
    controllers = np.broadcast_to(AGGREGATION.controller, (3, 11, 4))
    drivers = Drivers(networks(1), HIDDEN, np.full((3, 11), -1))
    given, none = (
        tl.swarm.simulate(AGGREGATION, controllers, poses, control_steps=50, drivers=one)
        for one in (drivers, None)
    )
    np.testing.assert_array_equal(given.poses, none.poses)


def test_a_network_that_says_the_same_as_a_controller_moves_alike_through_contacts_and_walls():
    scenario = replace(OBJECT_CLUSTERING, arena=Arena(120.0, 120.0))
    poses = tl.swarm.initial_poses(scenario, 4, np.random.default_rng(3))
    model = ElmanModel(states=3, hidden=1)
    weights = np.array([[0.0, 0.0, 0.0, 0.0, 0.0, 2 * np.arctanh(0.8), 2 * np.arctanh(0.3)]])
    controllers = np.broadcast_to([0.8, 0.3] * 3, (4, 5, 6))
    drivers = Drivers(weights, model.hidden, np.zeros((4, 5), int))
    driven = tl.swarm.simulate(scenario, controllers, poses, control_steps=40, drivers=drivers)
    reactive = tl.swarm.simulate(scenario, controllers, poses, control_steps=40)
    assert (
        np.abs(np.diff(reactive.poses[:, :, 5:, :2], axis=1)).max() > 0.1
    )  # objects have been pushed
    np.testing.assert_allclose(driven.poses[:, :15], reactive.poses[:, :15], atol=1e-6)


def test_inputs_are_not_written_over():
    controllers, weights = np.full((1, 2, 4), 0.5), networks(1)
    before = weights.copy()
    drivers = Drivers(weights, HIDDEN, np.zeros((1, 2), int))
    tl.swarm.simulate(AGGREGATION, controllers, scattered(1, 2), control_steps=3, drivers=drivers)
    assert (controllers == 0.5).all()
    np.testing.assert_array_equal(weights, before)


def test_the_memory_is_reset_before_every_trial():
    poses = np.repeat(scattered(1, 2), 70, axis=0)  # more than are advanced side by side
    drivers = Drivers(networks(1), HIDDEN, np.zeros((70, 2), int))
    result = tl.swarm.simulate(
        AGGREGATION,
        np.zeros((70, 2, 4)),
        poses,
        control_steps=5,
        wheel_noise=0.0,
        drivers=drivers,
        threads=1,
    )
    np.testing.assert_array_equal(
        result.speeds, np.broadcast_to(result.speeds[:1], result.speeds.shape)
    )


@pytest.mark.parametrize(
    ("weights", "driver", "message"),
    [
        (
            np.zeros((1, 7)),
            [[0]],
            r"`weights` must be of shape \(K, Q\) = \(any, 23\); got \(1, 7\)",
        ),
        (np.full((1, 23), np.nan), [[0]], "`weights` must be finite; got nan"),
        (np.zeros((2, 23)), [[0, 2]], r"`driver` must hold numbers of 2 networks .* got 0 to 2"),
        (np.zeros((2, 23)), [[-2, 0]], r"`driver` must hold .* or -1 for none; got -2 to 0"),
        (
            np.zeros((2, 23)),
            [[0.7, -1]],
            r"`driver` must be an array of integers; got an array of float64",
        ),
        (
            np.zeros((1, 23)) + 1j,
            [[0]],
            r"`weights` must be an array of numbers; got an array of complex128",
        ),
        (np.zeros((1, 23)).astype(str), [[0]], r"`weights` must be an array of numbers"),
        (np.ma.masked_equal(np.zeros((1, 23)), 0), [[0]], r"`weights` must have no masked values"),
        (np.zeros((2, 23)), [0, 1], r"`driver` must be of shape \(R, A\); got \(2,\)"),
    ],
)
def test_drivers_that_do_not_fit_are_refused(weights, driver, message):
    with pytest.raises(ValueError, match=message):
        Drivers(weights, HIDDEN, np.array(driver))


def test_drivers_do_not_change_with_the_callers_arrays():
    weights, driver = networks(2), np.zeros((1, 3), np.int64)
    drivers = Drivers(weights, HIDDEN, driver)
    driver[:], weights[:] = 10**9, np.nan
    assert not drivers.driver.any()
    assert np.isfinite(drivers.weights).all()
    with pytest.raises(ValueError, match="read-only"):
        drivers.driver[0, 0] = 10**9
    with pytest.raises(ValueError, match="`hidden` must be an integer"):
        Drivers(networks(1), 2.5, np.zeros((1, 3), int))


def test_drivers_of_other_robots_are_refused():
    drivers = Drivers(networks(1), HIDDEN, np.zeros((1, 3), int))
    with pytest.raises(
        ValueError, match=r"`drivers.driver` must be of shape \(R, A\) = \(1, 2\); got \(1, 3\)"
    ):
        tl.swarm.simulate(
            AGGREGATION, np.zeros((1, 2, 4)), scattered(1, 2), control_steps=1, drivers=drivers
        )
