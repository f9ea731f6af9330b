import numpy as np
import pytest
from scipy.special import stdtrit

from turing_learning.analysis import interval, pooled_estimate, pooled_interval, r_hat


def wandering(rng, count, runs, generations=300, correlation=0.93):
    """Series (count, K, W) of standard deviation 1 that hold about ten independent values each."""
    series = [rng.normal(size=(count, runs))]
    for shock in rng.normal(size=(generations - 1, count, runs)):
        series.append(correlation * series[-1] + np.sqrt(1 - correlation**2) * shock)
    return np.moveaxis(series, 0, -1)


def still(*values, generations=5):
    """Runs (K, W, 1) that do not move."""
    return np.repeat(values, generations).reshape(-1, generations, 1).astype(float)


def test_the_estimate_is_the_median_of_the_estimates_of_the_runs():
    typical = np.array([[1, 2, 99], [4, 5, 5], [7, 7, 8]])[..., None] * [1.0, -1.0]
    np.testing.assert_array_equal(pooled_estimate(typical), [5, -5])


@pytest.mark.parametrize("values", [(1, 2, 3, 6), (3, 5), (-2, 0.5, 0.6, 0.7, 40)])
def test_of_runs_that_do_not_move_it_is_the_prediction_interval_of_the_next(values):
    count, middle = len(values), np.median(values)
    half = stdtrit(count - 1, 0.95) * np.sqrt(1 + 1 / count) * np.std(values, ddof=1)
    np.testing.assert_allclose(pooled_interval(still(*values)), [[middle - half, middle + half]])


@pytest.mark.parametrize(
    "value", [2, 0.1, 0.7]
)  # the mean of equal numbers need not be that number
def test_where_nothing_moves_and_no_run_differs_the_interval_is_not_known(value):
    np.testing.assert_array_equal(pooled_interval(still(value, value, value)), [[np.nan, np.nan]])


@pytest.mark.parametrize(
    ("values", "generations"), [((2, 2, 2), 5), ((1, 2), 5), ((0.1, 0.7, 0.3), 300), ((1, 2), 1)]
)
def test_where_no_run_moves_it_is_not_known_whether_they_agree(values, generations):
    np.testing.assert_array_equal(r_hat(still(*values, generations=generations)), [np.nan])


def test_of_one_generation_each_nine_of_ten_of_one_more_run_are_held():
    # 4000 repetitions: standard error 0.005. Each value is region and wandering at once, and so is the truth.
    rng = np.random.default_rng(9)
    values = 2 * rng.normal(size=(5, 4000)) + rng.normal(size=(5, 4000))
    low, high = pooled_interval(values[:4, None]).T
    assert np.mean((low <= values[4]) & (values[4] <= high)) == pytest.approx(0.9, abs=0.02)


def test_a_run_that_does_not_move_says_where_it_has_settled_and_nothing_of_wandering():
    moving = wandering(np.random.default_rng(10), 1, 2)[0][..., None]
    moving -= np.median(moving, axis=1, keepdims=True)  # all three settle at 0: no scatter
    pooled = np.concatenate([moving, still(0, generations=300)])
    np.testing.assert_array_equal(pooled_interval(pooled), pooled_interval(moving))
    aside = pooled_interval(np.concatenate([moving, still(8, generations=300)]))[0]
    scatter = stdtrit(2, 0.95) * np.sqrt(4 / 3) * np.std([0, 0, 8], ddof=1)
    np.testing.assert_allclose(np.abs(aside), np.hypot(pooled_interval(moving)[0], scatter))


def test_a_run_that_does_not_move_does_not_make_the_others_seem_to_agree_less():
    moving = wandering(np.random.default_rng(11), 200, 3)
    middle = np.median(moving, axis=(1, 2))
    pooled = np.concatenate([moving, np.broadcast_to(middle[:, None, None], (200, 1, 300))], axis=1)
    agreeing, without = r_hat(np.moveaxis(pooled, 0, 2)), r_hat(np.moveaxis(moving, 0, 2))
    assert np.isfinite(agreeing).all()
    assert np.median(agreeing) <= np.median(without)


