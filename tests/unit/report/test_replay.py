import numpy as np
import pytest

from turing_learning.report import Replay, Swarm

POSES = np.zeros((3, 2, 3))


def make(*swarms, **changes):
    options = {
        "title": "t",
        "robot_radius_cm": 3.5,
        "object_radius_cm": 5.0,
        "interval_s": 0.1,
    } | changes
    return Replay(**options, swarms=swarms)


def test_the_duration_is_the_time_between_first_and_last_frame():
    assert make(Swarm("a", POSES, 2)).duration_s == pytest.approx(0.2)


def test_the_view_encloses_every_disk_at_any_time():
    rng = np.random.default_rng(0)
    swarms = [Swarm("a", scale * rng.normal(size=(9, 4, 3)), 3) for scale in (10.0, 200.0)]
    left, bottom, right, top = make(*swarms).view_cm
    x, y, _ = np.concatenate([swarm.poses.reshape(-1, 3) for swarm in swarms]).T
    assert left < x.min() - 5
    assert right > x.max() + 5
    assert bottom < y.min() - 5
    assert top > y.max() + 5


def test_the_view_encloses_the_walls():
    left, bottom, right, top = make(Swarm("a", POSES, 2), walls_cm=(-50, -60, 70, 80)).view_cm
    assert (left < -50, bottom < -60, right > 70, top > 80) == (True,) * 4


def test_the_view_of_a_thin_motion_is_not_a_slit():
    poses = np.zeros((2, 1, 3))
    poses[1, 0, 0] = 1000
    left, bottom, right, top = make(Swarm("a", poses, 1)).view_cm
    assert (top - bottom) / (right - left) > 0.5


def test_rows_behind_the_robots_are_objects():
    assert Swarm("a", POSES, 1).objects == 1


def test_robots_are_agents_by_default():
    assert Swarm("a", POSES, 2).is_replica.tolist() == [False, False]


@pytest.mark.parametrize(
    ("make_it", "message"),
    [
        (lambda: Swarm("a", POSES[0], 1), r"`poses` must be of shape \(F, B, 3\); got \(2, 3\)"),
        (lambda: Swarm("a", POSES[:0], 1), r"and not empty; got \(0, 2, 3\)"),
        (
            lambda: Swarm("a", np.add(POSES, [0, np.nan, 0]), 1),
            r"`poses` must be finite; got nan at \(0, 0, 1\)",
        ),
        (lambda: Swarm("a", POSES, 3), "`robots` must be an integer from 0 to 2; got 3"),
        (
            lambda: Swarm("a", POSES, 2, np.ones(3, bool)),
            r"`replica_mask` must be of shape \(A,\) = \(2,\); got \(3,\)",
        ),
        (lambda: make(), "`swarms` must hold at least one swarm; got none"),
        (
            lambda: make(Swarm("a", POSES, 1), Swarm("b", POSES[1:], 1)),
            r"same number of frames; got \[3, 2\]",
        ),
        (
            lambda: make(Swarm("a", POSES, 1), interval_s=0),
            "`interval_s` must be a finite number above 0; got 0",
        ),
        (
            lambda: make(Swarm("a", POSES, 1), robot_radius_cm=-1.0),
            "`robot_radius_cm` must be a finite number above 0; got -1.0",
        ),
        (
            lambda: make(Swarm("a", POSES, 1), object_radius_cm=np.inf),
            "`object_radius_cm` must be a finite number above 0; got inf",
        ),
        (
            lambda: make(Swarm("a", POSES, 1), walls_cm=(1, 0, 0, 1)),
            r"`walls_cm` must be left < right.*got \(1, 0, 0, 1\)",
        ),
    ],
)
def test_what_cannot_be_replayed_is_refused(make_it, message):
    with pytest.raises(ValueError, match=message):
        make_it()
