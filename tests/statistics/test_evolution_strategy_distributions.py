"""Distributions that the evolution strategy must draw from. All seeded; tolerances are five standard errors."""

import numpy as np

from turing_learning.evolution import EvolutionStrategy

CHILDREN = 20_000
DIMENSION = 4


def children_of(
    parents: np.ndarray, steps: np.ndarray, adaptation: float = 0.5
) -> tuple[np.ndarray, np.ndarray]:
    """Return the parameters and step sizes of many children of the given parents."""
    mu, dimension = parents.shape
    strategy = EvolutionStrategy(
        dimension,
        parents=mu,
        offspring=CHILDREN,
        seed=11,
        minimum_step_size=0.0,
        adaptation=adaptation,
    )
    state = strategy.state()
    state["population"][:mu] = parents
    state["step_sizes"][:mu] = steps
    strategy.restore(state)
    strategy.ask()
    strategy.tell(-np.arange(strategy.size, dtype=float))
    return strategy.ask()[mu:], strategy.step_sizes[mu:]


def test_the_first_population_is_uniform():
    population = EvolutionStrategy(
        3, parents=10_000, offspring=10_000, seed=2, initial_low=1, initial_high=4
    ).ask()
    uniform = np.sort((population - 1) / 3, axis=0)
    distance = np.abs(uniform - np.linspace(0, 1, len(uniform))[:, None]).max()
    # Kolmogorov: P(sqrt(n) D > 2.23) = 2 exp(-2 * 2.23^2) = 1e-4
    assert distance < 2.23 / np.sqrt(len(uniform))


def test_logarithms_of_step_sizes_have_the_variance_of_both_mutations():
    logs = np.log(children_of(np.zeros((1, DIMENSION)), np.ones((1, DIMENSION)))[1])
    common, own = 1 / (8 * DIMENSION), 1 / (8 * np.sqrt(DIMENSION))  # tau'^2, tau^2
    # a variance estimated from n normal numbers has the relative standard error sqrt(2 / n)
    np.testing.assert_allclose(logs.var(axis=0), common + own, rtol=5 * np.sqrt(2 / CHILDREN))


def test_adaptation_multiplies_the_learning_rates():
    steps = children_of(np.zeros((1, DIMENSION)), np.ones((1, DIMENSION)), adaptation=1.0)[1]
    # Eiben and Smith (2003): tau'^2 = 1 / (2 n), tau^2 = 1 / (2 sqrt(n))
    variance = 1 / (2 * DIMENSION) + 1 / (2 * np.sqrt(DIMENSION))
    tolerance = 5 * np.sqrt(2 / CHILDREN)
    np.testing.assert_allclose(np.log(steps).var(axis=0), variance, rtol=tolerance)


def test_step_sizes_of_a_child_share_the_common_mutation():
    logs = np.log(children_of(np.zeros((1, DIMENSION)), np.ones((1, DIMENSION)))[1])
    common, own = 1 / (8 * DIMENSION), 1 / (8 * np.sqrt(DIMENSION))
    covariances = np.cov(logs.T)[np.triu_indices(DIMENSION, 1)]
    # Var of a sample covariance: (v^2 + c^2) / n with variance v = common + own and covariance c = common
    error = np.sqrt(((common + own) ** 2 + common**2) / CHILDREN)
    np.testing.assert_allclose(covariances, common, atol=5 * error)


def test_logarithms_of_step_sizes_have_no_drift():
    logs = np.log(children_of(np.zeros((1, DIMENSION)), np.ones((1, DIMENSION)))[1])
    deviation = np.sqrt(1 / (8 * DIMENSION) + 1 / (8 * np.sqrt(DIMENSION)))
    np.testing.assert_allclose(logs.mean(axis=0), 0, atol=5 * deviation / np.sqrt(CHILDREN))


def test_mutations_are_normal_with_the_new_step_sizes():
    children, steps = children_of(np.full((1, DIMENSION), 2.0), np.full((1, DIMENSION), 3.0))
    standard = (children - 2) / steps
    # standard errors of mean, variance and fourth moment of a standard normal: sqrt(1, 2, 96 / n)
    np.testing.assert_allclose(standard.mean(axis=0), 0, atol=5 * np.sqrt(1 / CHILDREN))
    np.testing.assert_allclose(standard.var(axis=0), 1, atol=5 * np.sqrt(2 / CHILDREN))
    np.testing.assert_allclose((standard**4).mean(axis=0), 3, atol=5 * np.sqrt(96 / CHILDREN))


def test_mutations_of_different_parameters_are_independent():
    children, steps = children_of(np.zeros((1, DIMENSION)), np.ones((1, DIMENSION)))
    correlations = np.corrcoef((children / steps).T)[np.triu_indices(DIMENSION, 1)]
    np.testing.assert_allclose(correlations, 0, atol=5 / np.sqrt(CHILDREN))


def test_every_parent_passes_on_equally_many_parameters():
    parents = np.tile(np.arange(4.0)[:, None], (1, DIMENSION))
    children, _ = children_of(parents, np.zeros((4, DIMENSION)))
    shares = [(children == parent).mean(axis=0) for parent in range(4)]
    np.testing.assert_allclose(shares, 0.25, atol=5 * np.sqrt(0.25 * 0.75 / CHILDREN))


def test_the_two_parents_are_drawn_with_replacement():
    parents = np.tile(
        np.arange(4.0)[:, None], (1, 40)
    )  # two different parents: chance 2^-39 to look like one
    children, _ = children_of(parents, np.zeros((4, 40)))
    share = (children == children[:, :1]).all(axis=1).mean()
    np.testing.assert_allclose(share, 1 / 4, atol=5 * np.sqrt(0.25 * 0.75 / CHILDREN))


def test_parameters_are_chosen_independently_and_evenly_from_the_two_parents():
    parents = np.array([[0.0] * DIMENSION, [1.0] * DIMENSION])
    children, _ = children_of(parents, np.zeros((2, DIMENSION)))
    mixed = children[:, 0] != children[:, 1]
    # the parents differ in half of all pairs, and then two parameters come from different ones in half of all cases
    np.testing.assert_allclose(mixed.mean(), 1 / 4, atol=5 * np.sqrt(0.25 * 0.75 / CHILDREN))


def test_step_sizes_are_the_means_of_the_parents():
    _, steps = children_of(
        np.zeros((2, DIMENSION)), np.array([[1.0] * DIMENSION, [3.0] * DIMENSION])
    )
    logs = np.log(steps).mean(axis=0)
    # pairs (1, 1), (1, 3), (3, 1), (3, 3) are equally probable, with means 1, 2, 2, 3
    centers = np.log([1, 2, 2, 3])
    variance = centers.var() + 1 / (8 * DIMENSION) + 1 / (8 * np.sqrt(DIMENSION))
    np.testing.assert_allclose(logs, centers.mean(), atol=5 * np.sqrt(variance / CHILDREN))
