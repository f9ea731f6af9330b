from dataclasses import replace

import numpy as np
import pytest

from turing_learning.models import ElmanModel
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, SeparatedSwarm


def collect(models, seed=0, scenario=AGGREGATION, threads=1, model=None):
    source = SeparatedSwarm(scenario, threads, model)
    return source.collect(np.asarray(models, dtype=float), np.random.default_rng(seed))


def test_groups_of_agents_and_of_replicas_have_the_same_size():
    samples = collect(np.zeros((7, 4)))
    assert samples.genuine.shape == (77, 100, 2)
    assert samples.counterfeit.shape == (7, 11, 100, 2)


def test_no_agent_ever_meets_a_replica():
    some, others = np.random.default_rng(1).uniform(-1, 1, (2, 7, 4))
    scenario = replace(AGGREGATION, trial=replace(AGGREGATION.trial, start_side_cm=60.0))  # everybody meets somebody
    first, second = collect(some, scenario=scenario), collect(others, scenario=scenario)
    np.testing.assert_array_equal(first.genuine, second.genuine)
    assert (first.counterfeit != second.counterfeit).any()


def test_all_replicas_of_a_trial_execute_the_same_model():
    samples = collect([[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
    np.testing.assert_array_equal(samples.counterfeit[0, :, :, 1], 0.0)
    assert np.median(samples.counterfeit[1, :, :, 0], axis=1) == pytest.approx(np.full(11, 12.8), rel=0.05)
    assert np.median(samples.genuine[..., 0]) == pytest.approx(-0.85 * 12.8, rel=0.01)


def test_agents_and_replicas_of_the_true_model_do_the_same_from_other_starts():
    samples = collect([AGGREGATION.controller] * 40)
    means = [np.abs(one).mean(axis=(0, 1)) for one in (samples.genuine, samples.counterfeit.reshape(-1, 100, 2))]
    # 440 samples each; the mean turn rate of a sample has a standard deviation of about 0.45 rad/s, so that of the difference
    # of the means is 0.03
    np.testing.assert_allclose(means[0], means[1], atol=0.15)
    assert (samples.genuine[0] != samples.counterfeit[0, 0]).any()


def test_objects_are_in_both_groups():
    samples = collect([OBJECT_CLUSTERING.controller] * 3, scenario=OBJECT_CLUSTERING)
    assert samples.genuine.shape == (15, 100, 2)
    assert samples.counterfeit.shape == (3, 5, 100, 2)


@pytest.mark.parametrize("model", [None, ElmanModel(hidden=1)])
def test_samples_depend_on_the_generator_alone_not_on_threads(model):
    models = np.random.default_rng(1).normal(size=(20, 4 if model is None else 7))
    first, second = (collect(models, 5, threads=threads, model=model) for threads in (1, 3))
    np.testing.assert_array_equal(first.genuine, second.genuine)
    np.testing.assert_array_equal(first.counterfeit, second.counterfeit)
    assert not np.array_equal(first.genuine, collect(models, 6, model=model).genuine)


def test_a_group_of_replicas_is_driven_by_one_network_each():
    samples = collect(np.zeros((2, 7)), model=ElmanModel(hidden=1))
    np.testing.assert_array_equal(samples.counterfeit[..., 1], 0.0)


def test_models_of_another_width_are_refused():
    with pytest.raises(ValueError, match=r"`models` must be of shape \(M, P\) = \(any, 4\); got \(2, 6\)"):
        collect(np.zeros((2, 6)))
