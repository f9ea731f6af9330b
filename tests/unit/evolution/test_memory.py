import numpy as np
import pytest

from turing_learning.evolution import EvolutionStrategy, FitnessMemory


def strategy(decay=0.0, start=0):
    memory = FitnessMemory(4, decay, start) if decay else None
    return EvolutionStrategy(2, parents=2, offspring=2, seed=3, memory=memory)


def test_one_generation_ranks_as_the_fitness_does():
    fitness = np.array([3.0, -1.0, 2.0, 8.0])
    scores = FitnessMemory(4, 0.9).score(0, fitness)
    np.testing.assert_array_equal(np.argsort(scores), np.argsort(fitness))


def test_the_score_is_the_weighted_mean_of_the_differences_and_of_one_zero():
    memory = FitnessMemory(2, 0.5)
    memory.score(0, np.array([4.0, 0.0]))
    scores = memory.score(0, np.array([1.0, 3.0]))
    np.testing.assert_allclose(scores, np.array([0.5 * 2 - 1, 0.5 * -2 + 1]) / (0.5 + 1 + 1))


def test_what_is_not_to_be_remembered_is_forgotten():
    memory = FitnessMemory(2, 0.9, start=9)
    memory.score(0, np.array([5.0, 0.0]))
    np.testing.assert_allclose(memory.score(0, np.array([0.0, 1.0])), [-0.25, 0.25])


def test_survivors_take_their_past_along_and_newcomers_have_none():
    memory = FitnessMemory(3, 1.0)
    memory.score(0, np.array([0.0, 3.0, 6.0]))
    memory.keep(np.array([2, 1]))
    np.testing.assert_array_equal(memory.totals, [3, 0, 0])
    np.testing.assert_array_equal(memory.weights, [1, 1, 0])


def test_a_parent_with_a_good_past_outlives_a_lucky_child():
    forgetful, remembering = strategy(), strategy(0.9)
    for each in (forgetful, remembering):
        each.ask()
        each.tell(np.array([9.0, 0.0, 0.0, 0.0]))
        each.ask()
        each.tell(np.array([9.0, 0.0, 0.0, 0.0]))
    veteran = forgetful.ask()[0]
    np.testing.assert_array_equal(remembering.ask()[0], veteran)
    for each in (forgetful, remembering):
        each.tell(np.array([1.0, 0.0, 2.0, 1.5]))
    assert (forgetful.ask()[:2] != veteran).any(axis=1).all()
    np.testing.assert_array_equal(remembering.ask()[0], veteran)


def test_before_its_start_a_memory_changes_nothing():
    plain, late = strategy(), strategy(0.9, 3)
    fitness = np.random.default_rng(1).normal(size=(3, 4))
    for told in fitness:
        np.testing.assert_array_equal(plain.ask(), late.ask())
        plain.tell(told)
        late.tell(told)


def test_told_fitness_comes_back_as_the_scores_that_ranked():
    without, remembering = strategy(), strategy(0.5)
    fitness = np.array([4.0, 0.0, 1.0, 3.0])
    for each in (without, remembering):
        each.ask()
    np.testing.assert_array_equal(without.tell(fitness), fitness)
    np.testing.assert_allclose(remembering.tell(fitness), (fitness - 2) / 2)


def test_a_restored_strategy_remembers_as_the_one_that_was_never_stopped():
    rng, whole = np.random.default_rng(8), strategy(0.9)
    for _ in range(5):
        whole.ask()
        whole.tell(rng.normal(size=4))
    restored = strategy(0.9)
    restored.restore(whole.state())
    for told in rng.normal(size=(4, 4)):
        np.testing.assert_array_equal(restored.ask(), whole.ask())
        np.testing.assert_array_equal(restored.tell(told), whole.tell(told))


@pytest.mark.parametrize("decay", [-0.1, 1.1, np.nan])
def test_a_memory_outside_its_range_is_refused(decay):
    with pytest.raises(
        ValueError, match=r"`decay` must be a finite number of at least 0 and of at most 1; got"
    ):
        FitnessMemory(4, decay)


def test_a_negative_start_is_refused():
    with pytest.raises(ValueError, match=r"`start` must be an integer of at least 0; got -1"):
        FitnessMemory(4, 0.5, -1)
