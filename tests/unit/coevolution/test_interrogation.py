import numpy as np
import pytest

from turing_learning.coevolution import (
    Classifier,
    InteractiveInterrogation,
    InteractiveSampleSource,
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
    assert not isinstance(Source(), InteractiveSampleSource)
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


def test_interactive_interrogation_collects_for_each_classifier():
    source = Source()
    judgments = InteractiveInterrogation(source, Adder())(MODELS, GENOMES * 0, rng())
    values = [samples.genuine[:, 0, 0] for samples in source.collected]
    assert not np.isclose(values[0], values[1]).any()
    np.testing.assert_array_equal(judgments.genuine_outputs, values)


def test_interactive_interrogation_gives_judgments_of_the_same_shape():
    judgments = InteractiveInterrogation(Source(), Adder())(MODELS, GENOMES, rng())
    assert judgments.genuine_outputs.shape == (2, 4)
    assert judgments.counterfeit_outputs.shape == (2, 3, 2)


def test_each_classifier_can_influence_the_source():
    class Facing(Source):
        def facing(self, classifier):
            return Source(genuine=self.genuine) if classifier[0] == 0 else Silent()

    class Silent:
        def collect(self, models, rng):
            return Samples(np.zeros((4, 1, 1)), np.zeros((len(models), 2, 1, 1)))

    judgments = InteractiveInterrogation(Facing(), Adder())(MODELS, GENOMES, rng())
    np.testing.assert_allclose(judgments.counterfeit_outputs[0, :, 0], [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(judgments.counterfeit_outputs[1], 0.5)


@pytest.mark.parametrize("interrogation", [PassiveInterrogation, InteractiveInterrogation])
def test_a_source_that_forgets_models_is_refused(interrogation):
    class Forgetful(Source):
        def collect(self, models, rng):
            return super().collect(models[1:], rng)

    with pytest.raises(ValueError, match=r"`source` must yield counterfeit samples of each of the M = 3 models; got"):
        interrogation(Forgetful(), Adder())(MODELS, GENOMES, rng())


@pytest.mark.parametrize("interrogation", [PassiveInterrogation, InteractiveInterrogation])
def test_a_classifier_that_returns_another_shape_is_refused(interrogation):
    class Transposed(Adder):
        def judge(self, genomes, samples):
            return super().judge(genomes, samples).T

    with pytest.raises(ValueError, match=r"`classifier.judge` must return outputs of shape \(N, S\) = \(\d, 4\); got"):
        interrogation(Source(), Transposed())(MODELS, GENOMES, rng())


def test_a_source_that_yields_different_numbers_of_samples_is_refused():
    class Growing(Source):
        def collect(self, models, rng):
            self.genuine += 1
            return super().collect(models, rng)

    message = r"same numbers of samples \(K, M, C\) for every classifier; got \[\(5, 3, 2\), \(6, 3, 2\)\]"
    with pytest.raises(ValueError, match=message):
        InteractiveInterrogation(Growing(), Adder())(MODELS, GENOMES, rng())
