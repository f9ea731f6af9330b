import numpy as np
import pytest

from turing_learning.coevolution import Judgments

GENUINE = np.full((2, 5), 0.7)
COUNTERFEIT = np.full((2, 3, 1), 0.2)


def test_an_output_of_one_half_is_judged_genuine_and_anything_below_is_not():
    half = np.float32(0.5)
    below = np.nextafter(half, np.float32(0))
    judgments = Judgments(np.array([[half, below]]), np.array([[[below], [half]]]))
    np.testing.assert_array_equal(judgments.genuine, [[True, False]])
    np.testing.assert_array_equal(judgments.counterfeit, [[[False], [True]]])


def test_decisions_are_computed_once():
    judgments = Judgments(GENUINE, COUNTERFEIT)
    assert judgments.genuine is judgments.genuine
    assert judgments.counterfeit is judgments.counterfeit


def test_selection_is_active_where_one_model_misleads_one_classifier():
    counterfeit = COUNTERFEIT.copy()
    counterfeit[1, 2, 0] = 0.5
    assert Judgments(GENUINE, counterfeit).selection == "active"


def test_selection_stops_where_every_classifier_accepts_every_model():
    assert Judgments(GENUINE, COUNTERFEIT + 0.5).selection == "all accepted"


def test_selection_stops_where_every_classifier_rejects_every_model():
    assert Judgments(GENUINE, COUNTERFEIT).selection == "all rejected"


def test_selection_does_not_depend_on_genuine_samples():
    assert Judgments(1 - GENUINE, COUNTERFEIT).selection == "all rejected"


@pytest.mark.parametrize("genuine", [GENUINE[0], GENUINE[:, :0]])
def test_genuine_outputs_of_a_wrong_shape_are_refused(genuine):
    with pytest.raises(
        ValueError, match=r"`genuine_outputs` must be of shape \(N, K\)( and not empty)?; got \("
    ):
        Judgments(genuine, COUNTERFEIT)


def test_counterfeit_outputs_of_a_wrong_shape_are_refused():
    with pytest.raises(
        ValueError,
        match=r"`counterfeit_outputs` must be of shape \(N, M, C\) = \(2, any, any\); got \(2, 3\)",
    ):
        Judgments(GENUINE, COUNTERFEIT[..., 0])


def test_outputs_of_different_numbers_of_classifiers_are_refused():
    with pytest.raises(
        ValueError, match=r"`counterfeit_outputs` must be .* = \(1, any, any\); got \(2, 3, 1\)"
    ):
        Judgments(GENUINE[:1], COUNTERFEIT)


@pytest.mark.parametrize("value", [np.nan, -0.1, 1.1, np.inf])
def test_an_output_that_is_no_output_of_a_sigmoid_is_refused_with_its_place(value):
    counterfeit = COUNTERFEIT.copy()
    counterfeit[1, 2, 0] = value
    with pytest.raises(
        ValueError,
        match=rf"`counterfeit_outputs` must be from 0 to 1; got {value} at \(1, 2, 0\) of",
    ):
        Judgments(GENUINE, counterfeit)
