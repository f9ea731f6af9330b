import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from turing_learning.trajectories import Trajectories


def recording(frames=200, individuals=3, missing=0.0, headings=False, seed=0):
    rng = np.random.default_rng(seed)
    present = rng.random((frames, individuals)) >= missing
    present[0] = True
    positions = rng.normal(size=(frames, individuals, 2)).cumsum(axis=0) * present[..., None]
    angles = rng.normal(size=(frames, individuals)) if headings else None
    return Trajectories(positions, present, 10.0, tuple("abcdefgh"[:individuals]), headings=angles)


def frames_of(windows, index, steps, before, after):
    return {
        int(frame)
        for _, first in index
        for frame in range(first - before, first + steps + 1 + after)
    }


def test_a_window_holds_the_signals_of_its_individual_from_its_first_step():
    whole = recording()
    windows = whole.windows(20)
    signals = whole.speeds().values
    for sample, (who, first) in zip(windows.learning, windows.learning_index, strict=True):
        np.testing.assert_array_equal(sample, signals[first : first + 20, who])
    assert windows.learning.shape[1:] == (20, 2)
    assert (windows.names, windows.interval_s) == (("speed", "turn"), 0.1)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    steps=st.integers(1, 12),
    stride=st.one_of(st.none(), st.integers(1, 20)),
    hold_out=st.floats(0.1, 0.6),
    gap=st.integers(0, 5),
    smooth=st.sampled_from([1, 3, 5]),
    headings=st.booleans(),
    missing=st.sampled_from([0.0, 0.02]),
)
def test_learning_and_held_out_windows_have_no_frame_in_common(
    seed, steps, stride, hold_out, gap, smooth, headings, missing
):
    whole = recording(400, missing=missing, headings=headings, seed=seed)
    windows = whole.windows(steps, stride=stride, hold_out=hold_out, gap=gap, smooth_frames=smooth)
    before, after = smooth // 2 + (not headings), smooth // 2
    learning = frames_of(windows, windows.learning_index, steps, before, after)
    held_out = frames_of(windows, windows.held_out_index, steps, before, after)
    assert learning
    assert held_out
    apart = min(abs(a - b) for a in learning for b in (min(held_out, key=lambda f: abs(f - a)),))
    assert apart > gap
    assert min(learning | held_out) >= 0
    assert max(learning | held_out) < 400
    valid = whole.speeds(smooth_frames=smooth).valid
    for index in (windows.learning_index, windows.held_out_index):
        assert all(valid[first : first + steps, who].all() for who, first in index)


def test_windows_of_an_individual_do_not_overlap_unless_asked():
    starts = np.sort(recording(individuals=1).windows(10, hold_out=0).learning_index[:, 1])
    assert np.diff(starts).min() >= 10


def test_a_stride_sets_the_distance_of_windows():
    starts = recording(individuals=1).windows(10, stride=3, hold_out=0).learning_index[:, 1]
    np.testing.assert_array_equal(np.diff(starts), 3)


def test_a_block_that_is_shorter_than_the_smoothing_holds_no_window():
    whole = recording(frames=22, individuals=1)
    whole.present[15] = False
    with pytest.raises(ValueError, match="`steps` must leave at least one window for learning"):
        whole.windows(5, hold_out=0.9, gap=1, smooth_frames=5)


def test_every_window_that_fits_is_cut():
    assert len(recording(frames=102, individuals=2).windows(10, hold_out=0).learning) == 20


def test_held_out_blocks_are_spread_over_the_recording_and_have_their_share():
    blocks = recording(frames=2000).windows(10, hold_out=0.25).blocks
    held_out = [(first, end) for first, end, side in blocks if side == "held out"]
    assert len(held_out) == 5
    assert sum(end - first for first, end in held_out) == 500


def test_windows_keep_out_of_gaps():
    whole = recording(frames=50, individuals=1)
    whole.present[20] = False
    windows = whole.windows(10, hold_out=0)
    np.testing.assert_array_equal(windows.learning_index[:, 1], [1, 22, 32])
    assert windows.steps_without_signal == 4  # the first, and the three that need frame 20


def test_windows_keep_out_of_jumps_unless_asked():
    whole = recording(frames=50, individuals=1)
    whole.positions[20:] += 1000
    windows = whole.windows(10, hold_out=0)
    np.testing.assert_array_equal(windows.learning_index[:, 1], [1, 21, 31])
    assert windows.steps_with_jump == 1
    assert windows.learning[..., 0].max() < 100
    assert whole.windows(10, hold_out=0, jump_factor=None).learning[..., 0].max() > 10_000


