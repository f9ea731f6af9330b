import numpy as np
import pytest
from family_motion import order, spread, steps, turns

from turing_learning.families import Couzin

GROUP = Couzin(individuals=12, steps=150, start_side_cm=10.0)
MODEL = {
    "speed": 3.0,
    "turning_rate": 2.0,
    "repulsion_radius": 0.0,
    "orientation_width": 0.0,
    "attraction_width": 0.0,
    "noise": 0.0,
}


def move(family=GROUP, **values):
    parameters = np.tile(list((MODEL | values).values()), (6, 1))
    return family.simulate(parameters, np.random.default_rng(1))


def test_parameters_are_named_in_their_order():
    assert list(GROUP.parameters) == list(MODEL)


def test_repulsion_alone_spreads_a_group_until_nobody_is_near():
    last = move(repulsion_radius=6.0)[:, -1]
    distance = np.linalg.norm(last[:, None] - last[:, :, None], axis=-1) + 100 * np.eye(12)
    assert distance.min() >= 6.0


def test_orientation_alone_aligns_a_group():
    assert (order(move(orientation_width=100.0)) > 0.99).all()


def test_attraction_alone_keeps_a_group_together():
    together, apart = (spread(move(attraction_width=width))[:, -1] for width in (100.0, 0.0))
    assert (together < 10).all()
    assert (apart > 20).all()


def test_who_is_alone_and_without_noise_goes_straight():
    assert np.abs(turns(move())).max() < 1e-6


def test_nobody_turns_faster_than_the_turning_rate():
    angles = np.abs(turns(move(attraction_width=100.0, noise=0.3)))
    assert angles.max() == pytest.approx(2.0 * GROUP.interval_s, abs=1e-6)


def test_everybody_moves_at_the_given_speed():
    lengths = np.linalg.norm(steps(move(attraction_width=100.0, noise=0.1)), axis=-1)
    np.testing.assert_allclose(lengths, 0.3)


def test_repulsion_comes_before_all_else():
    pair = Couzin(individuals=2, steps=30, start_side_cm=1.0)
    last = move(pair, repulsion_radius=5.0, attraction_width=100.0)[:, :12]
    np.testing.assert_array_equal(last, move(pair, repulsion_radius=5.0)[:, :12])


def wish(places, directions, borders, **settings):
    family = Couzin(individuals=len(places), **settings)
    return family._wish(
        np.array([places], complex), np.array([directions], complex), np.reshape(borders, (3, 1, 1))
    )[0]


def test_who_is_behind_is_not_seen_but_repels():
    places, directions = [0, -2], [1, 1]
    assert wish(places, directions, [0, 0, 5])[0] == 0
    assert wish(places, directions, [3, 3, 5])[0] == 1


def test_with_the_whole_field_of_view_who_is_right_behind_is_seen():
    assert wish([0, -2], [1, 1], [0, 0, 5], field_of_view_rad=2 * np.pi)[0] == -1


def test_a_zone_begins_where_the_one_before_ends():
    # another to the left, whose direction is backwards: away from it, along with it, toward it, and no wish
    for distance, expected in ((0.99, -1j), (1, -1), (1.99, -1), (2, 1j), (3, 1j), (3.01, 0)):
        assert wish([0, distance * 1j], [1, -1], [1, 2, 3])[0] == expected


def test_orientation_and_attraction_add_up():
    np.testing.assert_allclose(wish([0, 1.5j, 2.5], [1, -1, 1j], [1, 2, 3])[0], -1 + 1)
    np.testing.assert_allclose(wish([0, 1.5j, 2.5], [1, 1j, 1j], [1, 2, 3])[0], 1j + 1)


@pytest.mark.parametrize("angle", [0.0, 7.0, np.nan])
def test_a_field_of_view_beyond_a_circle_is_refused(angle):
    with pytest.raises(
        ValueError, match=f"`field_of_view_rad` must be above 0 and at most 2 pi; got {angle}"
    ):
        Couzin(field_of_view_rad=angle)
