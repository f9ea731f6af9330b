"""Walls."""

import numpy as np
import pytest
from family_motion import steps

from turing_learning.families import FAMILIES, Couzin, Particles, Vicsek
from turing_learning.families._family import offsets, reflected

PARTICLES = {name: make for name, make in FAMILIES.items() if issubclass(make, Particles)}


@pytest.mark.parametrize("make", PARTICLES.values(), ids=PARTICLES)
def test_nobody_leaves_the_tank_and_the_whole_tank_is_used(make):
    unbounded = {"period_cm": None} if make is Vicsek else {}
    family = make(tank_cm=(30.0, 8.0), steps=100, **unbounded)
    highest = np.array([[parameter.high for parameter in family.parameters.values()]])
    positions = family.simulate(np.tile(highest / 2, (20, 1)), np.random.default_rng(1))
    assert (positions >= 0).all()
    assert (positions <= [30, 8]).all()
    np.testing.assert_allclose(np.ptp(positions, axis=(0, 1, 2)), [30, 8], rtol=0.05)


def test_a_wall_reflects_as_a_mirror():
    places, directions = reflected(
        np.array([11 + 3j, -1 - 2j, 4 + 4j]), np.array([1 + 2j, -3 - 4j, 5 + 6j]), (10.0, 5.0)
    )
    np.testing.assert_allclose(places, [9 + 3j, 1 + 2j, 4 + 4j])
    np.testing.assert_array_equal(directions, [-1 + 2j, 3 + 4j, 5 + 6j])


def test_two_reflections_in_one_step_leave_the_direction():
    places, directions = reflected(np.array([23 + 1j]), np.array([1 + 1j]), (10.0, 5.0))
    np.testing.assert_allclose(places, [3 + 1j])
    np.testing.assert_array_equal(directions, [1 + 1j])


def test_a_path_goes_on_in_the_mirrored_direction():
    lone = Couzin(individuals=1, tank_cm=(20.0, 10.0), steps=200)
    moved = steps(lone.simulate(np.array([[5.0, 1, 0, 0, 0, 0]]), np.random.default_rng(1)))[
        0, :, 0
    ]
    away = np.abs(
        moved[(np.abs(np.linalg.norm(moved, axis=-1) - 0.5)) < 1e-9]
    )  # steps without a wall
    assert len(away) > 150
    np.testing.assert_allclose(away, np.broadcast_to(away[0], away.shape))


def test_the_way_to_another_is_that_to_the_nearest_image():
    way = offsets(np.array([[1 + 1j, 9 + 6j]]), period=10.0)
    np.testing.assert_allclose(way[0], [[0, -2 + 5j], [2 - 5j, 0]])


@pytest.mark.parametrize("size", [(10.0,), (10.0, 0.0), (np.inf, 1.0), 5.0])
def test_a_tank_without_two_sides_is_refused(size):
    with pytest.raises(
        ValueError, match="`tank_cm` must be two finite numbers above 0, or None; got "
    ):
        Couzin(tank_cm=size)
