import numpy as np
import pytest

from turing_learning.analysis import polarization


def test_all_in_one_direction_is_one_and_opposite_directions_cancel():
    same, opposite = [[2.0, 0], [5, 0]], [[2.0, 0], [-5, 0]]
    np.testing.assert_allclose(polarization(np.array([same, opposite])), [1, 0], atol=1e-12)


def test_a_right_angle_lies_between():
    assert polarization(np.array([[[1.0, 0], [0, 3]]]))[0] == pytest.approx(np.sqrt(0.5))


def test_who_rests_or_is_absent_does_not_count():
    directions = np.array(
        [[[1.0, 0], [0, 0], [2, 0]], [[1.0, 0], [-1, 0], [2, 0]], [[1.0, 0], [0, 0], [0, 0]]]
    )
    present = np.array([[True, True, True], [True, False, True], [True, True, True]])
    np.testing.assert_allclose(polarization(directions, present), [1, 1])
