import numpy as np
import pytest

from turing_learning.few_trials import SearchSpace, TrialDesign


def design_of(dimension, limits=False, saturated=False, groups=(), **options):
    ends = np.ones(dimension)
    space = SearchSpace.between(-ends, ends, limits=limits, saturated=saturated, groups=groups)
    return TrialDesign(space, **options)


def normal(center, deviation):
    return lambda models, optimistic=False, least=None: (
        -0.5 * (((models - center) / deviation) ** 2).sum(axis=1)
    )


def follow(design, density, moves=15):
    for _ in range(moves):
        design.move(density)
    return design.walkers


def test_the_first_models_fill_the_range_of_each_parameter_evenly():
    models = design_of(3, seed=1).start(50)
    places = np.sort(np.floor((models + 1) / 2 * 50), axis=0)
    np.testing.assert_array_equal(places, np.tile(np.arange(50)[:, None], 3))


def test_walkers_become_draws_from_the_density():
    center, deviation = np.array([0.3, -0.4, 0.0]), np.array([0.05, 0.1, 0.2])
    walkers = follow(design_of(3, seed=1, walkers=400), normal(center, deviation))
    np.testing.assert_allclose(walkers.mean(axis=0), center, atol=4 * deviation.max() / 20)
    np.testing.assert_allclose(walkers.std(axis=0), deviation, rtol=0.2)


def test_walkers_leave_exchanged_states():
    truth = np.array([0.5, 1.0, 1.0, 0.5])
    design = design_of(4, seed=1, groups=[(0, 1), (2, 3)])
    follow(design, normal(truth[[2, 3, 0, 1]], 0.03))
    walkers = follow(design, normal(truth, 0.03), moves=6)
    assert np.abs(np.median(walkers, axis=0) - truth).max() < 0.05


def test_densities_too_low_to_count_need_not_be_computed():
    exact = normal(np.array([0.3, -0.4]), 0.1)

    def lazy(models, optimistic=False, least=None):
        density = exact(models)
        return density if least is None else np.where(density > least, density, -np.inf)

    first, second = design_of(2, seed=1), design_of(2, seed=1)
    np.testing.assert_array_equal(follow(first, exact), follow(second, lazy))


def test_two_centers_stay_alive():
    first, second = normal(np.array([-0.6, 0.2]), 0.04), normal(np.array([0.6, 0.2]), 0.04)
    walkers = follow(
        design_of(2, seed=1),
        lambda models, optimistic=False, least=None: np.logaddexp(first(models), second(models)),
        moves=30,
    )
    assert 0.2 < (walkers[:, 0] > 0).mean() < 0.8


def test_lost_walkers_start_again_beside_others():
    design, center = design_of(6, seed=1), np.full(6, 0.3)
    design.walkers[:140], design.walkers[140:] = 0.9, center
    design.move(normal(center, 0.03))
    assert np.abs(design.walkers - center).max() < 0.3


def test_proposals_lie_wider_than_walkers():
    design = design_of(2, seed=1, walkers=400, widening=3.0)
    walkers = follow(design, normal(np.zeros(2), 0.05))
    proposed = design.propose(2000, progress=1.0)
    ratio = proposed.std(axis=0) / walkers.std(axis=0)
    assert ((ratio > 1.8) & (ratio < 3.3)).all()


@pytest.mark.parametrize(("deviation", "least", "most"), [(0.02, 0, 0), (0.5, 0.06, 0.25)])
def test_a_quarter_of_the_proposals_goes_where_little_is_known(deviation, least, most):
    known, hoped = normal(np.zeros(2), 0.02), normal(np.zeros(2), deviation)
    design = design_of(2, seed=1)
    walkers = follow(
        design,
        lambda models, optimistic=False, least=None: (hoped if optimistic else known)(models),
    )
    assert np.abs(walkers).max() < 0.1
    far = (np.abs(design.propose(400, progress=1.0)) > 0.3).any(axis=1).mean()
    assert least <= far <= most


def test_explorers_spread_over_all_models_that_are_equally_good():
    def ridge(models, optimistic=False, power=1.0, least=None):
        # only the product shows; what is known best lies around one point of it
        known = 0.0 if optimistic else -0.5 * ((models[:, 0] - 0.5) / 0.05) ** 2
        return power * (known - 0.5 * ((models[:, 0] * models[:, 1] - 0.25) / 0.03) ** 2)

    def spread(explorers):
        design = design_of(2, seed=1, explorers=explorers)
        follow(design, ridge)
        proposed = design.propose(400, progress=1.0)[:, 0]
        return (proposed < -0.3).mean() + (proposed > 0.9).mean()

    assert spread(explorers=0.5) > spread(explorers=0.0) + 0.1


def test_proposals_jump_at_the_beginning_only():
    design = design_of(2, seed=1, exploration=0.5)
    follow(design, normal(np.zeros(2), 0.01))
    far = [
        (np.abs(design.propose(400, progress)) > 0.2).any(axis=1).mean()
        for progress in (0.0, 0.3, 0.7)
    ]
    assert far[0] > far[1] > far[2] == 0


@pytest.mark.parametrize(("limits", "furthest"), [(True, 1.0), (False, 1.5)])
def test_only_parameters_without_limits_leave_the_range(limits, furthest):
    design = design_of(2, seed=1, limits=limits)
    walkers = follow(design, normal(np.array([1.1, 0.0]), 0.05))
    assert (walkers[:, 0].max() > 1) == (not limits)
    assert np.abs(design.propose(500, progress=0.0)).max() <= furthest


@pytest.mark.parametrize("explorers", [0.0, 0.5])
def test_a_restored_design_goes_on_as_if_nothing_had_happened(explorers):
    whole, part = (design_of(2, seed=4, explorers=explorers) for _ in range(2))

    def density(models, optimistic=False, power=1.0, least=None):
        return power * normal(np.zeros(2), 0.1)(models)

    follow(whole, density, moves=2)
    part.restore(whole.state())
    for design in (whole, part):
        follow(design, density, moves=2)
    np.testing.assert_array_equal(whole.propose(30, 0.2), part.propose(30, 0.2))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: design_of(0, seed=1), r"`low` must be of shape \(P,\) and not empty; got \(0,\)"),
        (
            lambda: design_of(2, seed=1, widening=0.5),
            "`widening` must be a finite number of at least 1; got 0.5",
        ),
        (
            lambda: design_of(2, seed=1).restore({}),
            r"`state` must hold an array 'walkers'; got \[\]",
        ),
    ],
)
def test_what_does_not_fit_is_rejected(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_beyond_a_saturated_end_everything_is_the_end():
    seen = []

    def density(models, optimistic=False, least=None):
        seen.append(models)
        return -0.5 * (((models - [1.0, 0.0]) / 0.02) ** 2).sum(axis=1)

    design = design_of(2, seed=1, saturated=[True, False])
    for _ in range(10):
        design.move(density)
    assert max(np.abs(models[:, 0]).max() for models in seen) == 1
    assert (
        np.median(design.walkers[:, 0]) == 1
    )  # more than half of the draws lie beyond, and are stated as the end
    assert np.abs(design.walkers[:, 0]).max() == 1
    assert np.abs(design.propose(200, 0.9)[:, 0]).max() == 1
    again = design_of(2, seed=1, saturated=[True, False])
    again.restore(design.state())
    again.move(density)
    design.move(density)
    np.testing.assert_array_equal(again.walkers, design.walkers)
