"""Trials: who executes what, agents and replicas of models of every kind, from which poses, with which noise."""

from dataclasses import replace

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.models import Behavior, ElmanModel, MorphologyModel, ReactiveModel
from turing_learning.swarm import AGGREGATION, Sensor, Trials, alone, execution_of, mixed, observe

EXECUTED = np.array([[-1, 0, 1], [1, -1, -1]])
REPLICAS = ReactiveModel(2).behavior(np.random.default_rng(0).uniform(-1, 1, (3, 4)))
VIEW = 1.2
SCENARIO = replace(AGGREGATION, sensor=Sensor(field_of_view=VIEW))


def test_agents_execute_their_controller_and_replicas_their_model():
    models = np.array([[0.1, 0.2, 0.3, 0.4], [0.5, 0.6, 0.7, 0.8]])
    robots = execution_of(SCENARIO, ReactiveModel(2).behavior(models), EXECUTED)
    agent = AGGREGATION.controller
    np.testing.assert_array_equal(
        robots.controllers, [[agent, models[0], models[1]], [models[1], agent, agent]]
    )
    assert robots.fields_of_view is None
    assert robots.drivers is None


def test_agents_see_with_the_view_of_the_scenario_and_replicas_with_that_of_their_model():
    models = np.array([[0.1, 0.2, 0.3, 0.4, 0.0], [0.5, 0.6, 0.7, 0.8, 3.0]])
    robots = execution_of(SCENARIO, MorphologyModel(2).behavior(models), EXECUTED)
    np.testing.assert_array_equal(robots.fields_of_view, [[VIEW, 0.0, 3.0], [3.0, VIEW, VIEW]])
    np.testing.assert_array_equal(robots.controllers[1, 0], models[1, :4])


def test_behaviors_of_lists_and_series_are_those_of_arrays():
    speeds, views = [[0.1, 0.2, 0.3, 0.4], [0.5, 0.6, 0.7, 0.8]], [0.5, 3.0]
    pandas, labels = (
        pytest.importorskip("pandas"),
        [1, 0],
    )  # a series counts by its places, not by its labels
    framed = pandas.DataFrame(speeds, index=labels), pandas.Series(views, index=labels)
    expected = execution_of(SCENARIO, Behavior(np.array(speeds), np.array(views)), EXECUTED)
    for wheel_speeds, field_of_view in ((speeds, views), framed):
        robots = execution_of(SCENARIO, Behavior(wheel_speeds, field_of_view), EXECUTED)
        np.testing.assert_array_equal(robots.controllers, expected.controllers)
        np.testing.assert_array_equal(robots.fields_of_view, expected.fields_of_view)


def test_a_behavior_of_words_is_refused():
    with pytest.raises(
        ValueError, match="`wheel_speeds` must be an array of numbers; got an array of <U3"
    ):
        Behavior([["0.1", "0.2"]])


def test_replicas_are_driven_by_their_network_and_agents_by_none():
    networks = np.arange(14.0).reshape(2, 7)
    robots = execution_of(SCENARIO, ElmanModel(hidden=1).behavior(networks), EXECUTED)
    np.testing.assert_array_equal(robots.drivers.driver, EXECUTED)
    np.testing.assert_array_equal(robots.drivers.weights, networks)
    np.testing.assert_array_equal(
        robots.controllers[0], [AGGREGATION.controller, (1.0,) * 4, (1.0,) * 4]
    )


def test_a_network_may_be_fed_with_what_a_field_of_view_sees():
    model, side = ElmanModel(hidden=3), 60.0
    networks = np.random.default_rng(0).normal(0, 2, (2, 23))
    robots = execution_of(SCENARIO, model.behavior(networks), np.array([[-1, -1, 0, 1]]))
    poses = tl.swarm.initial_poses(SCENARIO, 1, np.random.default_rng(1), robots=4, side_cm=side)
    seen = tl.swarm.simulate(
        SCENARIO,
        robots.controllers,
        poses,
        control_steps=60,
        wheel_noise=0.0,
        drivers=robots.drivers,
    )
    for k, network in enumerate(networks):
        readings = seen.sensors[0, :-1, 2 + k]
        left, right = 12.8 * model.respond(network, readings).T
        np.testing.assert_allclose(seen.speeds[0, 2 + k, :, 1], (right - left) / 5.1, atol=1e-9)
    rays = tl.swarm.simulate(
        AGGREGATION,
        robots.controllers,
        poses,
        control_steps=60,
        wheel_noise=0.0,
        drivers=robots.drivers,
    )
    assert (seen.sensors != rays.sensors).any()


def test_replicas_come_after_the_agents_and_all_trials_of_a_model_in_a_row():
    executed = mixed(AGGREGATION, 3, trials=2)
    assert (executed[:, :10] == -1).all()
    assert executed[:, 10].tolist() == [0, 0, 1, 1, 2, 2]
    assert (alone(AGGREGATION, 4) == -1).all()


def test_what_is_observed_is_what_the_simulator_gives_for_the_same_poses_keys_and_controllers():
    trials = Trials.draw(AGGREGATION, mixed(AGGREGATION, 3), np.random.default_rng(1))
    controllers = np.tile(np.asarray(AGGREGATION.controller), (3, 11, 1))
    controllers[:, 10] = REPLICAS.wheel_speeds
    expected = observe(AGGREGATION, controllers, trials.poses, trials.keys, 1)
    np.testing.assert_array_equal(trials.observe(REPLICAS, 1), expected)


def test_without_models_all_are_agents():
    trials = Trials.draw(AGGREGATION, alone(AGGREGATION, 4), np.random.default_rng(1))
    speeds = trials.observe(threads=1)
    assert speeds.shape == (4, 11, 100, 2)
    assert np.median(speeds[..., 0]) == pytest.approx(-0.85 * 12.8, rel=0.01)
