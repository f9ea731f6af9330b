from dataclasses import replace

import numpy as np
import pytest

from turing_learning.config import ConfigurationError
from turing_learning.identifiability import Effort, two_sample_test


def test_a_wrong_model_is_told_apart(evidence, small):
    found = two_sample_test(evidence(), np.array([1.5, 0]), small, seed=1)
    assert found.told_apart
    assert found.p_value <= 0.01
    assert found.accuracy > 0.8
    assert found.accuracy > found.critical


def test_the_truth_is_not_told_apart(evidence, small):
    found = two_sample_test(evidence(), np.zeros(2), small, seed=1)
    assert found.p_value > 0.05
    assert abs(found.accuracy - 0.5) < 0.15


def test_the_result_is_the_same_for_any_number_of_threads(evidence, small):
    one, two = (
        two_sample_test(evidence(threads=n), np.array([0.3, 0]), small, seed=4) for n in (1, 2)
    )
    assert one == two


def test_kept_out_samples_are_never_trained_with(evidence, small):
    seen = []

    class Watching:
        def __init__(self, classifier):
            self.classifier, self.parameters = classifier, classifier.parameters

        def judge(self, genomes, samples):
            seen.append(samples)
            return self.classifier.judge(genomes, samples)

    given = evidence()
    two_sample_test(
        replace(given, classifier=Watching(given.classifier)), np.ones(2), small, seed=1
    )
    training, testing = seen[:-2], seen[-2]
    assert len(training) == small.generations + 1
    np.testing.assert_array_equal(testing, given.testing)
    first = {sample.tobytes() for samples in training for sample in samples}
    assert not first & {sample.tobytes() for sample in given.testing}


def test_samples_of_one_individual_are_one_group_and_simulated_ones_come_in_bundles_of_that_size(
    evidence, small
):
    found = two_sample_test(evidence(groups=np.repeat(np.arange(8), 5)), np.zeros(2), small, seed=1)
    assert (found.genuine_samples, found.genuine_groups) == (40, 8)
    assert (found.counterfeit_samples, found.counterfeit_groups) == (100, 20)


def test_a_single_group_is_refused(evidence, small):
    with pytest.raises(
        ConfigurationError,
        match="`groups` must tell at least 2 groups of held-out samples apart; got 1",
    ):
        two_sample_test(evidence(groups=np.zeros(40, dtype=int)), np.zeros(2), small, seed=1)


def test_a_model_that_cannot_be_simulated_is_refused_by_name(evidence, small):
    failing = evidence(simulate=lambda values, rng: np.zeros((1, 1, 20, 1)))
    with pytest.raises(
        ConfigurationError, match=r"got 39 failures of 40 \[\{'mean': 0.5, 'nothing': 0.0\}\]"
    ):
        two_sample_test(failing, np.array([0.5, 0]), small, seed=1)


@pytest.mark.parametrize(
    ("name", "value"), [("samples", 9), ("generations", 0), ("population", 3.0), ("points", -1)]
)
def test_too_little_effort_is_refused(name, value):
    with pytest.raises(ConfigurationError, match=f"`{name}` must be an integer of at least"):
        Effort(**{name: value})


@pytest.mark.parametrize("points", [1, 3, 5])
def test_profiles_too_coarse_to_pin_anything_down_are_refused(points):
    with pytest.raises(
        ConfigurationError,
        match=rf"`points` must be at least 6, or 0 for no profiles; got {points}\.",
    ):
        Effort(points=points)
