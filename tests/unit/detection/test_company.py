"""What individuals of a recording do beside each other."""

import numpy as np
import pytest

from turing_learning.detection._company import company, paths_of, usual_motion
from turing_learning.trajectories import Trajectories


def walks(frames=600, individuals=3, seed=0):
    rng = np.random.default_rng(seed)
    course = np.cumsum(rng.normal(0, 0.3, (frames, individuals)), axis=0)
    return np.cumsum(np.stack((np.cos(course), np.sin(course)), axis=-1), axis=0)


def test_own_motion_and_that_beside_others_by_hand():
    # the first goes to the right at 2 cm/s, the others rest: one 3 cm to the left of its start, one 4 cm ahead of it
    paths = np.zeros((4, 3, 2))
    paths[:, 0, 0] = np.arange(4)
    paths[:, 1] = [0.0, 3.0]
    paths[:, 2] = [4.0, 0.0]
    (found,) = company(paths, [0], 2.0)
    assert found.shape == (3, 16)
    (
        speed,
        turn,
        acceleration,
        _,
        _,
        distance,
        bearing,
        middle,
        ahead,
        border,
        center,
        _,
        _,
        _,
        _,
        _,
    ) = found.T
    np.testing.assert_allclose(speed, 2.0)
    np.testing.assert_allclose([turn, acceleration], 0.0)
    np.testing.assert_allclose(
        distance, [3.0, 3.0, 2.0]
    )  # from the second step on the one ahead is nearer
    np.testing.assert_allclose(bearing, [np.pi / 2, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(middle[0], 2.5)
    np.testing.assert_allclose(ahead[0], 0.8)
    np.testing.assert_allclose(border, 0.0)
    np.testing.assert_allclose(center, np.hypot([2.0, 1.0, 0.0], 1.5))


@pytest.mark.parametrize(("delay_s", "followed"), [(1.0, True), (5.0, True), (9.0, False)])
def test_who_does_what_another_did_some_seconds_ago_follows_and_who_is_ahead_does_not(
    delay_s, followed
):
    whole, fps = walks(frames=700), 10.0
    paths, begin = whole[100:].copy(), 100 - int(delay_s * fps)
    paths[:, 1] = whole[begin : begin + 600, 0] + 3.0
    copy, leader = (each[100:, 13].mean() for each in company(paths, (1, 0), fps))
    assert (copy > 0.9) == followed
    assert leader < 0.8


@pytest.mark.parametrize(("delay_s", "follows"), [(1.0, True), (5.0, True), (9.0, False)])
def test_who_is_where_another_was_is_near_its_earlier_places_by_hand(delay_s, follows):
    whole, fps = walks(frames=700), 10.0
    paths, begin = whole[100:].copy(), 100 - int(delay_s * fps)
    paths[:, 1] = whole[begin : begin + 600, 0] + [0.3, 0.4]
    copy, leader = (each[:, 14:] for each in company(paths, (1, 0), fps))
    if follows:
        np.testing.assert_allclose(
            np.exp(copy[300:, 0]), 0.5 + usual_motion(paths, fps).offset[4], atol=1e-6
        )
        assert copy[:, 1].mean() < -2.0
    else:
        assert copy[:, 0].mean() > np.log(2.0)
    assert leader[:, 0].mean() > np.log(2.0)


def test_the_nearest_earlier_places_are_those_of_all_others_and_times():
    paths, fps = walks(frames=80, individuals=4, seed=3), 5.0  # shorter than a stretch
    (found,) = company(paths, [2], fps)
    places, least = paths[:-1], []
    for other in (0, 1, 3):
        for lag in range(1, 31):
            apart = np.hypot(*(places[lag:, 2] - places[:-lag, other]).T)
            least.append((np.mean(apart**2), lag, apart))
    _, lag, apart = min(least, key=lambda each: each[0])
    distances = np.exp(found[:, 14])
    offset = distances[lag:] - apart  # a hundredth of the median over all individuals
    assert np.ptp(offset) < 1e-9
    assert 0 < offset[0] < 0.05 * apart.mean()
    np.testing.assert_allclose(distances[:lag] - offset[0], apart.mean())


def test_turns_and_distances_are_relative_to_what_is_usual_at_the_same_time():
    paths, fps = walks(individuals=5) + np.random.default_rng(2).normal(0, 0.1, (600, 5, 2)), 10.0
    found = np.stack(company(paths, range(5), fps))
    for size, relative in ((1, 3), (2, 4), (5, 11), (7, 12)):
        sizes = np.abs(found[..., size])
        logs = np.log(sizes + 0.01 * np.median(sizes) + 1e-9)
        np.testing.assert_allclose(found[..., relative], logs - np.median(logs, axis=0), atol=1e-9)
    np.testing.assert_allclose(
        company(7.0 * paths, [2], fps)[0][:, [3, 4, 11, 12, 15]],
        found[2][:, [3, 4, 11, 12, 15]],
        atol=1e-5,
    )
    wild = paths.copy()
    wild[:, 1] += np.random.default_rng(1).normal(0, 3.0, paths[:, 1].shape)
    (other,) = company(wild, [1], fps, usual_motion(paths, fps))  # of the recording without it
    assert other[:, 4].mean() > 1.0
    assert other[:, 4].mean() > company(wild, [1], fps)[0][:, 4].mean()


def test_gaps_are_bridged_by_straight_motion():
    positions = np.array([[[0.0, 0.0]], [[9.0, 9.0]], [[2.0, 4.0]]])
    recording = Trajectories(positions, np.array([[True], [False], [True]]), 10.0, ("a",))
    np.testing.assert_allclose(paths_of(recording)[1, 0], [1.0, 2.0])
