"""What every optimizer must do. A new one joins the suite with one entry in `OPTIMIZERS`."""

import io
from collections.abc import Callable

import numpy as np
import pytest

from turing_learning.evolution import (
    CMAEvolutionStrategy,
    EvolutionStrategy,
    FitnessMemory,
    Jumper,
    Optimizer,
    PhasedMating,
    RenewedOptimizer,
)

DIMENSION = 3
SIZE = 12


def evolution_strategy(**settings) -> Optimizer:
    return EvolutionStrategy(
        **{"dimension": DIMENSION, "parents": SIZE // 2, "offspring": SIZE // 2, **settings}
    )


def cma_evolution_strategy(**settings) -> Optimizer:
    return CMAEvolutionStrategy(**{"dimension": DIMENSION, "size": SIZE, **settings})


def renewed(*, seed=0, **settings) -> Optimizer:
    return RenewedOptimizer(
        lambda k: evolution_strategy(seed=seed if k == 0 else [77, k], **settings), 3, last=3
    )


def in_two_phases(*, initial_low=-1.0, initial_high=1.0, **settings) -> Optimizer:
    jumper = Jumper(
        np.full(DIMENSION, -1.0),
        np.full(DIMENSION, 1.0),
        redraw=0.1,
        exchange=0.1,
        groups=[[0], [1]],
        dependent=[2],
        refinement=30,
    )
    parts = {
        "mating": PhasedMating(0.5, True, 30),
        "jumper": jumper,
        "memory": FitnessMemory(SIZE, 0.1, 30),
    }
    return evolution_strategy(
        initial_low=initial_low, initial_high=initial_high, **parts, **settings
    )


OPTIMIZERS: dict[str, Callable[..., Optimizer]] = {
    "EvolutionStrategy": evolution_strategy,
    "EvolutionStrategy in two phases": in_two_phases,
    "CMAEvolutionStrategy": cma_evolution_strategy,
    "RenewedOptimizer": renewed,
}


@pytest.fixture(params=OPTIMIZERS.values(), ids=OPTIMIZERS.keys())
def new(request) -> Callable[..., Optimizer]:
    return request.param


def sphere(population: np.ndarray) -> np.ndarray:
    return -np.sum((population - 0.3) ** 2, axis=1)


def run(
    optimizer: Optimizer, generations: int, score: Callable[[np.ndarray], np.ndarray] = sphere
) -> list[np.ndarray]:
    populations = []
    for _ in range(generations):
        populations.append(optimizer.ask())
        optimizer.tell(score(populations[-1]))
    return populations


def test_it_fits_the_protocol(new):
    assert isinstance(new(), Optimizer)


def test_size_and_dimension_are_those_of_the_population(new):
    optimizer = new()
    assert (optimizer.size, optimizer.dimension) == (SIZE, DIMENSION)
    assert optimizer.ask().shape == (SIZE, DIMENSION)


def test_the_population_is_finite_float64(new):
    population = new().ask()
    assert population.dtype == np.float64
    assert np.isfinite(population).all()


def test_changing_what_ask_returned_changes_nothing_inside(new):
    optimizer, twin = new(), new()
    optimizer.ask()[:] = 7.0
    twin.ask()
    for each in (optimizer, twin):
        each.tell(np.arange(SIZE))
    np.testing.assert_array_equal(optimizer.ask(), twin.ask())


def test_changing_the_fitness_after_it_was_told_changes_nothing_inside(new):
    optimizer, twin = new(), new()
    fitness = np.arange(SIZE, dtype=float)
    for each in (optimizer, twin):
        each.ask()
        each.tell(fitness)
    expected = twin.state()
    fitness[:] = 0
    for name, array in optimizer.state().items():
        np.testing.assert_array_equal(array, expected[name])


def test_asking_twice_is_refused(new):
    optimizer = new()
    optimizer.ask()
    with pytest.raises(RuntimeError, match="`ask` must be called after `tell`; got a second `ask`"):
        optimizer.ask()


def test_telling_before_asking_is_refused(new):
    with pytest.raises(RuntimeError, match="`tell` must be called after `ask`"):
        new().tell(np.zeros(SIZE))


def test_telling_twice_is_refused(new):
    optimizer = new()
    run(optimizer, 1)
    with pytest.raises(RuntimeError, match="`tell` must be called after `ask`"):
        optimizer.tell(np.zeros(SIZE))


@pytest.mark.parametrize("fitness", [np.zeros(SIZE - 1), np.zeros((SIZE, 1)), 0.0])
def test_fitness_of_another_shape_is_refused(new, fitness):
    optimizer = new()
    optimizer.ask()
    with pytest.raises(ValueError, match=r"`fitness` must be of shape \(size,\) = \(12,\); got"):
        optimizer.tell(fitness)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_fitness_that_is_not_finite_is_refused(new, value):
    optimizer = new()
    optimizer.ask()
    fitness = np.zeros(SIZE)
    fitness[5] = value
    with pytest.raises(ValueError, match=rf"`fitness` must be finite; got {value} at \(5,\)"):
        optimizer.tell(fitness)


def test_after_refused_fitness_the_right_one_can_be_told(new):
    optimizer, twin = new(), new()
    run(twin, 1)
    population = optimizer.ask()
    with pytest.raises(ValueError, match="must be finite"):
        optimizer.tell(np.full(SIZE, np.nan))
    optimizer.tell(sphere(population))
    np.testing.assert_array_equal(optimizer.ask(), twin.ask())


def test_step_sizes_are_positive_and_one_for_each_parameter(new):
    optimizer = new()
    optimizer.ask()
    assert optimizer.step_sizes.shape == (SIZE, DIMENSION)
    assert (optimizer.step_sizes > 0).all()


def test_step_sizes_stay_those_of_the_population_last_asked_for(new):
    optimizer = new()
    run(optimizer, 3)
    population = optimizer.ask()
    before = optimizer.step_sizes
    optimizer.tell(sphere(population))
    np.testing.assert_array_equal(optimizer.step_sizes, before)
    optimizer.ask()
    assert not np.array_equal(optimizer.step_sizes, before)


def test_changing_the_step_sizes_returned_changes_nothing_inside(new):
    optimizer = new()
    optimizer.step_sizes[:] = -1
    assert (optimizer.step_sizes > 0).all()


def test_the_same_seed_gives_the_same_populations(new):
    np.testing.assert_array_equal(run(new(seed=[3, 1]), 4), run(new(seed=[3, 1]), 4))


def test_another_seed_gives_other_populations(new):
    assert not np.isclose(new(seed=1).ask(), new(seed=2).ask()).any()


def test_each_generation_draws_new_numbers(new):
    optimizer = new()
    populations = run(optimizer, 3, score=lambda x: np.zeros(SIZE))
    assert len({population[-1].tobytes() for population in populations}) == 3


def test_the_global_random_state_is_neither_read_nor_changed(new):
    np.random.seed(1)  # noqa: NPY002
    first = run(new(), 3)
    np.random.seed(2)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    np.testing.assert_array_equal(run(new(), 3), first)
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # noqa: NPY002


def test_larger_fitness_is_better(new):
    population = run(new(seed=4), 80)[-1]
    # the first population is at about 0.5 in the median; one that minimized would move away without bound
    assert np.linalg.norm(np.median(population, axis=0) - 0.3) < 0.2


def test_the_optimum_is_found_outside_of_the_initial_range(new):
    population = run(new(seed=4, initial_low=2.0, initial_high=[3.0, 4.0, 5.0]), 120)[-1]
    # the first population is at 4.4
    assert np.linalg.norm(np.median(population, axis=0) - 0.3) < 0.2


def test_only_the_order_of_the_fitness_values_counts(new):
    plain = run(new(), 5)
    np.testing.assert_array_equal(run(new(), 5, score=lambda x: 1e3 * sphere(x) + 7), plain)


@pytest.mark.parametrize(
    "score",
    [lambda x: np.zeros(SIZE), lambda x: np.abs(x).sum(axis=1), lambda x: -np.round(x[:, 0], 0)],
    ids=["selection has stopped", "growth is rewarded", "plateaus"],
)
def test_values_stay_finite(new, score):
    optimizer = new()
    population = run(optimizer, 1500, score)[-1]
    assert np.abs(population).max() <= 1e12
    assert np.isfinite(optimizer.step_sizes).all()
    assert (optimizer.step_sizes > 0).all()


def test_state_is_stored_without_pickle(new):
    optimizer = new()
    run(optimizer, 2)
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **optimizer.state())
    file.seek(0)
    with np.load(file, allow_pickle=False) as stored:
        restored = new()
        restored.restore(dict(stored))
    np.testing.assert_array_equal(restored.ask(), optimizer.ask())


