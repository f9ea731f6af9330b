import numpy as np
import pytest

from turing_learning.analysis import dispersion, least_dispersion


def test_two_touching_disks_have_a_dispersion_of_a_half():
    assert dispersion([[0.0, 0.0], [7.0, 0.0]], radius_cm=3.5) == pytest.approx(0.5)


def test_dispersion_is_a_sum_and_not_a_mean():
    # corners of a square of 10 cm: four times (5^2 + 5^2), over 4 * 5^2
    square = [[0, 0], [10, 0], [10, 10], [0, 10]]
    assert dispersion(square, radius_cm=5.0) == pytest.approx(2.0)
    assert dispersion(square * 2, radius_cm=5.0) == pytest.approx(4.0)


def test_every_moment_of_every_trial_has_a_dispersion():
    positions = np.random.default_rng(0).normal(size=(3, 4, 11, 2))
    found = dispersion(positions, radius_cm=1.0)
    assert found.shape == (3, 4)
    assert found[2, 1] == pytest.approx(float(dispersion(positions[2, 1], radius_cm=1.0)))


def test_dispersion_does_not_depend_on_where_the_swarm_is_and_how_it_is_turned():
    positions = np.random.default_rng(1).normal(size=(50, 2))
    turn = np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    assert dispersion(positions @ turn + 123.0, 3.5) == pytest.approx(
        float(dispersion(positions, 3.5))
    )


@pytest.mark.parametrize(
    ("disks", "least"),
    [(1, 0.0), (2, 0.5), (3, 1.0), (7, 6.0), (10, 13.5), (40, 220.3), (50, 343.5)],
)
def test_the_least_dispersion_is_that_of_the_best_known_packing(disks, least):
    assert least_dispersion(disks) == pytest.approx(least, abs=0.05)
