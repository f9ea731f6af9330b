import sys

import numpy as np
import pytest

from turing_learning.evolution import CMAEvolutionStrategy


def run(strategy, generations):
    for _ in range(generations):
        strategy.tell(-np.abs(strategy.ask()).sum(axis=1))


def test_without_cma_the_message_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "cma", None)
    with pytest.raises(ImportError, match=r"pip install 'turing-learning\[optimizers\]'"):
        CMAEvolutionStrategy(3)


def test_importing_the_room_does_not_import_cma(monkeypatch):
    monkeypatch.setitem(sys.modules, "cma", None)
    for name in [name for name in sys.modules if name.startswith("turing_learning.evolution")]:
        monkeypatch.delitem(sys.modules, name)
    import turing_learning.evolution as room

    assert room.CMAEvolutionStrategy is not CMAEvolutionStrategy


def test_one_dimension_is_refused_because_cma_does():
    with pytest.raises(ValueError, match="`dimension` must be an integer of at least 2; got 1"):
        CMAEvolutionStrategy(1)


def test_fewer_than_four_candidates_are_refused():
    with pytest.raises(ValueError, match="`size` must be an integer of at least 4; got 3"):
        CMAEvolutionStrategy(2, size=3)


def test_the_first_distribution_has_the_standard_deviation_of_the_initial_range():
    strategy = CMAEvolutionStrategy(2, size=1000, initial_low=[0.0, 10.0], initial_high=[1.0, 22.0])
    np.testing.assert_allclose(strategy.step_sizes[0], [1 / np.sqrt(12), np.sqrt(12)], rtol=1e-4)
    np.testing.assert_allclose(strategy.ask().mean(axis=0), [0.5, 16.0], rtol=0.1)


def test_all_candidates_share_their_step_sizes():
    strategy = CMAEvolutionStrategy(2)
    run(strategy, 3)
    strategy.ask()
    assert (strategy.step_sizes == strategy.step_sizes[0]).all()


def test_the_state_does_not_grow_and_leads_to_the_same_bits():
    strategy, restored = (
        CMAEvolutionStrategy(5, size=10, seed=3, minimum_step_size=1e-3) for _ in range(2)
    )
    run(strategy, 2)
    sizes = {name: array.shape for name, array in strategy.state().items()}
    for generations in (1, 7, 40, 250):
        run(strategy, generations)
        state = strategy.state()
        assert {name: array.shape for name, array in state.items()} == sizes
        restored.restore(state)
        run(restored, 30)
        restored.restore(state)
        for each in (strategy, restored):
            run(each, 60)
        np.testing.assert_array_equal(restored.ask(), strategy.ask())
        for each in (strategy, restored):
            each.tell(np.zeros(10))


def test_the_distribution_does_not_collapse():
    strategy = CMAEvolutionStrategy(2, size=10, minimum_step_size=0.02)
    run(strategy, 300)
    strategy.ask()
    assert strategy.step_sizes.max() >= 0.02 * (1 - 1e-12)
