import numpy as np
import pytest

from turing_learning.coevolution import (
    Classifier,
    InteractiveInterrogation,
    PassiveInterrogation,
    Samples,
    SampleSource,
)

MODELS = np.array([[0.1], [0.2], [0.3]])
GENOMES = np.array([[0.0], [0.5]])


class Source:
    """Genuine samples are random; the samples of a model are its parameter and, for the second, one half more."""

    def __init__(self, genuine=4):
        self.genuine = genuine
        self.collected = []

    def collect(self, models, rng):
        counterfeit = models[:, None, None, :] + np.array([0.0, 0.5])[:, None, None]
        self.collected.append(Samples(rng.random((self.genuine, 1, 1)), counterfeit))
        return self.collected[-1]


class Adder:
    """Outputs the value of the sample plus the parameter of the classifier, at most 1."""

    parameters = 1

    def judge(self, genomes, samples):
        return np.minimum(genomes + samples[:, 0, 0], 1.0)


def rng():
    return np.random.default_rng(1)


def test_doubles_fit_the_protocols():
    assert isinstance(Source(), SampleSource)
    assert isinstance(Adder(), Classifier)


def test_passive_interrogation_collects_once():
    source = Source()
    PassiveInterrogation(source, Adder())(MODELS, GENOMES, rng())
    assert len(source.collected) == 1


def test_outputs_are_ordered_by_classifier_model_and_sample():
    judgments = PassiveInterrogation(Source(), Adder())(MODELS, GENOMES, rng())
    expected = [[[0.1, 0.6], [0.2, 0.7], [0.3, 0.8]], [[0.6, 1.0], [0.7, 1.0], [0.8, 1.0]]]
    np.testing.assert_allclose(judgments.counterfeit_outputs, expected)


def test_all_classifiers_judge_the_same_genuine_samples_when_passive():
    source = Source()
    judgments = PassiveInterrogation(source, Adder())(MODELS, GENOMES * 0, rng())
    values = source.collected[0].genuine[:, 0, 0]
    np.testing.assert_array_equal(judgments.genuine_outputs, [values, values])


class Talks:
    """Outputs of a classifier on a model: the model's parameter plus the classifier's; on the system 1. Counts the trials."""

    def __init__(self):
        self.asked = []

    def confront(self, models, classifiers, met, genuine, rng):
        self.asked.append((met, genuine))
        return np.ones((len(classifiers), genuine)), classifiers + models[met][..., 0]


def test_each_classifier_meets_as_many_models_and_each_model_as_many_classifiers():
    source, models = Talks(), np.linspace(0, 0.3, 6)[:, None]
    judgments = InteractiveInterrogation(source, 2)(models, np.zeros((9, 1)), rng())
    (met, genuine) = source.asked[0]
    assert genuine == 2
    assert all(len(set(row)) == 2 for row in met.tolist())
    np.testing.assert_array_equal(np.bincount(met.ravel(), minlength=6), 3)
    np.testing.assert_array_equal(np.count_nonzero(judgments.met, axis=1), 2)
    np.testing.assert_allclose(
        judgments.counterfeit_outputs[judgments.met, 0],
        np.tile(models[:, 0], (9, 1))[judgments.met],
    )
    np.testing.assert_array_equal(judgments.counterfeit_outputs[~judgments.met], 0)


def test_classifiers_that_meet_all_models_leave_full_judgments():
    judgments = InteractiveInterrogation(Talks(), 100)(MODELS, GENOMES, rng())
    assert judgments.met is None
    np.testing.assert_allclose(
        judgments.counterfeit_outputs[:, :, 0], [[0.1, 0.2, 0.3], [0.6, 0.7, 0.8]]
    )


def test_referees_meet_models_of_their_own_and_not_the_system():
    source = Talks()
    judgments = InteractiveInterrogation(source, 2)(
        MODELS, GENOMES, rng(), referees=np.array([[0.25]])
    )
    assert [genuine for _, genuine in source.asked] == [2, 0]
    np.testing.assert_array_equal(np.count_nonzero(judgments.referees_met, axis=1), [2])


def test_a_source_that_returns_another_number_of_outputs_is_refused():
    class Short(Talks):
        def confront(self, models, classifiers, met, genuine, rng):
            return super().confront(models, classifiers, met[:, 1:], genuine, rng)

    with pytest.raises(
        ValueError,
        match=r"`source.confront` must return outputs of shapes \(2, 2\) and \(2, 2\); got",
    ):
        InteractiveInterrogation(Short(), 2)(MODELS, GENOMES, rng())


def test_a_source_that_forgets_models_is_refused():
    class Forgetful(Source):
        def collect(self, models, rng):
            return super().collect(models[1:], rng)

    with pytest.raises(
        ValueError,
        match=r"`source` must yield counterfeit samples of each of the M = 3 models; got",
    ):
        PassiveInterrogation(Forgetful(), Adder())(MODELS, GENOMES, rng())


def test_a_classifier_that_returns_another_shape_is_refused():
    class Transposed(Adder):
        def judge(self, genomes, samples):
            return super().judge(genomes, samples).T

    with pytest.raises(
        ValueError,
        match=r"`classifier.judge` must return outputs of shape \(N, S\) = \(\d, 4\); got",
    ):
        PassiveInterrogation(Source(), Transposed())(MODELS, GENOMES, rng())
