"""Individuals that a tracker loses: how often and how long, as recorded, and in groups of a model."""

import numpy as np
import pytest

from turing_learning.families._losses import Losses, lose, losses_of
from turing_learning.trajectories import Trajectories

NEAR = Losses(np.array([1.0]), np.array([1.0, 0.0]), np.array([3]), np.array([1.0]))
"""Whoever has another within 1 cm is lost for three frames, and the other, too."""


def recording(places, present):
    names = tuple(map(str, range(places.shape[1])))
    return Trajectories(places, present, fps=10, individuals=names)


def standing(frames, *places):
    return np.tile(np.array(places, dtype=float), (frames, 1, 1))


def generators(count):
    return np.random.default_rng(1).spawn(count)


def test_losses_are_counted_by_the_distance_of_the_nearest():
    # two pairs, 1 and 5 cm apart; of the near one, both are lost after every fourth frame for two frames
    places = standing(600, (0, 0), (1, 0), (100, 0), (105, 0))
    present = np.ones((600, 4), dtype=bool)
    lost = np.arange(600) % 6 >= 4
    lost[-6:] = False
    present[lost, :2] = False
    # the far ones are lost together now and then
    present[50:560:25, 2:] = False
    everything = np.ones_like(present)
    losses = losses_of([recording(places, present)], [everything])
    assert set(losses.gaps) == {1, 2}
    assert losses.joint.tolist() == [1]
    near, far = losses.chances[np.searchsorted(losses.distances, [1.0, 5.0])]
    assert near == pytest.approx(0.25, rel=0.02)
    assert far == pytest.approx(21 / 578, rel=0.02)


def test_neither_whoever_has_left_nor_what_is_held_out_counts():
    places = standing(100, (0, 0), (1, 0), (2, 0))
    present = np.ones((100, 3), dtype=bool)
    present[60:, 0] = False
    present[80:85, 1] = False
    learned = np.ones_like(present)
    learned[75:] = False
    assert not len(losses_of([recording(places, present)], [learned]).gaps)
    assert losses_of([recording(places, present)], [learned | True]).gaps.tolist() == [5]


def test_two_who_are_near_are_lost_and_found_together():
    positions = standing(200, (0, 0), (0.5, 0), (20, 0), (40, 0))[None]
    now_and_then = NEAR._replace(chances=np.array([0.2, 0.0]), gaps=np.array([2, 5]))
    seen = np.isfinite(lose(positions, now_and_then, generators(1))[0, ..., 0])
    assert 0.3 < seen[:, 0].mean() < 0.8
    assert seen[:, 0].tolist() == seen[:, 1].tolist()
    assert seen[:, 2:].all()


def test_the_share_of_joint_losses_is_that_of_the_recordings():
    # of two who are each other's nearest, one is lost a hundred times, and both fifty times
    places = standing(2000, (0, 0), (1, 0), (50, 0))
    present = np.ones((2000, 3), dtype=bool)
    present[10:1010:10, 0] = False
    present[1500:1900:8, :2] = False
    # a third, who is nobody's nearest, counts for nothing here
    present[15:1015:10, 2] = False
    losses = losses_of([recording(places, present)], [np.ones_like(present)])
    assert losses.joint == pytest.approx(100 / 200)


def test_two_are_lost_each_alone_where_recorded_ones_were():
    positions = standing(20_000, (0, 0), (0.5, 0), (20, 0), (40, 0))[None]
    often = NEAR._replace(chances=np.array([0.05, 0.0]), gaps=np.array([1]))
    for joint in (0.0, 0.6):
        losses = often._replace(joint=np.array([joint]))
        gone = np.isnan(lose(positions, losses, generators(1))[0, :, :2, 0])
        # whoever is alone has nobody near, and is not lost
        both = gone.all(axis=1).sum() / gone[:, 0].sum()
        assert both == pytest.approx(joint + (1 - joint) * 0.05, abs=0.06)
        assert gone[:, 0].mean() == pytest.approx(0.05, rel=0.15)


def test_who_is_lost_is_found_after_as_many_frames_as_recorded():
    positions = standing(9, (0, 0), (0.5, 0), (20, 0), (40, 0))[None]
    seen = np.isfinite(lose(positions, NEAR, generators(1))[0, ..., 0])
    # lost as soon as it is seen
    assert seen[:, 0].tolist() == [True, False, False, False] * 2 + [True]


def test_two_are_always_seen_in_samples():
    positions = standing(8, (0, 0), (0.5, 0), (20, 0))[None]
    assert np.isfinite(lose(positions, NEAR, generators(1))).all()
    assert np.isnan(lose(positions, NEAR, generators(1), fewest=0)[0, 1:4, :2]).all()


def test_whom_a_tracker_loses_does_not_depend_on_other_groups():
    positions = np.random.default_rng(2).random((4, 30, 5, 2)) * 5
    often = NEAR._replace(chances=np.array([0.3, 0.1]), gaps=np.array([1, 4]))
    among = lose(positions, often, generators(4))
    assert np.isnan(among).any()
    np.testing.assert_array_equal(lose(positions[:2], often, generators(2)), among[:2])
