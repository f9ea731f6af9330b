import numpy as np
import pytest
from family_motion import order, spread, steps, turns

from turing_learning.families import Boids
from turing_learning.families._kinds import allocated, limited

FLOCK = Boids(individuals=12, steps=150, start_side_cm=10.0, radius_cm=1000.0)


def move(family=FLOCK, speed=5.0, separation=0.0, alignment=0.0, cohesion=0.0):
    return family.simulate(
        np.tile([speed, separation, alignment, cohesion], (6, 1)), np.random.default_rng(1)
    )


def test_alignment_alone_aligns_a_flock():
    aligned, free = (order(move(alignment=strength)) for strength in (5.0, 0.0))
    assert aligned.mean() > 0.95  # not all: who has gone far hardly counts any more
    assert (
        free.mean() < 0.4
    )  # of 12 random directions the mean resultant has a root mean square of 0.29


def test_separation_alone_drives_boids_apart():
    pushed, free = (move(separation=strength) for strength in (50.0, 0.0))
    assert (spread(pushed)[:, 10] > spread(free)[:, 10]).all()


def test_cohesion_alone_keeps_a_flock_together():
    together, apart = (spread(move(cohesion=strength))[:, -1] for strength in (5.0, 0.0))
    assert (together < 15).all()
    assert (apart > 40).all()


def test_without_urges_boids_go_straight_at_the_largest_speed():
    positions = move()
    assert np.abs(turns(positions)).max() < 1e-6
    np.testing.assert_allclose(np.linalg.norm(steps(positions), axis=-1), 0.5)


def test_speeds_stay_between_the_slowest_and_the_largest():
    lengths = (
        np.linalg.norm(steps(move(separation=50.0, alignment=2.0, cohesion=5.0)), axis=-1)
        / FLOCK.interval_s
    )
    assert lengths.min() >= 2.5 - 1e-9
    assert lengths.max() <= 5.0 + 1e-9


def test_who_is_beyond_the_radius_is_not_perceived():
    lonely = Boids(individuals=2, steps=20, start_side_cm=1e6)
    assert np.abs(turns(move(lonely, separation=100.0, alignment=5.0, cohesion=5.0))).max() < 1e-3


def requests(places, velocities, strengths=(1.0, 1.0, 1.0)):
    family = Boids(individuals=len(places))
    found = family._requests(
        np.array([places], complex),
        np.array([velocities], complex),
        np.reshape(strengths, (3, 1, 1)),
    )
    return np.array(found)[:, 0, 0]


def test_two_boids_request_what_the_formulas_say():
    np.testing.assert_allclose(
        requests([0, 2], [1, 1j], (8.0, 3.0, 5.0)), [-8 / 4, 3 * (1j - 1), 5 * 2]
    )


def test_the_nearer_counts_by_the_inverse_square():
    # weights 1 and 1/4: mean velocity (1 * 1j + 1/4 * 6) / (5/4), mean way (1 + 1/4 * 2j) / (5/4)
    expected = [-(1 + 1j / 4), (1j + 1.5) / 1.25, (1 + 0.5j) / 1.25]
    np.testing.assert_allclose(requests([0, 1, 2j], [0, 1j, 6]), expected)


def test_boids_at_the_same_place_request_nothing():
    np.testing.assert_array_equal(requests([1, 1], [1, 1j]), 0)


def test_the_most_urgent_is_granted_first_and_the_last_is_trimmed():
    granted = allocated(
        [np.array([3j, 9j, 0]), np.array([4.0, 4.0, 1.0]), np.array([-1.0, -1.0, -1.0])],
        np.array(5.0),
    )
    np.testing.assert_allclose(granted, [3j + 2, 5j, 0])


def test_rest_stays_rest():
    np.testing.assert_array_equal(
        limited(np.array([0j, 8j, 1]), np.array(2.0), np.array(4.0)), [0, 4j, 2]
    )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"radius_cm": 0.0}, "`radius_cm` must be a finite number above 0; got 0.0"),
        (
            {"acceleration_per_s": -1.0},
            "`acceleration_per_s` must be a finite number above 0; got -1.0",
        ),
        ({"slowest": 1.5}, r"`slowest` must be in \[0, 1\]; got 1.5"),
    ],
)
def test_settings_that_break_a_rule_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        Boids(**settings)
