import numpy as np
import pytest

from turing_learning.evolution import check_seed, generation_rng


def test_the_same_generation_of_the_same_seed_draws_the_same_numbers():
    np.testing.assert_array_equal(
        generation_rng([3, 1], 7).random(5), generation_rng([3, 1], 7).random(5)
    )


def test_no_two_generations_and_seeds_draw_the_same_numbers():
    seeds = [0, 1, [0, 1], [1, 1], [1, 2], [1, 2, 3]]
    draws = {
        generation_rng(seed, generation).random() for seed in seeds for generation in range(20)
    }
    assert len(draws) == len(seeds) * 20


@pytest.mark.parametrize("seed", [0, 2**200, (1, 2), [np.int64(3)]])
def test_natural_numbers_and_sequences_of_them_are_seeds(seed):
    assert check_seed(seed) is seed


@pytest.mark.parametrize("seed", [-1, 1.0, True, [], [1, None], "12"])
def test_anything_else_is_refused(seed):
    with pytest.raises(
        ValueError, match="`seed` must be a non-negative integer or a sequence of them; got"
    ):
        check_seed(seed)