@pytest.mark.parametrize("generations", [0, 5])
def test_a_restored_optimizer_goes_on_bit_identically(new, generations):
    optimizer = new(seed=9)
    run(optimizer, generations)
    restored = new(seed=9)
    run(restored, 2, score=lambda x: -sphere(x))
    restored.restore(optimizer.state())
    np.testing.assert_array_equal(run(restored, 5), run(optimizer, 5))
    np.testing.assert_array_equal(restored.step_sizes, optimizer.step_sizes)
    for name, array in restored.state().items():
        np.testing.assert_array_equal(array, optimizer.state()[name])


def test_after_restoring_the_step_sizes_are_those_of_the_population_to_come(new):
    optimizer, restored = new(), new()
    run(optimizer, 3)
    restored.restore(optimizer.state())
    optimizer.ask()
    np.testing.assert_array_equal(restored.step_sizes, optimizer.step_sizes)


def test_a_state_can_be_restored_between_ask_and_tell(new):
    optimizer, twin = new(), new()
    state = optimizer.state()
    optimizer.ask()
    optimizer.restore(state)
    np.testing.assert_array_equal(run(optimizer, 3), run(twin, 3))


def test_a_state_is_not_changed_by_going_on(new):
    optimizer = new()
    run(optimizer, 2)
    state = optimizer.state()
    copies = {name: array.copy() for name, array in state.items()}
    optimizer.restore(state)
    run(optimizer, 2)
    for name, array in state.items():
        np.testing.assert_array_equal(array, copies[name])


