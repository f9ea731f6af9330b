"""Ridges: what shows of parameters, models all along one, and the one in the middle."""

from types import SimpleNamespace

import numpy as np
import pytest

from turing_learning.few_trials import (
    Examiner,
    PooledClassifier,
    SearchSpace,
    expressions,
    ridge_coordinates,
)
from turing_learning.few_trials._readout import beside_walkers
from turing_learning.few_trials._ridge import ridges
from turing_learning.models import Parameter

DRIFT = {name: Parameter(0.1, 10) for name in ("mobility", "heat", "force")}


def space_of(parameters):
    """Return the space of some parameters that end at their ranges."""
    low, high = np.array([[p.low, p.high] for p in parameters.values()]).T
    return SearchSpace.between(low, high, limits=True, ridges=ridge_coordinates(parameters))


def draws_of(parameters, numbers):
    """Return models (N, P) of such numbers (N, P)."""
    space = space_of(parameters)
    return (numbers - space.middle) / space.half


def short_ridge(count=600):
    """Return draws of the drift of a particle on a short part of its ridge."""
    rng = np.random.default_rng(1)
    mobility = rng.uniform(0.5, 1.0, count)
    heat, force = 4 / mobility, 2.5 / mobility
    wobble = np.exp(0.02 * rng.standard_normal((count, 2)))
    return draws_of(DRIFT, np.stack((mobility, heat * wobble[:, 0], force * wobble[:, 1]), axis=1))


def first_ridge(draws, parameters):
    return next(ridges(draws, np.ones(len(parameters)), ridge_coordinates(parameters)))


def test_what_shows_is_found_in_simple_numbers():
    ridge = first_ridge(short_ridge(), DRIFT)
    assert ridge.coordinates.logarithmic
    shown = set(expressions(ridge.shown, True, list(DRIFT)))
    assert len(shown) == 2
    assert shown < {"mobility x heat", "mobility x force", "heat / force", "force / heat"}


def test_draws_reach_both_ends_of_a_ridge_and_are_as_likely_as_there_is_room():
    rng = np.random.default_rng(2)
    ridge = first_ridge(short_ridge(), DRIFT)
    spread = ridge.spread(np.repeat(short_ridge(), 10, axis=0), np.ones(3), rng)
    assert (np.abs(spread) <= 1 + 1e-9).all()
    mobility, heat, force = space_of(DRIFT).to_numbers(spread).T
    assert np.std(mobility * heat) < 0.1
    assert np.std(mobility * force) < 0.1
    # the density of mobility is that of 1 / mobility^2, from where heat is 10 to the end at 10
    # P(mobility < m) = (1 / 0.4 - 1 / m) / (1 / 0.4 - 1 / 10)
    for m in (0.5, 1.0, 3.0):
        expected = (1 / 0.4 - 1 / m) / (1 / 0.4 - 1 / 10)
        # six standard errors of 6000 draws, and 2 % of heat
        assert np.mean(mobility < m) == pytest.approx(expected, abs=0.06)


def test_draws_fill_a_ridge_of_two_directions():
    rng = np.random.default_rng(3)
    names = {"callers": Parameter(0.1, 10), "reach": Parameter(0.1, 10), "rate": Parameter(0.1, 10)}
    callers, reach = rng.uniform(0.8, 2.5, (2, 900))
    rate = 6 / (callers * reach**2) * np.exp(0.01 * rng.standard_normal(900))
    draws = draws_of(names, np.stack((callers, reach, rate), axis=1))
    ridge = first_ridge(draws, names)
    assert expressions(ridge.shown, True, list(names)) == ("callers x reach^2 x rate",)
    models = ridge.spread(draws, np.ones(3), rng)
    spread = space_of(names).to_numbers(models)
    assert np.std(np.log(spread[:, 0] * spread[:, 1] ** 2 * spread[:, 2])) < 0.02
    assert (np.quantile(spread, 0.95, axis=0) > [5, 2.5, 5]).all()
    # the product of the medians is 8.8
    middle = space_of(names).to_numbers(ridge.middle(models))
    assert middle[0] * middle[1] ** 2 * middle[2] == pytest.approx(6, rel=0.01)
    # no farther from the medians than has to be
    assert (np.abs((spread < middle).mean(axis=0) - 0.5) < 0.1).all()


