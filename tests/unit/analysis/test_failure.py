import numpy as np
import pytest

from turing_learning.analysis import name_failure

TRUTH = np.array([0.5, 1.0, 1.0, 0.5, 0.1, 0.5])


@pytest.mark.parametrize(
    ("estimate", "name"),
    [
        (TRUTH + 0.05, "good"),
        ([0.5, 1.0, 1.0, 0.5, 12.0, -11.0], "runaway"),
        ([1.0, 0.5, 0.5, 1.0, 0.1, 0.5], "states exchanged"),
        ([0.5, 1.0, 1.0, 0.5, 0.95, 0.52], "I = 2 as I = 1"),
        ([0.5, 1.0, 1.0, 0.5, 0.9, -0.9], "other"),
    ],
)
def test_failures_have_names(estimate, name):
    assert name_failure(np.array(estimate), TRUTH) == name


@pytest.mark.parametrize(
    ("estimate", "name"),
    [
        ([-0.7, -1.0, 1.0, -1.0, 1.0], "good"),
        ([-0.7, -1.0, 1.0, -1.0, 4.0], "field of view"),
        ([1.0, -1.0, -0.7, -1.0, 4.0], "states exchanged"),
        ([-0.7, -1.0, 1.0, -5.0, 1.0], "runaway"),
    ],
)
def test_failures_of_models_with_a_field_of_view_have_names(estimate, name):
    assert name_failure(np.array(estimate), np.array([-0.7, -1.0, 1.0, -1.0, 1.05])) == name
