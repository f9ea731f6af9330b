"""The simulator against motion recorded from Enki, and against its own slow twin."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from naive_swarm import NaiveSwarm

import turing_learning as tl

DATA = Path(__file__).parent / "data"
RECORDINGS = {
    "aggregation_sparse": (tl.swarm.AGGREGATION, 11),
    "aggregation_dense": (tl.swarm.AGGREGATION, 11),
    "clustering": (tl.swarm.OBJECT_CLUSTERING, 5),
}


def difference(poses, reference):
    error = poses - reference
    error[..., 2] = (error[..., 2] + np.pi) % (2 * np.pi) - np.pi
    return np.abs(error)


@pytest.mark.parametrize("name", RECORDINGS)
def test_motion_agrees_with_every_recorded_trial(name):
    scenario, robots = RECORDINGS[name]
    scenario = scenario.in_world("enki")
    with np.load(DATA / f"{name}.npz") as file:
        reference, sensors = file["pose"], file["sensor"]
    controllers = np.broadcast_to(
        scenario.controller, (len(reference), robots, len(scenario.controller))
    )
    result = tl.swarm.simulate(
        scenario, controllers, reference[:, 0], control_steps=100, wheel_noise=0.0
    )
    error = difference(result.poses, reference)
    assert error[:, :21].max() < 1e-8
    assert error.max() < 1e-6
    np.testing.assert_array_equal(result.sensors, sensors[:, :, :robots])


WORLDS = {
    "sparse": (tl.swarm.AGGREGATION, 11, 331.66),
    "crowded": (tl.swarm.AGGREGATION, 11, 40.0),
    "objects": (tl.swarm.OBJECT_CLUSTERING, 5, 70.0),
    "clamped": (
        replace(tl.swarm.AGGREGATION, robot=tl.swarm.Robot(clamp_wheel_speeds=True)),
        6,
        50.0,
    ),
    "walled": (replace(tl.swarm.OBJECT_CLUSTERING, arena=tl.swarm.Arena(90.0, 110.0)), 5, None),
    "two physics steps": (
        replace(tl.swarm.AGGREGATION, trial=tl.swarm.Trial(physics_steps=2)),
        6,
        60.0,
    ),
    "one physics step": (
        replace(tl.swarm.AGGREGATION, trial=tl.swarm.Trial(physics_steps=1)),
        6,
        60.0,
    ),
    "gravity of the earth": (
        replace(tl.swarm.OBJECT_CLUSTERING, objects=tl.swarm.Objects(gravity_cm_s2=981)),
        5,
        50.0,
    ),
    "a lag": (
        replace(tl.swarm.AGGREGATION, robot=tl.swarm.Robot(actuation_lag_cycles=1)),
        11,
        60.0,
    ),
    "a long lag": (
        replace(tl.swarm.OBJECT_CLUSTERING, robot=tl.swarm.Robot(actuation_lag_cycles=3)),
        5,
        50.0,
    ),
    "wheels of many scales": (
        replace(tl.swarm.AGGREGATION, robot=tl.swarm.Robot(wheel_scale_spread=0.3)),
        11,
        60.0,
    ),
    "slip": (replace(tl.swarm.AGGREGATION, robot=tl.swarm.Robot(slip=0.4)), 11, 60.0),
    "scales and slip of clamped wheels": (
        replace(
            tl.swarm.AGGREGATION,
            robot=tl.swarm.Robot(clamp_wheel_speeds=True, wheel_scale_spread=0.2, slip=0.2),
        ),
        6,
        50.0,
    ),
    "mistaken sensors": (
        replace(
            tl.swarm.OBJECT_CLUSTERING,
            sensor=replace(tl.swarm.OBJECT_CLUSTERING.sensor, mistakes=0.3),
        ),
        5,
        50.0,
    ),
    "the paper's world": (tl.swarm.OBJECT_CLUSTERING.in_world("paper"), 5, 50.0),
    "many bodies in the paper's world": (tl.swarm.AGGREGATION.in_world("paper"), 45, 300.0),
}


@pytest.mark.parametrize("name", WORLDS)
def test_simulator_equals_its_slow_twin_with_noise_and_fast_replicas(name):
    # Rounding differs (closed form against ten steps) and contacts amplify it: 1e-9 after 30 cycles leaves a factor of 1000.
    scenario, robots, side = WORLDS[name]
    rng = np.random.default_rng(5)
    poses = tl.swarm.initial_poses(scenario, 3, rng, robots=robots, side_cm=side)
    controllers = rng.uniform(-1, 1, (3, robots, len(scenario.controller)))
    controllers[:, -1] *= 5
    result = tl.swarm.simulate(
        scenario, controllers, poses, control_steps=30, seed=9, wheel_noise=0.05
    )
    keys = np.random.SeedSequence(9).generate_state(3, np.uint64)
    for trial in range(3):
        twin = NaiveSwarm(scenario, controllers[trial], poses[trial], keys[trial], 0.05)
        twin_poses, twin_sensors, twin_speeds = twin.run(30)
        assert difference(result.poses[trial], twin_poses).max() < 1e-9
        np.testing.assert_array_equal(result.sensors[trial], twin_sensors)
        np.testing.assert_allclose(result.speeds[trial], twin_speeds, atol=1e-8)


@pytest.mark.parametrize("threads", [2, 5])
def test_the_number_of_threads_does_not_change_a_bit(threads):
    scenario = tl.swarm.OBJECT_CLUSTERING
    rng = np.random.default_rng(1)
    poses = tl.swarm.initial_poses(scenario, 70, rng)
    controllers = rng.uniform(-1, 1, (70, 5, 6))
    alone = tl.swarm.simulate(scenario, controllers, poses, control_steps=20, threads=1)
    together = tl.swarm.simulate(scenario, controllers, poses, control_steps=20, threads=threads)
    np.testing.assert_array_equal(together.poses, alone.poses)
    np.testing.assert_array_equal(together.speeds, alone.speeds)


def test_a_trial_does_not_depend_on_the_trials_beside_it():
    scenario = tl.swarm.AGGREGATION
    rng = np.random.default_rng(2)
    poses = tl.swarm.initial_poses(scenario, 9, rng, side_cm=60)
    controllers = np.broadcast_to(scenario.controller, (9, 11, 4))
    many = tl.swarm.simulate(scenario, controllers, poses, control_steps=50, wheel_noise=0)
    one = tl.swarm.simulate(scenario, controllers[4:5], poses[4:5], control_steps=50, wheel_noise=0)
    np.testing.assert_allclose(one.poses[0], many.poses[4], atol=1e-9)
