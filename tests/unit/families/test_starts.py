"""Groups that begin as they were recorded."""

import numpy as np
import pytest

from turing_learning.families import (
    BurstAndCoast,
    Composed,
    Couzin,
    RecordedStarts,
    Robots,
    Vicsek,
    as_recorded,
)
from turing_learning.swarm import OBJECT_CLUSTERING
from turing_learning.trajectories import Trajectories

MODEL = [[6, 2.5, 1.5, 4, 8, 0.15]]
FRAMES = 100


def recording(corner=(0.0, 0.0), individuals=3):
    """Return a group that walks from one corner of a field to the other, 0.5 cm a frame."""
    rng = np.random.default_rng(8)
    steps = rng.normal((0.3, 0.4), 0.05, (FRAMES, individuals, 2))
    positions = np.asarray(corner) + steps.cumsum(axis=0)
    names = tuple("abcdef"[:individuals])
    return Trajectories(positions, np.ones((FRAMES, individuals), bool), 10.0, names)


def first_places(family, models=40):
    """Return where the groups of some models are before their first step (M, A, 2)."""
    return family.simulate(np.tile(MODEL, (models, 1)), np.random.default_rng(3))[:, 0]


def matched(places, recorded):
    """Return at which moment (F, A, 2) a group is as recorded, in any order, and who comes first."""
    # (F, A, A): from everybody to everybody who was recorded
    distances = np.linalg.norm(places[:, None] - recorded[:, None], axis=-1)
    moment = int(distances.min(axis=2).max(axis=1).argmin())
    order = distances[moment].argmin(axis=1)
    assert distances[moment].min(axis=1).max() < 0.1
    assert sorted(order) == list(range(len(places)))
    return moment, int(order[0])


def test_groups_begin_at_recorded_moments_of_the_learning_part():
    fish = recording()
    windows = fish.windows(10)
    family = as_recorded(Couzin, fish, windows, settling_steps=0)
    corner = fish.positions.min(axis=(0, 1))
    learned = windows.frames("learning")[0].any(axis=1)
    recorded = (fish.positions - corner)[learned]
    moments = set()
    first = set()
    for places in first_places(family):
        moment, individual = matched(places, recorded)
        moments.add(moment)
        first.add(individual)
    assert len(moments) > 10
    # the one that is observed is anybody
    assert first == {0, 1, 2}


def test_groups_go_on_in_the_direction_in_which_they_moved():
    fish = recording()
    family = as_recorded(Couzin, fish, fish.windows(10), settling_steps=0)
    # no noise, nobody near, and so slow that nobody turns
    straight = np.tile([5.0, 0.0, 0.0, 0.0, 0.0, 0.0], (40, 1))
    paths = family.simulate(straight, np.random.default_rng(3))
    directions = np.diff(paths[:, :2], axis=1)[:, 0] / 0.5
    angles = family.starts.directions
    units = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    for group in directions:
        matched(group, units)


def test_groups_settle_for_as_long_as_a_window_unless_told_otherwise():
    fish = recording()
    windows = fish.windows(10)
    assert as_recorded(Couzin, fish, windows).settling_steps == 10
    assert as_recorded(Couzin, fish, windows, settling_steps=3).settling_steps == 3


def test_what_was_recorded_lies_in_the_middle_of_a_tank():
    fish = recording(corner=(200.0, -300.0))
    width, height = 80.0, 90.0
    family = as_recorded(
        BurstAndCoast, fish, fish.windows(10), tanks=[(width, height)], settling_steps=0
    )
    recorded = fish.positions - fish.reach.mean(axis=0) + (width / 2, height / 2)
    places = family.starts.positions
    distances = np.abs(recorded[:, None] - places).max(axis=(2, 3))
    assert (distances.min(axis=0) < 1e-9).all()


def test_moments_where_somebody_is_missing_or_jumps_are_left_out():
    fish = recording()
    fish.present[10:40, 1] = False
    fish.positions[60, 2] += 50.0
    family = as_recorded(Couzin, fish, fish.windows(10))
    corner = fish.positions[fish.present].min(axis=0)
    places = family.starts.positions + corner
    # nobody stands where the lost one was said to be
    lost = fish.positions[10:40, 1]
    assert np.abs(places[:, None, 1] - lost).max(axis=-1).min() > 1e-9
    assert np.abs(places[:, 2] - fish.positions[60, 2]).max(axis=-1).min() > 10


