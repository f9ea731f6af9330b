import numpy as np

from turing_learning.few_trials._search import Search

AGENTS = np.array([0.3, -0.4, 0.6])


def outputs(models, rng):
    """Return what twelve observers say: they see where a model is, bent, and much that does not depend on it."""
    weights = np.random.default_rng(1).standard_normal((12, 3))
    noise = 0.1 * rng.standard_normal((len(models), 12))
    return np.tanh(models @ weights.T) + noise


def test_searches_find_the_agents_where_no_trial_was_near():
    rng = np.random.default_rng(2)
    models = rng.uniform(-1, 1, (400, 3))
    models = models[np.abs(models - AGENTS).max(axis=1) > 0.3]
    genuine, seen = outputs(np.tile(AGENTS, (500, 1)), rng), outputs(models, rng)
    search = Search(np.full(3, 1.5))
    assert search.batch_size == 35
    for k in range(12):
        tried = search.step(35, 0.5 + 0.02 * k, models, seen, genuine, rng)
        assert tried.shape == (35, 3)
        models, seen = np.concatenate((models, tried)), np.concatenate((seen, outputs(tried, rng)))
        copy = Search(np.full(3, 1.5))
        copy.restore(search.state())
        for each in (search, copy):
            each.update_centers(models, seen, genuine)
        np.testing.assert_array_equal(copy.centers, search.centers)
        search = copy
    assert np.abs(search.centers[0] - AGENTS).max() < 0.1


def test_searches_go_to_other_places_and_stay_in_the_range():
    rng = np.random.default_rng(3)
    models = rng.uniform(-1, 1, (600, 2))

    def seen(models):  # two models look alike, and nothing does beyond the range
        return np.c_[models[:, 0] ** 2, models[:, 1]] + 0.1 * rng.standard_normal((len(models), 2))

    genuine = seen(np.tile([0.6, 0.9], (300, 1)))
    search, known = Search(np.ones(2)), seen(models)
    for _ in range(30):
        tried = search.step(28, 0.5, models, known, genuine, rng)
        assert np.abs(tried).max() <= 1
        models, known = np.concatenate((models, tried)), np.concatenate((known, seen(tried)))
    search.update_centers(models, known, genuine)
    for mirror in ([0.6, 0.9], [-0.6, 0.9]):
        assert np.abs(search.centers[:6] - mirror).max(axis=1).min() < 0.05


def test_a_run_is_lost_whose_map_fits_nothing_for_long_in_its_second_half():
    search = Search(np.ones(3))
    for _ in range(20):
        search.note_misfit(0.4, 9.0)  # too early
    assert not search.lost
    for _ in range(6):
        search.note_misfit(0.4, 1.0)
    search.note_misfit(0.6, 1.0)
    assert not search.lost
    for _ in range(20):
        search.note_misfit(0.9, 9.0)  # too late
    assert not search.lost
    search.note_misfit(0.6, 1.0)
    assert search.lost
    search.reset_if_early(0.9)
    assert search.lost
    search.reset_if_early(0.3)  # the run has got more trials
    assert not search.lost
