import math

import numpy as np
import pytest

from turing_learning.robots.emulation._arena import DARK, read_infrared
from turing_learning.robots.emulation._emulated_robot import OBSTACLE, SENSOR_ANGLES, WALL

ARENA, RADIUS = (200.0, 225.0), 3.5


def readings(*poses, seed=0):
    return read_infrared(np.array(poses, dtype=float), ARENA, RADIUS, np.random.default_rng(seed))


def test_in_the_open_there_is_nothing_but_noise():
    seen = np.concatenate([readings((100, 100, 0.3), seed=seed) for seed in range(50)])
    assert np.abs(seen - DARK).max() < 30
    assert seen.std() > 2


@pytest.mark.parametrize("sensor", range(8))
def test_each_sensor_sees_a_wall_at_its_own_side_best(sensor):
    heading = math.pi - SENSOR_ANGLES[sensor]  # so that it points at the wall x = 0
    seen = readings((RADIUS + 1.0, 100, heading))[0]
    assert np.argmax(seen) == sensor
    assert seen[sensor] > WALL


@pytest.mark.parametrize(("x", "y"), [(4.5, 100), (195.5, 100), (100, 4.5), (100, 220.5)])
def test_all_four_walls_are_seen(x, y):
    assert readings((x, y, 0.0)).max() > WALL


def test_a_wall_is_brighter_the_nearer_it_is():
    seen = [readings((RADIUS + gap, 100, math.pi))[0][0] for gap in (0.2, 1.0, 2.0, 3.0, 5.0)]
    assert sorted(seen, reverse=True) == seen
    assert seen[0] > 3 * seen[2]


def test_a_robot_that_touches_is_an_obstacle_and_never_a_wall():
    for bearing in np.linspace(-math.pi, math.pi, 73):
        other = (100 + 2 * RADIUS * math.cos(bearing), 100 + 2 * RADIUS * math.sin(bearing), 0.0)
        assert readings((100, 100, 0.0), other)[0].max() < WALL
    ahead = readings((100, 100, 0.0), (100 + 2 * RADIUS + 0.5, 100, 0.0))[0]
    assert ahead[[0, 7]].min() > OBSTACLE


def test_robots_do_not_see_themselves_and_see_each_other_alike():
    assert readings((100, 100, 0.0)).max() < DARK + 30
    seen = readings((100, 100, 0.0), (108, 100, math.pi))
    assert np.abs(seen[0] - seen[1]).max() < 40


def test_readings_are_what_the_robots_converter_can_say():
    seen = readings((RADIUS, 100, math.pi - SENSOR_ANGLES[0]), (0.0, 0.0, 0.0))
    assert seen.dtype.kind == "i"
    assert seen.min() >= 0
    assert seen.max() <= 4095
