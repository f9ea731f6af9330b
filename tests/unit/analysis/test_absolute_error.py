import numpy as np
import pytest

from turing_learning.analysis import absolute_error, mean_absolute_error

TRUTH = [-0.7, -1.0, 1.0, -1.0]


def test_absolute_error_is_the_distance_in_each_parameter():
    np.testing.assert_allclose(absolute_error([-0.6, -1.0, 0.5, 1.0], TRUTH), [0.1, 0, 0.5, 2])


def test_mean_absolute_error_is_the_mean_over_the_parameters():
    assert mean_absolute_error([-0.6, -1.0, 0.5, 1.0], TRUTH) == pytest.approx(0.65)


def test_many_models_are_compared_at_once():
    models = np.random.default_rng(0).random((2, 3, 4))
    assert absolute_error(models, TRUTH).shape == (2, 3, 4)
    assert mean_absolute_error(models, TRUTH)[1, 2] == mean_absolute_error(models[1, 2], TRUTH)


@pytest.mark.parametrize("compute", [absolute_error, mean_absolute_error])
@pytest.mark.parametrize(("inferred", "truth"), [([1.0], TRUTH), (1.0, TRUTH), ([1.0], [[1.0]]), ([], [])])
def test_shapes_that_do_not_fit_are_refused(compute, inferred, truth):
    with pytest.raises(ValueError, match=r"`estimate` must be of shape \(..., P\) and `truth` of shape \(P,\); got"):
        compute(inferred, truth)


def test_an_estimate_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="`estimate` must be finite; got nan"):
        absolute_error([np.nan, 0, 0, 0], TRUTH)


def test_a_truth_that_is_not_finite_is_refused():
    with pytest.raises(ValueError, match="`truth` must be finite; got inf"):
        mean_absolute_error([0.0], [np.inf])