def test_state_between_ask_and_tell_is_refused(new):
    optimizer = new()
    optimizer.ask()
    with pytest.raises(RuntimeError, match=r"`state` must be called after `tell` or before `ask`"):
        optimizer.state()


def test_a_state_that_lacks_an_array_is_refused(new):
    optimizer = new()
    for name in optimizer.state():
        state = optimizer.state()
        del state[name]
        with pytest.raises(ValueError, match=f"`state` must hold an array '{name}'; got"):
            new().restore(state)


def test_a_state_of_another_dimension_is_refused(new):
    with pytest.raises(ValueError, match=r"`state\['\w+'\]` must be of shape \(.*\); got"):
        new(dimension=DIMENSION + 1).restore(new().state())


def test_a_state_that_is_not_finite_is_refused(new):
    optimizer = new()
    run(optimizer, 1)
    state = optimizer.state()
    name = next(name for name, array in state.items() if array.ndim == 2)
    state[name][0, 0] = np.nan
    with pytest.raises(ValueError, match=rf"`state\['{name}'\]` must be finite; got nan"):
        new().restore(state)


def test_a_refused_state_changes_nothing(new):
    optimizer, twin = new(), new()
    for each in (optimizer, twin):
        run(each, 2)
    state = optimizer.state()
    name = next(name for name, array in state.items() if array.ndim == 2)
    state[name] = state[name][:, :-1]
    with pytest.raises(ValueError, match="must be of shape"):
        optimizer.restore(state)
    np.testing.assert_array_equal(run(optimizer, 2), run(twin, 2))


def test_nothing_is_printed_and_no_file_written(new, capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run(new(), 120)
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("dimension", [0, -1, 2.0, True])
def test_a_dimension_that_is_no_count_is_refused(new, dimension):
    with pytest.raises(
        ValueError, match=rf"`dimension` must be an integer of at least \d; got {dimension}"
    ):
        new(dimension=dimension)


@pytest.mark.parametrize("seed", [-1, 1.5, [1, -2], [], "1", None])
def test_a_seed_that_is_no_natural_number_is_refused(new, seed):
    with pytest.raises(
        ValueError, match="`seed` must be a non-negative integer or a sequence of them; got"
    ):
        new(seed=seed)


def test_an_initial_range_of_another_shape_is_refused(new):
    with pytest.raises(
        ValueError, match=r"`initial_low` must be a number or of shape \(dimension,\) = \(3,\); got"
    ):
        new(initial_low=[-1.0, -1.0])


def test_an_initial_range_that_is_not_finite_is_refused(new):
    with pytest.raises(ValueError, match="`initial_high` must be finite; got inf"):
        new(initial_high=np.inf)


def test_an_empty_initial_range_is_refused(new):
    message = r"`initial_low` must be below `initial_high`; got 1.0 and 1.0 for parameter 2"
    with pytest.raises(ValueError, match=message):
        new(initial_low=[-1.0, -1.0, 1.0])


def test_a_negative_minimum_step_size_is_refused(new):
    with pytest.raises(ValueError, match=r"`minimum_step_size` must not be negative; got -0.1"):
        new(minimum_step_size=-0.1)
