"""Sensors with a field of view against a plain twin in angles, and against the line of sight."""

import math
from dataclasses import replace

import numpy as np
import pytest
from naive_view import nearest_visible as naive_distance
from naive_view import read
from standalone import standalone

from turing_learning.kernels import trials
from turing_learning.kernels.sensing import nearest_visible
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Sensor, initial_poses, simulate

nearest_visible = standalone(nearest_visible)

NEARLY_FULL = math.nextafter(2 * math.pi, 0)
FIELDS = (
    0.0,
    1e-9,
    1e-3,
    0.4,
    math.pi / 3,
    2.0,
    math.pi - 1e-9,
    math.pi,
    math.pi + 1e-9,
    4.0,
    6.0,
    NEARLY_FULL,
    2 * math.pi,
)


def distance(ahead, off, radius, field_of_view):
    found = nearest_visible(
        ahead, off, radius, math.cos(field_of_view / 2), math.sin(field_of_view / 2)
    )
    return None if found == math.inf else found


def seen_by(field_of_view, place, radius=3.5):
    """Return whether a robot in the origin that heads along x sees a disk."""
    return distance(*place, radius, field_of_view) is not None


def swarm(scenario, side, field_of_view, seed, robots=None):
    """Return poses and readings of many swarms of one robot more than bodies that fill the square."""
    scenario = replace(scenario, sensor=replace(scenario.sensor, field_of_view=field_of_view))
    starts = initial_poses(scenario, 8, np.random.default_rng(seed), side_cm=side, robots=robots)
    count = robots or scenario.individuals
    still = np.zeros((8, count, len(scenario.controller)))
    return starts, simulate(scenario, still, starts, control_steps=1).sensors[:, 0]


@pytest.mark.parametrize("field_of_view", FIELDS)
def test_distances_are_those_of_the_plain_twin(field_of_view):
    rng = np.random.default_rng(3)
    for ahead, off in rng.uniform(-20, 20, (3000, 2)):
        expected = naive_distance(ahead, off, 3.5, field_of_view)
        found = distance(ahead, off, 3.5, field_of_view)
        assert (found is None) == (expected is None)
        assert found is None or found == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("robots", [None, 60])
@pytest.mark.parametrize("side", [30.0, 200.0])
@pytest.mark.parametrize("field_of_view", FIELDS)
def test_readings_of_three_states_are_those_of_the_plain_twin(field_of_view, side, robots):
    scenario = OBJECT_CLUSTERING
    poses, readings = swarm(scenario, side, field_of_view, 5, robots)
    count = readings.shape[1]
    bodies = [(3.5, 2)] * count + [(5.0, 1)] * (poses.shape[1] - count)
    for trial in range(2 if robots else len(poses)):
        x, y, heading = poses[trial].T
        assert readings[trial].tolist() == [
            read(i, x, y, heading, bodies, field_of_view) for i in range(count)
        ]


def test_a_disk_is_seen_as_soon_as_its_rim_is_in_view():
    half, radius, far = math.pi / 6, 3.5, 50.0
    touching = half + math.asin(radius / far)
    place = lambda angle: (far * math.cos(angle), far * math.sin(angle))  # noqa: E731
    assert seen_by(2 * half, place(touching - 1e-9))
    assert seen_by(2 * half, place(-touching + 1e-9))
    assert not seen_by(2 * half, place(touching + 1e-9))


def test_an_item_behind_is_seen_only_by_eyes_at_the_back():
    assert not seen_by(0.0, (-8.0, 0.0))
    assert not seen_by(math.pi, (-8.0, 0.0))
    assert seen_by(2 * math.pi, (-8.0, 0.0))
    assert not seen_by(5.0, (-800.0, 0.0))
    assert seen_by(6.2, (-8.0, 0.0))


def test_half_a_turn_sees_what_reaches_over_the_line_between_the_wheels():
    assert seen_by(math.pi, (-3.4, 7.0))
    assert not seen_by(math.pi, (-3.6, 7.0))


