import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from turing_learning.evolution import EvolutionStrategy, Jumper, PhasedMating


def without_mutation(parents, offspring, dimension):
    """A strategy whose step sizes are 0, so that children are recombinations of their parents and nothing else."""
    strategy = EvolutionStrategy(
        dimension, parents=parents, offspring=offspring, minimum_step_size=0.0
    )
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
    strategy = EvolutionStrategy(1, parents=4, offspring=1)
    population = strategy.ask()
    strategy.tell(np.array([1.0, 2.0, 1.0, 2.0, 2.0]))
    np.testing.assert_array_equal(strategy.ask()[:4], population[[1, 3, 4, 0]])


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
    with pytest.raises(
        ValueError,
        match=r"`initial_step_size` must be above 0, at least `minimum_step_size`, and at",
    ):
        EvolutionStrategy(2, initial_step_size=initial, minimum_step_size=minimum)


@pytest.mark.parametrize("generation", [-1, 2.5])
def test_a_state_without_a_valid_generation_is_refused(generation):
    strategy = EvolutionStrategy(2)
    with pytest.raises(
        ValueError, match=r"`state\['generation'\]` must be a non-negative integer; got"
    ):
        strategy.restore({**strategy.state(), "generation": np.array(generation)})


def children_of(recombination, generation, intermediate=False):
    """Children, without steps, of two parents that have no number in common."""
    mating = PhasedMating(recombination, intermediate, refinement=2)
    strategy = EvolutionStrategy(8, parents=2, offspring=60, minimum_step_size=0.0, mating=mating)
    state = strategy.state()
    population = np.r_[[np.zeros(8), np.ones(8)], np.full((60, 8), 9.0)]
    still = {"population": population, "step_sizes": np.zeros_like(population)}
    strategy.restore({**state, **still, "generation": np.array(generation)})
    strategy.ask()
    strategy.tell(-np.arange(62.0))
    return strategy.ask()[2:]


def mixed(children):
    return np.count_nonzero((children != children[:, :1]).any(axis=1))


def test_without_recombination_a_child_has_one_parent():
    children = children_of(0.0, generation=0)
    assert mixed(children) == 0
    assert set(children[:, 0]) == {0.0, 1.0}


def test_some_children_recombine_where_that_is_their_probability():
    assert 0 < mixed(children_of(0.5, generation=0)) < mixed(children_of(1.0, generation=0))


def test_in_the_refinement_all_recombine():
    np.testing.assert_array_equal(children_of(0.0, generation=2), children_of(1.0, generation=2))
    assert mixed(children_of(0.0, generation=2)) > 0


def test_in_the_refinement_children_can_be_means():
    children = children_of(1.0, generation=2, intermediate=True)
    assert mixed(children) == 0
    assert set(children[:, 0]) == {0.0, 0.5, 1.0}


def test_before_the_refinement_no_child_is_a_mean():
    assert set(children_of(1.0, generation=1, intermediate=True).ravel()) == {0.0, 1.0}


def jumped(generation, **settings):
    """Children of parents that are all (1, 2, 3, 4), without steps."""
    jumper = Jumper(np.full(4, 5.0), np.full(4, 6.0), refinement=2, **settings)
    strategy = EvolutionStrategy(4, parents=2, offspring=40, minimum_step_size=0.0, jumper=jumper)
    state = strategy.state()
    still = {
        "population": np.tile([1.0, 2.0, 3.0, 4.0], (42, 1)),
        "step_sizes": np.zeros_like(state["step_sizes"]),
    }
    strategy.restore({**state, **still, "generation": np.array(generation)})
    strategy.ask()
    strategy.tell(np.zeros(42))
    return strategy.ask()[2:]


def test_one_parameter_of_a_child_is_drawn_anew_from_the_initial_range():
    children = jumped(generation=1, redraw=1.0)
    new = children != [1, 2, 3, 4]
    assert (np.count_nonzero(new, axis=1) == 1).all()
    assert ((children[new] >= 5) & (children[new] < 6)).all()
    assert (np.count_nonzero(new, axis=0) > 0).all()


def test_two_groups_of_a_child_exchange_their_values():
    children = jumped(generation=1, exchange=1.0, groups=[(0, 1), (3, 2)])
    np.testing.assert_array_equal(children, np.tile([4.0, 3.0, 2.0, 1.0], (40, 1)))


def test_any_two_of_more_groups_exchange_their_values():
    children = jumped(generation=1, exchange=1.0, groups=[[0], [1], [2]])
    expected = {(2.0, 1.0, 3.0, 4.0), (3.0, 2.0, 1.0, 4.0), (1.0, 3.0, 2.0, 4.0)}
    assert {tuple(child) for child in children.tolist()} == expected


