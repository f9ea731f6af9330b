"""Trials: who executes what, from which poses, with which noise."""

import numpy as np
import pytest

from turing_learning.models import ReactiveModel
from turing_learning.swarm import AGGREGATION, Trials, alone, mixed, observe

MODELS = ReactiveModel(2).behavior(np.random.default_rng(0).uniform(-1, 1, (3, 4)))


def test_replicas_come_after_the_agents_and_all_trials_of_a_model_in_a_row():
    executed = mixed(AGGREGATION, 3, trials=2)
    assert (executed[:, :10] == -1).all()
    assert executed[:, 10].tolist() == [0, 0, 1, 1, 2, 2]
    assert (alone(AGGREGATION, 4) == -1).all()


def test_what_is_observed_is_what_the_simulator_gives_for_the_same_poses_keys_and_controllers():
    trials = Trials.draw(AGGREGATION, mixed(AGGREGATION, 3), np.random.default_rng(1))
    controllers = np.tile(np.asarray(AGGREGATION.controller), (3, 11, 1))
    controllers[:, 10] = MODELS.wheel_speeds
    expected = observe(AGGREGATION, controllers, trials.poses, trials.keys, 1)
    np.testing.assert_array_equal(trials.observe(MODELS, 1), expected)


def test_without_models_all_are_agents():
    trials = Trials.draw(AGGREGATION, alone(AGGREGATION, 4), np.random.default_rng(1))
    speeds = trials.observe(threads=1)
    assert speeds.shape == (4, 11, 100, 2)
    assert np.median(speeds[..., 0]) == pytest.approx(-0.85 * 12.8, rel=0.01)
