"""Windows have the digest of what they were computed from, whatever the processor."""

from dataclasses import replace

import numpy as np
import pytest

from turing_learning.trajectories import (
    SIGNALS,
    Trajectories,
    compute_signals,
    origin_of,
    pooled_windows,
)
from turing_learning.trajectories._origin import MEASUREMENT

RNG = np.random.default_rng(1)
RECORDING = Trajectories(
    positions=np.cumsum(RNG.normal(size=(300, 3, 2)), axis=0),
    present=np.ones((300, 3), dtype=bool),
    fps=10.0,
    individuals=("a", "b", "c"),
    headings=RNG.uniform(-3, 3, (300, 3)),
)
CUT = {"steps": 12, "signals": tuple(SIGNALS), "hold_out": 0.2}
ORIGIN = origin_of(RECORDING.windows(**CUT))


def moved(**changes):
    arrays = {}
    for name, (place, value) in changes.items():
        arrays[name] = getattr(RECORDING, name).copy()
        arrays[name][place] = value
    return replace(RECORDING, **arrays)


def test_last_digits_of_signals_do_not_count(on_another_processor):
    here = RECORDING.windows(**CUT)
    on_another_processor()
    there = RECORDING.windows(**CUT)
    assert (there.learning != here.learning).all()
    assert origin_of(there) == ORIGIN


def test_last_digits_of_headings_do_not_count():
    turned = replace(RECORDING, headings=np.nextafter(RECORDING.headings, np.inf))
    assert origin_of(turned.windows(**CUT)) == ORIGIN


@pytest.mark.parametrize(
    "other",
    [
        moved(positions=((7, 1, 0), np.nextafter(RECORDING.positions[7, 1, 0], np.inf))),
        moved(present=((150, 2), False)),
        moved(headings=((7, 1), RECORDING.headings[7, 1] + 1e-5)),
        replace(RECORDING, headings=None),
        replace(RECORDING, positions=RECORDING.positions[::-1]),
        replace(RECORDING, fps=20.0),
        replace(RECORDING, unit="px"),
        RECORDING.selected(["b", "a", "c"]),
        RECORDING.selected(["a", "b"]),
    ],
)
def test_other_recordings_have_another_digest(other):
    assert origin_of(other.windows(**CUT)) not in ("", ORIGIN)


@pytest.mark.parametrize(
    "option",
    [
        {"steps": 13},
        {"stride": 5},
        {"signals": tuple(SIGNALS)[::-1]},
        {"smooth_frames": 3},
        {"hold_out": 0.3},
        {"hold_out_individuals": ["a"]},
        {"individuals": ["a", "b"]},
        {"gap": 4},
    ],
)
def test_windows_that_are_cut_otherwise_have_another_digest(option):
    assert origin_of(RECORDING.windows(**CUT | option)) not in ("", ORIGIN)


def test_the_order_of_recordings_counts_and_which_are_held_out():
    recordings = [RECORDING, RECORDING.selected(["b", "c"])]
    digests = {
        origin_of(pooled_windows(recordings, **CUT)),
        origin_of(pooled_windows(recordings[::-1], **CUT)),
        origin_of(pooled_windows(recordings, hold_out_recordings=[1], **CUT)),
        ORIGIN,
    }
    assert len(digests - {""}) == 4


def test_windows_that_were_changed_have_no_digest():
    windows = RECORDING.windows(**CUT)
    assert origin_of(replace(windows, sources=())) == ""
    assert origin_of(replace(windows, learning=windows.learning[::-1])) == ""
    assert origin_of(replace(windows, held_out_index=windows.held_out_index + 1)) == ""
    assert origin_of(replace(windows, cut={**windows.cut, "steps": 1000})) == ""
    windows.learning[3, 2, 1] += 1e-3
    assert origin_of(windows) == ""


def test_the_number_of_the_measurement_changes_with_the_signals():
    """If this fails because signals are meant to be others now, raise `MEASUREMENT`."""
    positions = np.array([[[0, 0], [3, 4]], [[1, 0], [3, 3]], [[1, 2], [2, 3]], [[0, 2], [2, 1]]])
    quarter = np.pi / 2
    # without a step before there are no turns
    expected = [
        [[0, 0, 0, 0], [0, 0, 0, 0]],
        [
            [2, quarter, np.sqrt(13), np.arctan2(3, 2)],
            [1, -quarter, np.sqrt(13), np.arctan2(-3, -2) + quarter],
        ],
        [[1, quarter, np.sqrt(2), -quarter / 2], [2, quarter, np.sqrt(2), quarter / 2]],
    ]
    values = compute_signals(positions, fps=1.0, names=tuple(SIGNALS)).values
    assert MEASUREMENT == 1
    np.testing.assert_allclose(values, expected)
