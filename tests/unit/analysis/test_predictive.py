"""Samples of an estimate are held against genuine ones by statistics that no run uses."""

import numpy as np
import pytest

from turing_learning.analysis import predictive_check, resemblance

NAMES = ("x", "y")


def walk(parameters, rng):
    """Return samples (M, 30, 2) of a mean and a spread: x is noise, y follows the last x."""
    mean, spread = parameters.T[:, :, None]
    x = mean + spread * rng.standard_normal((len(parameters), 30))
    y = 0.5 * np.roll(x, 1, axis=1) + rng.standard_normal(x.shape)
    return np.stack((x, y), axis=-1)


def check(genuine, draws, simulate=walk, rng=None):
    rng = np.random.default_rng(7) if rng is None else rng
    others = draws.mean(axis=0) + 3 * (draws[:200] - draws.mean(axis=0))
    return predictive_check(
        genuine,
        simulate(draws[:100], rng),
        draws[:100],
        draws,
        names=NAMES[: genuine.shape[2]],
        rng=rng,
        others=(simulate(others, rng), others),
    )


def draws_around(center, width, rng):
    return np.asarray(center) + width * rng.standard_normal((400, len(center)))


def test_samples_of_the_right_model_resemble_the_genuine_ones():
    rng = np.random.default_rng(1)
    p_values = []
    for _ in range(40):
        genuine = walk(np.tile([2.0, 1.0], (60, 1)), rng)
        p_values.append(check(genuine, draws_around([2.0, 1.0], 0.02, rng), rng=rng).p_value)
    # 40 runs of a level of at most 5 %: 7 or more below it happen once in 300
    assert (np.array(p_values) < 0.05).sum() <= 6
    assert min(p_values) > 0.001


@pytest.mark.parametrize(("center", "statistic"), [([2.6, 1.0], "x"), ([2.0, 1.5], "x")])
def test_a_narrow_estimate_far_off_is_told(center, statistic):
    rng = np.random.default_rng(2)
    genuine = walk(np.tile([2.0, 1.0], (60, 1)), rng)
    told = check(genuine, draws_around(center, 0.02, rng))
    assert told.p_value < 0.005
    assert statistic in told.statistic or "direction" in told.statistic


def test_a_mechanism_that_the_model_lacks_is_told():
    rng = np.random.default_rng(3)
    genuine = walk(np.tile([2.0, 1.0], (60, 1)), rng)

    def without(parameters, rng):
        samples = walk(parameters, rng)
        samples[:, :, 1] = rng.permuted(samples[:, :, 1], axis=1)
        return samples

    told = check(genuine, draws_around([2.0, 1.0], 0.02, rng), without)
    assert told.p_value < 0.005
    assert told.statistic == "correlation of x with the next y"


def test_an_estimate_that_leaves_much_open_may_be_right():
    rng = np.random.default_rng(4)
    genuine = walk(np.tile([2.0, 1.0], (60, 1)), rng)
    wide = np.column_stack((rng.uniform(1.6, 2.6, 400), rng.uniform(0.85, 1.3, 400)))
    assert check(genuine, wide).p_value > 0.005


@pytest.mark.parametrize(("center", "right"), [([2.0, 1.0], True), ([2.1, 1.0], False)])
def test_a_simulator_without_noise_has_to_surround_the_genuine_samples(center, right):
    rng = np.random.default_rng(5)

    def swing(parameters, rng):
        return (parameters[:, :1] * np.sin(parameters[:, 1:] * np.arange(20) / 5))[:, :, None]

    genuine = swing(np.tile([2.0, 1.0], (20, 1)), rng)
    assert (check(genuine, draws_around(center, 1e-3, rng), swing).p_value > 0.005) == right


def test_samples_of_one_step_are_told_by_their_directions():
    rng = np.random.default_rng(6)

    def line(parameters, rng):
        # two signals that go together: their difference is what the second parameter changes
        common = parameters[:, :1] + 5 * rng.standard_normal((len(parameters), 1))
        return np.column_stack(
            (common, common + parameters[:, 1:] + 0.2 * rng.standard_normal((len(parameters), 1)))
        )[:, None]

    genuine = line(np.tile([0.0, 0.0], (80, 1)), rng)
    assert check(genuine, draws_around([0.0, 0.3], 0.01, rng), line).p_value < 0.005
    assert check(genuine, draws_around([0.0, 0.0], 0.02, rng), line).p_value > 0.005


def test_few_samples_of_many_signals_do_not_reject_the_right_model():
    rng = np.random.default_rng(8)

    def signals(parameters, rng):
        noise = rng.standard_normal((len(parameters), 30, 4))
        return parameters[:, None, :1] + noise * [1, 1, 2, 2]

    rejected = 0
    for _ in range(8):
        genuine = signals(np.full((20, 1), 5.0), rng)
        draws = draws_around([5.0], 0.05, rng)
        check = predictive_check(
            genuine,
            signals(draws[:30], rng),
            draws[:30],
            draws,
            names=("a", "b", "c", "d"),
            rng=rng,
            others=(signals(draws[-60:], rng), draws[-60:]),
        )
        rejected += check.p_value < 0.01
    # before: eight of eight
    assert rejected <= 1


def test_equal_values_of_the_right_model_are_not_told_by_their_precision():
    # a run stores its samples in single precision, where a seventh is another number
    def counts(parameters, rng):
        return rng.poisson(parameters[:, :, None], (len(parameters), 30, 1)) - 1 / 7

    p_values = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        genuine = counts(np.full((30, 1), 0.3), rng)
        draws = np.abs(draws_around([0.3], 0.02, rng))
        others = np.abs(draws_around([0.3], 0.1, rng))
        result = predictive_check(
            genuine,
            counts(draws[:30], rng),
            draws[:30],
            draws,
            names=("x",),
            rng=rng,
            others=(counts(others, rng).astype(np.float32), others),
        )
        p_values.append(result.p_value)
    assert np.mean(np.array(p_values) <= 0.05) <= 0.15


def test_two_sets_of_samples_of_one_system_are_told_as_often_as_the_p_value_says():
    p_values = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        # 25 samples, and more statistics than that
        both = rng.standard_normal((2, 25, 20, 2)).cumsum(axis=2)
        p_values.append(resemblance(*both, ("x", "y"), rng))
    # of 30 six or more would be below 0.05 in one of 300 cases
    assert np.mean(np.array(p_values) <= 0.05) < 0.2
