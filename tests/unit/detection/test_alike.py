"""Judged alike: who is unlike normal individuals, what can be promised, and which way to look is read."""

from dataclasses import replace

import numpy as np
import pytest

from turing_learning.analysis.statistics import signal_statistics
from turing_learning.config import ConfigurationError
from turing_learning.detection import _alike, detect, plant_abnormal, run_classifiers
from turing_learning.detection._alike import (
    Case,
    NormalIndividuals,
    TrainedMethod,
    beside_fellows,
    judge_alike,
)
from turing_learning.detection._features import motion_statistics
from turing_learning.detection._methods import (
    MOTION_STATISTICS,
    ONE_CLASS,
    WINDOW_STATISTICS,
    Method,
    PlantedChange,
)
from turing_learning.detection._planted import PLANTED_KINDS, plant
from turing_learning.trajectories import Trajectories

RNG = np.random.default_rng(7)
NAMES = ("a", "b", "c", "d", "e")


def group(size=5, windows=12, shift=0.0, own=0.3):
    """Windows (W, 6, 2) of individuals that differ lastingly; all of them are shifted alike."""
    means = own * RNG.standard_normal((size, 1, 1, 2)) + shift
    return list(means + RNG.standard_normal((size, windows, 6, 2)))


def judged(motion, normal, methods=None, **options):
    return judge_alike(
        methods or [WINDOW_STATISTICS], motion, normal, names=NAMES[: len(motion)], **options
    )


def strange(shift=0.0, by=4.0):
    motion = group(shift=shift)
    motion[2] = motion[2] + by
    return motion


NORMAL = [group() for _ in range(6)]


@pytest.mark.parametrize("by", [4.0, -4.0])
def test_whoever_is_unlike_normal_individuals_comes_first_on_either_side(by):
    found = judged(strange(by=by), NORMAL)
    third = found.individuals[2]
    assert (third.rank, third.abnormal, third.p_value) == (1, True, pytest.approx(1 / 31))
    assert sorted(each.rank for each in found.individuals) == [1, 2, 3, 4, 5]
    assert third.score == pytest.approx(third.shares.mean())


def test_what_all_of_a_recording_share_is_no_sign():
    alike, apart = (
        judged(strange(shift=50.0), NORMAL, relative=relative) for relative in (None, False)
    )
    assert sum(each.abnormal for each in alike.individuals) <= 2
    assert all(each.abnormal for each in apart.individuals)


def test_a_rate_that_normal_individuals_are_too_few_for_is_not_promised():
    found = judged(strange(), NORMAL, false_alarms=0.01)
    assert found.level == pytest.approx(1 / 31)
    assert found.remarks[0].startswith(
        "A false-alarm rate of 0.01 cannot be promised by 30 normal individuals: the lowest is 1 of 31, 0.032."
    )
    assert found.remarks[0].endswith("about 0.16 of 5 normal ones would, too.")
    assert found.verdict == "stands out"
    promised = judged(strange(), NORMAL, false_alarms=0.1)
    assert (promised.level, promised.verdict) == (0.1, "abnormal")


def test_normal_individuals_are_judged_by_the_recordings_of_others():
    odd = [
        *NORMAL[:5],
        group(own=8.0),
    ]  # individuals of the last recording differ by far more than those of the others
    found = judged(strange(), odd, false_alarms=0.1)
    assert found.rankings[0].called >= 3
    assert "judged by the recordings of the others" in found.remarks[0]
    alone = judged(strange(), NORMAL[:1], false_alarms=0.2)
    assert (alone.normal, alone.recordings) == (5, 1)
    assert "judged by the others:" in alone.remarks[0]


def test_without_a_promise_there_is_a_ranking_and_no_verdict():
    found = judged(strange(), NORMAL, promised=False)
    assert found.level is None
    assert found.individuals[2].rank == 1
    assert {each.abnormal for each in found.individuals} == {None}
    assert "the ranking stands" in found.remarks[0]


def test_normal_recordings_are_cut_as_short_as_the_motion():
    short = [each[:2] for each in group()]
    called = np.mean(
        [
            judged([w[:2] for w in group()], NORMAL, false_alarms=0.2).individuals[k].abnormal
            for k in range(5)
        ]
    )
    assert called <= 0.6
    assert judged(short, NORMAL).normal == 30  # pieces of an individual are not individuals


def test_who_has_few_windows_is_neither_normal_nor_abnormal_and_no_measure_for_others():
    motion = strange()
    motion[0] = motion[0][:3]
    normal = [[*recording[:4], recording[4][:2]] for recording in NORMAL]
    found = judged(motion, normal)
    assert found.normal == 24
    assert found.individuals[0].abnormal is None
    assert np.isnan(found.individuals[0].p_value)
    assert found.individuals[2].abnormal
    assert "Too short to judge: a. With fewer than 9 windows" in " ".join(found.remarks)


