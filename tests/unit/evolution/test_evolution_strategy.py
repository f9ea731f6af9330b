import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from turing_learning.evolution import EvolutionStrategy
from turing_learning.evolution._evolution_strategy import fittest


def without_mutation(parents, offspring, dimension):
    """A strategy whose step sizes are 0, so that children are recombinations of their parents and nothing else."""
    strategy = EvolutionStrategy(dimension, parents=parents, offspring=offspring, minimum_step_size=0.0)
    state = strategy.state()
    strategy.restore({**state, "step_sizes": np.zeros_like(state["step_sizes"])})
    return strategy


def test_the_first_population_lies_in_the_initial_range():
    population = EvolutionStrategy(2, initial_low=[-1.0, 5.0], initial_high=[0.0, 6.0]).ask()
    assert (population >= [-1, 5]).all()
    assert (population <= [0, 6]).all()


def test_all_individuals_start_with_the_initial_step_sizes():
    steps = EvolutionStrategy(2, initial_step_size=[1.0, 2.0]).step_sizes
    np.testing.assert_array_equal(steps, np.tile([1.0, 2.0], (100, 1)))


def test_the_fittest_become_parents_in_the_order_of_their_fitness():
    strategy = EvolutionStrategy(2, parents=3, offspring=5)
    population = strategy.ask()
    strategy.tell(np.array([0, 7, 1, 2, 9, 3, 8, 4]))
    np.testing.assert_array_equal(strategy.ask()[:3], population[[4, 6, 1]])


def test_parents_keep_their_step_sizes():
    strategy = EvolutionStrategy(2, parents=2, offspring=4)
    strategy.ask()
    strategy.tell(np.arange(6))
    strategy.ask()
    steps = strategy.step_sizes
    strategy.tell(np.array([0, 0, 0, 5, 0, 4]))
    strategy.ask()
    np.testing.assert_array_equal(strategy.step_sizes[:2], steps[[3, 5]])


def test_parents_lose_their_place_when_they_are_scored_low():
    strategy = EvolutionStrategy(1, parents=2, offspring=2)
    strategy.ask()
    strategy.tell(np.array([4, 3, 2, 1]))
    population = strategy.ask()
    strategy.tell(np.array([0, 0, 1, 1]))
    np.testing.assert_array_equal(strategy.ask()[:2], population[2:])


def test_of_equals_the_first_come_first():
    np.testing.assert_array_equal(fittest(np.array([1.0, 2.0, 1.0, 2.0, 2.0]), 4), [1, 3, 4, 0])


def test_a_population_of_equals_keeps_its_parents():
    strategy = EvolutionStrategy(3, parents=4, offspring=4)
    parents = strategy.ask()[:4]
    for _ in range(100):
        strategy.tell(np.ones(8))
        assert np.array_equal(strategy.ask()[:4], parents)


def test_children_take_each_parameter_from_one_of_the_parents():
    strategy = without_mutation(3, 200, 5)
    parents = strategy.ask()[:3]
    strategy.tell(-np.arange(203))
    children = strategy.ask()[3:]
    assert (children[:, None] == parents[None]).any(axis=1).all()


def test_children_of_one_parent_are_its_copies_without_mutation():
    strategy = without_mutation(1, 20, 5)
    parent = strategy.ask()[7]
    fitness = np.zeros(21)
    fitness[7] = 1
    strategy.tell(fitness)
    np.testing.assert_array_equal(strategy.ask(), np.tile(parent, (21, 1)))


def test_no_step_size_falls_below_its_minimum():
    strategy = EvolutionStrategy(2, parents=5, offspring=500, minimum_step_size=[0.9, 0.1])
    strategy.ask()
    strategy.tell(np.zeros(505))
    strategy.ask()
    assert strategy.step_sizes[:, 0].min() == 0.9
    assert strategy.step_sizes[:, 1].min() > 0.1


