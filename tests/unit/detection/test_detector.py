import logging
from dataclasses import replace

import numpy as np
import pytest

from turing_learning.config import ConfigurationError
from turing_learning.detection import RULES, Detector, Motion, RecordedMotion

RNG = np.random.default_rng(3)
LIMITS = np.array([[-1.0], [2.0], [4.0], [9.0]])  # accept everything, two that tell, accept nothing


@pytest.fixture
def genuine(motion_at):
    """Forty individuals whose speed in five samples is about 6, with a slow sample now and then."""
    return motion_at(RNG.normal(6, 1.2, (40, 5)))


@pytest.fixture
def abnormal(motion_at):
    return motion_at(RNG.normal(1, 1.2, (30, 5)))


@pytest.fixture
def detector(speed_limits, genuine, abnormal):
    def make(**options):
        limits = LIMITS[2:3] if options.get("rule") == "fittest" else LIMITS
        return Detector.calibrate(
            speed_limits, limits, genuine=genuine, abnormal=abnormal, **options
        )

    return make


def test_only_classifiers_that_tell_have_a_vote(speed_limits, motion_at):
    genuine = motion_at(
        [[1, 3, 5, 5], [5, 5, 5, 5]]
    )  # the limits accept 1, 3/4, 1/2, 0 of the first half
    abnormal = motion_at([[0, 0, 3, 3]])  # and 1, 1/2, 0, 0 of these
    found = Detector.calibrate(speed_limits, LIMITS, genuine=genuine, abnormal=abnormal)
    assert found.genomes.ravel().tolist() == [2.0, 4.0]
    assert found.weights[1] > found.weights[0] > 0
    assert found.weights.sum() == pytest.approx(1.0)


def test_a_score_is_the_weighted_share_of_votes_for_genuine(speed_limits, motion_at):
    genuine, abnormal = motion_at([[1, 3, 5, 5], [5, 5, 5, 5]]), motion_at([[0, 0, 3, 3]])
    found = Detector.calibrate(speed_limits, LIMITS, genuine=genuine, abnormal=abnormal)
    np.testing.assert_allclose(
        found.judge(motion_at([[0, 2, 6]])[0]), [0, found.weights[0], 1], atol=1e-9
    )


def test_only_the_second_half_says_what_scores_are_usual(speed_limits, motion_at):
    genuine, abnormal = motion_at([[9, 9], [3, 9]]), motion_at([[0, 0]])
    found = Detector.calibrate(speed_limits, LIMITS[:3], genuine=genuine, abnormal=abnormal)
    assert found.weights.tolist() == pytest.approx([0.5, 0.5])
    assert found.genuine_scores.tolist() == [0.5, 1.0]


def test_the_fittest_votes_alone(speed_limits, genuine, abnormal):
    found = Detector.calibrate(
        speed_limits, LIMITS[2:3], genuine=genuine, abnormal=abnormal, rule="fittest"
    )
    assert (found.genomes.tolist(), found.weights.tolist()) == ([[4.0]], [1.0])


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("false_alarms", [0.02, 0.2])
def test_no_more_than_the_stated_share_of_genuine_individuals_is_called_abnormal(
    speed_limits, motion_at, samples, false_alarms
):
    limits = np.linspace(0, 8, 60)[:, None]
    genuine, abnormal = (
        motion_at(RNG.normal(6, 1.2, (500, 4))),
        motion_at(RNG.normal(1, 1.2, (50, 4))),
    )
    found = Detector.calibrate(
        speed_limits,
        limits,
        genuine=genuine,
        abnormal=abnormal,
        rule="discriminant",
        false_alarms=false_alarms,
    )
    fresh = found.called_abnormal(motion_at(RNG.normal(6, 1.2, (4000, samples))))
    # 1000 scores calibrate and 4000 test: four standard deviations of both, of the share for single samples
    margin = 4 * np.sqrt(false_alarms * (1 - false_alarms) * (1 / 1000 + 1 / 4000))
    assert abs(np.mean(fresh) - false_alarms) < margin


