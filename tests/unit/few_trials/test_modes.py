"""Solutions are apart where models between them are unlikely."""

import numpy as np

from turing_learning.few_trials import modes


def sampled(log_likelihood, rng, count=400):
    points = rng.uniform(-1, 1, (20000, 2))
    weights = np.exp(log_likelihood(points))
    return points[rng.choice(len(points), count, p=weights / weights.sum())]


def normal(points, center, width):
    return -0.5 * (((points - center) / width) ** 2).sum(axis=1)


def test_two_peaks_are_two_solutions_the_heavier_one_first():
    def both(points):
        return np.logaddexp(
            normal(points, [0.5, -0.5], 0.1) + np.log(3), normal(points, [-0.5, 0.5], 0.1)
        )

    draws = sampled(both, np.random.default_rng(1))
    number = modes(draws, both)
    assert set(number) == {0, 1}
    assert (draws[number == 0, 0] > 0).all()
    assert (draws[number == 1, 0] < 0).all()
    assert 0.65 < (number == 0).mean() < 0.85


def test_a_bent_ridge_is_one_solution():
    def ridge(points):
        radius = np.hypot(points[:, 0] + 1, points[:, 1] + 1)
        return -0.5 * ((radius - 1.2) / 0.03) ** 2

    draws = sampled(ridge, np.random.default_rng(2))
    assert not modes(draws, ridge).any()


def test_one_peak_is_one_solution_whatever_the_scales():
    def peak(points):
        return normal(points, [0.3, 0.2], np.array([1e-3, 0.2]))

    rng = np.random.default_rng(3)
    draws = np.array([0.3, 0.2]) + np.array([1e-3, 0.2]) * rng.standard_normal((400, 2))
    assert not modes(draws, peak).any()


def test_a_few_stray_draws_are_no_solution_of_their_own():
    def both(points):
        return np.logaddexp(normal(points, [0.5, -0.5], 0.1), normal(points, [-0.5, 0.5], 0.05) - 2)

    rng = np.random.default_rng(4)
    draws = np.concatenate((
        [0.5, -0.5] + 0.1 * rng.standard_normal((400, 2)),
        [-0.5, 0.5] + 0.05 * rng.standard_normal((8, 2)),
    ))  # fmt: skip
    assert not modes(draws, both).any()
