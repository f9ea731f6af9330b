"""Robots in a simulator that owns its time: the page's example, in pymunk, and what a simulator must give."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from turing_learning.robots import load_laboratory, supervise
from turing_learning.runs import read_events, read_trials, start_laboratory

EXAMPLES = Path(__file__).parents[3] / "examples"
SPEED_CM_S = 12.8
AXLE_CM = 5.1


@pytest.fixture
def laboratory():
    return load_laboratory(
        EXAMPLES / "simulator.toml", {"run.generations": 1, "models.population": 4}
    )


@pytest.fixture
def discs(monkeypatch):
    pytest.importorskip("pymunk")
    monkeypatch.syspath_prepend(str(EXAMPLES))
    from simulator import Discs

    return Discs


def test_the_example_in_pymunk_executes_the_models_that_are_sent(laboratory, discs, tmp_path):
    equipment = supervise(laboratory, discs(8, 200.0, 225.0))
    setup = laboratory.setup.model_copy(
        update={"evaluation": laboratory.setup.evaluation.model_copy(update={"repeats": 0})}
    )
    start_laboratory(replace(laboratory, setup=setup), tmp_path / "run", equipment=equipment)
    trials = read_trials(tmp_path / "run", "generation-0000")
    assert trials.poses.shape == (2, 51, 8, 3)
    assert not [
        event["fault"] for event in read_events(tmp_path / "run") if event["kind"] == "disturbed"
    ]
    speeds = trials.speeds()
    states = np.concatenate(
        [np.tile([(-0.7, -1.0, 1.0, -1.0)], (2, 6, 1)), trials.models], axis=1
    ).reshape(2, 8, 2, 2)
    linear = SPEED_CM_S * states.mean(axis=-1)
    angular = SPEED_CM_S * (states[..., 1] - states[..., 0]) / AXLE_CM
    for state in range(2):
        near = np.abs(speeds[..., 0] - linear[..., state, None]) < 0.5
        near &= np.abs(speeds[..., 1] - angular[..., state, None]) < 0.2
        if state == 0:
            either = near
        either = either | near
    assert (
        np.median(either.mean(axis=-1)) > 0.5
    )  # others are between two cycles, at walls, or pushed


class Still:
    """A simulator of robots that stand, or of some other number of them."""

    def __init__(self, robots):
        self._robots = robots

    def step(self, dt_s, wheels):
        assert dt_s == pytest.approx(0.02)
        assert wheels.shape == (8, 2)
        return np.ones((self._robots, 3))

    def sights(self):
        return [0] * 8

    def proximity(self):
        return [[60] * 8] * 8


def test_poses_are_taken_when_a_camera_would_take_them(laboratory):
    equipment = supervise(laboratory, Still(8))
    track = equipment.tracker().track(1.23, 5)
    assert equipment.clock.now() == pytest.approx(1.63)
    assert track.poses.shape == (5, 8, 3)
    assert track.labels == laboratory.setup.labels


def test_a_simulator_of_other_robots_is_refused(laboratory):
    equipment = supervise(laboratory, Still(7))
    with pytest.raises(ValueError, match="`poses` must"):
        equipment.clock.sleep(0.1)
