import numpy as np
import pytest

from turing_learning.analysis import estimate, interval


def test_the_estimate_is_the_median_over_the_last_generations():
    typical = np.array([[100.0, 100.0], [1.0, 30.0], [2.0, 10.0], [6.0, 20.0]])
    np.testing.assert_array_equal(estimate(typical, window=3), [2.0, 20.0])


def test_a_hundred_generations_are_the_default():
    typical = np.r_[np.full(500, 9.0), np.full(51, 1.0), np.full(49, 5.0)][:, None]
    np.testing.assert_array_equal(estimate(typical), [1.0])


def test_all_generations_are_taken_where_there_are_fewer():
    np.testing.assert_array_equal(estimate(np.array([[1.0], [3.0]]), window=100), [2.0])


def test_an_excursion_does_not_count():
    typical = np.full((100, 1), 0.5)
    typical[20:60] = 1e12
    np.testing.assert_array_equal(estimate(typical), [0.5])


@pytest.mark.parametrize("typical", [np.zeros(3), np.zeros((0, 3)), np.zeros((3, 0))])
def test_a_history_of_another_shape_is_refused(typical):
    with pytest.raises(ValueError, match=r"`typical_models` must be of shape \(G, P\) and not empty; got"):
        estimate(typical)


def test_a_history_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="`typical_models` must be finite; got nan"):
        estimate(np.array([[np.nan]]))


@pytest.mark.parametrize("window", [0, -5])
def test_a_window_without_generations_is_refused(window):
    with pytest.raises(ValueError, match=f"`window` must be at least 1; got {window}"):
        estimate(np.zeros((3, 1)), window=window)


def test_the_interval_is_the_central_range_of_the_last_generations():
    typical = np.r_[np.full(50, 1e6), np.arange(101.0)][:, None] * [1.0, -2.0]
    np.testing.assert_allclose(interval(typical, window=101), [[5.0, 95.0], [-190.0, -10.0]])


def test_the_interval_holds_the_estimate():
    typical = np.random.default_rng(2).normal(size=(400, 3))
    middle, ends = estimate(typical, 300), interval(typical, 300)
    assert ((ends[:, 0] < middle) & (middle < ends[:, 1])).all()


def test_an_interval_of_nothing_is_refused():
    with pytest.raises(ValueError, match=r"`typical_models` must be of shape \(G, P\) and not empty; got"):
        interval(np.zeros((0, 3)))