def test_touching_disks_see_each_other_where_they_touch():
    assert distance(7.0, 0.0, 3.5, 1.0) == 3.5
    assert not seen_by(1.0, (0.0, 7.0))
    assert seen_by(2.2, (0.0, 7.0))


def test_a_disk_around_the_robot_is_in_any_view_but_a_line():
    assert seen_by(1e-6, (-2.0, 0.0))
    assert not seen_by(0.0, (-2.0, 0.0))


def test_a_full_view_sees_every_item():
    rng = np.random.default_rng(1)
    assert all(seen_by(2 * math.pi, place) for place in rng.uniform(-500, 500, (2000, 2)))


def test_a_field_of_zero_among_others_is_the_line_of_sight_to_the_last_bit():
    poses = initial_poses(OBJECT_CLUSTERING, 40, np.random.default_rng(2), side_cm=60)
    controllers = np.broadcast_to(OBJECT_CLUSTERING.controller, (40, 5, 6))
    fields = np.zeros((40, 5))
    fields[20:, 4] = 1.0  # in other trials, so that sectors are computed at all
    mixed = simulate(OBJECT_CLUSTERING, controllers, poses, control_steps=50, fields_of_view=fields)
    rays = simulate(OBJECT_CLUSTERING, controllers, poses, control_steps=50)
    np.testing.assert_array_equal(mixed.poses[:20], rays.poses[:20])
    np.testing.assert_array_equal(mixed.sensors[:20], rays.sensors[:20])
    assert (mixed.sensors[20:] != rays.sensors[20:]).any()


@pytest.mark.parametrize("threads", [1, 2])
def test_many_robots_move_as_few_do_and_threads_change_nothing(threads, monkeypatch):
    rng = np.random.default_rng(7)
    poses = initial_poses(AGGREGATION, 3, rng, robots=60, side_cm=250)
    controllers = rng.uniform(-1, 1, (3, 60, 4))
    fields = rng.uniform(0, 2 * math.pi, (3, 60))
    fields[:, ::3] = 0.0
    many = simulate(
        AGGREGATION, controllers, poses, control_steps=20, fields_of_view=fields, threads=threads
    )
    monkeypatch.setattr(trials, "MANY_BODIES", 1000)
    side_by_side = simulate(
        AGGREGATION, controllers, poses, control_steps=20, fields_of_view=fields, threads=1
    )
    np.testing.assert_array_equal(many.poses, side_by_side.poses)
    np.testing.assert_array_equal(many.sensors, side_by_side.sensors)


def test_an_item_that_the_sensor_does_not_know_is_invisible():
    sensor = Sensor(readings=("background", "object"), field_of_view=2 * math.pi)
    scenario = replace(OBJECT_CLUSTERING, sensor=sensor, controller=(0.0,) * 4)
    poses = np.array([[[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [30.0, 0.0, 0.0]]] * 2)
    assert simulate(scenario, np.zeros((2, 2, 4)), poses, control_steps=1).sensors[
        0, 0
    ].tolist() == [1, 1]
    assert simulate(scenario, np.zeros((2, 3, 4)), poses, control_steps=1).sensors[
        0, 0
    ].tolist() == [0, 0, 0]


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (
            np.zeros((2, 3)),
            r"`fields_of_view` must have shape \(\), \(A,\) or \(R, A\) = \(1, 3\); got \(2, 3\)",
        ),
        (-0.1, r"`fields_of_view` must be from 0 to 2 pi = 6\.283185 rad; got \[-0\.1\]"),
        (6.3, r"`fields_of_view` must be from 0 to 2 pi = 6\.283185 rad; got \[6\.3\]"),
        (math.nan, r"`fields_of_view` must be from 0 to 2 pi = 6\.283185 rad; got \[nan\]"),
    ],
)
def test_what_is_no_field_of_view_is_refused(fields, message):
    with pytest.raises(ValueError, match=message):
        simulate(
            AGGREGATION,
            np.zeros((1, 3, 4)),
            np.zeros((1, 3, 3)),
            control_steps=1,
            fields_of_view=fields,
        )
