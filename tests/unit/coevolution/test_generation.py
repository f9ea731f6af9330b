import numpy as np

from turing_learning.coevolution import Generation


def generation(models, fitness):
    models = np.array(models, dtype=float)
    classifiers = np.zeros((2, 2))
    return Generation(
        number=0,
        models=models,
        model_step_sizes=np.ones_like(models),
        model_fitness=np.array(fitness),
        model_scores=np.array(fitness),
        classifiers=classifiers,
        classifier_step_sizes=classifiers,
        classifier_fitness=np.zeros(2),
        selection="active",
        referees=classifiers[:0],
    )


def test_the_best_model_has_the_highest_fitness_and_is_the_first_of_equals():
    best = generation([[0, 1], [2, 3], [4, 5]], [0.1, 0.9, 0.9]).best_model
    np.testing.assert_array_equal(best, [2, 3])


def test_the_typical_model_is_the_median_of_each_parameter_over_the_better_half():
    models = [[1, 30], [9, 9], [2, 10], [9, 9], [6, 20], [9, 9]]
    typical = generation(models, [0.5, 0.1, 0.6, 0.1, 0.7, 0.1]).typical_model
    np.testing.assert_array_equal(typical, [2, 20])


def test_of_equally_fit_models_the_first_belong_to_the_better_half():
    typical = generation([[1], [3], [100], [200]], [0.5, 0.5, 0.5, 0.5]).typical_model
    np.testing.assert_array_equal(typical, [2])


def test_a_single_model_is_its_own_better_half():
    np.testing.assert_array_equal(generation([[4, 2]], [0.0]).typical_model, [4, 2])
