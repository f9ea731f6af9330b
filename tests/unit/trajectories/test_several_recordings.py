"""Windows of several recordings, and groups as they were recorded."""

from dataclasses import replace

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.families import BurstAndCoast, Couzin, Replicates, Vicsek, as_recorded
from turing_learning.systems import held_out_groups, observed
from turing_learning.trajectories import Trajectories, join_windows, pooled_windows

QUICK = {"models.population": 8, "classifiers.population": 8, "run.threads": 1}


def recording(frames=200, individuals=3, seed=0, fps=10.0):
    rng = np.random.default_rng(seed)
    positions = rng.normal(0.3, 0.2, (frames, individuals, 2)).cumsum(axis=0)
    return Trajectories(
        positions, np.ones((frames, individuals), bool), fps, tuple("abcdefgh"[:individuals])
    )


SOME = [recording(), recording(individuals=5, seed=1), recording(frames=150, seed=2)]


def test_windows_remember_their_recording_and_individual():
    pooled, each = pooled_windows(SOME, steps=10), [one.windows(10) for one in SOME]
    individuals, rows = np.cumsum([0, 3, 5]), np.cumsum([0, 200, 200])
    for k, one in enumerate(each):
        for side in ("learning", "held_out"):
            of = getattr(pooled, f"{side}_recording") == k
            np.testing.assert_array_equal(getattr(pooled, side)[of], getattr(one, side))
            index = getattr(pooled, f"{side}_index")[of] - [individuals[k], rows[k]]
            np.testing.assert_array_equal(index, getattr(one, f"{side}_index"))
    nested = join_windows([join_windows(each[:2]), each[2]])
    np.testing.assert_array_equal(nested.learning_index, pooled.learning_index)
    np.testing.assert_array_equal(nested.recordings, pooled.recordings)
    assert nested.blocks == pooled.blocks


def test_recordings_are_held_out_whole():
    windows = pooled_windows(SOME, steps=10, hold_out_recordings=[1])
    assert set(windows.learning_recording) == {0, 2}
    assert set(windows.held_out_recording) == {1}
    np.testing.assert_array_equal(windows.held_out, SOME[1].windows(10, hold_out=0).learning)
    with pytest.raises(
        ValueError,
        match=r"`hold_out_recordings` must be some of 0 to 2, but not all; got \[0, 1, 2\]",
    ):
        pooled_windows(SOME, steps=10, hold_out_recordings=[0, 1, 2])


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (
            recording(fps=20.0),
            r"`fps` must be the same in all recordings; got 10 and 20 \[recording 2\]",
        ),
        (
            replace(SOME[0], unit="px"),
            r"`recordings` must be in cm, as the first recording; got px \[recording 2\]",
        ),
        (
            replace(SOME[0], headings=np.zeros((200, 3))),
            r"`headings` must be the same in all recordings; got False and True \[recording 2\]",
        ),
        (
            recording(frames=12),
            r"`steps` must leave at least one window for learning.* \[recording 2\]",
        ),
    ],
)
def test_recordings_that_are_measured_otherwise_are_refused(other, message):
    with pytest.raises(ValueError, match=message):
        pooled_windows([SOME[0], other], steps=15)


def test_what_is_held_out_is_grouped_by_recordings_where_there_are_enough():
    windows = [recording(seed=k).windows(10) for k in range(5)]
    labels, what = held_out_groups(observed(windows[:4]))
    assert what == "individuals"
    assert len(np.unique(labels)) == 12
    joined = observed(windows)
    labels, what = held_out_groups(joined)
    assert what == "recordings"
    np.testing.assert_array_equal(labels, joined.held_out_recording)


def test_one_recording_needs_no_list_and_pixels_are_refused():
    windows = SOME[0].windows(10)
    assert (
        str(windows)
        == "45 windows for learning and 9 held out, each of 10 steps of 0.1 s: speed, turn"
    )
    assert as_recorded(Couzin, SOME[0], windows) == as_recorded(Couzin, SOME[:1], windows)
    with pytest.raises(
        ValueError, match="`recordings` must be in cm, as the models are; got pixels"
    ):
        as_recorded(Couzin, replace(SOME[0], unit="px"), windows)
    with pytest.raises(
        ValueError,
        match=r"^`scenario` must be a known scenario; got Trajectories\(.*\.\.\.\. Choose from",
    ):
        tl.infer(SOME[0])


def test_groups_are_as_large_as_recorded_and_drawn_as_often_as_windows():
    windows = pooled_windows(SOME, steps=10)
    family = as_recorded(Couzin, SOME, windows, tanks=[(30, 20)])
    assert [group.individuals for group in family.groups] == [3, 5]
    share = np.isin(windows.learning_recording, [0, 2]).mean()
    np.testing.assert_allclose(family.shares, [share, 1 - share])
    models = np.tile([6, 2.5, 1.5, 4, 8, 0.15], (40, 1))
    samples = family(models, np.random.default_rng(1))
    assert samples.shape == (40, 1, 10, 2)
    np.testing.assert_array_equal(samples, family(models, np.random.default_rng(1)))
    drawn = np.random.default_rng(1)
    which = drawn.choice(2, size=40, p=family.shares)
    np.testing.assert_array_equal(samples[which == 0], family.groups[0](models[which == 0], drawn))


def test_recordings_that_are_alike_are_one_family():
    windows = pooled_windows(SOME[::2], steps=10)
    family = as_recorded(BurstAndCoast, SOME[::2], windows)
    settings = {"individuals": 3, "steps": 10, "interval_s": 0.1, "settling_steps": 10}
    assert family == BurstAndCoast(**settings, starts=family.starts)
    apart = pooled_windows(SOME, steps=10, hold_out_recordings=[1])
    assert as_recorded(BurstAndCoast, SOME, apart).individuals == 3
    near = pooled_windows(SOME, steps=10, signals=("speed", "neighbor_distance"))
    assert {group.period_cm for group in as_recorded(Vicsek, SOME, near).groups} == {None}
    with pytest.raises(
        ValueError, match="`tanks` must be one, or one for each of 3 recordings; got 2"
    ):
        as_recorded(Couzin, SOME, windows, tanks=[(1, 1), (2, 2)])


def test_a_list_of_windows_makes_a_run_that_is_resumed_and_checked(tmp_path):
    windows = [one.windows(10, signals=("speed", "neighbor_distance")) for one in SOME]
    family = as_recorded(Couzin, SOME, join_windows(windows))
    assert isinstance(family, Replicates)
    given = {"genuine": windows, "simulate": family}
    out = tmp_path / "run"
    tl.infer(
        **given,
        parameters=family.parameters,
        generations=2,
        settings=QUICK,
        out=out,
        should_stop=lambda: True,
    )
    assert tl.resume(out, **given).complete
    effort = tl.identifiability.Effort(samples=20, points=0)
    found = tl.load_run(out).check(**given, recording=SOME, effort=effort, recoveries=0)
    assert {"polarization"} <= {each.name for each in found.quantities}
    with pytest.raises(ValueError, match="of several: genuine=pooled_windows"):
        tl.infer(genuine=SOME, simulate=family, parameters=family.parameters)


def test_frames_are_of_a_side_that_there_is():
    windows = SOME[0].windows(10)
    assert sum(map(np.sum, windows.frames("held out"))) > 0
    with pytest.raises(ValueError, match=r'`side` must be "learning" or "held out"; got held_out'):
        windows.frames("held_out")
