from dataclasses import replace

import numpy as np
import pytest

from turing_learning.analysis import decision_accuracy
from turing_learning.classifiers import ElmanClassifier
from turing_learning.reproduction import _post_evaluation
from turing_learning.reproduction._post_evaluation import (
    count_agents,
    decision_accuracies,
    grid_models,
)
from turing_learning.swarm import AGGREGATION, Robot, Trial, initial_poses, observe

RNG = np.random.default_rng(0)
GENOMES = RNG.normal(0, 2, (6, 46))
MODELS = RNG.uniform(-1, 1, (7, 4))


@pytest.fixture(scope="module")
def scenario():
    """Three robots for one second."""
    return replace(AGGREGATION, agents=2, trial=Trial(duration_s=1.0, start_side_cm=100.0))


def post_evaluate(classifier, genomes, scenario, models, *, seed=0, **options):
    """Return the decision accuracy (N,) of classifiers."""
    counts = count_agents(classifier, genomes, scenario, models, seed=seed, **options)
    return decision_accuracies(counts, scenario, len(models))


class Listener:
    """Judge every sample alike, and keep them."""

    def __init__(self, judgment=0.0):
        self.heard = []
        self._judgment = judgment

    def judge(self, genomes, samples):
        self.heard.append(samples.copy())
        return np.full((len(genomes), len(samples)), self._judgment, np.float32)


def naive_accuracy(classifier, genomes, scenario, models, trials, seed):
    """Ask one classifier about one individual after the other."""
    rng = np.random.default_rng((7, seed, 3))
    poses = initial_poses(scenario, trials, rng)
    keys = rng.integers(0, 2**64, size=(len(models), trials), dtype=np.uint64)
    accuracies = []
    for genome in genomes:
        right = {True: [], False: []}
        for model, key in zip(models, keys, strict=True):
            controllers = np.tile(
                np.asarray(scenario.controller), (len(key), scenario.individuals, 1)
            )
            controllers[:, scenario.agents :] = model
            samples = observe(scenario, controllers, poses.copy(), key, 1).swapaxes(0, 1)
            for k, individual in enumerate(samples):
                is_model = k >= scenario.agents
                says_model = all(
                    classifier.judge(genome[None], sample[None])[0, 0] < 0.5
                    for sample in individual
                )
                right[is_model].append(says_model == is_model)
        accuracies.append((np.mean(right[True]) + np.mean(right[False])) / 2)
    return np.array(accuracies)


def test_the_grid_of_the_paper_has_14641_models():
    models = grid_models(4, 11)
    assert models.shape == (14641, 4)
    np.testing.assert_allclose(np.unique(models.round(9)), np.linspace(-1, 1, 11), atol=1e-9)
    assert len(np.unique(models, axis=0)) == 14641


def test_the_last_parameter_of_a_grid_changes_fastest():
    np.testing.assert_array_equal(grid_models(3, 2)[:3], [[-1, -1, -1], [-1, -1, 1], [-1, 1, -1]])


def test_the_accuracy_is_that_of_the_naive_twin(scenario):
    classifier = ElmanClassifier(scale=scenario.input_scale, threads=1)
    expected = naive_accuracy(classifier, GENOMES, scenario, MODELS, trials=3, seed=4)
    found = post_evaluate(classifier, GENOMES, scenario, MODELS, trials=3, seed=4, threads=1)
    assert len(np.unique(expected)) > 1
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_the_accuracy_is_that_of_all_judgments_taken_together(scenario):
    classifier, listener = ElmanClassifier(scale=scenario.input_scale, threads=1), Listener()
    found = post_evaluate(classifier, GENOMES, scenario, MODELS, trials=3, seed=4, threads=1)
    post_evaluate(listener, GENOMES[:1], scenario, MODELS, trials=3, seed=4, threads=1)
    judged = np.stack(
        [classifier.judge(GENOMES, trial) >= 0.5 for trial in listener.heard], axis=-1
    )
    agents, models = judged[:, :14], judged[:, 14:]
    np.testing.assert_allclose(found, decision_accuracy(agents, models), rtol=1e-12)


