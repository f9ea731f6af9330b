import numpy as np
import pytest

from turing_learning.config import ConfigurationError
from turing_learning.detection import RULES
from turing_learning.detection._votes import weigh

RNG = np.random.default_rng(5)
NOISE = RNG.random((4, 200, 10)) < 0.2


def votes(*errors, truth):
    """Return votes (N, 200, 10) of classifiers that are right except where their errors say so."""
    return np.stack([error != truth for error in errors])


def weights(rule, *errors):
    return weigh(rule, votes(*errors, truth=True), votes(*errors, truth=False))


@pytest.mark.parametrize("rule", RULES)
def test_weights_are_shares(rule):
    found = weights(rule, *NOISE, ~NOISE[0])
    assert (found >= 0).all()
    assert found.sum() == pytest.approx(1.0)


def test_equal_votes_do_not_ask_for_competence():
    assert weights("fittest", NOISE[0], ~NOISE[0]).tolist() == [0.5, 0.5]


@pytest.mark.parametrize("rule", ["unanimous", "discriminant"])
def test_one_that_is_wrong_more_often_than_right_has_no_vote(rule):
    found = weights(rule, NOISE[0], ~NOISE[1])
    assert found.tolist() == [1.0, 0.0]


def test_those_that_say_the_same_share_the_vote_of_one():
    found = weights("discriminant", NOISE[0], NOISE[0], NOISE[0], NOISE[1])
    assert found[3] > 1.3 * found[0]
    assert found[:3].tolist() == pytest.approx([found[0]] * 3)


def test_one_that_hardly_ever_errs_outweighs_one_that_errs_often():
    rare = RNG.random((200, 10)) < 0.01
    found = weights("discriminant", rare, NOISE[0])
    assert found[0] / found[1] > 5


def test_the_discriminant_is_better_than_competence_alone_where_many_say_the_same():
    def shares(found):
        fresh = RNG.random((4, 4000, 1)) < 0.2
        copies = np.concatenate([np.repeat(fresh[:1], 20, axis=0), fresh[1:]])
        return np.mean(np.tensordot(found, copies, axes=1) > 0.5)

    errors = [*[NOISE[0]] * 20, *NOISE[1:]]
    assert shares(weights("discriminant", *errors)) < 0.6 * shares(
        np.full(len(errors), 1 / len(errors))
    )


@pytest.mark.parametrize("rule", RULES)
def test_without_classifiers_there_is_no_weight(rule):
    nobody = np.empty((0, 3, 2), bool)
    with pytest.raises(
        ConfigurationError, match=r"^`genomes` must hold a classifier that tells .* got 0 that"
    ):
        weigh(rule, nobody, nobody)