def test_more_samples_say_more_against_an_individual(detector, motion_at):
    once, often = (
        detector(rule="discriminant").p_values(motion_at([[3.0] * n]))[0] for n in (1, 10)
    )
    assert often < 0.1 * once


def test_more_false_alarms_call_more_individuals_abnormal(detector, motion_at):
    found, motion = (
        detector(rule="discriminant", false_alarms=0.01),
        motion_at(RNG.normal(4, 2, (50, 5))),
    )
    few, many = (each.called_abnormal(motion) for each in (found, replace(found, false_alarms=0.2)))
    assert set(np.flatnonzero(few)) < set(np.flatnonzero(many))
    assert found.false_alarms == 0.01


def test_an_individual_is_abnormal_if_its_mean_score_is_low(detector, motion_at):
    found = detector(rule="discriminant")
    assert found.abnormal(motion_at([[0, 1, 0, 1]])[0])
    assert not found.abnormal(motion_at([[6, 6, 0, 6]])[0])


@pytest.mark.parametrize(("speeds", "expected"), [([0] * 10, True), ([0] * 9 + [6], False)])
def test_by_the_unanimous_rule_all_samples_must_be_judged_counterfeit(
    detector, motion_at, speeds, expected
):
    assert detector(rule="unanimous").abnormal(motion_at([speeds])[0]) is expected


def test_for_the_unanimous_rule_a_classifier_that_is_strict_with_single_samples_is_best(
    speed_limits, motion_at
):
    genuine = motion_at([[3, 5, 3, 5]] * 4)  # never all below 4
    abnormal = motion_at([[0, 2, 3, 1]] * 4)
    options = {"genuine": genuine, "abnormal": abnormal}
    assert Detector.calibrate(
        speed_limits, LIMITS, rule="unanimous", **options
    ).genomes.tolist() == [[4.0]]


def test_the_verdict_says_how_much_was_judged_genuine_and_since_when_not(detector, motion_at):
    motion = Motion(
        ("good", "late", "bad"), motion_at([[6, 6, 6, 6, 6], [6, 0, 6, 0, 0], [0, 0, 0, 0, 0]])
    )
    good, late, bad = detector(rule="fittest").verdicts(motion)
    assert (good.individual, good.abnormal, good.since, good.genuine_share) == (
        "good",
        False,
        None,
        1.0,
    )
    assert (late.individual, late.abnormal, late.since, late.genuine_share) == (
        "late",
        True,
        4,
        0.4,
    )
    assert (bad.abnormal, bad.since, bad.genuine_share, bad.score) == (True, 1, 0.0, 0.0)
    assert bad.p_value < late.p_value <= 0.01 < good.p_value


def test_individuals_without_names_are_counted(detector, motion_at):
    assert [verdict.individual for verdict in detector().verdicts(motion_at([[6.0], [0.0]]))] == [
        "1",
        "2",
    ]


def test_the_order_of_individuals_does_not_matter(detector, motion_at):
    found, motion = detector(rule="discriminant"), motion_at(RNG.normal(4, 3, (12, 5)))
    order = RNG.permutation(12)
    np.testing.assert_array_equal(found.p_values(motion[order]), found.p_values(motion)[order])


def test_p_values_are_the_same_every_time_and_for_each_alone(detector, motion_at):
    found, motion = detector(rule="discriminant"), motion_at(RNG.normal(4, 2, (70, 7)))
    together = found.p_values(motion)
    np.testing.assert_array_equal(together, found.p_values(motion))
    np.testing.assert_array_equal(together, [found.p_values(motion[[k]])[0] for k in range(70)])


@pytest.mark.parametrize("rule", RULES)
def test_perfect_classifiers_raise_no_alarm(speed_limits, motion_at, rule):
    limits = np.linspace(2, 4, 7)[
        :, None
    ]  # seven equal weights do not sum to 1 in floating-point numbers
    found = Detector.calibrate(
        speed_limits,
        limits,
        genuine=motion_at(np.full((4, 3), 9.0)),
        abnormal=motion_at([[0, 0, 0]]),
        rule=rule,
    )
    assert not found.abnormal(motion_at([[9] * 11])[0])
    assert found.abnormal(motion_at([[0] * 11])[0])


