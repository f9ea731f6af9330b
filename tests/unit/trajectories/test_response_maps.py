"""Maps of how individuals respond to the nearest other and to walls."""

import numpy as np
import pytest
from matplotlib.collections import QuadMesh

from turing_learning.families import Couzin, virtual_group
from turing_learning.trajectories import Trajectories, response_figure, response_maps

TANK = (40.0, 40.0)
FAMILY = Couzin(individuals=6, interval_s=0.1, tank_cm=TANK)
VALUES = {name: (p.low + p.high) / 2 for name, p in FAMILY.parameters.items()}


def moved(seed, **others):
    return virtual_group(FAMILY, VALUES | others, duration_s=600, seed=seed)


@pytest.fixture(scope="module")
def maps():
    return response_maps(moved(1), tank_cm=TANK)


def test_maps_of_the_same_animals_agree_and_those_of_others_less(maps):
    same = response_maps(moved(2), tank_cm=TANK, like=maps).agreement(maps)
    alone = {"orientation_width": 0.0, "attraction_width": 0.0}
    other = response_maps(moved(3, **alone), tank_cm=TANK, like=maps).agreement(maps)
    assert same["turning"] > 0.9
    assert same["wall_turning"] > 0.9
    assert other["turning"] < same["turning"] - 0.1


def followers(turn):
    """One that goes straight along x, and one 2 cm beside it on the left, that turns by a rate (rad/s)."""
    time_s = np.arange(40) / 10
    straight = np.stack([time_s, np.zeros(40)], axis=1)
    angle = turn * time_s
    beside = np.cumsum(np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0) / 10
    beside += (0.0, 2.0)
    positions = np.stack([straight, beside], axis=1) + 10
    return Trajectories(positions, np.ones((40, 2), dtype=bool), 10.0, ("straight", "turning"))


def test_a_turn_away_from_a_neighbor_on_the_right_is_where_it_belongs():
    found = response_maps(followers(0.3), cells=8)
    on_the_left, on_the_right = found.turning[:, :4], found.turning[:, 4:]
    assert np.nanmean(on_the_right) == pytest.approx(0.3, abs=0.02)
    assert np.nanmean(on_the_left) == pytest.approx(0.0, abs=1e-9)


def test_the_wall_ahead_is_in_the_middle():
    frames = np.arange(100)
    back_and_forth = 5 + 4.5 * np.sin(frames / 50)
    positions = np.stack([np.stack([back_and_forth, np.full(100, 5.0 + k)], 1) for k in (0, 1)], 1)
    recording = Trajectories(positions, np.ones((100, 2), dtype=bool), 10.0, ("a", "b"))
    found = response_maps(recording, tank_cm=(10.0, 10.0), cells=5)
    nearest = found.wall_moments[0]
    assert nearest[2] > 0
    assert np.nansum(np.abs(found.wall_turning[:, 2])) == pytest.approx(0.0, abs=1e-9)


def test_pixels_and_individuals_alone_are_refused():
    recording = followers(0.0)
    alone = Trajectories(
        recording.positions[:, :1], recording.present[:, :1], recording.fps, ("alone",)
    )
    with pytest.raises(ValueError, match="`recordings` must hold two individuals beside each"):
        response_maps(alone)
    pixels = Trajectories(recording.positions, recording.present, 10.0, ("a", "b"), unit="px")
    with pytest.raises(ValueError, match="`recordings` must be in cm; got pixels"):
        response_maps(pixels)


def test_what_cannot_be_compared_or_drawn_is_refused(maps):
    with pytest.raises(ValueError, match="`other` must have the same cells"):
        maps.agreement(response_maps(moved(1), tank_cm=TANK, cells=5))
    with pytest.raises(ValueError, match="`other` must have the same cells"):
        maps.agreement(response_maps(moved(1), tank_cm=(60.0, 60.0)))
    with pytest.raises(ValueError, match="`tank_cm` must be two finite numbers above 0"):
        response_maps(followers(0.0), tank_cm=(0.0, 0.0))
    with pytest.raises(ValueError, match="`recordings` must be one or several; got none"):
        response_maps([])
    with pytest.raises(ValueError, match="`maps` must be of one source"):
        response_figure({})


def test_cells_of_few_moments_stay_empty_in_the_figure(maps):
    assert np.sum((maps.moments > 0) & (maps.moments < 20)) > 0
    assert np.sum((maps.wall_moments > 0) & (maps.wall_moments < 20)) > 0
    meshes = []
    for axes in response_figure({"Recorded": maps}).axes:
        meshes += [mesh.get_array() for mesh in axes.collections if isinstance(mesh, QuadMesh)]
    drawn = [np.ma.count(np.ma.masked_invalid(mesh)) for mesh in meshes[:3]]
    cells, wall_cells = np.sum(maps.moments >= 20), np.sum(maps.wall_moments >= 20)
    assert drawn == [cells, cells, wall_cells]


def test_maps_are_drawn_side_by_side(maps, tmp_path):
    figure = response_figure({"Recorded": maps, "Simulated": maps})
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert sum(title.startswith("Recorded: ") for title in titles) == 3
    figure.savefig(tmp_path / "maps.png")
