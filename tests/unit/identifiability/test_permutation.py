import numpy as np
import pytest

from turing_learning.identifiability._two_sample import group_means, permutation_test


def test_scores_that_differ_have_the_smallest_p_value():
    found = permutation_test(
        np.linspace(0.8, 1, 12), np.linspace(0, 0.2, 12), np.random.default_rng(0)
    )
    assert found.difference == pytest.approx(0.8)
    assert found.p_value == 1 / 1000
    assert found.difference > found.critical


def test_genuine_scores_below_the_others_are_no_evidence():
    found = permutation_test(
        np.linspace(0, 0.2, 12), np.linspace(0.8, 1, 12), np.random.default_rng(0)
    )
    assert found.p_value == 1


def test_scores_that_are_all_the_same_are_no_evidence():
    found = permutation_test(np.full(5, 0.5), np.full(9, 0.5), np.random.default_rng(0))
    assert (found.difference, found.p_value, found.critical) == (0, 1, 0)


def test_the_p_value_is_at_most_a_twentieth_from_the_critical_difference_on():
    rng = np.random.default_rng(3)
    genuine, counterfeit = rng.normal(size=30), rng.normal(size=30)
    critical = permutation_test(genuine, counterfeit, np.random.default_rng(1)).critical
    shift = critical - (genuine.mean() - counterfeit.mean())
    below, above = (
        permutation_test(genuine + shift * factor, counterfeit, np.random.default_rng(1)).p_value
        for factor in (0.8, 1.3)
    )
    assert above <= 0.06 < below


def test_the_p_value_and_the_critical_difference_say_the_same():
    """Also next to it, where one permutation more or less decides."""
    near = 0
    for seed in range(400):
        rng = np.random.default_rng(seed)
        found = permutation_test(rng.normal(0.6, size=10), rng.normal(size=15), rng)
        assert (found.p_value <= 0.05) == (found.difference > found.critical)
        near += abs(found.p_value - 0.05) < 0.002
    assert near >= 3


def test_false_alarms_stay_near_the_nominal_rate_where_few_genuine_groups_vary_more():
    alarms = 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        genuine, counterfeit = rng.normal(size=8, scale=2.0), rng.normal(size=20)
        alarms += permutation_test(genuine, counterfeit, rng, permutations=199).p_value <= 0.1
    # Binomial(300, 0.1) exceeds 48 once in two thousand times; without the standard error the rate is 0.22
    assert 12 <= alarms <= 48


def test_groups_have_the_mean_of_their_scores():
    np.testing.assert_allclose(
        group_means(np.array([1.0, 2, 3, 4]), np.array([5, 2, 5, 2])), [3, 2]
    )


@pytest.mark.parametrize(
    ("genuine", "permutations", "message"),
    [
        (1, 99, "`genuine` must hold at least 2 groups; got 1."),
        (3, 18, "`permutations` must be an integer of at least 19; got 18."),
    ],
)
def test_too_little_is_refused(genuine, permutations, message):
    with pytest.raises(ValueError, match=message):
        permutation_test(
            np.zeros(genuine), np.zeros(4), np.random.default_rng(0), permutations=permutations
        )
