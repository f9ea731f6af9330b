import numpy as np
import pytest

from turing_learning.analysis import decision_accuracy


def test_agents_and_models_have_half_of_the_weight_each():
    # two agents of three are judged genuine at least once; one model of four is never judged genuine
    agents = [[1, 0], [0, 0], [1, 1]]
    models = [[0, 0], [0, 1], [1, 0], [1, 1]]
    assert decision_accuracy(agents, models) == pytest.approx((2 / 3 + 1 / 4) / 2)


def test_a_single_genuine_judgment_makes_an_agent():
    ten = np.zeros((1, 10), dtype=bool)
    assert decision_accuracy([[1]], ten) == 1.0
    ten[0, 7] = True
    assert decision_accuracy([[1]], ten) == 0.5


def test_each_classifier_has_an_accuracy():
    agents, models = np.ones((3, 5, 10)), np.zeros((3, 6, 10))
    models[1] = 1
    np.testing.assert_array_equal(decision_accuracy(agents, models), [1.0, 0.5, 1.0])
