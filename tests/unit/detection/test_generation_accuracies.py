import numpy as np
import pytest

from turing_learning.config import ConfigurationError
from turing_learning.detection import accuracy_over_generations, grid_models, post_evaluate, run_classifiers
from turing_learning.detection._post_evaluation import sampled_generations


def test_the_first_and_the_last_generation_are_among_those_sampled():
    chosen = sampled_generations(1000)
    assert (chosen[0], chosen[1], chosen[-1]) == (0, 1, 999)
    assert 10 < len(chosen) <= 16
    assert (np.diff(chosen) > 0).all()


@pytest.mark.parametrize(("total", "expected"), [(1, [0]), (2, [0, 1]), (3, [0, 1, 2])])
def test_of_a_short_run_all_generations_are_sampled(total, expected):
    assert sampled_generations(total).tolist() == expected


def test_accuracies_of_a_run_are_those_of_its_classifiers(run):
    parts = run_classifiers(run)
    models = grid_models(parts.scenario, 2)
    history = run.history
    found = accuracy_over_generations(
        parts.classifier, history["classifier"], history["classifier_fitness"], parts.scenario,
        models=models, generations=[0, 3, 6], trials=2, seed=3, threads=1,
    )  # fmt: skip
    genomes = history["classifier"].to_numpy()
    for row, generation in enumerate((0, 3, 6)):
        alone = post_evaluate(parts.classifier, genomes[generation], parts.scenario, models, trials=2, seed=3)
        np.testing.assert_array_equal(found.accuracy[row], alone.accuracy)
    best = history["classifier_fitness"].to_numpy()[[0, 3, 6]].argmax(axis=1)
    np.testing.assert_array_equal(found.subjective, found.accuracy[[0, 1, 2], best])
    np.testing.assert_array_equal(found.objective, found.accuracy.max(axis=1))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"generations": [0, 3]}, r"^`generations` must be numbers from 0 to 2; got \[0, 3\]"),
        ({"generations": []}, r"^`generations` must be numbers from 0 to 2; got \[\]"),
        ({"fitness": np.zeros((3, 5))}, r"^`fitness` must have the shape \(G, N\), as populations; got \(3, 5\)"),
    ],
)
def test_generations_that_do_not_fit_are_refused(changes, message, scenario, speed_limits):
    given = {"fitness": np.zeros((3, 4)), "generations": None} | changes
    with pytest.raises(ConfigurationError, match=message):
        accuracy_over_generations(speed_limits, np.zeros((3, 4, 1)), given.pop("fitness"), scenario, **given)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0,), "^`generations` must be an integer of at least 1; got 0"),
        ((5, 1), "^`points` must be an integer of at least 2; got 1"),
    ],
)
def test_a_sample_of_generations_that_is_none_is_refused(arguments, message):
    with pytest.raises(ConfigurationError, match=message):
        sampled_generations(*arguments)