def test_a_jump_keeps_out_of_the_turn_after_it_and_of_what_is_smoothed_with_it():
    whole = recording(frames=50, individuals=1)
    whole.positions[20:] += 1000
    windows = whole.windows(1, hold_out=0, smooth_frames=3)
    assert not {18, 19, 20, 21} & set(windows.learning_index[:, 1])
    assert {17, 22} <= set(windows.learning_index[:, 1])


def test_the_length_may_be_given_in_seconds():
    assert recording().windows(length_s=1.5).learning.shape[1] == 15


def test_windows_of_some_individuals_keep_the_others_as_neighbors():
    whole = recording()
    windows = whole.windows(10, signals=("neighbor_distance",), individuals=["c"])
    assert set(windows.learning_index[:, 0]) == {2}
    who, first = windows.learning_index[0]
    expected = whole.signals(("neighbor_distance",)).values[first : first + 10, who]
    np.testing.assert_array_equal(windows.learning[0], expected)


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({}, "`steps` must be given, or `length_s`, one of them; got None and None"),
        (
            {"steps": 3, "length_s": 1},
            "`steps` must be given, or `length_s`, one of them; got 3 and 1",
        ),
        ({"steps": 0}, "`steps` must be an integer of at least 1; got 0"),
        (
            {"steps": 3.5},
            r"`steps` must be an integer of at least 1; got 3\.5\. A length in s is given as `length_s`\.",
        ),
        ({"steps": True}, "`steps` must be an integer of at least 1; got True"),
        ({"steps": "3"}, "`steps` must be an integer of at least 1; got '3'"),
        ({"length_s": 0.01}, "`length_s` must be at least one frame of 0.1 s; got 0.01"),
        ({"steps": 3, "stride": 0}, "`stride` must be an integer of at least 1; got 0"),
        ({"steps": 3, "stride": 1.5}, r"`stride` must be an integer of at least 1; got 1\.5"),
        (
            {"steps": 3, "smooth_frames": 2.5},
            r"`smooth_frames` must be an integer of at least 1; got 2\.5",
        ),
        ({"steps": 3, "hold_out": 1}, "`hold_out` must be from 0 to 0.9; got 1"),
        ({"steps": 3, "gap": -1}, "`gap` must be an integer of at least 0; got -1"),
        ({"steps": 3, "gap": 0.5}, r"`gap` must be an integer of at least 0; got 0\.5"),
        ({"steps": 3, "individuals": ["z"]}, "`individuals` must be among a, b, c; got 'z'"),
        (
            {"steps": 3, "individuals": ["a", "a"]},
            r"`individuals` must be different names; got \['a', 'a'\]. Name each once",
        ),
        ({"steps": 3, "jump_factor": 0}, "`jump_factor` must be a finite number above 1; got 0"),
        (
            {"steps": 500},
            "`steps` must leave at least one window for learning; got 500 steps in 200 frames .* Take shorter windows",
        ),
        (
            {"steps": 90},
            "`steps` must leave at least one window held out; got 90 steps in 200 frames with hold_out 0.2, gap 0",
        ),
    ],
)
def test_windows_that_cannot_be_cut_are_refused(said, message):
    with pytest.raises(ValueError, match=message):
        recording().windows(**said)


@pytest.mark.parametrize("hold_out", [0.0, 0.3])
def test_held_out_individuals_are_not_learned_from(hold_out):
    whole = recording(frames=1000, individuals=4)
    windows = whole.windows(10, hold_out=hold_out, hold_out_individuals=["b", "d"])
    assert set(windows.learning_index[:, 0]) == {0, 2}
    assert set(windows.held_out_index[:, 0]) == {1, 3}
    times = [
        {int(first) for first in index[:, 1]}
        for index in (windows.learning_index, windows.held_out_index)
    ]
    plain = whole.windows(10, hold_out=hold_out)
    assert times[0] == set(plain.learning_index[:, 1])
    if hold_out:
        assert not times[0] & times[1]
        np.testing.assert_array_equal(
            windows.held_out, plain.held_out[np.isin(plain.held_out_index[:, 0], [1, 3])]
        )
    else:
        assert times[0] == times[1]
        assert windows.blocks == ((0, 1000, "learning and held out"),)


@pytest.mark.parametrize("named", [["a", "e"], ["a", "b", "c"], "ab", ["c"]])
def test_held_out_individuals_are_some_of_those_whose_windows_are_cut(named):
    options = {"individuals": ["a", "b"]} if named == ["c"] else {}
    with pytest.raises(
        ValueError,
        match=r"^`hold_out_individuals` must be a list of names, some of a, b(, c)? but not all; got ",
    ):
        recording().windows(10, hold_out_individuals=named, **options)
