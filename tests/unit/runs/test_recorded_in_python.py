"""A run that Python begins on a recording knows as much of it as one that a command begins."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

import turing_learning as tl
from turing_learning.families import Couzin, RecordedSystem, Vicsek, as_recorded
from turing_learning.runs import RunFolder
from turing_learning.runs._plots import recorded_replay

SMALL = {"models.population": 8, "classifiers.population": 8, "run.threads": 1}


class Flock(Vicsek):
    """One's own family, which another process can import."""


def fish(folder):
    """Return a recording of three that wander around (60, 40) cm, read from a file in pixels."""
    walk = np.cumsum(np.random.default_rng(1).normal(0, 2, (400, 3, 2)), axis=0)
    walk += [600, 400]
    rows = ["frame,id,x,y"]
    for (frame, who), (x, y) in zip(np.ndindex(400, 3), walk.reshape(-1, 2), strict=True):
        rows.append(f"{frame},{who},{x},{y}")
    path = folder / "fish.csv"
    path.write_text("\n".join(rows) + "\n")
    return tl.load_trajectories(path, fps=5, pixels_per_cm=10, y_axis="up").bridged(3)


@pytest.mark.parametrize("family", [Vicsek, Flock])
def test_a_folder_knows_recording_scale_and_family_and_replicas_are_beside_it(tmp_path, family):
    recording = fish(tmp_path)
    windows = recording.windows(length_s=4.0, stride=7, hold_out=0.3)
    models = as_recorded(family, recording, windows)
    where = tmp_path / "run"
    begun = tl.infer(
        genuine=windows,
        simulate=models,
        parameters=models.parameters,
        generations=2,
        settings=SMALL,
        out=where,
    )
    options = RunFolder(where).manifest()["recording"]["options"]
    assert (options["fps"], options["scale"], options["bridge"]) == (5, 10, 3)
    loaded = tl.load_run(where)
    drawn = [result.plot.distributions(Figure().subplots(1, 2)) for result in (begun, loaded)]
    extents = [[axes.dataLim.bounds for axes in panels] for panels in drawn]
    assert extents[0] == extents[1]
    recorded, replicas = recorded_replay(RunFolder(where).read("motion.npz")).swarms
    reach = recorded.poses[..., :2].max(axis=(0, 1))
    begin = replicas.poses[0, :, :2].mean(axis=0)
    assert (begin >= 0).all()
    assert (begin <= reach).all()


@pytest.mark.parametrize(
    ("done", "again"),
    [
        (lambda recording: recording, True),
        (lambda recording: recording.thinned(2), True),
        (lambda recording: recording.selected(["0", "2"]), False),
    ],
)
def test_files_are_named_only_if_they_lead_to_the_same_windows(tmp_path, done, again):
    windows = done(fish(tmp_path)).windows(length_s=4.0, hold_out=0.3)
    begun = RecordedSystem.begun_in_python(windows, None)
    assert ("trajectories" in begun.options) is again
    if again:
        read, _, _ = begun.opened()
        np.testing.assert_array_equal(read.learning, windows.learning)
        np.testing.assert_array_equal(read.held_out, windows.held_out)


def test_a_run_goes_on_with_groups_that_begin_as_they_did(tmp_path):
    recording = fish(tmp_path)
    windows = recording.windows(length_s=4.0, hold_out=0.3)
    model = as_recorded(Couzin, recording, windows)
    entry = RecordedSystem.begun_in_python(windows, model).entry
    _, family, _ = RecordedSystem.remembered(entry).opened()
    assert family == model
    assert family.starts is not None

    # before decision 0059 runs did not say how groups begin: they began scattered
    del entry["groups_begin"]
    old = RecordedSystem.remembered(entry)
    _, family, _ = old.opened()
    assert family == replace(model, starts=None, settling_steps=0)
    assert "groups_begin" not in old.entry

    # so does a family that was made by hand
    scattered = RecordedSystem.begun_in_python(windows, family)
    assert scattered.options["model"] == "couzin"
    assert scattered.scattered


def test_of_a_table_in_memory_scale_and_rate_are_kept(tmp_path):
    recording = tl.load_trajectories(
        fish(tmp_path).positions * 10, fps=5, pixels_per_cm=10, y_axis="up"
    )
    windows = recording.windows(length_s=4.0)
    begun = RecordedSystem.begun_in_python(windows, as_recorded(Vicsek, recording, windows))
    assert begun.options == {"fps": 5.0, "scale": 10.0, "y_axis": "up"}


def run_on(recording, seed, out=None):
    windows = recording.windows(length_s=4.0)
    models = as_recorded(Vicsek, recording, windows)
    return tl.infer(
        genuine=windows,
        simulate=models,
        parameters=models.parameters,
        generations=2,
        seed=seed,
        settings=SMALL,
        out=out,
    )


def test_runs_are_resumed_and_pooled_where_signals_have_other_last_digits(
    tmp_path, on_another_processor
):
    recording = fish(tmp_path)
    begun = run_on(recording, 1, tmp_path / "run")
    on_another_processor()
    windows = recording.windows(length_s=4.0)
    models = as_recorded(Vicsek, recording, windows)
    resumed = tl.resume(tmp_path / "run", genuine=windows, simulate=models)
    assert resumed.complete
    other = run_on(recording, 2)
    systems = [run.configuration.system for run in (begun, other)]
    assert systems[0].digest != systems[1].digest
    assert systems[0].center != systems[1].center
    assert tl.pool([begun, other]).seeds == (1, 2)


def test_a_run_is_not_resumed_or_pooled_with_a_recording_of_nearly_the_same_motion(
    tmp_path, on_another_processor
):
    recording = fish(tmp_path)
    begun = run_on(recording, 1, tmp_path / "run")
    positions = recording.positions.copy()
    positions[100, 1] += 1e-9
    near = replace(recording, positions=positions)
    on_another_processor()
    with pytest.raises(ValueError, match=r"`genuine` must be the samples that the run began with"):
        tl.resume(tmp_path / "run", genuine=near.windows(length_s=4.0))
    with pytest.raises(ValueError, match=r"scenario\.digest = "):
        tl.pool([begun, run_on(near, 2)])