def test_motion_of_lists_is_that_of_arrays(detector, motion_at):
    samples, found = motion_at([[6, 6, 6, 6, 6], [0, 0, 0, 0, 0]]), detector(rule="fittest")
    expected = found.verdicts(Motion(("good", "bad"), samples))
    motion = Motion(["good", "bad"], samples.tolist())
    assert motion.individuals == ("good", "bad")
    np.testing.assert_array_equal(motion.samples, samples)
    assert found.verdicts(motion) == expected


@pytest.mark.parametrize(
    ("names", "samples", "message"),
    [
        (("a", "b"), np.zeros((2, 3, 4)), "^`samples` must be of shape"),
        (
            ("a", "b"),
            np.full((2, 3, 4, 2), "0.5"),
            "^`samples` must be an array of numbers; got an array of <U3",
        ),
        (
            ("a",),
            np.zeros((2, 3, 4, 2)),
            "^`individuals` must be one name for each of the 2 individuals; got 1",
        ),
    ],
)
def test_motion_that_is_none_is_refused(names, samples, message):
    with pytest.raises(ConfigurationError, match=message):
        Motion(names, samples)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"rule": "fitest"},
            "^`rule` must be one of the rules; got 'fitest'. Did you mean `fittest`?",
        ),
        ({"rule": "archive"}, "got 'archive'. Choose from: discriminant, fittest, unanimous."),
        ({"false_alarms": 0.0}, "^`false_alarms` must be .* above 0 and below 1; got 0.0"),
        ({"false_alarms": 1.0}, "^`false_alarms` must be .* above 0 and below 1; got 1.0"),
    ],
)
def test_a_detector_that_cannot_be_made_is_refused(detector, options, message):
    with pytest.raises(ConfigurationError, match=message):
        detector(**options)


@pytest.mark.parametrize(
    ("genuine", "abnormal", "message"),
    [
        (
            np.ones((1, 3, 4, 2)),
            np.zeros((2, 3, 4, 2)),
            "^`genuine` must hold at least 2 individuals; got 1",
        ),
        (
            np.ones((3, 4, 2)),
            np.zeros((2, 3, 4, 2)),
            r"^`genuine` must be of shape \(individuals, samples, T, D\); got",
        ),
        (
            np.ones((2, 3, 4, 2)),
            np.zeros((2, 3, 5, 2)),
            r"^`abnormal` must be of .* = \(any, any, 4, 2\); got ",
        ),
        (
            np.ones((2, 3, 4, 2)),
            np.ones((2, 3, 4, 2)) * [1, 2],
            "^`genomes` must hold a classifier that tells .* got 4",
        ),
        (
            np.arange(48.0).reshape(2, 3, 4, 2),
            np.arange(48.0).reshape(2, 3, 4, 2)[::-1, 1:],
            "^`abnormal` must be other motion than `genuine`; got 4 samples that are all in `genuine`, too. Give motion of",
        ),
    ],
)
def test_motion_that_cannot_calibrate_is_refused(speed_limits, genuine, abnormal, message):
    with pytest.raises(ConfigurationError, match=message):
        Detector.calibrate(speed_limits, LIMITS, genuine=genuine, abnormal=abnormal)


def test_motion_that_is_not_finite_is_refused_with_its_place(detector, motion_at):
    motion = motion_at([[6, 6], [6, 6]])
    motion[1, 0, 2, 1] = np.nan
    message = r"^`motion` must be finite; got nan \[individual slow, sample 0, step 2, signal 1\]"
    with pytest.raises(ConfigurationError, match=message):
        detector().verdicts(Motion(("quick", "slow"), motion))


def test_samples_of_another_length_are_refused(detector):
    message = r"^`samples` must be .* = \(any, any, 4, 2\); got \(1, 3, 5, 2\)"
    with pytest.raises(ConfigurationError, match=message):
        detector().judge(np.zeros((3, 5, 2)))


def test_no_sample_has_no_verdict(detector):
    with pytest.raises(
        ConfigurationError, match=r"^`samples` must be .* and not empty; got \(1, 0, 4, 2\)"
    ):
        detector().abnormal(np.zeros((0, 4, 2)))


