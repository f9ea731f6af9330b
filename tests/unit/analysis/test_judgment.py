"""Whether to believe an estimate: which words follow from which evidence."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from turing_learning.analysis import Judgment, Verdict

TRUTHS = (0.50, 0.49, 0.51, 0.50, 0.51, 0.48, 0.52)
SUCCEED = {"recovered": (0.50, 0.52, 0.51, 0.53, 0.49), "attainable": TRUTHS}
MISS = {"recovered": (0.68, 0.72, 0.61, 0.75, 0.66), "attainable": TRUTHS}


@dataclass(frozen=True)
class Examined:
    """An examiner of whom nothing else is known."""

    accuracy: float
    p_value: float
    power: float = 0.95
    plausible: tuple[float, ...] = ()


PASSES, TELLS, BLIND = Examined(0.488, 0.6), Examined(0.64, 0.001), Examined(0.56, 0.2, power=0.5)


@pytest.mark.parametrize(
    ("said", "examination", "evidence", "verdicts"),
    [
        ((), None, {}, ["converged"]),
        (["converged"], None, {}, ["converged"]),
        (["still moving", "at a bound"], None, {}, ["still moving", "at a bound"]),
        (["classifiers can still tell"], None, {}, ["classifiers can still tell"]),
        # fresh classifiers cannot tell
        ((), PASSES, SUCCEED, ["converged"]),
        ((), PASSES, {}, ["converged"]),
        ((), PASSES, MISS, ["search unreliable"]),
        ((), PASSES, {"near": False}, ["converged"]),
        (["classifiers can still tell"], PASSES, SUCCEED, ["classifiers disagree"]),
        (["runs disagree"], PASSES, SUCCEED, ["runs disagree"]),
        # they can
        ((), TELLS, {}, ["classifiers can still tell"]),
        ((), TELLS, {"near": False}, ["classifiers can still tell"]),
        ((), TELLS, {"near": True}, ["classifiers can still tell"]),
        ((), TELLS, SUCCEED, ["model rejected"]),
        (
            ["classifiers can still tell", "still moving"],
            TELLS,
            SUCCEED,
            ["model rejected", "still moving"],
        ),
        ((), TELLS, MISS, ["search failed"]),
        (["classifiers can still tell"], TELLS, MISS, ["search failed"]),
        # searches miss, but by far less than the estimate is told
        ((), replace(TELLS, accuracy=0.967), MISS, ["model rejected"]),
        ((), replace(TELLS, accuracy=0.85), MISS, ["search failed"]),
        # they do, but no better than they tell right models
        ((), replace(TELLS, accuracy=0.525), SUCCEED, ["converged"]),
        ((), replace(TELLS, accuracy=0.515), MISS, ["search unreliable"]),
        ((), replace(TELLS, plausible=(0.55, 0.6, 0.65, 0.7)), {}, ["converged"]),
        (
            (),
            replace(TELLS, accuracy=0.8, plausible=(0.55, 0.6, 0.62)),
            {},
            ["classifiers can still tell"],
        ),
        # right models are told so well that nothing could be told better
        ((), replace(TELLS, accuracy=1.0, plausible=(0.9, 1.0, 0.98)), {}, ["check cannot say"]),
        # they would not notice
        ((), BLIND, SUCCEED, ["check cannot say"]),
        ((), BLIND, MISS, ["search unreliable", "check cannot say"]),
        (["classifiers can still tell"], BLIND, SUCCEED, ["classifiers can still tell"]),
        # what is known of the parameters
        ((), PASSES, {"parameters": 2, "loose": ("a", "b")}, ["nothing pinned down"]),
        ((), PASSES, {"parameters": 2, "loose": ("a",)}, ["converged"]),
        ((), TELLS, {"parameters": 1, "loose": ("a",)}, ["classifiers can still tell"]),
        ((), BLIND, {"parameters": 1, "loose": ("a",)}, ["check cannot say"]),
    ],
)
def test_words_follow_from_the_evidence(said, examination, evidence, verdicts):
    found = Judgment(tuple(said), examination, **evidence)
    assert list(found.verdicts) == verdicts
    assert found.line.startswith(f"Verdict: {verdicts[0]}. ")
    assert found.to_json()["verdicts"] == verdicts


def test_a_passing_estimate_whose_search_misses_known_truths_has_not_failed():
    found = Judgment((), PASSES, **MISS)
    assert found.sentences[:2] == (
        "The estimate passes: fresh classifiers cannot tell held-out samples from the model (accuracy 0.488, p = 0.600).",
        "Searches for a known truth end with models that classifiers tell from it (mean accuracy 0.684).",
    )


def test_what_a_search_that_misses_does_not_explain_is_said():
    found = Judgment((), replace(TELLS, accuracy=0.967), **MISS)
    assert "The estimate is told far better: the search does not explain it." in found.sentences


def test_a_test_that_would_not_notice_cannot_say():
    (said, *_) = Judgment((), BLIND).sentences
    assert said == (
        "Fresh classifiers cannot say whether the estimate fits (accuracy 0.560, p = 0.200): they would notice a "
        "clearly wrong model in 50% of such checks."
    )


def test_an_estimate_that_passes_as_others_would_is_not_called_determined():
    found = Judgment((), PASSES, parameters=2, loose=("a", "b"))
    assert "The check shows for no parameter that the samples determine it." in found.sentences
    assert found.look == "warning"


def test_a_failed_search_looks_as_bad_as_a_wrong_model():
    assert [Judgment((), TELLS, **each).look for each in (SUCCEED, MISS)] == ["bad", "bad"]
    assert Judgment((), PASSES, **SUCCEED).look == "good"


def test_a_right_model_passes_nine_times_of_ten():
    rng, verdicts = np.random.default_rng(4), []
    for _ in range(300):
        accuracy = rng.normal(0.51, 0.02)
        test = Examined(accuracy, 0.04 if accuracy > 0.53 else 0.4)
        recovered, attainable = tuple(rng.normal(0.51, 0.02, 5)), tuple(rng.normal(0.505, 0.02, 15))
        verdicts.append(Judgment((), test, recovered=recovered, attainable=attainable).verdict)
    assert verdicts.count(Verdict.CONVERGED) / 300 >= 0.9


def test_every_word_has_a_meaning_and_is_read_again():
    for verdict in Verdict:
        assert verdict.meaning.endswith(".")
        assert Judgment((verdict,)).verdicts == (verdict,)


def test_words_of_version_0_2_0_are_read():
    words = [
        "model rejected",
        "classifiers can still tell",
        "runs disagree",
        "still moving",
        "at a bound",
        "converged",
    ]
    assert [Verdict(word) for word in words] == words
