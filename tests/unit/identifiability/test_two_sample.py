import numpy as np
import pytest

from turing_learning import examination
from turing_learning.analysis import Judgment
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


def test_held_out_samples_are_never_learned_from(evidence, small, monkeypatch):
    learned = []
    monkeypatch.setattr(
        examination,
        "answers",
        lambda genuine, others, judged, **options: (
            learned.append((genuine, judged)) or np.arange(len(judged)) % 2 == 0
        ),
    )
    source = evidence()
    two_sample_test(source, np.ones(2), small, seed=1)
    ((genuine, judged),) = learned
    np.testing.assert_array_equal(judged[: len(source.testing)], source.testing)
    first = {sample.tobytes() for sample in genuine}
    assert not first & {sample.tobytes() for sample in source.testing}


def test_a_model_is_right_if_it_is_told_no_better_than_what_is_plausible(evidence, small):
    means = np.linspace(-2, 2, 100)
    plausible = np.stack((means, np.zeros(100)), axis=1)
    wide = two_sample_test(evidence(), plausible, small, seed=1, references=12)
    assert len(wide.plausible) == 12
    assert Judgment(examination=wide).fits is not False
    wrong = two_sample_test(evidence(), plausible / 20 + [1.5, 0], small, seed=1, references=12)
    assert Judgment(examination=wrong).fits is False


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


@pytest.mark.parametrize(("name", "value"), [("samples", 9), ("references", 1), ("points", -1)])
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
