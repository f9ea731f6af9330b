"""The laboratory's trials in plain simulation, and robots that no PC leads."""

from dataclasses import replace

import numpy as np
import pytest

from turing_learning.robots import LABORATORY
from turing_learning.robots.emulation import SimulatedLaboratory, move_alone

TRUTH = np.array(LABORATORY.controller)
SHORT = replace(LABORATORY, trial=replace(LABORATORY.trial, duration_s=1.0))


def test_each_model_has_one_sample_and_every_trial_eight_agents():
    samples = SimulatedLaboratory(SHORT).collect(np.zeros((6, 4)), np.random.default_rng(1))
    assert samples.counterfeit.shape == (6, 1, 10, 2)
    assert samples.genuine.shape == (3 * 8, 10, 2)


def test_each_replica_executes_its_own_model():
    speeds = np.array([[1.0, 1.0, 1.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    samples = SimulatedLaboratory(SHORT).observe(speeds, "stage")
    assert samples.counterfeit[0, 0, :, 0].mean() == pytest.approx(12.8, rel=0.05)
    assert np.abs(samples.counterfeit[1, 0]).max() < 1.0  # pushed at most


def test_models_are_bounded_by_the_hyperbolic_tangent():
    laboratory = SimulatedLaboratory(SHORT)
    np.testing.assert_allclose(laboratory.to_units(np.array([[0.0, 100.0]])), [[0.0, 1.0]])
    large = laboratory.collect(np.full((2, 4), 100.0), np.random.default_rng(1))
    assert np.median(large.counterfeit[:, 0, :, 0]) == pytest.approx(12.8, rel=0.05)


def test_stages_have_other_noise_and_the_same_stage_the_same():
    one, same, other = (
        SimulatedLaboratory(SHORT, seed=3).observe(np.tile(TRUTH, (2, 1)), stage).genuine
        for stage in ("a", "a", "b")
    )
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)


def test_models_that_leave_a_replica_without_one_are_refused():
    with pytest.raises(
        ValueError, match=r"`models` must be a multiple of 2 replicas, not 0; got 3\."
    ):
        SimulatedLaboratory(SHORT).observe(np.zeros((3, 4)), "stage")


def test_robots_without_a_pc_gather():
    rng = np.random.default_rng(5)
    start = np.column_stack([rng.uniform(60, 140, (6, 2)), rng.uniform(-3, 3, 6)])
    poses = np.array(list(move_alone(LABORATORY, TRUTH, start, cycles=300, seed=1)))
    assert poses.shape == (301, 6, 3)
    np.testing.assert_array_equal(poses[0], start)

    def spread(places):
        return np.square(places[:, :2] - places[:, :2].mean(axis=0)).sum()

    assert spread(poses[-1]) < 0.5 * spread(start)


def test_a_robot_without_a_pc_comes_away_from_a_wall():
    start = np.array([[100.0, 5.0, -np.pi / 2]])
    straight = np.full(4, 0.9)  # its wheels would press it against the wall for ever
    poses = np.array(list(move_alone(LABORATORY, straight, start, cycles=50, seed=1)))
    assert poses[-1, 0, 1] > 15.0
