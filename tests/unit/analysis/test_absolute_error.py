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