def test_what_does_not_lie_along_a_ridge_has_its_median():
    rng = np.random.default_rng(9)
    leaks = {name: Parameter(-1, 3) for name in ("leak", "decay", "noise")}
    leak, noise = rng.uniform(-0.5, 1.5, (2, 600))
    draws = draws_of(
        leaks, np.stack((leak, 1.5 - leak + 0.003 * rng.random(600), noise**2), axis=1)
    )
    ridge = first_ridge(draws, leaks)
    leak, decay, noise = space_of(leaks).to_numbers(ridge.middle(draws))
    assert leak + decay == pytest.approx(1.5, abs=0.01)
    assert noise == pytest.approx(np.median(space_of(leaks).to_numbers(draws)[:, 2]))


@pytest.mark.parametrize("width", [0.02, 0.4])
def test_a_ridge_is_looked_for_where_a_parameter_is_wide(width):
    rng = np.random.default_rng(4)
    leaks = {"leak": Parameter(-1, 3), "decay": Parameter(-1, 3)}
    leak = rng.uniform(0.5 - width, 0.5 + width, 600)
    draws = draws_of(leaks, np.stack((leak, 1.5 - leak + 0.003 * rng.random(600)), axis=1))
    found = list(ridges(draws, np.ones(2), ridge_coordinates(leaks)))
    assert len(found) == (width > 0.1)
    for ridge in found:
        assert expressions(ridge.shown, False, list(leaks)) == ("leak + decay",)


def test_parameters_that_say_nothing_of_each_other_are_no_ridge():
    draws = np.random.default_rng(5).uniform(-0.5, 0.5, (600, 3))
    assert not list(ridges(draws, np.ones(3), ridge_coordinates(DRIFT)))


def test_what_shows_reads_as_a_formula():
    names = ["a", "b", "c"]
    assert expressions(np.array([[0, -1 / 2, 1]]), True, names) == ("b / c^2",)
    assert expressions(np.array([[1, 2, -1], [1, 0, 3]]), False, names) == (
        "a + 2 b - c",
        "a + 3 c",
    )


@pytest.mark.parametrize("exact", [True, False])
def test_draws_go_all_along_a_ridge_whose_ends_are_as_good(exact):
    def collect(models, rng):
        mobility, heat, force = models.T[..., None]
        shocks = rng.standard_normal((len(models), 60))
        # what tells mobility alone, though hardly on the part of the ridge that draws know
        drift = mobility * force + (0 if exact else 0.4 * mobility)
        steps = drift + np.sqrt(2 * mobility * heat) * shocks
        return SimpleNamespace(counterfeit=steps[:, None, :, None])

    space = space_of(DRIFT)
    genuine = collect(np.tile([0.7, 6, 4], (50, 1)), np.random.default_rng(6)).counterfeit[:, 0]
    source = SimpleNamespace(collect=collect)
    examiner = Examiner(source, space, genuine, ("step",), PooledClassifier(1))
    found = examiner.along_ridge(short_ridge(), 1000, np.random.default_rng(7))
    assert (found is not None) == exact
    if exact:
        mobility = space.to_numbers(found[0])[:, 0]
        assert np.quantile(mobility, 0.95) > 2.5


def test_half_of_the_draws_are_walkers_where_these_are_wider_by_far():
    rng = np.random.default_rng(8)
    widest = np.ones(2)
    wide, narrow = 0.5 * rng.uniform(-1, 1, (2, 600, 2))
    assert beside_walkers(wide, 1.2 * narrow[:150], widest) is None
    # of a parameter that is known
    assert beside_walkers(0.1 * wide, narrow[:150], widest) is None
    joined = beside_walkers(wide, 1.8 * narrow[:150], widest)
    assert joined.shape == wide.shape
    assert 1.1 < np.quantile(joined[:, 0], 0.95) / np.quantile(wide[:, 0], 0.95) < 1.8
