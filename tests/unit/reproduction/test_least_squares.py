from dataclasses import replace

import numpy as np
import pytest

from turing_learning.coevolution import Samples
from turing_learning.reproduction._methods import least_squares, squared_errors
from turing_learning.swarm import AGGREGATION

BLIND = replace(
    AGGREGATION,
    agents=3,
    controller=(0.5, 0.8, 0.5, 0.8),
    robot=replace(AGGREGATION.robot, wheel_noise=0.0),
    trial=replace(AGGREGATION.trial, duration_s=2.0),
)
"""Agents without noise that do the same whatever they see."""


def naive(genuine, counterfeit):
    """Sum the squares one by one; genuine (A, M, T, D), counterfeit (M, T, D)."""
    agents, models, steps, signals = genuine.shape
    errors = np.zeros(models)
    for m in range(models):
        for i in range(agents):
            for t in range(steps):
                for d in range(signals):
                    errors[m] += (counterfeit[m, t, d] - genuine[i, m, t, d]) ** 2
    return errors


def test_each_model_is_compared_with_the_agents_of_its_own_trial():
    rng = np.random.default_rng(0)
    genuine, counterfeit = rng.normal(size=(3, 5, 4, 2)), rng.normal(size=(5, 4, 2))
    samples = Samples(genuine.reshape(-1, 4, 2), counterfeit[:, None])
    np.testing.assert_allclose(squared_errors(samples), naive(genuine, counterfeit), rtol=1e-12)


def test_several_samples_of_a_model_are_averaged():
    genuine, counterfeit = np.zeros((1, 1, 2)), np.array([[[[1.0, 0.0]], [[0.0, 3.0]]]])
    assert squared_errors(Samples(genuine, counterfeit)).tolist() == [(1 + 9) / 2]


def test_signals_are_divided_by_their_scale():
    genuine, counterfeit = np.zeros((1, 1, 2)), np.array([[[[4.0, 6.0]]]])
    assert squared_errors(Samples(genuine, counterfeit), (2.0, 3.0)).tolist() == [2**2 + 2**2]


def test_samples_that_do_not_belong_to_the_models_are_refused():
    samples = Samples(np.zeros((5, 3, 2)), np.zeros((2, 1, 3, 2)))
    with pytest.raises(
        ValueError, match="as many genuine samples for each of the 2 models; got 5 in all"
    ):
        squared_errors(samples)


@pytest.mark.parametrize("scale", [(1.0, 0.0), (1.0, 2.0, 3.0)])
def test_a_scale_that_does_not_fit_is_refused(scale):
    samples = Samples(np.zeros((2, 3, 2)), np.zeros((2, 1, 3, 2)))
    with pytest.raises(
        ValueError, match=r"`scale` must be 2 finite numbers above 0, or one; got \[1\.0, "
    ):
        squared_errors(samples, scale)


def test_no_generations_are_refused():
    with pytest.raises(ValueError, match="`generations` must be an integer of at least 1; got 0"):
        least_squares(AGGREGATION, generations=0)


def test_agents_that_do_not_react_are_inferred():
    # step sizes do not fall below 0.01, so that the best of 50 models is off by a few hundredths
    found = least_squares(BLIND, seed=1, generations=120, parents=25, offspring=25)
    np.testing.assert_allclose(found["best"][:2], BLIND.controller[:2], atol=0.05)
    np.testing.assert_allclose(found["typical"][:2], BLIND.controller[:2], atol=0.02)


def test_the_result_depends_on_the_seed_and_not_on_the_threads():
    results = [
        least_squares(BLIND, seed, generations=3, parents=4, offspring=4, threads=threads)["best"]
        for threads, seed in ((1, 5), (2, 5), (1, 6))
    ]
    np.testing.assert_array_equal(results[0], results[1])
    assert (results[0] != results[2]).any()


def test_a_stop_leaves_no_model():
    assert least_squares(BLIND, generations=3, should_stop=lambda: True) is None