def test_what_is_drawn_anew_may_lie_farther_than_the_first_individuals():
    children = jumped(generation=1, redraw=1.0, reach=[1.0, 5.0, 1.0, 1.0])
    new = np.where(children != [1, 2, 3, 4], children, np.nan)
    assert np.nanmin(new[:, [0, 2, 3]]) >= 5
    assert np.nanmax(new[:, [0, 2, 3]]) < 6
    assert 3 <= np.nanmin(new[:, 1]) < 5  # 5.5 - 2.5
    assert 6 < np.nanmax(new[:, 1]) < 8


def test_a_parameter_that_depends_on_the_groups_is_drawn_anew_with_their_exchange():
    children = jumped(
        generation=1, exchange=1.0, groups=[[0], [1]], dependent=[3], reach=[1.0, 1.0, 1.0, 5.0]
    )
    np.testing.assert_array_equal(children[:, :3], np.tile([2.0, 1.0, 3.0], (40, 1)))
    assert len(np.unique(children[:, 3])) == 40
    assert ((children[:, 3] >= 3) & (children[:, 3] < 8)).all()


@pytest.mark.parametrize("jump", [{"redraw": 0.5}, {"exchange": 0.5, "groups": [(0, 1), (2, 3)]}])
def test_a_share_of_the_children_jumps(jump):
    changed = (jumped(generation=0, **jump) != [1, 2, 3, 4]).any(axis=1)
    assert 0 < np.count_nonzero(changed) < 40


JUMPS = [{"redraw": 1.0}, {"exchange": 1.0, "groups": [(0, 1), (2, 3)]}]


@pytest.mark.parametrize("jump", JUMPS)
def test_nothing_jumps_in_a_refinement_without_end(jump):
    np.testing.assert_array_equal(
        jumped(generation=2, **jump), np.tile([1.0, 2.0, 3.0, 4.0], (40, 1))
    )


@pytest.mark.parametrize("jump", JUMPS)
def test_in_the_refinement_jumps_become_rarer_and_end(jump):
    counts = [
        np.count_nonzero((jumped(generation=g, settled=12, **jump) != [1, 2, 3, 4]).any(axis=1))
        for g in (1, 4, 9, 12)
    ]
    assert counts[0] == 40
    assert 24 <= counts[1] <= 38  # 0.8 of 40 on average
    assert 4 <= counts[2] <= 20  # 0.3 of 40
    assert counts[3] == 0


def test_jumps_that_end_before_the_refinement_are_refused():
    with pytest.raises(ValueError, match=r"`settled` must be an integer of at least 2; got 1"):
        jumped(generation=0, settled=1)


LOW, HIGH = np.full(4, -1.0), np.full(4, 1.0)


@pytest.mark.parametrize("name", ["recombination", "redraw", "exchange"])
@pytest.mark.parametrize("share", [-0.1, 1.5, np.nan])
def test_what_is_no_probability_is_refused(name, share):
    with pytest.raises(
        ValueError, match=f"`{name}` must be a finite number of at least 0 and of at most 1; got"
    ):
        PhasedMating(share) if name == "recombination" else Jumper(LOW, HIGH, **{name: share})


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"groups": [(0, 1)]},
            "`groups` must be two or more of one length and have no index in common; got",
        ),
        (
            {"groups": [(0, 1), (2,)]},
            "`groups` must be two or more of one length and have no index in common; got",
        ),
        (
            {"groups": [(0, 1), (1, 2)]},
            "`groups` must be two or more of one length and have no index in common; got",
        ),
        (
            {"groups": [(0, 0), (1, 2)]},
            "`groups` must be two or more of one length and have no index in common; got",
        ),
        (
            {"groups": [(0, 1), (2, 4)]},
            r"`groups` must hold indices from 0 to 3; got \[\(0, 1\), \(2, 4\)\]",
        ),
        ({"reach": 0.0}, "`reach` must be above 0; got"),
        ({"reach": [1.0, 1.0, 0.0, 1.0]}, "`reach` must be above 0; got"),
        (
            {"groups": [(0,), (1,)], "dependent": [1]},
            "`dependent` must hold no index of a group; got",
        ),
        (
            {"groups": [(0,), (1,)], "dependent": [4]},
            "`dependent` must hold indices from 0 to 3; got",
        ),
    ],
)
def test_jumps_that_cannot_be_are_refused(settings, message):
    with pytest.raises(ValueError, match=message):
        Jumper(LOW, HIGH, **settings)