def test_scores_of_0_that_are_no_rarer_than_false_alarms_are_told_with_the_numbers(
    detector, motion_at, caplog
):
    found = detector(rule="fittest")  # by a single sample, and one classifier, the score is 0 or 1
    with caplog.at_level(logging.WARNING, logger="turing_learning"):
        lowest, _ = found.verdicts(motion_at([[0.0], [6.0]]))
        share = np.mean(found.genuine_scores == 0)
        assert not lowest.abnormal
        assert caplog.messages == [
            f"Nobody can be called abnormal by 1 sample each: with score 0 throughout the p-value is {lowest.p_value:.3g}, and "
            f"at most 0.01 is asked for; {share:.3g} of 100 genuine samples have that score. Take more samples of each, another "
            "rule, or allow more false alarms."
        ]
        caplog.clear()
        assert found.verdicts(motion_at([[0.0] * 10, [6.0] * 10]))[0].abnormal
        assert replace(found, false_alarms=0.5).verdicts(motion_at([[0.0], [6.0]]))[0].abnormal
        assert (
            detector(rule="unanimous", false_alarms=1e-9).verdicts(motion_at([[0.0]]))[0].abnormal
        )
    assert caplog.messages == []


def test_too_few_genuine_samples_are_told_with_the_number_that_is_needed(
    detector, motion_at, caplog
):
    found = detector(rule="discriminant", false_alarms=0.005)  # 100 genuine scores
    with caplog.at_level(logging.WARNING, logger="turing_learning"):
        assert not found.verdicts(motion_at([[-9.0]]))[0].abnormal
        assert caplog.messages == [
            "Nobody can be called abnormal by 1 sample each: with score 0 throughout the p-value is 0.0099, and at most 0.005 is "
            "asked for; 199 genuine samples without a part in the weights (the second half of `genuine`) are needed, and there "
            "are 100. Calibrate with more, take more samples of each, or allow more false alarms."
        ]
        caplog.clear()
        assert replace(found, false_alarms=0.01).verdicts(motion_at([[-9.0]]))[0].abnormal
        assert found.verdicts(motion_at([[-9.0, -9.0]]))[0].abnormal
    assert caplog.messages == []


def test_classifiers_that_do_not_tell_the_motion_apart_are_told(speed_limits, motion_at, caplog):
    genuine, abnormal = (
        motion_at([[9, 9], [1, 3]]),
        motion_at([[5, 5]]),
    )  # the second half scores lower than abnormal motion
    found = Detector.calibrate(
        speed_limits,
        LIMITS[1:2],
        genuine=genuine,
        abnormal=abnormal,
        rule="fittest",
        false_alarms=0.5,
    )
    with caplog.at_level(logging.WARNING, logger="turing_learning"):
        found.verdicts(motion_at([[1.0]]))
    assert caplog.messages[:1] == [
        "The classifiers do not tell genuine from abnormal motion: the mean score of 2 genuine samples that had no part in the "
        "weights is 0.500, and that of abnormal motion 1.000. Verdicts mean nothing; run more generations, or calibrate with other "
        "motion."
    ]


def test_too_few_windows_for_any_evidence_are_told_with_the_numbers(detector, motion_at, caplog):
    found = detector(rule="unanimous")
    windows = [motion_at([[0.0] * count])[0] for count in (1, 40, 0)]
    times = tuple(
        np.stack((np.arange(len(each)), np.arange(len(each)) + 1.0), axis=1) for each in windows
    )
    motion = RecordedMotion(("short", "long", "never"), tuple(windows), times, 40.0)
    with caplog.at_level(logging.WARNING, logger="turing_learning"):
        short, long, never = found.timeline(motion)
    assert (short.abnormal, long.abnormal, never.abnormal) == (False, True, False)
    assert short.strength <= short.threshold
    assert caplog.messages == [
        "1 of 3 individuals cannot be called abnormal, whatever they do: the evidence in 1 window is at most "
        f"{short.strength:.2f}, and the threshold {short.threshold:.2f}, by 100 genuine samples and a share of false alarms of "
        "0.01. Record for longer, calibrate with more genuine motion, or allow more false alarms."
    ]