def test_a_classifier_that_accepts_everything_decides_half_of_it_correctly(scenario):
    found = post_evaluate(Listener(1.0), GENOMES, scenario, MODELS, trials=2)
    assert found.tolist() == [0.5] * 6


def test_initial_poses_are_common_to_all_models(scenario):
    silent = replace(scenario, robot=Robot(wheel_noise=0.0))
    same = np.tile(silent.controller, (3, 1))
    listener = Listener()
    post_evaluate(listener, GENOMES, silent, same, trials=2, threads=1)
    trials = [samples.reshape(3, 3, 10, 2) for samples in listener.heard]
    for samples in trials:
        np.testing.assert_array_equal(samples[:, 1], samples[:, 0])
        np.testing.assert_array_equal(samples[:, 2], samples[:, 0])
    assert not np.array_equal(trials[0], trials[1])


def test_the_accuracy_does_not_depend_on_threads_and_on_what_is_judged_at_once(
    scenario, monkeypatch
):
    classifier = ElmanClassifier(scale=scenario.input_scale)
    whole = post_evaluate(classifier, GENOMES, scenario, MODELS, trials=2, threads=1)
    monkeypatch.setattr(_post_evaluation, "BLOCK_BYTES", 1)
    monkeypatch.setattr(_post_evaluation, "CLASSIFIERS_AT_ONCE", 2)
    parts = post_evaluate(classifier, GENOMES, scenario, MODELS, trials=2, threads=2)
    np.testing.assert_array_equal(parts, whole)


def test_no_more_than_a_block_is_judged_at_once(scenario, monkeypatch):
    monkeypatch.setattr(_post_evaluation, "BLOCK_BYTES", 2 * 8 * 3 * 2 * 10 * 2)
    listener = Listener()
    post_evaluate(listener, GENOMES, scenario, MODELS, trials=2)
    assert [len(samples) for samples in listener.heard] == [6, 6, 6, 6, 6, 6, 3, 3]


def test_who_was_judged_genuine_once_is_not_judged_again(scenario):
    class Choosy(Listener):
        """Judge every sample genuine except the last."""

        def judge(self, genomes, samples):
            return super().judge(genomes, samples) + (np.arange(len(samples)) < len(samples) - 1)

    listener = Choosy()
    counts = count_agents(listener, GENOMES[:1], scenario, MODELS[:2], trials=4, seed=0, threads=1)
    assert [len(samples) for samples in listener.heard] == [6, 1, 1, 1]
    assert counts.tolist() == [[4, 1]]


@pytest.mark.parametrize("sparse", [0.0, 0.5, 1.0])
def test_who_is_picked_out_and_who_is_judged_with_all_others_makes_no_difference(
    sparse, scenario, monkeypatch
):
    monkeypatch.setattr(_post_evaluation, "FEW_UNDECIDED", sparse)
    classifier = ElmanClassifier(scale=scenario.input_scale, threads=1)
    expected = naive_accuracy(classifier, GENOMES, scenario, MODELS, trials=3, seed=4)
    found = post_evaluate(classifier, GENOMES, scenario, MODELS, trials=3, seed=4, threads=1)
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_counts_of_parts_add_up_to_those_of_all(scenario):
    classifier = ElmanClassifier(scale=scenario.input_scale, threads=1)
    options = {"trials": 2, "seed": 3, "threads": 1}
    parts = [
        count_agents(classifier, GENOMES, scenario, MODELS, chunk=part, **options)
        for part in (slice(3), slice(3, None))
    ]
    whole = count_agents(classifier, GENOMES, scenario, MODELS, **options)
    np.testing.assert_array_equal(sum(parts), whole)


def test_counting_stops_between_classifiers_when_it_is_asked_to(scenario, monkeypatch):
    monkeypatch.setattr(_post_evaluation, "CLASSIFIERS_AT_ONCE", 2)
    asked, listener = [], Listener()

    def should_stop():
        asked.append(True)
        return len(asked) > 1

    assert (
        count_agents(listener, GENOMES, scenario, MODELS, trials=3, seed=0, should_stop=should_stop)
        is None
    )
    assert len(listener.heard) == 3
