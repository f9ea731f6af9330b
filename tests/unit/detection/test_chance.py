"""P-values of mean scores."""

from itertools import combinations
from math import comb

import numpy as np
import pytest

from turing_learning.detection._chance import CHANCE_DRAWS, genuine_samples_needed, p_values

RNG = np.random.default_rng(8)


@pytest.mark.parametrize("known", [19, 20, 99, 100, 198, 199])
@pytest.mark.parametrize("share", [0.01, 0.05, 0.3])
def test_a_single_sample_is_low_if_it_is_below_the_score_at_the_place_of_the_share(known, share):
    genuine = RNG.random(known)
    place = int(share * (known + 1) + 1e-9)  # counted from 1; 0 for none
    below = np.append(genuine, 0.0) < (np.sort(genuine)[place - 1] if place else -np.inf)
    np.testing.assert_array_equal(
        p_values(genuine, np.append(genuine, 0.0)[:, None]) <= share, below
    )


def test_an_equal_score_is_not_below():
    genuine = np.repeat([0.2, 0.8], [4, 95])
    assert p_values(genuine, np.array([[0.2], [0.2 - 1e-6]])).tolist() == [0.05, 0.01]
    assert p_values(np.ones(50), np.ones((1, 3))) == 1


@pytest.mark.parametrize(("known", "samples"), [(9, 1), (6, 2), (2, 5), (12, 4)])
def test_all_choices_are_tried_where_they_are_few(known, samples):
    genuine, own = RNG.random(known), RNG.random((3, samples)) * 0.7
    expected = [
        np.mean(
            [sum(some) <= sum(each) + 1e-12 for some in combinations([*genuine, *each], samples)]
        )
        for each in own
    ]
    np.testing.assert_allclose(p_values(genuine, own), expected)


def test_many_choices_are_drawn():
    own = np.linspace(0, 0.15, 4)[None]
    genuine = np.arange(40) / 200
    exact = np.mean(
        [sum(some) <= own.sum() + 1e-12 for some in combinations([*genuine, *own[0]], 4)]
    )
    assert comb(44, 4) > CHANCE_DRAWS
    assert p_values(genuine, own)[0] == pytest.approx(
        exact, abs=4 * np.sqrt(exact * (1 - exact) / CHANCE_DRAWS)
    )


def test_choices_are_counted_where_nothing_is_lower():
    """However rare they are, where drawing does not see them."""
    genuine = np.repeat([0.1, 0.2, 0.8], [1, 1, 198])
    own = np.array([np.zeros(10), np.repeat([0.0, 0.1], [8, 2]), np.full(10, 0.1)])
    expected = np.array([1, comb(3, 2), comb(11, 10)]) / comb(210, 10)
    np.testing.assert_allclose(p_values(genuine, own), expected)


@pytest.mark.parametrize("share", [0.2, 0.05, 0.01, 1e-3])
@pytest.mark.parametrize("samples", [1, 2, 10])
def test_the_number_that_is_needed_is_enough_and_no_less_is(share, samples):
    needed = genuine_samples_needed(share, samples)
    enough, fewer = (
        p_values(np.arange(n) + 1.0, np.zeros((1, samples)))[0] for n in (needed, needed - 1)
    )
    assert enough <= share < fewer
