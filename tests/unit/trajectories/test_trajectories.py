from dataclasses import replace

import numpy as np
import pytest

from turing_learning.trajectories import Trajectories
from turing_learning.trajectories._recording import Jump


def recording(positions, present=None, **more):
    positions = np.asarray(positions, dtype=float)
    present = (
        np.ones(positions.shape[:2], dtype=bool)
        if present is None
        else np.asarray(present, dtype=bool)
    )
    names = tuple("abcdefgh"[: positions.shape[1]])
    return Trajectories(
        **{
            "positions": positions * present[..., None],
            "present": present,
            "fps": 10.0,
            "individuals": names,
        }
        | more
    )


def line(frames=6, individuals=1):
    """Return individuals that move one cm per frame along x."""
    return np.stack(
        [np.repeat(np.arange(frames)[:, None], individuals, 1), np.zeros((frames, individuals))],
        axis=-1,
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"positions": np.zeros((3, 2))},
            r"`positions` must be of shape \(F, A, 2\) and not empty; got \(3, 2\)",
        ),
        (
            {"positions": np.zeros((0, 1, 2))},
            r"`positions` must be of shape \(F, A, 2\) and not empty; got \(0, 1, 2\)",
        ),
        (
            {"positions": np.full((6, 1, 2), np.nan)},
            r"`positions` must be finite; got nan at \(0, 0, 0\)",
        ),
        (
            {"present": np.ones((5, 1), bool)},
            r"`present` must be of shape \(F, A\) = \(6, 1\); got \(5, 1\)",
        ),
        (
            {"present": np.zeros((6, 1), bool)},
            "`present` must be booleans, some of them true; got bool",
        ),
        (
            {"present": np.ones((6, 1))},
            "`present` must be booleans, some of them true; got float64",
        ),
        ({"headings": np.ones(6)}, r"`headings` must be of shape \(F, A\) = \(6, 1\); got \(6,\)"),
        (
            {"confidence": np.full((6, 1), np.inf)},
            r"`confidence` must be finite; got inf at \(0, 0\)",
        ),
        ({"fps": 0.0}, "`fps` must be a finite number above 0; got 0.0"),
        ({"individuals": ("a", "b")}, r"`individuals` must be 1 different names; got \('a', 'b'\)"),
        ({"unit": "m"}, "`unit` must be 'cm' or 'px'; got 'm'"),
    ],
)
def test_what_does_not_fit_together_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        replace(recording(line()), **change)


def test_names_that_occur_twice_are_refused():
    with pytest.raises(
        ValueError, match=r"`individuals` must be 2 different names; got \('a', 'a'\)"
    ):
        replace(recording(line(individuals=2)), individuals=("a", "a"))


def test_a_recording_says_in_a_line_what_it_is():
    text = str(recording(line(), present=[[1], [1], [0], [1], [1], [1]]))
    assert text == "1 individual, 6 frames at 10 per second (0.5 s), in cm, 16.67% missing"


def test_the_duration_is_the_time_between_first_and_last_frame():
    assert recording(line(11)).duration_s == 1.0


def test_nothing_is_found_in_a_recording_without_problems():
    problems = recording(line()).problems
    assert not problems.found
    assert str(problems) == "no problems found"


def test_missing_values_are_counted_for_each_individual():
    present = np.ones((6, 2), dtype=bool)
    present[[1, 2, 4], 1] = False
    problems = recording(line(individuals=2), present).problems
    assert (problems.missing, problems.gaps, problems.longest_gap) == (
        {"a": 0, "b": 3},
        {"a": 0, "b": 2},
        {"a": 0, "b": 2},
    )
    assert str(problems) == "b: 3 of 6 frames missing, in 2 gaps of up to 2"