def test_who_has_no_windows_is_ranked_last_and_not_called_abnormal():
    motion = strange()
    motion[0] = motion[0][:0]
    found = judged(motion, NORMAL).individuals[0]
    assert (found.rank, found.windows, found.abnormal) == (5, 0, False)


def test_the_stretch_that_makes_an_individual_abnormal_is_flagged():
    motion = group(windows=20)
    motion[2][10:] += 6.0
    flagged = judged(motion, [group(windows=20) for _ in range(6)]).individuals[2].flagged
    assert flagged[11:].all()
    assert not flagged[:9].any()


def test_the_way_that_tells_cases_is_read_and_cases_have_no_part_in_their_measure():
    noise = lambda windows: np.sin(1e7 * windows[:, 0, :1])  # noqa: E731
    blind = Method("judged alike", noise)
    cases = [Case(NORMAL[r][k] + 4.0, r, k) for r in range(6) for k in range(2)]
    found = judged(
        strange(),
        NORMAL,
        [blind, WINDOW_STATISTICS],
        cases=cases,
        cases_in_words="12 planted individuals",
    )
    areas = {each.name: each.area for each in found.rankings}
    assert areas["window statistics"] > 0.95 > areas["judged alike"]
    assert found.rankings[0].name == "window statistics"
    assert (
        "On 12 planted individuals the classifiers do not beat the baselines" in found.remarks[-1]
    )


def kinds(by, what):
    """Individuals of the normal recordings whose first or second signal is shifted: two kinds."""
    shift = [0.0, 0.0]
    shift[what] = by
    return [
        Case(NORMAL[r][k] + np.array(shift), r, k, f"signal {what}")
        for r in range(3)
        for k in range(2)
    ]


@pytest.mark.parametrize("by", [2.0, -2.0])
def test_motion_statistics_that_are_shown_planted_individuals_tell_them_in_either_sense(by):
    motion = group()
    motion[2] = motion[2] + [by, 0.0]
    options = {"planted": kinds(2.0, 0), "cases": kinds(2.0, 0), "cases_in_words": "planted ones"}
    found = judged(motion, NORMAL, [MOTION_STATISTICS], **options)
    assert found.individuals[2].rank == 1
    assert found.individuals[2].abnormal


def test_motion_statistics_are_compared_by_kinds_that_they_have_not_been_shown():
    both, seen = kinds(2.0, 0) + kinds(2.0, 1), []
    method = MOTION_STATISTICS

    def learn(*arguments):
        scorer = method.learn(*arguments)

        def score(one, without=""):
            seen.append((without, {each.kind for each in arguments[2]}))
            return scorer(one, without)

        return score

    watched = replace(method, learn=learn)
    found = judged(
        strange(), NORMAL, [watched], planted=both, cases=both, cases_in_words="planted ones"
    )
    assert {without for without, _ in seen} == {"", "signal 0", "signal 1"}
    assert {"signal 0", "signal 1"} in [known for _, known in seen]
    normal = [beside_fellows(method.features(each), True) for each in NORMAL]
    shown = []
    for case in both:
        before, after = (
            normal[case.recording][case.index].windows,
            method.features([case.windows])[0],
        )
        shown.append(
            PlantedChange(case.recording, case.kind, after.mean(axis=0) - before.mean(axis=0))
        )
    everybody = [each for recording in normal for each in recording]
    whole, half = (
        method.learn(everybody, True, some) for some in (shown, shown[len(kinds(2.0, 0)) :])
    )
    for each in normal[0]:
        np.testing.assert_allclose(whole(each, "signal 0"), half(each))
    assert found.rankings[0].area > 0.5


def coupled(first):
    """Windows (W, 6, 7) of nine individuals: all but the first are as much faster as farther from others, the last signal."""
    group, means = RNG.standard_normal((9, 40, 6, 7)), np.arange(-4.0, 5.0)
    group[..., 0] += means[:, None, None]
    group[..., 6] += np.append(first, means[1:])[:, None, None]
    return list(group)


@pytest.mark.parametrize(("recordings", "told"), [(1, False), (4, True)])
def test_one_recording_does_not_say_how_own_motion_goes_together_with_what_is_done_beside_others(
    recordings, told
):
    normal, names = [coupled(-4.0) for _ in range(recordings)], [f"{k}" for k in range(9)]
    other, *fellows = judge_alike(
        [MOTION_STATISTICS], coupled(4.0), normal, names=names
    ).individuals
    assert (other.score > 2 * max(each.score for each in fellows)) == told


