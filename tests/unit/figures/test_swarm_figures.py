import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from turing_learning.figures import swarm_frame
from turing_learning.figures._picture import svg_markup
from turing_learning.figures.swarms import gathering_figure, snapshots_figure

POSES = np.array([[0.0, 0.0, 0.0], [20.0, 0.0, np.pi / 2], [0.0, 30.0, 1.0]])


RNG = np.random.default_rng(0)


def draw(figure):
    """Draw everything: warnings are errors."""
    svg_markup(figure, "f", "")
    return figure


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


def test_moments_stand_side_by_side_at_the_same_scale():
    poses = RNG.uniform(0, 100, size=(4, 7, 3))
    figure = draw(snapshots_figure(poses, times_s=(0, 20, 40, 60), robots=5, robot_radius_cm=3.5))
    assert [axes.get_title() for axes in figure.axes] == [
        "initial configuration",
        *(f"after {t} s" for t in (20, 40, 60)),
    ]
    assert len({axes.get_xlim() for axes in figure.axes}) == 1
    low, high = figure.axes[0].get_xlim()
    assert low < poses[..., 0].min()
    assert poses[..., 0].max() < high


def test_robots_in_a_wide_arena_are_enlarged_and_the_figure_says_so():
    wide = RNG.uniform(0, 2000, size=(1, 5, 3))
    assert (
        "times as large"
        in draw(snapshots_figure(wide, times_s=(0,), robots=5, robot_radius_cm=3.5)).get_supxlabel()
    )
    near = wide / 20
    assert (
        "times as large"
        not in draw(
            snapshots_figure(near, times_s=(0,), robots=5, robot_radius_cm=3.5)
        ).get_supxlabel()
    )


def test_swarms_are_drawn_as_means_with_bands_and_the_best_possible():
    swarms = {"agents": RNG.random((4, 6)), "model": RNG.random((4, 6))}
    figure = draw(
        gathering_figure(
            np.arange(6.0), {"Share": swarms, "Spread": swarms}, limits={"Share": 1, "Spread": 0}
        )
    )
    for axes in figure.axes:
        np.testing.assert_allclose(axes.lines[0].get_ydata(), swarms["agents"].mean(axis=0))
        assert len(axes.collections) == 2
    assert figure.axes[0].lines[2].get_ydata()[0] == 1


def test_moments_can_stand_in_rows():
    poses = RNG.uniform(0, 100, (5, 4, 3))
    figure = draw(
        snapshots_figure(poses, times_s=(0, 1, 2, 3, 4), robots=4, robot_radius_cm=3.5, columns=3)
    )
    rows = {round(axes.get_position().y0, 1) for axes in figure.axes[:5]}
    assert (len(figure.axes), len(rows)) == (6, 2)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"poses": POSES[:, :2], "robots": 1}, r"`poses` must be of shape \(B, 3\); got \(3, 2\)"),
        ({"poses": POSES, "robots": 4}, "`robots` must be an integer from 0 to 3; got 4"),
        (
            {"poses": POSES, "robots": 2, "replicas": [True]},
            r"`replicas` must be of shape \(A,\) = \(2,\); got \(1,\)",
        ),
        (
            {"poses": POSES, "robots": 2, "trail": POSES},
            r"`trail` must be of shape \(F, B, 3\) = \(any, 3, 3\); got \(3, 3\)",
        ),
    ],
)
def test_what_is_no_swarm_is_refused(axes, options, message):
    with pytest.raises(ValueError, match=message):
        swarm_frame(axes, **options)
