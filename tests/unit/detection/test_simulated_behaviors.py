from dataclasses import replace

import numpy as np
import pytest

from turing_learning.config import ConfigurationError
from turing_learning.detection import plant_abnormal, random_controllers, simulate_behaviors
from turing_learning.swarm import AGGREGATION, Robot

STILL = np.zeros((2, 4))


def rng():
    return np.random.default_rng(1)


def test_random_controllers_keep_away_from_that_of_the_agents():
    drawn = random_controllers(AGGREGATION, 500, rng(), near=0.4)
    assert drawn.shape == (500, 4)
    assert np.abs(drawn - AGGREGATION.controller).mean(axis=1).min() >= 0.4
    assert np.abs(drawn).max() <= 1


def test_agents_and_abnormal_individuals_come_apart(scenario):
    motion = simulate_behaviors(scenario, STILL, trials=3, rng=rng())
    assert motion.genuine.shape == (4, 3, 10, 2)
    assert motion.abnormal.shape == (2, 3, 10, 2)
    assert np.abs(motion.abnormal).max() == 0
    assert np.abs(motion.genuine).min() > 0


def test_individuals_of_a_swarm_are_beside_each_other(scenario):
    silent = replace(scenario, robot=Robot(wheel_noise=0.0))
    fast = np.array([[1.0, 1.0, 1.0, 1.0], [0.5, 0.5, 0.5, 0.5]])
    motion = simulate_behaviors(replace(silent, replicas=2), fast, trials=1, rng=rng())
    speeds = motion.abnormal[:, 0, 0, 0]
    np.testing.assert_allclose(speeds, [12.8, 12.8, 6.4, 6.4], rtol=1e-6)


def test_behaviors_do_not_depend_on_threads(scenario):
    one, two = (
        simulate_behaviors(scenario, STILL + 0.5, trials=3, rng=rng(), threads=n) for n in (1, 2)
    )
    np.testing.assert_array_equal(one.genuine, two.genuine)
    np.testing.assert_array_equal(one.abnormal, two.abnormal)


def test_planted_individuals_are_named_and_not_at_the_same_place(scenario):
    swarms = [plant_abnormal(scenario, 2, samples=4, seed=seed) for seed in range(6)]
    assert all(
        sorted(swarm.individuals) == ["agent 1", "planted 1", "planted 2"] for swarm in swarms
    )
    assert all(swarm.samples.shape == (3, 4, 10, 2) for swarm in swarms)
    assert len({swarm.individuals for swarm in swarms}) > 1


def test_planted_individuals_move_otherwise_than_agents():
    silent = replace(AGGREGATION, robot=Robot(wheel_noise=0.0))
    swarm = plant_abnormal(silent, 1, samples=3, seed=2)
    planted = swarm.individuals.index("planted 1")
    agent = AGGREGATION.controller
    of_agents = {round(12.8 * abs(agent[k] + agent[k + 1]) / 2, 2) for k in (0, 2)}
    first = np.abs(swarm.samples[:, :, 0, 0]).round(2)
    assert not set(first[planted]) & of_agents
    agents = np.delete(first, planted, axis=0)
    assert np.isin(agents, list(of_agents)).mean() > 0.9  # one that starts inside another is pushed


def test_the_same_seed_plants_the_same(scenario):
    first, second = (plant_abnormal(scenario, 1, samples=2, seed=5, threads=n) for n in (1, 2))
    assert first.individuals == second.individuals
    np.testing.assert_array_equal(first.samples, second.samples)


@pytest.mark.parametrize(
    ("count", "changes", "message"),
    [
        (0, {}, "^`simulate` must be an integer from 1 to 2; got 0"),
        (3, {}, "^`simulate` must be an integer from 1 to 2; got 3"),
        (1.5, {}, r"^`simulate` must be an integer from 1 to 2; got 1\.5"),
        (1, {"samples": 2.5}, r"^`samples` must be an integer from 1 to 1000000000000; got 2\.5"),
        (1, {"samples": 0}, "^`samples` must be an integer from 1 to .*; got 0"),
        (1, {"seed": -1}, "^`seed` must be an integer of at least 0; got -1"),
    ],
)
def test_what_cannot_be_planted_is_refused(count, changes, message, scenario):
    with pytest.raises(ConfigurationError, match=message):
        plant_abnormal(scenario, count, **changes)


@pytest.mark.parametrize(
    ("count", "near", "message"),
    [
        (0, 0.2, "^`count` must be an integer from 1 to .*; got 0"),
        (2.5, 0.2, r"from 1 to .*; got 2\.5"),
        (
            2**63,
            0.2,
            "^`count` must be an integer from 1 to 1000000000000; got 9223372036854775808",
        ),
        (1, 0.6, "^`near` must be .* at most 0.5; got 0.6"),
    ],
)
def test_controllers_that_cannot_be_drawn_are_refused(count, near, message):
    with pytest.raises(ConfigurationError, match=message):
        random_controllers(AGGREGATION, count, rng(), near=near)


@pytest.mark.parametrize(
    ("controllers", "trials", "message"),
    [
        (
            np.zeros((2, 3)),
            1,
            r"^`controllers` must be of shape \(M, P\) = \(any, 4\); got \(2, 3\)",
        ),
        (STILL, 0, "^`trials` must be an integer from 1 to .*; got 0"),
        (STILL, 2**63, "^`trials` must be an integer from 1 to .*; got 9223372036854775808"),
    ],
)
def test_behaviors_that_cannot_be_simulated_are_refused(controllers, trials, message, scenario):
    with pytest.raises(ConfigurationError, match=message):
        simulate_behaviors(scenario, controllers, trials=trials, rng=rng())
