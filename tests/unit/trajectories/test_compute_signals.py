import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from turing_learning.trajectories import SIGNALS, compute_signals

POLYGON = np.array([[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]], dtype=float)[:, None]
"""An individual that walks round a square of 2 cm, to the left."""


def test_speed_and_turn_of_a_walk_round_a_square():
    signals = compute_signals(POLYGON, fps=10)
    np.testing.assert_allclose(signals.values[:, 0, 0], [0, 20, 20, 20])
    np.testing.assert_allclose(signals.values[:, 0, 1], [0, *[np.pi / 2 * 10] * 3])
    np.testing.assert_array_equal(signals.valid[:, 0], [False, True, True, True])


def test_speed_alone_exists_from_the_first_step():
    assert compute_signals(POLYGON, fps=10, names=("speed",)).valid.all()


def test_with_headings_speed_against_the_heading_is_negative():
    headings = np.array([[0.0], [1.0], [-1.0], [-2.0], [0.0]])
    signals = compute_signals(POLYGON, fps=1, headings=headings)
    np.testing.assert_allclose(signals.values[:, 0], [[2, 1], [2, -2], [-2, -1], [2, 2]])
    assert signals.valid.all()


def test_a_heading_turns_the_shorter_way_round():
    headings = np.array([[3.0], [-3.0]])
    turn = compute_signals(np.zeros((2, 1, 2)), fps=1, names=("turn",), headings=headings).values[
        0, 0, 0
    ]
    assert turn == pytest.approx(2 * np.pi - 6)


def test_who_stands_still_keeps_the_direction():
    positions = np.array([[0, 0], [1, 0], [1, 0], [1, 1]], dtype=float)[:, None]
    np.testing.assert_allclose(compute_signals(positions, fps=1).values[1:, 0, 1], [0, np.pi / 2])


def test_who_has_not_moved_yet_does_not_turn():
    positions = np.array([[0, 0], [0, 0], [0, 1], [0, 2]], dtype=float)[:, None]
    np.testing.assert_array_equal(compute_signals(positions, fps=1).values[:, 0, 1], 0)


def test_a_direction_is_not_kept_over_a_gap():
    positions = np.array([[0, 0], [1, 0], [1, 1], [0, 0], [2, 2], [2, 2], [3, 2]], dtype=float)[
        :, None
    ]
    present = np.array([1, 1, 1, 0, 1, 1, 1], dtype=bool)[:, None]
    signals = compute_signals(positions, fps=1, present=present)
    np.testing.assert_array_equal(signals.valid[:, 0], [False, True, False, False, False, True])
    assert signals.values[5, 0, 1] == 0


def test_values_are_zero_where_there_is_no_signal():
    present = np.array([1, 1, 0, 1, 1], dtype=bool)[:, None]
    signals = compute_signals(POLYGON, fps=1, present=present)
    assert not signals.values[~signals.valid].any()


def test_the_nearest_neighbor_is_seen_at_its_distance_and_bearing():
    positions = np.zeros((3, 3, 2))
    positions[:, 0, 0] = [0, 1, 2]
    positions[:, 1] = [2, 1]
    positions[:, 2] = [9, 9]
    signals = compute_signals(positions, fps=1, names=("neighbor_distance", "neighbor_bearing"))
    np.testing.assert_allclose(signals.values[1, 0], [np.sqrt(2), np.pi / 4])
    assert not signals.valid[:, 1:].any()  # they never moved: no bearing


def test_the_bearing_is_relative_to_the_heading_if_there_is_one():
    positions = np.zeros((2, 2, 2))
    positions[:, 1] = [0, 3]
    headings = np.full((2, 2), np.pi / 2)
    signals = compute_signals(positions, fps=1, names=("neighbor_bearing",), headings=headings)
    np.testing.assert_allclose(np.abs(signals.values[0, :, 0]), [0, np.pi], atol=1e-12)


def test_absent_individuals_are_no_neighbors():
    positions = np.zeros((2, 3, 2))
    positions[:, 1], positions[:, 2] = [1, 0], [5, 0]
    present = np.array([[1, 0, 1], [1, 0, 1]], dtype=bool)
    signals = compute_signals(positions, fps=1, names=("neighbor_distance",), present=present)
    assert signals.values[0, 0, 0] == 5
    np.testing.assert_array_equal(signals.valid[0], [True, False, True])


