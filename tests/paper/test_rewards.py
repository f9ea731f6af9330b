"""Equations 1 to 4 of the paper, worked by hand."""

import numpy as np
import pytest

from turing_learning.coevolution import (
    Judgments,
    classifier_reward,
    model_reward,
    sensitivity,
    specificity,
)

# N = 2 classifiers, K = 4 genuine samples, M = 3 models with one sample each; 1: judged genuine
JUDGMENTS = Judgments(
    genuine_outputs=np.array([[1.0, 1.0, 1.0, 0.0], [0.0, 1.0, 0.0, 1.0]]),
    counterfeit_outputs=np.array([[[1.0], [0.0], [0.0]], [[1.0], [1.0], [0.0]]]),
)


def test_equation_1_the_quality_of_a_model_is_the_share_of_the_classifiers_that_it_misleads():
    # model 1 misleads both classifiers, model 2 the second, model 3 none
    np.testing.assert_array_equal(model_reward(JUDGMENTS), [2 / 2, 1 / 2, 0 / 2])


def test_equation_2_the_quality_of_a_classifier_is_the_mean_of_specificity_and_sensitivity():
    # (3/4 + 2/3) / 2 = 17/24 and (2/4 + 1/3) / 2 = 5/12
    np.testing.assert_allclose(classifier_reward(JUDGMENTS), [17 / 24, 5 / 12], rtol=1e-15)


def test_equation_3_specificity_is_the_share_of_genuine_samples_judged_genuine():
    np.testing.assert_array_equal(specificity(JUDGMENTS), [3 / 4, 2 / 4])


def test_equation_4_sensitivity_is_the_share_of_counterfeit_samples_judged_counterfeit():
    np.testing.assert_array_equal(sensitivity(JUDGMENTS), [2 / 3, 1 / 3])


def test_samples_of_one_model_have_equal_weight():
    # N = 2, M = 2, C = 3: model 1 has 2 of 3 and 0 of 3 samples accepted, model 2 has 3 of 3 and 1 of 3
    counterfeit = np.array([[[1, 1, 0], [1, 1, 1]], [[0, 0, 0], [0, 1, 0]]], dtype=float)
    judgments = Judgments(np.ones((2, 1)), counterfeit)
    np.testing.assert_array_equal(model_reward(judgments), [2 / 6, 4 / 6])
    np.testing.assert_array_equal(sensitivity(judgments), [1 / 6, 5 / 6])


@pytest.mark.parametrize("answer", [0.0, 1.0])
def test_a_classifier_that_gives_every_sample_the_same_answer_has_the_quality_one_half(answer):
    judgments = Judgments(np.full((1, 7), answer), np.full((1, 3, 1), answer))
    np.testing.assert_array_equal(classifier_reward(judgments), [0.5])


def test_rewards_are_exact_at_the_size_of_the_paper():
    rng = np.random.default_rng(0)
    genuine, counterfeit = rng.random((100, 1000)), rng.random((100, 100, 1))
    judgments = Judgments(genuine, counterfeit)
    accepted = [sum(bool(counterfeit[i, j, 0] >= 0.5) for i in range(100)) for j in range(100)]
    np.testing.assert_array_equal(model_reward(judgments), np.array(accepted) / 100)
    correct = [sum(bool(value >= 0.5) for value in row) for row in genuine]
    np.testing.assert_array_equal(specificity(judgments), np.array(correct) / 1000)
