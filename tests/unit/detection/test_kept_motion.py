"""Motion that a run in a laboratory keeps to calibrate detectors with."""

import numpy as np
import pytest

from turing_learning.detection import observed_calibration

ESTIMATE = np.array([0.5, -0.5])


def samples(count, first=0):
    """Samples (count, 3, 2) that hold nothing but their number."""
    return np.tile(np.arange(first, first + count, dtype=float)[:, None, None], (1, 3, 2))


def keep(learned=40, held_out=10, models=None):
    models = np.array([[0.5, -0.4], [0.0, 0.0], [0.9, -0.9]]) if models is None else models
    return observed_calibration(
        learned=samples(learned),
        held_out=samples(held_out, first=100),
        replicas=samples(len(models), first=200),
        models=models,
        estimate=ESTIMATE,
    )


def test_as_many_are_kept_that_were_learned_from_as_were_not():
    genuine = keep()["genuine"][:, 0, 0]
    assert len(genuine) == 20
    assert (genuine[:10] < 40).all()
    assert (genuine[0], genuine[9]) == (0, 39)
    np.testing.assert_array_equal(genuine[10:], np.arange(100, 110))


def test_at_most_a_thousand_of_each_are_kept():
    assert len(keep(learned=3000, held_out=2000)["genuine"]) == 2000


def test_models_near_the_estimate_are_not_called_abnormal():
    np.testing.assert_array_equal(keep()["abnormal"][:, 0, 0], [201, 202])


def test_the_first_of_many_models_are_kept():
    kept = keep(models=np.zeros((500, 2)))
    np.testing.assert_array_equal(kept["abnormal"][:, 0, 0], np.arange(200, 400))


@pytest.mark.parametrize(
    "few", [{"held_out": 1}, {"learned": 1}, {"models": np.array([[0.5, -0.5]])}]
)
def test_nothing_is_kept_where_one_kind_is_missing(few):
    assert keep(**few) is None
