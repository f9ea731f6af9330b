"""Rays and near pairs through tiles against the plain loops over all bodies: the same to the last bit."""

import numpy as np
import pytest
from naive_swarm import NaiveSwarm
from standalone import standalone

import turing_learning as tl
from turing_learning.kernels import trials
from turing_learning.kernels.sensing import sense
from turing_learning.kernels.stepping import find_near_pairs
from turing_learning.kernels.tiles import (
    find_pairs_in_tiles,
    new_tiles,
    read_sensors,
    renew_boxes,
    renew_order,
)
from turing_learning.kernels.world import new_state
from turing_learning.swarm._trials import build_world

find_near_pairs = standalone(find_near_pairs)
find_pairs_in_tiles = standalone(find_pairs_in_tiles)
read_sensors = standalone(read_sensors)
sense = standalone(sense)
renew_boxes = standalone(renew_boxes)
renew_order = standalone(renew_order)


def uniform(side):
    return lambda rng, bodies: rng.uniform(0, side, (bodies, 2))


def lattice(rng, bodies):
    """Place bodies at the points of a grid, some twice: many entry distances and many distances are equal."""
    return rng.integers(0, 12, (bodies, 2)) * 7.0


def far_flung(rng, bodies):
    """Place clusters up to 1e12 cm apart."""
    return rng.uniform(-1e12, 1e12, (10, 2))[rng.integers(0, 10, bodies)] + rng.uniform(
        0, 50, (bodies, 2)
    )


def every_magnitude(rng, bodies):
    return rng.normal(size=(bodies, 2)) * 10.0 ** rng.uniform(-3, 150, (bodies, 1))


WORLDS = {
    "sparse": (300, 100, uniform(2000.0)),
    "dense": (300, 100, uniform(150.0)),
    "overlapping": (200, 0, uniform(20.0)),
    "in one point": (70, 30, uniform(0.0)),
    "lattice": (150, 50, lattice),
    "far-flung": (300, 100, far_flung),
    "every magnitude": (100, 37, every_magnitude),
    "more objects than robots": (3, 200, uniform(300.0)),
    "a tile exactly": (8, 0, uniform(60.0)),
    "a block and one": (65, 0, uniform(90.0)),
}


def make(name, seed):
    """Return a world in which each body gives a reading of its own, its state with random headings, and its tiles."""
    robots, objects, place = WORLDS[name]
    rng = np.random.default_rng(seed)
    bodies = robots + objects
    world = build_world(tl.swarm.OBJECT_CLUSTERING, robots, objects, 0.0)._replace(
        reading=1 + np.arange(bodies)
    )
    state, tiles = new_state(1, bodies), new_tiles(bodies, bodies**2)
    state.x[:, 0], state.y[:, 0] = place(rng, bodies).T
    headings = rng.uniform(-np.pi, np.pi, bodies)
    along = rng.random(bodies) < 0.3
    headings[along] = rng.choice([0.0, np.pi / 2, np.pi, -np.pi / 2], along.sum())
    state.cosine[:, 0], state.sine[:, 0] = (
        np.round(np.cos(headings), 15),
        np.round(np.sin(headings), 15),
    )
    state.reach[:, 0] = world.radius + rng.choice([0.5, 1.8, 10.0], bodies)
    state.reach[rng.integers(bodies), 0] = 1e3
    return world, state, tiles


def renew(world, state, tiles):
    renew_boxes(state.x[:, 0], state.y[:, 0], world.sight_radius, state.reach[:, 0], tiles)


def assert_equal_to_the_plain_loops(world, state, tiles):
    sense(world.sectors, world, state)
    expected = state.reading[:, 0].copy()
    state.reading[:] = 0
    read_sensors(state.cosine[:, 0], state.sine[:, 0], state.reading[:, 0], world, tiles)
    np.testing.assert_array_equal(state.reading[:, 0], expected)
    for margin in (0.0, 8.0):
        plain, fast = (np.zeros((world.bodies**2, 2), np.int64) for _ in range(2))
        count = find_near_pairs(0, margin, world, state, plain)
        assert find_pairs_in_tiles(world.bodies, margin, fast, tiles) == count
        np.testing.assert_array_equal(fast[:count], plain[:count])


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("name", WORLDS)
def test_readings_and_near_pairs_are_those_of_the_plain_loops(name, seed):
    world, state, tiles = make(name, seed)
    renew_order(state.x[:, 0], state.y[:, 0], tiles)
    renew(world, state, tiles)
    assert_equal_to_the_plain_loops(world, state, tiles)


