import numpy as np
import pytest

from turing_learning.few_trials._jurors import train_moments

TRUTH = np.array([0.2, -0.3])


def judged(models, seed, noise=0.5, jurors=60):
    """Return outputs of jurors for one sample of each model: squashed mixtures of the parameters and noise."""
    rng, fixed = np.random.default_rng(seed), np.random.default_rng(99)
    seen = np.column_stack((models, models**2)) + noise * rng.standard_normal((len(models), 4))
    return 1 / (
        1 + np.exp(-(seen @ fixed.standard_normal((4, jurors)) + fixed.standard_normal(jurors)))
    )


def trained(count=800, seed=0):
    models = np.random.default_rng(seed).uniform(-1, 1, (count, 2))
    system = judged(np.tile(TRUTH, (2000, 1)), seed + 1)
    return models, train_moments(
        models, judged(models, seed + 2), system, np.random.default_rng(seed)
    )


def test_moments_are_zero_for_right_models_and_not_for_others():
    models, moments = trained(4000)
    near = np.abs(models - TRUTH).max(axis=1) < 0.15
    errors = moments.values[near].std(axis=0) / np.sqrt(near.sum())
    assert (np.abs(moments.values[near].mean(axis=0)) < 4 * errors).all()
    opposite = np.abs(models + TRUTH).max(axis=1) < 0.15
    assert np.abs(moments.values[opposite].mean(axis=0)).max() > 0.3


def test_noise_has_variance_one_on_average():
    models, moments = trained(4000)
    near = np.abs(models - TRUTH).max(axis=1) < 0.15
    assert 0.7 < np.mean(moments.values[near].var(axis=0)) < 1.4


def test_what_a_trial_tells_is_measured_out_of_fold():
    rng = np.random.default_rng(0)
    models = rng.uniform(-1, 1, (300, 3))  # of the third parameter nobody sees anything
    outputs, system = judged(models[:, :2], 1), judged(np.tile(TRUTH, (500, 1)), 2)
    explained = train_moments(models, outputs, system, rng).explained
    assert (explained[:2] > 0.4).all()
    assert explained[2] < 0.05


@pytest.mark.parametrize("size", [1e-10, 1e-4, 1.0, 1e6])
def test_jurors_of_classifiers_that_say_the_same_are_solved_in_single_precision(size):
    models = np.random.default_rng(0).uniform(-1, 1, (200, 2))
    outputs, system = judged(models, 1, jurors=1), judged(np.tile(TRUTH, (500, 1)), 2, jurors=1)
    single, double = (
        train_moments(
            models,
            np.repeat(size * outputs, 600, axis=1).astype(precision),
            np.repeat(size * system, 600, axis=1).astype(precision),
            np.random.default_rng(0),
        )
        for precision in (np.float32, np.float64)
    )
    np.testing.assert_allclose(single.values, double.values, atol=1e-3)


@pytest.mark.parametrize("wrong", [np.nan, -np.inf])
def test_outputs_that_are_not_finite_are_refused(wrong):
    models = np.random.default_rng(0).uniform(-1, 1, (100, 2))
    outputs = judged(models, 1)
    outputs[3, 5] = wrong
    system = judged(np.tile(TRUTH, (50, 1)), 2)
    with (
        np.errstate(invalid="ignore"),
        pytest.raises(
            np.linalg.LinAlgError, match=r"must have a finite solution; got .* nan to nan"
        ),
    ):
        train_moments(models, outputs, system, np.random.default_rng(0))
