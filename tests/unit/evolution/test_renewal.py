import numpy as np
import pytest

from turing_learning.evolution import EvolutionStrategy, RenewedOptimizer


def make(k):
    return EvolutionStrategy(2, parents=2, offspring=2, seed=[5, k])


def populations(optimizer, generations):
    result = []
    for _ in range(generations):
        result.append(optimizer.ask())
        optimizer.tell(result[-1].sum(axis=1))
    return result


def test_a_fresh_optimizer_takes_over_after_each_interval():
    asked = populations(RenewedOptimizer(make, 3), 7)
    for k in range(2):
        np.testing.assert_array_equal(asked[3 * k], make(k).ask())
    np.testing.assert_array_equal(asked[1], populations(make(0), 2)[1])


def test_after_the_last_renewal_the_optimizer_stays():
    asked = populations(RenewedOptimizer(make, 3, last=3), 10)
    np.testing.assert_array_equal(asked[9], populations(make(1), 7)[6])


@pytest.mark.parametrize("stop", [1, 3, 4, 6])
def test_a_restored_optimizer_goes_on_as_if_nothing_had_happened(stop):
    whole = populations(RenewedOptimizer(make, 3), 8)
    first = RenewedOptimizer(make, 3)
    populations(first, stop)
    second = RenewedOptimizer(make, 3)
    second.restore(first.state())
    np.testing.assert_array_equal(populations(second, 8 - stop), whole[stop:])


def test_an_interval_below_one_is_refused():
    with pytest.raises(ValueError, match="`interval` must be an integer of at least 1; got 0"):
        RenewedOptimizer(make, 0)


def test_a_state_without_the_number_of_generations_is_refused():
    with pytest.raises(ValueError, match="`state` must hold an array 'renewal'; got"):
        RenewedOptimizer(make, 3).restore(make(0).state())