@pytest.mark.parametrize("runs", [2, 4, 8])
@pytest.mark.parametrize("scatter", [0.0, 1.0, 5.0, 50.0])
def test_it_holds_nine_truths_of_ten_wherever_runs_settle(runs, scatter):
    # 300 repetitions: standard error 0.017. The truth is to the runs what one more run would be, at one of its generations.
    rng = np.random.default_rng(runs)
    series = wandering(rng, 300, runs) + scatter * rng.normal(size=(300, runs, 1))
    truth = scatter * rng.normal(size=300) + rng.normal(size=300)
    low, high = pooled_interval(np.moveaxis(series, 0, 2)).T
    assert 0.85 <= np.mean((low <= truth) & (truth <= high)) <= 0.985
    alone = np.array([interval(own[0][:, None], 300)[0] for own in series]).T
    if scatter >= 5:
        assert np.mean((alone[0] <= truth) & (truth <= alone[1])) < 0.3


def test_four_runs_that_agree_leave_an_interval_as_wide_as_that_of_one():
    series = wandering(np.random.default_rng(3), 200, 4)
    widths = np.diff(pooled_interval(np.moveaxis(series, 0, 2)))
    alone = [np.diff(interval(own[0][:, None], 300)) for own in series]
    assert 0.95 < np.median(widths) / np.median(alone) < 1.15


def test_the_order_of_the_runs_says_nothing():
    # by the autocorrelation of the runs one after the other, those whose medians rise would count as one slow series
    series = wandering(np.random.default_rng(4), 1, 4)[0] + np.array([[1], [2], [3], [4]])
    expected = pooled_interval(series[..., None])
    for order in ([3, 2, 1, 0], [1, 3, 0, 2]):
        np.testing.assert_allclose(pooled_interval(series[order][..., None]), expected)


def test_runs_that_wander_slowly_leave_a_wider_interval():
    fast, slow = (
        wandering(np.random.default_rng(8), 100, 2, correlation=correlation)
        for correlation in (0.5, 0.99)
    )
    quiet = [
        series - np.median(series, axis=2, keepdims=True) for series in (fast, slow)
    ]  # no scatter of the runs
    ranges = [np.diff(np.percentile(series, (5, 95), axis=(1, 2)), axis=0)[0] for series in quiet]
    growths = [
        np.diff(pooled_interval(np.moveaxis(series, 0, 2)))[:, 0] / width
        for series, width in zip(quiet, ranges, strict=True)
    ]
    np.testing.assert_allclose(growths[0], 1, atol=0.03)
    assert np.median(growths[1]) > 1.08


def test_the_ends_are_as_far_away_as_the_wandering_goes_to_each_side():
    skewed = np.random.default_rng(5).exponential(size=(4, 500, 1))
    (low, high), middle = pooled_interval(skewed)[0], pooled_estimate(skewed)[0]
    assert high - middle > 2.5 * (middle - low) > 0


def test_r_hat_is_one_where_runs_agree_and_large_where_they_share_no_value():
    series = wandering(np.random.default_rng(6), 200, 4)
    agreeing = r_hat(np.moveaxis(series, 0, 2))
    assert np.median(agreeing) < 1.1
    assert np.mean(agreeing > 1.2) < 0.05
    apart = r_hat(np.moveaxis(series + 10 * np.arange(4)[:, None], 0, 2))
    np.testing.assert_allclose(apart, 3.05, atol=0.02)
    np.testing.assert_allclose(
        r_hat(series[0, :2, :, None] + 10 * np.arange(2)[:, None, None]), 2.13, atol=0.02
    )


def test_r_hat_does_not_depend_on_the_scale_nor_an_excursion():
    series = wandering(np.random.default_rng(7), 1, 4)[0][..., None] + np.arange(4.0)[:, None, None]
    expected = r_hat(series)
    np.testing.assert_allclose(r_hat(np.exp(series)), expected)
    series[2, 40:50] = 1e12
    np.testing.assert_allclose(r_hat(series), expected, rtol=0.1)