def test_who_comes_later_or_goes_earlier_is_away_and_not_missing():
    seen = recording(line(), [[0], [0], [1], [0], [1], [0]])
    problems = seen.problems
    assert (problems.missing, problems.gaps, problems.longest_gap) == ({"a": 1}, {"a": 1}, {"a": 1})
    assert problems.away == {"a": 3}
    assert problems.empty_frames == (0, 1, 3, 5)
    said = "a: 1 of 3 frames missing, in 1 gap of up to 1; away for 3 frames before and after"
    assert str(problems).startswith(said)
    assert str(seen).endswith("33.33% missing")
    come_and_go = "1 position of all individuals missing (33.33%), in 1 gap of up to 1 frames (a); "
    assert problems.described_gaps == come_and_go + "1 of 1 individual come later or go earlier"


def test_a_jump_is_a_step_above_the_stated_multiple_of_the_typical_one():
    positions = line(10)
    positions[5:] += [24, 0]
    problems = recording(positions, first_frame=100).check(jump_factor=20)
    assert problems.jumps == (Jump("a", 104, 25.0, 25.0),)
    assert str(problems) == "a: jump of 25 cm after frame 104 (25 typical steps)"
    assert recording(positions).check(jump_factor=25).jumps == ()


def test_a_displacement_over_a_gap_is_no_jump():
    positions = line(10)
    positions[5:] += [100, 0]
    assert recording(positions, np.arange(10)[:, None] != 5).problems.jumps == ()


def test_a_jump_factor_that_makes_every_step_a_jump_is_refused():
    with pytest.raises(ValueError, match="`jump_factor` must be a finite number above 1; got 1"):
        recording(line()).check(jump_factor=1)


def test_frames_that_repeat_the_one_before_are_named():
    positions = np.repeat(line(6, 2), 2, axis=0)
    positions[7, 1] += 0.1
    problems = recording(positions, first_frame=10).problems
    assert problems.repeated_frames == (11, 13, 15, 19, 21)
    assert str(problems) == "5 frames repeat the one before: 11, 13, 15, 19, 21"


def test_a_frame_in_which_somebody_disappears_repeats_nothing():
    assert recording(np.zeros((2, 2, 2)), [[1, 1], [1, 0]]).problems.repeated_frames == ()


def test_individuals_that_never_move_have_no_jumps():
    assert recording(np.zeros((5, 1, 2))).problems.typical_step == 0


def test_individuals_that_never_move_are_named():
    positions = line(6, 4)
    positions[:, 1:] = 3
    present = np.ones((6, 4), dtype=bool)
    present[[0, 3], 2] = False
    present[1:, 3] = False
    problems = recording(positions, present).problems
    assert problems.still == ("b", "c")
    assert problems.found
    assert "b: never moves, in 6 frames\nc: never moves, in 4 frames" in str(problems)


def circling(frames=361):
    """Return an individual that runs in a circle, four degrees in a frame, and its headings in [0, 2 pi)."""
    angle = np.radians(4) * np.arange(frames)[:, None]
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1), (angle + np.pi / 2) % (2 * np.pi)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (np.degrees, "headings may be in degrees, as 98% are beyond 2 pi; they are taken as rad"),
        (
            np.negative,
            "% of the longer steps go backwards by the headings: if that is not how they move, see whether",
        ),
        (
            lambda headings: headings + np.pi,
            "100% of the longer steps go backwards by the headings",
        ),
    ],
)
def test_headings_that_may_be_something_else_are_told(wrong, told):
    positions, headings = circling()
    problems = recording(positions, headings=wrong(headings)).problems
    assert problems.found
    assert told in str(problems)


def test_headings_that_are_right_are_not_told():
    positions, headings = circling()
    assert recording(positions, headings=headings).problems.headings == ()
    assert recording(positions, headings=np.unwrap(headings, axis=0)).problems.headings == ()
    assert recording(0 * positions, headings=headings).problems.headings == ()


def test_long_lists_of_frames_are_cut_in_the_text():
    assert str(recording(np.zeros((20, 1, 2))).problems).endswith("8, 9, 10, ...")


def test_gaps_are_bridged_by_straight_motion_at_even_speed():
    present = [[1], [0], [0], [1], [1], [1]]
    filled = recording(line(), present).bridged(2)
    np.testing.assert_allclose(filled.positions, line())
    np.testing.assert_array_equal(filled.interpolated[:, 0], [0, 1, 1, 0, 0, 0])
    assert filled.present.all()
    assert filled.remarks == ("2 positions in gaps of up to 2 frames were interpolated",)


