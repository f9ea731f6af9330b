"""What likelihood-free methods are given."""

from dataclasses import replace

import numpy as np
import pytest

from turing_learning.reproduction._methods import (
    Groups,
    Inferred,
    baseline,
    summaries,
    wheel_speeds,
)
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, initial_poses, simulate

ALONE = replace(AGGREGATION, robot=replace(AGGREGATION.robot, wheel_noise=0.0))


def motion_of(controller, noise=0.0):
    """Motion (1, 100, 2) of a robot that sees nobody."""
    start = initial_poses(ALONE, 1, np.random.default_rng(1), robots=1)
    return simulate(
        ALONE, np.array(controller)[None, None], start, control_steps=100, wheel_noise=noise
    ).speeds[0]


@pytest.mark.parametrize("wheels", [(0.5, 1.0), (-0.7, -1.0), (1.0, -1.0), (0.3, 0.3), (1.4, -0.2)])
def test_wheel_speeds_are_those_of_a_robot_that_nothing_pushes(wheels):
    found = wheel_speeds(motion_of((*wheels, 0.0, 0.0)), ALONE)
    # the tenth of a cycle that the robot needs to get into motion is in the first one
    np.testing.assert_allclose(found[0, 1:], np.broadcast_to(wheels, (99, 2)), atol=2e-3)


def naive(motion):
    wheels = wheel_speeds(motion, ALONE)
    individuals, steps, _ = wheels.shape
    cycles = [wheels[c, t] for c in range(individuals) for t in range(steps)]
    mean = sum(cycles) / len(cycles)
    variance = sum((cycle - mean) ** 2 for cycle in cycles) / len(cycles) + 1e-9
    parts = [mean, variance**0.5]
    for lag in (1, 10):
        products = [
            (wheels[c, t] - mean) * (wheels[c, t + lag] - mean)
            for c in range(individuals)
            for t in range(steps - lag)
        ]
        parts.append(sum(products) / len(products) / variance)
    parts.append([sum(np.prod(cycle - mean) for cycle in cycles) / len(cycles)])
    cycles.sort(key=lambda cycle: cycle[1] - cycle[0])
    length = len(cycles) // 20
    parts += [sum(cycles[k * length : (k + 1) * length]) / length for k in range(20)]
    return np.concatenate(parts)


def test_summaries_are_what_a_plain_computation_gives():
    motion = np.random.default_rng(2).normal(size=(2, 40, 2))
    np.testing.assert_allclose(summaries(motion, ALONE), naive(motion), rtol=1e-9, atol=1e-12)


def test_groups_are_summarized_one_by_one_whatever_the_order_of_their_individuals():
    motion = np.random.default_rng(3).normal(size=(4, 3, 20, 2))
    both = summaries(motion, ALONE)
    np.testing.assert_allclose(both[1], summaries(motion[1], ALONE))
    np.testing.assert_allclose(summaries(motion[:, ::-1], ALONE), both)


def test_a_group_has_one_model_and_models_differ():
    groups = Groups(AGGREGATION, size=4)
    found = groups.simulate(
        np.array([[0.2, 0.2, 0.2, 0.2], [0.8, 0.8, 0.8, 0.8]]), np.random.default_rng(1)
    )
    np.testing.assert_allclose(found[:, :2], [[0.2, 0.2], [0.8, 0.8]], atol=0.05)


def test_agents_are_observed_and_not_the_models_beside_them():
    genuine = Groups(OBJECT_CLUSTERING).observe(30, np.random.default_rng(1))
    assert genuine.shape == (120, 100, 2)
    # half of the agents' cycles are at the level of I = 0, of models from the prior one in a thousand
    at_level = (
        np.abs(wheel_speeds(genuine, OBJECT_CLUSTERING).reshape(-1, 2) - [0.5, 1.0]).max(axis=1)
        < 0.06
    )
    assert at_level.mean() > 0.3


def test_models_of_the_prior_lie_around_the_truth_on_both_sides():
    models = Groups(AGGREGATION).draw(2000, np.random.default_rng(1))
    assert models.shape == (2000, 4)
    assert (models.min(axis=0) < -1.45).all()
    assert (models.max(axis=0) > 1.45).all()


def test_groups_of_nothing_are_refused():
    with pytest.raises(ValueError, match="`size` must be an integer of at least 1; got 0"):
        Groups(AGGREGATION, 0)


def test_a_posterior_gives_median_and_central_nine_tenths():
    draws = np.linspace(0, 1, 1001)[:, None]
    found = Inferred.of_posterior(draws)
    np.testing.assert_allclose(
        [found.low[0], found.estimate[0], found.high[0]], [0.05, 0.5, 0.95], atol=0.002
    )


def test_weights_of_draws_count():
    found = Inferred.of_posterior(np.array([[0.0], [1.0]]), np.array([0.01, 0.99]))
    assert (found.low[0], found.estimate[0]) == (1.0, 1.0)


def test_a_package_that_is_not_there_is_asked_for():
    with pytest.raises(
        ImportError, match=r"no_such_package must be .* pip install 'turing-learning\[baselines\]'"
    ):
        baseline("no_such_package.part")
