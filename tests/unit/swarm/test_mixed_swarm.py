from dataclasses import replace

import numpy as np
import pytest

from turing_learning.swarm import AGGREGATION, MixedSwarm


def collect(models, seed=0, scenario=AGGREGATION, threads=None):
    return MixedSwarm(scenario, threads).collect(np.asarray(models, dtype=float), np.random.default_rng(seed))


def test_one_trial_per_model_gives_samples_of_every_individual():
    samples = collect(np.zeros((7, 4)))
    assert samples.genuine.shape == (70, 100, 2)
    assert samples.counterfeit.shape == (7, 1, 100, 2)


def test_agents_execute_the_true_controller_and_replicas_the_model():
    samples = collect([[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
    np.testing.assert_array_equal(samples.counterfeit[0, 0, :, 1], 0.0)
    assert np.median(samples.counterfeit[1, 0, :, 0]) == pytest.approx(12.8, rel=0.05)
    assert np.median(samples.genuine[..., 0]) == pytest.approx(-0.85 * 12.8, rel=0.01)


def test_several_replicas_execute_the_same_model():
    samples = collect(np.ones((2, 4)), scenario=replace(AGGREGATION, replicas=3, agents=8))
    assert samples.genuine.shape == (16, 100, 2)
    assert samples.counterfeit.shape == (2, 3, 100, 2)


def test_samples_depend_on_the_generator_alone_not_on_threads():
    models = np.random.default_rng(1).normal(size=(20, 4))
    np.testing.assert_array_equal(collect(models, 5, threads=1).genuine, collect(models, 5, threads=3).genuine)
    assert not np.array_equal(collect(models, 5).genuine, collect(models, 6).genuine)


def test_models_of_another_width_are_refused():
    with pytest.raises(ValueError, match=r"`models` must be of shape \(M, P\) = \(any, 4\); got \(2, 6\)"):
        collect(np.zeros((2, 6)))
