"""Items of one's own against the slow twin: what is seen, what stays, what is pushed, in few bodies and in tiles."""

from dataclasses import replace

import numpy as np
import pytest
from naive_swarm import NaiveSwarm
from naive_view import read

import turing_learning as tl
from turing_learning.kernels import trials
from turing_learning.swarm import Arena, Item, Sensor

ITEMS = {
    "light": Item(count=2, radius_cm=6.0, mobility="seen"),
    "post": Item(radius_cm=4.0, centers_cm=((40.0, 40.0), (46.0, 40.0), (15.0, 60.0))),
    "ball": Item(count=3, radius_cm=2.0, mobility="pushed", mass_g=10.0, friction=0.2),
    "lamp": Item(radius_cm=9.0, mobility="seen", centers_cm=((-30.0, 45.0),)),
}
SCENARIO = replace(
    tl.swarm.OBJECT_CLUSTERING,
    controller=(0.5, 1.0, 1.0, 0.5, 0.1, 0.5, 1.0, 0.9, 0.8, 1.0, 1.0, 0.7, 0.6, 1.0),
    items=ITEMS,
    sensor=Sensor(("background", "object", "robot", "light", "post", "ball", "lamp")),
    arena=Arena(80.0, 80.0),
)
OWN = 9


def test_seven_sensor_states_equal_the_slow_twin():
    rng = np.random.default_rng(5)
    poses = tl.swarm.initial_poses(SCENARIO, 3, rng)
    poses[:, 0] = (41.0, 30.0, np.pi / 2)  # it drives into a post
    controllers = np.broadcast_to(SCENARIO.controller, (3, 5, 14)).copy()
    result = tl.swarm.simulate(SCENARIO, controllers, poses, control_steps=40, seed=9)
    keys = np.random.SeedSequence(9).generate_state(3, np.uint64)
    for trial in range(3):
        twin = NaiveSwarm(SCENARIO, controllers[trial], poses[trial], keys[trial], 0.05)
        twin_poses, twin_sensors, twin_speeds = twin.run(40)
        # 400 steps: contacts amplify rounding.
        np.testing.assert_allclose(result.poses[trial, ..., :2], twin_poses[..., :2], atol=1e-7)
        np.testing.assert_array_equal(result.sensors[trial], twin_sensors)
        np.testing.assert_allclose(result.speeds[trial], twin_speeds, atol=1e-6)
    assert set(np.unique(result.sensors)) == set(range(7))
    moved = np.ptp(result.poses[..., :2], axis=1).max(axis=(0, 2))
    light, post, ball, lamp = moved[-9:-7], moved[-7:-4], moved[-4:-1], moved[-1]
    assert ball.max() > 1
    assert light.max() == post.max() == lamp == 0
    distance = np.linalg.norm(
        result.poses[:, 1:, :5, None, :2] - result.poses[:, 1:, None, -7:-4, :2], axis=-1
    )
    # A second contact in the same step may push a robot back into a post, by less than a step.
    assert 7.5 - 0.2 < distance.min() < 7.6


@pytest.mark.parametrize("field_of_view", [0.0, 1.0])
def test_in_tiles_items_are_as_in_plain_loops(field_of_view, monkeypatch):
    sensor = replace(SCENARIO.sensor, field_of_view=field_of_view)
    scenario = replace(SCENARIO, sensor=sensor, arena=Arena())
    poses = tl.swarm.initial_poses(scenario, 1, np.random.default_rng(2), robots=30, side_cm=70)
    controllers = np.broadcast_to(scenario.controller, (1, 30, 14)).copy()
    in_tiles = tl.swarm.simulate(scenario, controllers, poses, control_steps=40, seed=3)
    monkeypatch.setattr(trials, "MANY_BODIES", 10**9)
    plain = tl.swarm.simulate(scenario, controllers, poses, control_steps=40, seed=3)
    np.testing.assert_array_equal(in_tiles.sensors, plain.sensors)
    np.testing.assert_array_equal(in_tiles.poses, plain.poses)
    reading = [sensor.reading_of("robot")] * 30 + [sensor.reading_of("object")] * 60
    radius = [3.5] * 30 + [5.0] * 60
    for name, item in ITEMS.items():
        reading += [sensor.reading_of(name)] * item.count
        radius += [item.radius_cm] * item.count
    bodies = list(zip(radius, reading, strict=True))
    end = plain.poses[0, -1]
    expected = [read(i, *end.T, bodies, field_of_view) for i in range(30)]
    assert plain.sensors[0, -1].tolist() == expected
