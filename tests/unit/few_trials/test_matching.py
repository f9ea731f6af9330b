"""Matching on a case with a known answer: classifiers whose outputs are linear in a normally distributed sample."""

import numpy as np
import pytest

from turing_learning.few_trials import _likelihood, match

LOW, HIGH = np.array([-2.0, 0.0, 5.0]), np.array([2.0, 4.0, 9.0])
TRUTH = np.array([0.5, 1.0, 6.0])
MIXING = np.random.default_rng(3).normal(size=(12, 2)) / 12


def outputs(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the outputs (12, S) of classifiers for samples whose mean is the first two parameters; the third does nothing."""
    samples = parameters[:, :2] + rng.normal(size=(len(parameters), 2))
    return 0.5 + (MIXING @ samples.T) / 4 + 0.002 * rng.normal(size=(12, len(parameters)))


def matched(
    seed: int, genuine: int = 100, counterfeit: int = 600, alien: float = 0.0, alike: int = 1
):
    """Match samples of the truth: with an output `alien` to all models, each `alike` times."""
    rng = np.random.default_rng(seed)
    parameters = rng.uniform(LOW, HIGH, (counterfeit, 3))
    genuine_outputs = outputs(np.tile(TRUTH, (genuine, 1)), rng)
    genuine_outputs[0] += alien
    genuine_outputs = np.repeat(genuine_outputs, alike, axis=1)
    return match(
        parameters,
        outputs(parameters, rng),
        genuine_outputs,
        low=LOW,
        high=HIGH,
        start=(LOW + HIGH) / 2,
        spread=(HIGH - LOW) / 2,
        samples_per_trial=alike,
        rng=rng,
    )


def test_the_solution_is_as_good_as_the_mean_of_the_samples():
    solution = matched(1)
    assert np.abs(solution.estimate - TRUTH)[:2].max() < 4 * np.sqrt(1 / 100 + 1 / 200)
    assert 0.1 < np.sqrt(solution.covariance[0, 0]) < 0.2


def test_a_parameter_without_effect_gets_its_whole_range():
    solution = matched(2)
    assert solution.identified.tolist() == [True, True, False]
    assert solution.interval_low[2] < 5.5
    assert solution.interval_high[2] > 8.5


def test_no_interval_is_given_where_the_classifiers_still_tell_the_model_from_the_agents():
    solution = matched(4, alien=0.05)
    assert solution.p_value < 0.005
    assert not solution.passed_checks
    assert np.isnan(solution.interval_low).all()
    assert np.isfinite(solution.estimate).all()


@pytest.mark.parametrize("alike", [1, 4])
def test_samples_of_one_trial_say_no_more_than_the_trial(alike):
    solutions = [matched(seed, genuine=25, alike=alike) for seed in range(5)]
    assert sum(solution.passed_checks for solution in solutions) >= 4
    widths = [np.sqrt(solution.covariance[0, 0]) for solution in solutions]
    assert 0.2 < np.median(widths) < 0.35  # of the mean of 25 samples: 0.2


@pytest.mark.parametrize("farther", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_many_samples_much_alike_leave_intervals_as_wide_as_the_genuine_samples_say(seed, farther):
    """Three quarters of 4,500 samples lie within two standard errors of the truth, the others within one of a sample."""
    rng = np.random.default_rng([5, seed])
    reach = np.where(np.arange(4500) < 1100, 10.0 ** -rng.uniform(0, 1, 4500), 0.1)
    parameters = np.clip(TRUTH[:2] + reach[:, None] * rng.normal(size=(4500, 2)), LOW[:2], HIGH[:2])
    solution = match(
        parameters,
        outputs(parameters, rng),
        outputs(np.tile(TRUTH[:2], (400, 1)), rng),
        low=LOW[:2],
        high=HIGH[:2],
        start=TRUTH[:2],
        spread=np.full(2, 0.02),
        farther=farther,
        rng=rng,
    )
    exact = 1.645 / np.sqrt(400)
    assert solution.passed_checks
    assert (solution.interval_high - solution.interval_low) / 2 / exact == pytest.approx(
        1.0, rel=0.6
    )


def test_the_same_generator_gives_the_same_solution():
    assert np.array_equal(matched(3).draws, matched(3).draws)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parameters": np.zeros((10, 3))}, "`counterfeit_outputs` must be of shape"),
        ({"genuine_outputs": np.zeros((5, 4))}, "`genuine_outputs` must be of shape"),
        ({"high": LOW}, "`low` must be below `high`"),
        ({"spread": np.zeros(3)}, "`spread` must be positive"),
        ({"genuine_outputs": np.zeros((12, 1))}, "`genuine_outputs` must be of at least 2 samples"),
    ],
)
def test_what_does_not_fit_is_rejected(change, message):
    given = {
        "parameters": np.zeros((40, 3)),
        "counterfeit_outputs": np.zeros((12, 40)),
        "genuine_outputs": np.zeros((12, 5)),
        "low": LOW,
        "high": HIGH,
        "start": LOW,
        "spread": HIGH - LOW,
    } | change
    with pytest.raises(ValueError, match=message):
        match(**given, rng=np.random.default_rng(0))


def test_where_the_canary_has_lost_the_middle_of_its_range_the_draws_are_those_with_it(monkeypatch):
    monkeypatch.setattr(
        _likelihood.Likelihood, "without_canary", lambda self, z: np.full(len(z), -np.inf)
    )
    solution = matched(0)
    assert np.isfinite(solution.draws).all()
    assert solution.draws.std(axis=0).min() > 0
