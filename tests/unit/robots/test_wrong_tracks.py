"""Wrong poses, and robots that are exchanged, are noticed within ten trials; right laboratories are left alone."""

import numpy as np
import pytest
from wrong_tracks import WRONG, found_at, in_metres

from turing_learning.robots import LABORATORY, Track
from turing_learning.robots.program._plausible import TrackCheck


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: wrong.__name__)
def test_what_is_wrong_is_found_within_ten_trials_and_named(wrong):
    for seed in range(4):
        number, fault = found_at(seed, wrong)
        assert number, seed
        assert WRONG[wrong] in fault


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"lag": 3},
        {"spread": 0.1},
        {"noise_cm": 0.1, "noise_rad": 0.03},
        {"agents": 1, "replicas": 1},
        {"controller": (-0.7, -1.0, 1.0, -1.0)},
        {"controller": (0.5, 0.5, 0.5, 0.5)},
        {"controller": (0.0, 0.0, 0.0, 0.0)},
        {"controller": (1.0, 1.0, 1.0, 1.0), "noise_cm": 0.0, "noise_rad": 0.0, "near": 0.001},
        {"near": 0.1},
    ],
    ids=str,
)
def test_nothing_is_found_in_right_laboratories(options):
    assert [found_at(seed, count=12, **options) for seed in range(100, 103)] == [(0, "")] * 3


def test_positions_in_metres_are_noticed_in_the_first_trial_before_anybody_is_asked_to_free_a_robot():
    for seed in range(4):
        assert found_at(seed, in_metres)[0] == 1


def test_robots_that_crowd_are_not_taken_for_some_in_metres():
    robot = LABORATORY.robot
    check = TrackCheck(robot, ["r1"])
    x, y = np.meshgrid(np.arange(3), np.arange(3))
    poses = np.zeros((51, 9, 3))
    poses[..., :2] = 2 * robot.radius_cm * np.column_stack([x.ravel(), y.ravel()])
    track = Track(poses, np.ones((51, 9), bool), ("x",) * 9, 0.1)
    assert check.fault(track, np.zeros((1, 4))) == ""