def test_groups_that_were_never_recorded_begin_scattered():
    fish = recording()
    windows = fish.windows(10)
    family = as_recorded(Couzin, fish, windows, tanks=[(60, 60)])
    assert family.in_group(3).starts == family.starts
    assert family.in_group(5).starts is None
    assert family.in_group(3, (40.0, 40.0)).starts is None
    # nobody is in a periodic square
    assert as_recorded(Vicsek, fish, windows).starts is None
    # never all at once
    fish.present[::2, 0] = False
    fish.present[1::2, 1] = False
    alone = as_recorded(Couzin, fish, recording(individuals=3).windows(10))
    assert alone.starts is None
    assert alone.settling_steps == 0


def test_whoever_rests_begins_in_any_direction():
    starts = RecordedStarts(np.zeros((1, 4, 2)), np.full((1, 4), np.nan))
    still = BurstAndCoast(individuals=4, steps=5, starts=starts)
    ways = np.diff(still.simulate(np.array([[9, 0.5, 0.5, 0.0]]), np.random.default_rng(2)), axis=1)
    angles = np.arctan2(ways[0, 0, :, 1], ways[0, 0, :, 0])
    assert np.isfinite(angles).all()
    assert np.ptp(angles) > 0.5


def test_moments_of_another_number_of_individuals_are_refused():
    starts = RecordedStarts(np.zeros((1, 4, 2)), np.full((1, 4), np.nan))
    with pytest.raises(ValueError, match="`starts` must be of 3 individuals, as the group; got 4"):
        Couzin(individuals=3, starts=starts)


def test_robots_begin_at_recorded_places_and_headings():
    swarm = Robots(individuals=5, steps=30, settling_steps=200, start_side_cm=100.0)
    model = np.array([[0.7, 0.9, 1.0, -1.0]])
    rng = np.random.default_rng(4)
    positions, headings = swarm._paths(model, rng)
    present = np.ones(positions.shape[1:3], dtype=bool)
    names = tuple("abcde")
    recording = Trajectories(positions[0], present, 10.0, names, headings=headings[0])
    family = as_recorded(Robots, recording, recording.windows(5), settling_steps=0)
    corner = recording.reach[0]
    for poses, angles in zip(*family._paths(np.tile(model, (6, 1)), rng), strict=True):
        # robots that touch are pushed apart before they move
        moment, first = matched(poses[0] + corner, positions[0])
        turned = np.angle(np.exp(1j * (angles[0, 0] - headings[0, moment, first])))
        assert abs(turned) < 1e-6
    assert family.in_group(6).starts is None


def test_robots_among_walls_or_objects_begin_scattered():
    assert not Robots.can_begin_as_recorded(scenario=OBJECT_CLUSTERING)
    assert Robots.can_begin_as_recorded()


def test_positions_that_can_hardly_be_true_are_no_starts():
    fish = recording()
    fish.positions[40, 1] = (3000.0, 3000.0)
    fish.positions[60:75, 2] = 0.0
    windows = recording().windows(10)
    for tanks in ((), ((60.0, 60.0),)):
        starts = as_recorded(Couzin, fish, windows, tanks=tanks).starts
        sides = np.ptp(starts.positions, axis=(0, 1))
        # everybody walks some 30 by 40 cm
        assert (sides < 60).all()
        assert np.abs(starts.positions).max() < 80
    unmoved = np.linalg.norm(starts.positions - starts.positions[:, :1], axis=-1)
    assert unmoved.max() < 15


def test_headings_count_for_families_that_have_some():
    fish = recording()
    motion = as_recorded(Couzin, fish, fish.windows(10)).starts.directions
    backwards = np.full(fish.positions.shape[:2], 1.0)
    turned = Trajectories(fish.positions, fish.present, 10.0, fish.individuals, headings=backwards)
    windows = turned.windows(5)
    np.testing.assert_array_equal(as_recorded(Couzin, turned, windows).starts.directions, motion)
    assert (as_recorded(Robots, turned, windows).starts.directions == 1.0).all()
    assert np.isnan(as_recorded(Robots, fish, fish.windows(5)).starts.directions).all()


def test_families_from_parts_settle_for_no_shorter_than_they_do():
    fish = recording()
    family = as_recorded(Composed, fish, fish.windows(10), parts=("kicks",))
    assert family.settling_steps == 100
