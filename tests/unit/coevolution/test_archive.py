import numpy as np
import pytest

from turing_learning.coevolution import ClassifierArchive, Judgments, jury_reward, model_reward


def filled(capacity, offered, seed=1):
    archive = ClassifierArchive(capacity, seed=seed)
    for k in range(offered):
        archive.admit(np.array([float(k), -1.0]), k / 100)
    return archive


def test_everything_is_kept_until_the_archive_is_full():
    np.testing.assert_array_equal(filled(5, 3).genomes[:, 0], [0, 1, 2])


def test_a_full_archive_keeps_its_size():
    assert filled(5, 100).genomes.shape == (5, 2)


def test_every_generation_has_the_same_chance_to_be_kept():
    kept = np.concatenate([filled(10, 50, seed=seed).genomes[:, 0] for seed in range(200)]).astype(
        int
    )
    counts = np.bincount(kept, minlength=50)
    # 200 archives of 10 out of 50: 40 expected for each, variance 200 * 0.2 * 0.8 = 32; 4.5 standard deviations are 25.
    assert counts.min() > 40 - 25
    assert counts.max() < 40 + 25


def test_a_restored_archive_goes_on_as_if_nothing_had_happened():
    whole = filled(4, 30)
    part = filled(4, 12)
    copy = ClassifierArchive(4, seed=1)
    copy.restore(part.state())
    for k in range(12, 30):
        copy.admit(np.array([float(k), -1.0]), k / 100)
    np.testing.assert_array_equal(copy.genomes, whole.genomes)
    np.testing.assert_array_equal(copy.specificity, whole.genomes[:, 0] / 100)


def test_a_capacity_below_one_is_refused():
    with pytest.raises(ValueError, match="`capacity` must be an integer of at least 1; got 0"):
        ClassifierArchive(0, seed=1)


def test_a_state_that_lacks_an_array_is_refused():
    message = r"`state` must hold an array 'specificity'; got \['genomes'\]"
    with pytest.raises(ValueError, match=message):
        ClassifierArchive(4, seed=1).restore({"genomes": np.zeros((2, 3))})


def judgments(referees=None, specificity=None):
    """Two classifiers of specificity 1 and 2/3; the first misled by model 0, the second by both."""
    genuine = np.array([[0.9, 0.9, 0.9], [0.9, 0.9, 0.1]])
    return Judgments(genuine, np.array([[[0.9], [0.1]], [[0.9], [0.9]]]), referees, specificity)


def test_only_who_tells_the_system_from_the_models_has_a_vote():
    # Youden's J: 1 - 1/2 = 1/2 for the first classifier, 2/3 - 1 < 0 for the second.
    np.testing.assert_allclose(jury_reward(judgments()), [1.0, 0.0])


def test_referees_vote_according_to_their_specificity_then_and_their_sensitivity_now():
    referees = np.array([[[0.2], [0.8]], [[0.9], [0.9]], [[0.1], [0.1]]])
    # J of the jurors: 1/2 and none as above; 1 - 1/2, 1 - 1 = 0 and 1/4 - 0.
    refereed = judgments(referees, np.array([1.0, 1.0, 0.25]))
    np.testing.assert_allclose(jury_reward(refereed), [0.5 / 1.25, 0.5 / 1.25])


def test_where_nobody_can_tell_anything_the_reward_is_equation_1():
    blind = Judgments(np.full((2, 3), 0.1), np.array([[[0.9], [0.1]], [[0.9], [0.9]]]))
    np.testing.assert_array_equal(jury_reward(blind), model_reward(blind))


def test_referees_must_have_judged_the_same_models():
    with pytest.raises(
        ValueError,
        match=r"`referee_outputs` must be of shape \(B, M, C\) = \(any, 2, 1\); got \(4, 3, 1\)",
    ):
        judgments(np.full((4, 3, 1), 0.5))