def test_who_is_alone_has_no_neighbor_signal():
    assert not compute_signals(POLYGON, fps=1, names=("speed", "neighbor_distance")).valid.any()


def test_smoothing_is_a_centered_mean_narrower_toward_the_ends():
    positions = np.array([[0, 0], [3, 0], [0, 0], [3, 0], [9, 0]], dtype=float)[:, None]
    smoothed = np.array([0, 1, 2, 4, 9.0])
    signals = compute_signals(positions, fps=1, names=("speed",), smooth_frames=3)
    np.testing.assert_allclose(signals.values[:, 0, 0], np.diff(smoothed))


def test_smoothing_does_not_reach_over_a_gap():
    positions = np.array([[0, 0], [3, 0], [99, 0], [3, 0], [9, 0]], dtype=float)[:, None]
    present = np.array([1, 1, 0, 1, 1], dtype=bool)[:, None]
    signals = compute_signals(positions, fps=1, names=("speed",), present=present, smooth_frames=3)
    np.testing.assert_allclose(signals.values[:, 0, 0], [3, 0, 0, 6])


def test_many_recordings_are_computed_at_once():
    positions = np.random.default_rng(0).normal(size=(4, 7, 3, 2)).cumsum(axis=1)
    together = compute_signals(positions, fps=5, names=tuple(SIGNALS), smooth_frames=3).values
    for one, alone in zip(together, positions, strict=True):
        np.testing.assert_array_equal(
            one, compute_signals(alone, fps=5, names=tuple(SIGNALS), smooth_frames=3).values
        )


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(-3, 3))
def test_signals_do_not_change_when_everything_is_turned_and_moved(seed, angle):
    positions = np.random.default_rng(seed).normal(size=(8, 3, 2)).cumsum(axis=0)
    turned = positions @ np.array(
        [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
    ) + [30, -50]
    before, after = (
        compute_signals(p, fps=1, names=tuple(SIGNALS)).values for p in (positions, turned)
    )
    difference = after - before
    difference[..., [1, 3]] = (difference[..., [1, 3]] + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(difference, 0, atol=1e-9)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_signals_follow_when_individuals_change_places(seed):
    rng = np.random.default_rng(seed)
    positions, present, order = (
        rng.normal(size=(8, 4, 2)),
        rng.random((8, 4)) < 0.8,
        rng.permutation(4),
    )
    before = compute_signals(positions, fps=1, names=tuple(SIGNALS), present=present)
    after = compute_signals(
        positions[:, order], fps=1, names=tuple(SIGNALS), present=present[:, order]
    )
    np.testing.assert_allclose(after.values, before.values[:, order], atol=1e-12)
    np.testing.assert_array_equal(after.valid, before.valid[:, order])


@pytest.mark.parametrize(
    ("said", "message"),
    [
        (
            {"positions": np.zeros((1, 1, 2))},
            r"`positions` must be of shape \(..., F, A, 2\) with 2 frames or more; got \(1, 1, 2\)",
        ),
        (
            {"positions": np.full((3, 1, 2), np.nan)},
            "`positions` must be finite wherever `present`; got a value that is not",
        ),
        (
            {"present": np.ones((5, 2), bool)},
            r"`present` must be of shape \(..., F, A\) = \(5, 1\); got \(5, 2\)",
        ),
        (
            {"headings": np.ones(5)},
            r"`headings` must be of shape \(..., F, A\) = \(5, 1\); got \(5,\)",
        ),
        ({"fps": -1}, "`fps` must be a finite number above 0; got -1"),
        (
            {"names": ("spin",)},
            r"`names` must be some of speed, turn, .*, each once; got \('spin',\)",
        ),
        ({"names": ()}, r"`names` must be some of .*; got \(\)"),
        ({"names": ("turn", "turn")}, r"`names` must be some of .*; got \('turn', 'turn'\)"),
        ({"smooth_frames": 2}, "`smooth_frames` must be odd and 1 or more; got 2"),
    ],
)
def test_what_does_not_fit_is_refused(said, message):
    with pytest.raises(ValueError, match=message):
        compute_signals(**{"positions": POLYGON, "fps": 1} | said)