@pytest.mark.parametrize("name", WORLDS)
def test_they_are_whatever_bodies_share_a_tile(name):
    world, state, tiles = make(name, 0)
    tiles.order[: world.bodies] = np.random.default_rng(1).permutation(world.bodies)
    tiles.home[tiles.order[: world.bodies]] = np.arange(world.bodies)
    renew(world, state, tiles)
    assert_equal_to_the_plain_loops(world, state, tiles)


def test_items_that_a_sensor_passes_through_are_not_seen_in_tiles_either():
    world, state, tiles = make("dense", 3)
    world = world._replace(sight_radius=np.where(np.arange(world.bodies) < world.robots, 3.5, -1.0))
    renew_order(state.x[:, 0], state.y[:, 0], tiles)
    renew(world, state, tiles)
    assert_equal_to_the_plain_loops(world, state, tiles)
    assert 0 < state.reading.max() <= world.robots


DRIVEN = 1.28 * 1.05
"""The farthest that a robot drives in a cycle (cm); 0.5 is the skin, 4 the half of the margin of the second attempt."""

TRIALS = {
    "aggregation": (tl.swarm.AGGREGATION, 100, None, 1.0),
    "a crowd": (tl.swarm.AGGREGATION, 100, 90.0, 1.0),
    "a compressed crowd": (tl.swarm.AGGREGATION, 80, 25.0, 1.0),
    "objects": (tl.swarm.OBJECT_CLUSTERING, 30, 200.0, 1.0),
    "fast replicas": (tl.swarm.AGGREGATION, 60, 200.0, 100.0),
}


@pytest.mark.parametrize("name", TRIALS)
def test_a_trial_in_tiles_is_the_plain_trial_to_the_last_bit(name, monkeypatch):
    scenario, robots, side, fastest = TRIALS[name]
    rng = np.random.default_rng(7)
    poses = tl.swarm.initial_poses(scenario, 1, rng, robots=robots, side_cm=side)
    controllers = np.repeat(np.array(scenario.controller)[None, None], robots, axis=1)
    controllers[:, :5] *= fastest
    in_tiles = tl.swarm.simulate(scenario, controllers, poses, control_steps=60, seed=3)
    monkeypatch.setattr(trials, "MANY_BODIES", 10**9)
    plain = tl.swarm.simulate(scenario, controllers, poses, control_steps=60, seed=3)
    np.testing.assert_array_equal(in_tiles.sensors, plain.sensors)
    np.testing.assert_array_equal(in_tiles.poses, plain.poses)
    np.testing.assert_array_equal(in_tiles.speeds, plain.speeds)


@pytest.mark.parametrize(("side", "farthest"), [(20.0, DRIVEN + 4.5), (90.0, DRIVEN + 0.5)])
def test_a_crowd_that_pushes_bodies_beyond_their_reach_equals_the_slow_twin(side, farthest):
    scenario, robots, cycles = tl.swarm.AGGREGATION, 60, 4
    rng = np.random.default_rng(4)
    poses = tl.swarm.initial_poses(scenario, 1, rng, robots=robots, side_cm=side)
    controllers = rng.uniform(-1, 1, (1, robots, 4))
    result = tl.swarm.simulate(scenario, controllers, poses, control_steps=cycles, seed=9)
    key = np.random.SeedSequence(9).generate_state(1, np.uint64)[0]
    twin_poses, twin_sensors, _ = NaiveSwarm(scenario, controllers[0], poses[0], key, 0.05).run(
        cycles
    )
    moved = np.hypot(*(twin_poses[1, :, :2] - twin_poses[0, :, :2]).T).max()
    assert moved > farthest
    # Contacts amplify rounding: a factor of 1000 over what the sums of 40 steps leave.
    np.testing.assert_allclose(result.poses[0, ..., :2], twin_poses[..., :2], atol=1e-9)
    np.testing.assert_array_equal(result.sensors[0], twin_sensors)


def test_many_trials_of_many_bodies_do_not_depend_on_threads_or_on_each_other():
    scenario = tl.swarm.OBJECT_CLUSTERING
    poses = tl.swarm.initial_poses(scenario, 7, np.random.default_rng(1), robots=20, side_cm=150)
    controllers = np.broadcast_to(scenario.controller, (7, 20, 6))
    many = tl.swarm.simulate(
        scenario, controllers, poses, control_steps=30, wheel_noise=0, threads=3
    )
    for k in range(7):
        one = tl.swarm.simulate(
            scenario,
            controllers[k : k + 1],
            poses[k : k + 1],
            control_steps=30,
            wheel_noise=0,
            threads=1,
        )
        np.testing.assert_array_equal(many.poses[k], one.poses[0])
