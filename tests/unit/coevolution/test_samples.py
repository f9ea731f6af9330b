import numpy as np
import pytest

from turing_learning.coevolution import Samples

GENUINE = np.zeros((4, 10, 2))
COUNTERFEIT = np.zeros((3, 1, 10, 2))


def test_samples_keep_the_arrays_without_copying():
    samples = Samples(GENUINE, COUNTERFEIT)
    assert samples.genuine is GENUINE
    assert samples.counterfeit is COUNTERFEIT


def test_any_finite_magnitude_and_precision_is_accepted():
    largest = np.full((4, 10, 2), np.finfo(np.float32).max, dtype=np.float32)
    assert Samples(largest, -COUNTERFEIT + np.finfo(float).max).genuine.dtype == np.float32


@pytest.mark.parametrize("genuine", [GENUINE[0], GENUINE[:0], GENUINE[:, :0]])
def test_genuine_samples_of_a_wrong_shape_are_refused(genuine):
    with pytest.raises(
        ValueError, match=r"`genuine` must be of shape \(K, T, D\)( and not empty)?; got \("
    ):
        Samples(genuine, COUNTERFEIT)


@pytest.mark.parametrize("counterfeit", [COUNTERFEIT[0], COUNTERFEIT[:, :0]])
def test_counterfeit_samples_of_a_wrong_shape_are_refused(counterfeit):
    with pytest.raises(
        ValueError,
        match=r"`counterfeit` must be of shape \(M, C, T, D\) = \(any, any, 10, 2\)( and not empty)?; got \(",
    ):
        Samples(GENUINE, counterfeit)


@pytest.mark.parametrize("counterfeit", [COUNTERFEIT[:, :, :9], COUNTERFEIT[..., :1]])
def test_samples_that_disagree_in_time_or_signals_are_refused(counterfeit):
    message = r"`counterfeit` must be of shape \(M, C, T, D\) = \(any, any, 10, 2\); got \(3, 1, "
    with pytest.raises(ValueError, match=message):
        Samples(GENUINE, counterfeit)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_value_that_is_not_finite_is_refused_with_its_place(value):
    counterfeit = COUNTERFEIT.copy()
    counterfeit[2, 0, 7, 1] = value
    with pytest.raises(
        ValueError, match=rf"`counterfeit` must be finite; got {value} at \(2, 0, 7, 1\) of \(M, C,"
    ):
        Samples(GENUINE, counterfeit)


@pytest.mark.parametrize(
    ("genuine", "received"),
    [(GENUINE.astype(int), "int64"), (GENUINE.tolist(), "list"), (None, "NoneType")],
)
def test_anything_but_an_array_of_floats_is_refused(genuine, received):
    with pytest.raises(TypeError, match=f"`genuine` must be an array of floats; got {received}"):
        Samples(genuine, COUNTERFEIT)
