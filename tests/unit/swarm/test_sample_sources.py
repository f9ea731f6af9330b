"""Swarms as sources of samples: replicas among agents, and apart from them."""

from dataclasses import replace

import numpy as np
import pytest

from turing_learning.models import ElmanModel
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, MixedSwarm, SeparatedSwarm

BOTH = pytest.mark.parametrize("kind", [MixedSwarm, SeparatedSwarm])
NETWORK = ElmanModel(hidden=3)


def collect(kind, models, seed=0, scenario=AGGREGATION, threads=1, model=None):
    return kind(scenario, threads, model).collect(
        np.asarray(models, dtype=float), np.random.default_rng(seed)
    )


def networks(count):
    return np.random.default_rng(0).normal(0, 2, (count, len(NETWORK.parameter_names)))


@pytest.mark.parametrize(
    ("kind", "changes", "genuine", "counterfeit"),
    [
        (MixedSwarm, {}, 70, (7, 1)),
        (MixedSwarm, {"replicas": 3, "agents": 8}, 56, (7, 3)),
        (SeparatedSwarm, {}, 77, (7, 11)),
    ],
)
def test_samples_are_of_every_individual_in_a_trial_per_model_and_group(
    kind, changes, genuine, counterfeit
):
    samples = collect(kind, np.zeros((7, 4)), scenario=replace(AGGREGATION, **changes))
    assert samples.genuine.shape == (genuine, 100, 2)
    assert samples.counterfeit.shape == (*counterfeit, 100, 2)


def test_objects_are_in_both_groups():
    samples = collect(
        SeparatedSwarm, [OBJECT_CLUSTERING.controller] * 3, scenario=OBJECT_CLUSTERING
    )
    assert samples.genuine.shape == (15, 100, 2)
    assert samples.counterfeit.shape == (3, 5, 100, 2)


@BOTH
def test_agents_execute_the_true_controller_and_all_replicas_of_a_trial_its_model(kind):
    samples = collect(kind, [[0.0, 0.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]])
    np.testing.assert_array_equal(samples.counterfeit[0, :, :, 1], 0.0)
    medians = np.median(samples.counterfeit[1, :, :, 0], axis=1)
    assert medians == pytest.approx(np.full(len(medians), 12.8), rel=0.05)
    assert np.median(samples.genuine[..., 0]) == pytest.approx(-0.85 * 12.8, rel=0.01)


@BOTH
def test_replicas_of_networks_are_driven_by_them_and_agents_are_not(kind):
    samples = collect(kind, np.zeros((2, len(NETWORK.parameter_names))), model=NETWORK)
    np.testing.assert_array_equal(samples.counterfeit[..., 1], 0.0)
    assert np.median(samples.genuine[..., 0]) == pytest.approx(-0.85 * 12.8, rel=0.01)


def test_no_agent_ever_meets_a_replica_of_a_separated_swarm():
    some, others = np.random.default_rng(1).uniform(-1, 1, (2, 7, 4))
    scenario = replace(
        AGGREGATION, trial=replace(AGGREGATION.trial, start_side_cm=60.0)
    )  # everybody meets somebody
    first, second = (
        collect(SeparatedSwarm, models, scenario=scenario) for models in (some, others)
    )
    np.testing.assert_array_equal(first.genuine, second.genuine)
    assert (first.counterfeit != second.counterfeit).any()


def test_agents_and_replicas_of_the_true_model_do_the_same_from_other_starts():
    samples = collect(SeparatedSwarm, [AGGREGATION.controller] * 40)
    means = [
        np.abs(one).mean(axis=(0, 1))
        for one in (samples.genuine, samples.counterfeit.reshape(-1, 100, 2))
    ]
    # 440 samples each; the mean turn rate of a sample has a standard deviation of about 0.45 rad/s, so that of the difference
    # of the means is 0.03
    np.testing.assert_allclose(means[0], means[1], atol=0.15)
    assert (samples.genuine[0] != samples.counterfeit[0, 0]).any()


@BOTH
@pytest.mark.parametrize(
    "models", [np.random.default_rng(1).normal(size=(20, 4)), networks(70)], ids=["gray", "black"]
)
def test_samples_depend_on_the_generator_alone_not_on_threads(kind, models):
    model = None if models.shape[1] == 4 else NETWORK
    first, second = (collect(kind, models, 5, threads=threads, model=model) for threads in (1, 3))
    np.testing.assert_array_equal(first.genuine, second.genuine)
    np.testing.assert_array_equal(first.counterfeit, second.counterfeit)
    assert not np.array_equal(first.genuine, collect(kind, models, 6, model=model).genuine)


@BOTH
@pytest.mark.parametrize(("model", "count"), [(None, 4), (NETWORK, 23)])
def test_models_of_another_width_are_refused(kind, model, count):
    with pytest.raises(
        ValueError, match=rf"`models` must be of shape \(M, P\) = \(any, {count}\); got \(2, 6\)"
    ):
        collect(kind, np.zeros((2, 6)), model=model)
