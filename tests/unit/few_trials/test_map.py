import numpy as np
import pytest

from turing_learning.few_trials import MomentField, _map

TRUTH = np.array([0.3, -0.5])


def tried(count=400, width=1.0, seed=0):
    """Return models and moments that are 0 on average at the truth, one of them bent."""
    rng = np.random.default_rng(seed)
    models = rng.uniform(-width, width, (count, 2))
    away = models - TRUTH
    means = np.column_stack(
        (3 * away[:, 0], 2 * away[:, 1] + away[:, 0] ** 2, np.sin(2 * away.sum(axis=1)))
    )
    return models, means + rng.standard_normal(means.shape)


def field(count=400, **options):
    return MomentField(*tried(count), 0.0, np.random.default_rng(1), **options)


def grid(side=41):
    axis = np.linspace(-1, 1, side)
    return np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)


@pytest.mark.parametrize("inducing", [400, 60])
def test_the_density_is_highest_at_the_right_model(inducing):
    points = grid()
    best = points[np.argmax(field(inducing=inducing).log_density(points))]
    np.testing.assert_allclose(best, TRUTH, atol=0.12)


def test_expectations_are_within_their_errors():
    points = grid(9)
    mean, variance = field().predict(points)
    away = points - TRUTH
    truth = np.column_stack(
        (3 * away[:, 0], 2 * away[:, 1] + away[:, 0] ** 2, np.sin(2 * away.sum(axis=1)))
    )
    assert 0.3 < ((mean - truth) ** 2 / variance).mean() < 2.5


def test_where_nothing_was_tried_the_expectation_is_open():
    near, far = field().predict(np.array([[0.0, 0.0], [6.0, 6.0]]))[1]
    assert (far > 20 * near).all()


def test_moments_that_no_model_explains_temper_the_density():
    models, moments = tried()
    odd = np.column_stack((moments, 3.0 + 0 * moments[:, :1], -3.0 + 0 * moments[:, :1]))
    fine, wrong = (
        MomentField(models, values, 0.01, np.random.default_rng(1)) for values in (moments, odd)
    )
    for each in (fine, wrong):
        each.calibrate(grid())
    assert fine.misfit < 2 < 20 < wrong.misfit
    assert fine.temper == fine.misfit
    assert wrong.temper == 2


def test_a_restored_field_is_the_same_to_the_bit():
    first = field(inducing=50)
    first.calibrate(grid())
    np.testing.assert_array_equal(
        MomentField.restored(first.state()).log_density(grid()), first.log_density(grid())
    )


def test_an_incomplete_state_is_rejected():
    state = {name: value for name, value in field().state().items() if name != "misfit"}
    with pytest.raises(ValueError, match=r"`state` must hold an array 'misfit'; got"):
        MomentField.restored(state)


def exact(state, places):
    """Return mean and variance (N, Q) of the process of a field's state at places (N, 2), from all trials."""
    tried, places = state["parameters"] - state["center"], places - state["center"]
    mean, variance = np.empty((2, len(places), len(state["shapes"])))
    for q, (length, amplitude) in enumerate(state["shapes"]):

        def kernel(first, second, length=length, amplitude=amplitude):
            squares = ((first[:, None] - second) ** 2).sum(axis=2)
            return amplitude * np.exp(-0.5 * squares / length**2) + 100 * (1 + first @ second.T)

        covariance, cross = kernel(tried, tried) + np.eye(len(tried)), kernel(places, tried)
        mean[:, q] = cross @ np.linalg.solve(covariance, state["moments"][:, q])
        explained = (cross * np.linalg.solve(covariance, cross.T).T).sum(axis=1)
        variance[:, q] = np.diag(kernel(places, places)) - explained
    return mean, variance


def test_a_map_that_rests_on_few_trials_says_what_the_exact_process_says_near_the_truth():
    rng = np.random.default_rng(3)
    models = np.concatenate(
        (TRUTH + 0.02 * rng.standard_normal((700, 2)), rng.uniform(-1, 1, (100, 2)))
    )
    away = models - TRUTH
    means = np.column_stack(
        (40 * away[:, 0], 40 * away[:, 1] + 30 * away[:, 0] ** 2, 9 * np.sin(4 * away.sum(axis=1)))
    )
    few = MomentField(
        models,
        means + rng.standard_normal(means.shape),
        0.001,
        np.random.default_rng(1),
        inducing=60,
    )
    places = TRUTH + 0.02 * rng.standard_normal((40, 2))
    (mean, variance), (mean_of_all, variance_of_all) = (
        few.predict(places),
        exact(few.state(), places),
    )
    assert np.sqrt(((mean - mean_of_all) ** 2 / variance_of_all).mean()) < 1
    assert 0.8 < np.median(variance / variance_of_all) < 1.25


@pytest.mark.parametrize("seed", range(3))
def test_single_precision_changes_densities_little_and_serves_no_more_than_3000_samples(
    monkeypatch, seed
):
    rng = np.random.default_rng(seed)
    truth = np.array([0.3, -0.4, 0.1])
    models = truth + rng.choice([0.1, 1.0], (2000, 1)) * rng.uniform(-1, 1, (2000, 3))
    away = models - truth
    means = 20 * np.column_stack((np.sin(2 * away + np.roll(away, -1, axis=1)), away[:, 0] ** 2))
    moments = means + rng.standard_normal(means.shape)
    places = truth + rng.choice([0.003, 0.01, 0.03], (4000, 1)) * rng.standard_normal((4000, 3))

    def change(samples, least_noise):
        usual = MomentField(models, moments, 1 / samples, np.random.default_rng(1))
        density = usual.log_density(places)
        monkeypatch.setattr(_map, "LEAST_SINGLE_NOISE", least_noise)
        other = MomentField.restored(usual.state()).log_density(places)
        monkeypatch.undo()
        near = density > density.max() - 20
        return np.abs(density - other)[near].max()

    assert 0 < change(3000, np.inf) < 0.6
    # these are evaluated in double precision; in single precision they would change
    assert change(100_000, np.inf) == 0 < change(100_000, 0.0)
