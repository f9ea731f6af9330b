import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from turing_learning.figures import swarm_frame

POSES = np.array([[0.0, 0.0, 0.0], [20.0, 0.0, np.pi / 2], [0.0, 30.0, 1.0]])


@pytest.fixture
def axes():
    return Figure().subplots()


def test_robots_and_objects_are_disks_at_their_places(axes):
    swarm_frame(axes, POSES, robots=2, robot_radius_cm=3, object_radius_cm=7)
    disks = {(*map(float, disk.center), disk.radius) for disk in axes.patches}
    assert disks == {(0, 0, 3), (20, 0, 3), (0, 30, 7)}


def test_headings_point_ahead(axes):
    swarm_frame(axes, POSES, robots=2, robot_radius_cm=3)
    np.testing.assert_allclose(axes.lines[1].get_xydata(), [[20, 0], [20, 3]], atol=1e-12)


def test_replicas_differ_in_color_and_shape(axes):
    swarm_frame(axes, POSES, robots=3, replicas=[False, True, False])
    at_replica = [disk for disk in axes.patches if disk.center[0] == 20]
    at_agent = [disk for disk in axes.patches if disk.center == (0, 0)]
    assert (len(at_replica), len(at_agent)) == (2, 1)
    assert to_hex(at_replica[1].get_edgecolor()) != to_hex(at_agent[0].get_facecolor())


def test_trails_are_drawn_for_robots_only(axes):
    trail = np.stack([POSES, POSES + 1])
    swarm_frame(axes, POSES, robots=2, trail=trail)
    np.testing.assert_array_equal(axes.lines[1].get_xydata(), trail[:, 1, :2])
    assert len(axes.lines) == 4  # two trails, two headings


def test_both_directions_have_the_same_scale(axes):
    swarm_frame(axes, POSES, robots=2)
    assert axes.get_aspect() == 1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"poses": POSES[:, :2], "robots": 1}, r"`poses` must have the shape \(A \+ O, 3\).*got \(3, 2\)"),
        ({"poses": POSES, "robots": 4}, r"`robots` must be between 0 and the number of poses, 3; got 4"),
        ({"poses": POSES, "robots": 2, "replicas": [True]}, r"`replicas` must have the shape \(2,\); got \(1,\)"),
        ({"poses": POSES, "robots": 2, "trail": POSES}, r"`trail` must have the shape \(F, 3, 3\).*got \(3, 3\)"),
    ],
)
def test_what_is_no_swarm_is_refused(axes, options, message):
    with pytest.raises(ValueError, match=message):
        swarm_frame(axes, **options)