def test_a_recording_without_windows_beside_one_that_has_some_is_as_if_it_were_not_given():
    motion, empty = strange(), [each[:0] for each in NORMAL[1]]
    both, one = (
        judged(motion, normal, [MOTION_STATISTICS]).individuals
        for normal in ([NORMAL[0], empty], NORMAL[:1])
    )
    assert [each.score for each in both] == [each.score for each in one]


def test_one_recording_shows_no_planted_individuals():
    cases, motion = [each for each in kinds(2.0, 0) if each.recording == 0], strange()
    shown, alone = (
        judged(motion, NORMAL[:1], [MOTION_STATISTICS], planted=some).individuals
        for some in (cases, ())
    )
    assert [each.score for each in shown] == [each.score for each in alone]


@pytest.mark.parametrize("recordings", [1, 6])
def test_half_of_the_median_score_of_the_fellows_is_subtracted(recordings, monkeypatch):
    motion, known = strange(), NormalIndividuals.of(NORMAL[:recordings], 12)
    cases = kinds(2.0, 0)[:2]

    def scored():
        trained = TrainedMethod.learn(WINDOW_STATISTICS, known, cases, (), True)
        return trained.scores(motion), trained.case_scores()

    lowered, lowered_cases = scored()
    monkeypatch.setattr(_alike, "FELLOWS_WEIGHT", 0.0)
    plain, plain_cases = scored()

    def less(scores):
        return [one - 0.5 * np.median(np.delete(scores, k)) for k, one in enumerate(scores)]

    np.testing.assert_allclose(
        [each.mean() for each in lowered.shares], less([each.mean() for each in plain.shares])
    )
    for own, before in zip(lowered.normal.reshape(-1, 5), plain.normal.reshape(-1, 5), strict=True):
        np.testing.assert_allclose(own, less(before))
    for k in range(2):
        assert lowered_cases[k] == pytest.approx(
            plain_cases[k] - 0.5 * np.median(np.delete(plain.normal[:5], k))
        )


@pytest.mark.parametrize("method", [WINDOW_STATISTICS, ONE_CLASS])
def test_others_are_raised_as_normal_ones_are_that_are_scored_by_fewer_recordings(
    method, monkeypatch
):
    monkeypatch.setattr(_alike, "FELLOWS_WEIGHT", 0.0)
    known, ones = NormalIndividuals.of(NORMAL, 12), beside_fellows(method.features(strange()), True)
    normal = [beside_fellows(method.features(each), True) for each in NORMAL]
    found = np.array(
        [each.mean() for each in TrainedMethod.learn(method, known, (), (), True).shares(ones)]
    )

    def scored(recordings):
        score = method.learn([one for each in recordings for one in each], True, ())
        return np.array([score(one).mean() for one in ones])

    whole = scored(normal)
    fewer = np.mean([scored(normal[:k] + normal[k + 1 :]) for k in range(len(normal))], axis=0)
    if method is ONE_CLASS:
        np.testing.assert_allclose(found, whole + np.median(fewer - whole))
    else:
        np.testing.assert_allclose(found, whole * np.median(fewer / whole))
        assert (found > whole).all()


def test_a_recording_without_planted_ones_is_scored_by_the_distance_alone():
    method = MOTION_STATISTICS
    assert judged(strange(), NORMAL, [method]).individuals[2].rank == 1


def test_a_one_class_machine_finds_what_is_far_away():
    assert judged(strange(), NORMAL, [ONE_CLASS]).individuals[2].rank == 1


def test_a_way_to_look_may_be_any_description_of_windows():
    sums = RNG.standard_normal((5, 2))
    method = Method("judged alike", lambda windows: windows.mean(axis=1) @ sums.T)
    assert method.features(NORMAL[0])[0].shape == (12, 5)
    assert judged(strange(), NORMAL, [method]).individuals[2].rank == 1


def test_windows_have_seven_statistics_for_each_signal():
    windows = np.zeros((1, 4, 2))
    windows[0, :, 0] = [0, 1, 0, 1]
    found = signal_statistics(windows)[0].reshape(7, 2)
    np.testing.assert_allclose(found[:, 0], [0.5, 0.5, 0, 0.5, 1, np.std([1, -1, 1]), -1.0])
    np.testing.assert_allclose(found[:, 1], 0)


@pytest.mark.parametrize(
    ("motion", "normal", "options", "message"),
    [
        (
            group(),
            [[group()[0]]],
            {},
            "`genuine` must hold at least 2 normal individuals with a window; got 1",
        ),
        (group(), NORMAL, {"false_alarms": 1.0}, "`false_alarms` must be .* below 1; got 1"),
        ([each[:0] for each in group()], NORMAL, {}, "`motion` must hold a window; got none"),
    ],
)
def test_what_cannot_be_judged_is_rejected(motion, normal, options, message):
    with pytest.raises(ValueError, match=message):
        judged(motion, normal, **options)