def test_parameters_and_step_sizes_have_an_upper_limit():
    strategy = EvolutionStrategy(2, parents=5, offspring=500)
    state = strategy.state()
    state["population"][:] = [1e12, -1e12]
    state["step_sizes"][:] = 1e6
    strategy.restore(state)
    strategy.ask()
    strategy.tell(np.zeros(505))
    population = strategy.ask()
    assert population.max() == 1e12
    assert population.min() == -1e12
    assert strategy.step_sizes.max() == 1e6


def test_values_stay_finite_over_twenty_thousand_generations_of_random_fitness():
    strategy = EvolutionStrategy(2, parents=2, offspring=2)
    fitness = np.random.default_rng(0).random((20_000, 4))
    for row in fitness:
        strategy.ask()
        strategy.tell(row)
    assert np.abs(strategy.ask()).max() <= 1e12
    assert strategy.step_sizes.max() <= 1e6
    assert strategy.step_sizes.min() >= 0.01


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 6), st.integers(1, 6), st.integers(1, 5), st.integers(0, 2**70))
def test_any_split_of_the_population_works(parents, offspring, dimension, seed):
    strategy = EvolutionStrategy(dimension, parents=parents, offspring=offspring, seed=seed)
    for _ in range(3):
        population = strategy.ask()
        assert population.shape == (parents + offspring, dimension)
        strategy.tell(population[:, 0])
    survivors = np.sort(population[:, 0])[::-1][:parents]
    np.testing.assert_array_equal(strategy.ask()[:parents, 0], survivors)


@pytest.mark.parametrize("name", ["parents", "offspring"])
def test_a_population_without_parents_or_offspring_is_refused(name):
    with pytest.raises(ValueError, match=f"`{name}` must be an integer of at least 1; got 0"):
        EvolutionStrategy(2, **{name: 0})


@pytest.mark.parametrize(("initial", "minimum"), [(0.005, 0.01), (0.0, 0.0), (1e7, 0.01)])
def test_an_initial_step_size_out_of_its_limits_is_refused(initial, minimum):
    with pytest.raises(ValueError, match=r"`initial_step_size` must be above 0, at least `minimum_step_size`, and at"):
        EvolutionStrategy(2, initial_step_size=initial, minimum_step_size=minimum)


@pytest.mark.parametrize("generation", [-1, 2.5])
def test_a_state_without_a_valid_generation_is_refused(generation):
    strategy = EvolutionStrategy(2)
    with pytest.raises(ValueError, match=r"`state\['generation'\]` must be a non-negative integer; got"):
        strategy.restore({**strategy.state(), "generation": np.array(generation)})


def redrawn(generation, redraw=1.0):
    strategy = EvolutionStrategy(
        3,
        parents=2,
        offspring=40,
        initial_low=5.0,
        initial_high=6.0,
        minimum_step_size=0.0,
        redraw=redraw,
        refinement=2,
    )
    state = strategy.state()
    nowhere = {"population": np.zeros_like(state["population"]), "step_sizes": np.zeros_like(state["step_sizes"])}
    strategy.restore({**state, **nowhere, "generation": np.array(generation)})
    strategy.ask()
    strategy.tell(np.zeros(42))
    return strategy.ask()[2:]


def test_one_parameter_of_a_child_is_drawn_anew_from_the_initial_range():
    children = redrawn(generation=1)
    assert (np.count_nonzero(children, axis=1) == 1).all()
    assert ((children == 0) | ((children >= 5) & (children < 6))).all()
    assert (np.count_nonzero(children, axis=0) > 0).all()


def test_a_share_of_the_children_is_redrawn():
    assert 0 < np.count_nonzero(redrawn(generation=0, redraw=0.5)) < 40


def test_nothing_is_redrawn_in_the_refinement():
    assert not redrawn(generation=2).any()


@pytest.mark.parametrize("redraw", [-0.1, 1.5, np.nan])
def test_a_redraw_that_is_no_probability_is_refused(redraw):
    with pytest.raises(ValueError, match=r"`redraw` must be from 0 to 1; got"):
        EvolutionStrategy(2, redraw=redraw)