def test_longer_gaps_and_those_at_the_ends_are_never_bridged():
    present = np.array([[0], [1], [0], [0], [1], [0]], dtype=bool)
    np.testing.assert_array_equal(recording(line(), present).bridged(1).present, present)
    np.testing.assert_array_equal(
        recording(line(), present).bridged(99).present[:, 0], [0, 1, 1, 1, 1, 0]
    )


def test_headings_turn_the_shorter_way_over_a_gap():
    headings = np.array([[3.0], [0.0], [-3.0]])
    filled = recording(line(3), [[1], [0], [1]], headings=headings).bridged(1)
    assert abs(filled.headings[1, 0]) == pytest.approx(np.pi)


def test_what_was_bridged_before_stays_known():
    twice = recording(line(8), [[1], [0], [1], [0], [0], [1], [1], [1]]).bridged(1).bridged(2)
    np.testing.assert_array_equal(np.flatnonzero(twice.interpolated), [1, 3, 4])


def test_a_gap_of_no_frames_cannot_be_bridged():
    with pytest.raises(ValueError, match="`max_gap` must be an integer of at least 1; got 0"):
        recording(line()).bridged(0)


def test_thinning_keeps_the_speed():
    thin = recording(line(9)).thinned(4)
    assert (len(thin.positions), thin.fps) == (3, 2.5)
    np.testing.assert_allclose(thin.signals(("speed",)).values, 10)
    assert thin.remarks == ("one frame in 4 was kept, frame numbers count those",)


@pytest.mark.parametrize("every", [0, 7, 1.5])
def test_thinning_to_nothing_is_refused(every):
    with pytest.raises(ValueError, match=f"`every` must be an integer from 1 to 6; got {every}"):
        recording(line()).thinned(every)


def test_thinning_keeps_the_first_frame_with_somebody():
    thin = recording(line(), [[0], [1], [0], [1], [0], [1]]).thinned(2)
    assert thin.present.all()
    np.testing.assert_array_equal(thin.positions[:, 0, 0], [1, 3, 5])


def test_a_recording_of_every_third_frame_is_named_as_such():
    present = np.zeros((31, 2), dtype=bool)
    present[1::3] = True
    present[4, 1] = False
    sparse = recording(line(31, individuals=2), present)
    assert sparse.every == 3
    assert str(sparse.problems).startswith(
        "only one frame in 3 is there: keep those, by `thinned(3)` or --thin 3\n"
    )
    message = (
        r"`fps` must be the rate of the frames that are there; got 10 per second, of which only one in 3 is there: 3.33333 per "
        r"second\. .* keep those by `thinned\(3\)` or --thin 3\."
    )
    with pytest.raises(ValueError, match=message):
        sparse.windows(2)
    thin = sparse.thinned(sparse.every)
    assert (thin.every, thin.fps) == (1, pytest.approx(10 / 3))
    np.testing.assert_allclose(thin.windows(2, hold_out=0).learning[..., 0], 10)


@pytest.mark.parametrize("there", [[0, 1, 2, 3], [0, 2, 4, 5], [0, 4], [3]])
def test_other_gaps_are_gaps(there):
    present = np.isin(np.arange(6), there)[:, None]
    assert recording(line(), present).every == 1
    assert "one frame in" not in str(recording(line(), present).problems)


def test_individuals_are_selected_by_name():
    positions = line(6, 3) + np.arange(3)[:, None]
    chosen = recording(positions, headings=positions[..., 0]).selected(["c", "a"])
    assert chosen.individuals == ("c", "a")
    np.testing.assert_array_equal(chosen.positions, positions[:, [2, 0]])
    np.testing.assert_array_equal(chosen.headings, positions[:, [2, 0], 0])


def test_an_unknown_individual_is_refused():
    with pytest.raises(ValueError, match="`individuals` must be among a, b; got 'z'"):
        recording(line(individuals=2)).selected(["z"])