def test_simulated_robots_need_no_normal_recordings(run):
    learned = run_classifiers(run)
    motion = plant_abnormal(learned.scenario, 1, samples=3, seed=1, threads=1)
    one, two = (detect(learned, motion, threads=threads) for threads in (1, 2))
    assert one.level == 0.01
    assert one.recordings == 0
    assert [each.score for each in one.individuals] == [each.score for each in two.individuals]
    assert "96 simulated robots with other parameters" in one.remarks[-1]


@pytest.mark.parametrize("kind", PLANTED_KINDS)
def test_a_planted_individual_moves_otherwise_and_within_the_space_of_all(kind):
    positions = np.cumsum(RNG.normal(0.2, 0.3, (400, 3, 2)), axis=0)
    present = np.ones((400, 3), dtype=bool)
    present[50:60, 1] = False
    recording = Trajectories(
        np.where(present[..., None], positions, 0.0), present, 10.0, ("a", "b", "c")
    )
    moved = plant(recording, 1, kind, np.random.default_rng(0))
    np.testing.assert_array_equal(moved.positions[:, [0, 2]], recording.positions[:, [0, 2]])
    assert np.abs(moved.positions - recording.positions)[present].max() > 0.1
    assert (moved.positions[present] >= positions.min(axis=(0, 1)) - 1e-9).all()
    assert (moved.positions[present] <= positions.max(axis=(0, 1)) + 1e-9).all()
    np.testing.assert_array_equal(moved.positions[50:60, 1], 0.0)


def test_an_unknown_kind_is_rejected():
    recording = Trajectories(np.zeros((9, 1, 2)), np.ones((9, 1), dtype=bool), 10.0, ("a",))
    with pytest.raises(
        ConfigurationError,
        match=r"`kind` must be a known kind of planted individual; got 'too slwo'. Did you mean",
    ):
        plant(recording, 0, "too slwo", np.random.default_rng(0))


def test_motion_statistics_see_rhythm_and_what_goes_together_whatever_the_unit():
    time = np.arange(40)
    slow, fast = np.sin(2 * np.pi * time / 40), np.sin(2 * np.pi * time / 3)
    late = np.roll(np.abs(RNG.standard_normal(40)), 5)
    windows = np.stack([slow, fast, late], axis=1)[None]
    found = motion_statistics(windows)
    np.testing.assert_allclose(motion_statistics(1e-3 * windows)[:, :48], found[:, :48], atol=1e-6)
    shares = found[0, :21].reshape(
        7, 3
    )  # of bands: a period is the window, half of it, ..., 2 to 3 steps
    assert shares[:, 0].argmax() == 0
    assert shares[:, 1].argmax() == 5
    assert (shares[2:, 0] < -6).all()
    assert (shares[:5, 1] < -6).all()


def test_motion_statistics_find_how_late_one_magnitude_follows_another():
    early = RNG.standard_normal((200, 48))
    windows = np.stack(
        [early[:, 8:], early[:, 3:-5]], axis=2
    )  # the second does what the first did five steps ago
    together = motion_statistics(windows)[:, -21:-16].mean(
        axis=0
    )  # statistics and trends of both come last
    assert together.argmax() == 0
    assert together[0] > 0.7
    assert np.abs(together[1:]).max() < 0.2


def test_motion_statistics_have_the_trend_of_each_signal_whatever_its_sense():
    rising = np.stack([np.linspace(0, 3, 40), np.linspace(3, 0, 40), np.ones(40)], axis=1)[None]
    up, down, level = motion_statistics(rising)[0, -3:]
    assert up == pytest.approx(down)
    assert up == pytest.approx((rising[0, :, 0] * np.linspace(-1, 1, 40)).mean())
    assert level == pytest.approx(0.0)


def test_of_what_is_done_after_others_the_means_alone_count_and_come_last():
    windows = RNG.standard_normal((5, 40, 16))
    found = motion_statistics(windows)
    np.testing.assert_allclose(found[:, -3:], windows[..., 13:].mean(axis=1))
    np.testing.assert_array_equal(motion_statistics(windows[..., :13]), found[:, :-3])
    windows[..., :5] *= -2.0  # own motion
    changed = (motion_statistics(windows) != found).any(axis=0)
    assert not changed[-(8 * 8 + 3) :].any()  # eight statistics of eight signals, and three means
    assert changed[-(8 * 8 + 4)]


def test_windows_of_two_steps_have_motion_statistics():
    assert np.isfinite(motion_statistics(RNG.standard_normal((3, 2, 4)))).all()
