import copy
import json
import logging
import pickle
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import turing_learning as tl
from turing_learning.analysis import Verdict, interval
from turing_learning.config import ConfigurationError, load_configuration
from turing_learning.identifiability import Effort, Recovery, TwoSampleTest
from turing_learning.robots import LABORATORY
from turing_learning.runs import (
    TIMINGS,
    Run,
    RunFolder,
    RunFolderError,
    RunStorageError,
    new_run_path,
    resume,
    resume_command,
    start,
    stored_generations,
)
from turing_learning.runs._history import Traces
from turing_learning.runs._paper import paper_absolute_errors
from turing_learning.runs._record import Record
from turing_learning.runs._summary import Ending, summarize
from turing_learning.systems import Arguments


def untimed(folder):
    content = json.loads((folder / "result.json").read_text())
    return {name: value for name, value in content.items() if name not in TIMINGS}


def contents(folder):
    return {
        path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()
    }


@pytest.fixture(scope="module")
def whole(tmp_path_factory, small):
    """A finished run that no test may change."""
    path = tmp_path_factory.mktemp("whole") / "run"
    start(small(), path)
    return path


@pytest.fixture
def finished(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "run")


@pytest.fixture
def stopped(small, tmp_path, stop_after):
    start(small(), tmp_path / "run", should_stop=stop_after(5))
    return tmp_path / "run"


def test_a_run_leaves_all_that_belongs_to_a_run_folder(finished):
    names = {path.name for path in finished.iterdir()}
    assert names == {
        "config.toml", "manifest.json", "result.json", "history.zarr", "checkpoints", "figures", "report.html", "lock",
        "seals.txt",
    }  # fmt: skip
    figures = {path.name for path in (finished / "figures").iterdir()}
    stems = ("parameters", "error", "fitness", "step-sizes")
    assert figures == {f"{name}.{kind}" for name in stems for kind in ("png", "svg")}


def test_the_result_file_has_the_agreed_keys(finished):
    content = json.loads((finished / "result.json").read_text())
    agreed = {
        "scenario", "generations", "seed", "complete", "truth", "best_model", "estimate", "absolute_error",
        "estimate_absolute_error", "mae", "seconds_total", "seconds_per_generation",
    }  # fmt: skip
    assert agreed <= set(content)
    assert (content["scenario"], content["generations"], content["seed"], content["complete"]) == (
        "aggregation", 7, 1, True,
    )  # fmt: skip
    assert content["truth"] == {"vl0": -0.7, "vr0": -1.0, "vl1": 1.0, "vr1": -1.0}
    assert content["mae"] == pytest.approx(np.mean(list(content["absolute_error"].values())))


def test_the_manifest_says_what_ran_where(finished):
    manifest = json.loads((finished / "manifest.json").read_text())
    assert (manifest["format_version"], manifest["state"], manifest["seed"]) == (1, "finished", 1)
    assert {"python", "numpy", "numba", "turing-learning"} <= set(manifest["versions"])
    assert manifest["machine"]["processors"] >= 1
    assert manifest["started"] <= manifest["finished"]
    assert manifest["seconds"] > 0


def test_the_stored_configuration_is_the_resolved_one(small, finished):
    assert load_configuration(finished / "config.toml") == small()


def test_a_run_in_memory_infers_the_same_as_one_on_disk(small, finished):
    in_memory = tl.infer(config=small())
    on_disk = tl.load_run(finished)
    assert (in_memory.estimate, in_memory.best_model) == (on_disk.estimate, on_disk.best_model)
    xr.testing.assert_identical(in_memory.history.drop_attrs(), on_disk.history.load().drop_attrs())
    assert in_memory.path is None


def test_the_best_model_is_that_of_the_last_generation(finished):
    result = tl.load_run(finished)
    last = result.history.isel(generation=-1)
    best = last["model"].to_numpy()[np.argmax(last["model_fitness"].to_numpy())]
    assert list(result.best_model.values()) == best.tolist()


def test_any_number_of_threads_gives_the_same_result(small, finished, tmp_path):
    for threads in (2, 3):
        start(small(threads=threads), tmp_path / f"{threads}")
        assert untimed(tmp_path / f"{threads}") == untimed(finished)


def test_another_seed_gives_another_result(small, finished, tmp_path):
    assert tl.infer(config=small(), seed=2).estimate != tl.load_run(finished).estimate


def test_arguments_come_before_the_configuration(small):
    result = tl.infer(config=small(), generations=2, seed=8)
    assert (result.generations, result.seed, result.scenario) == (2, 8, "aggregation")


def test_a_refused_argument_is_named():
    with pytest.raises(
        ConfigurationError,
        match=re.escape("`run.seed` must be greater than or equal to 0; got -1 [argument seed]."),
    ):
        tl.infer("aggregation", seed=-1)


def test_a_run_that_is_stopped_keeps_what_it_has(stopped):
    result = tl.load_run(stopped)
    assert (result.complete, result.generations) == (False, 5)
    assert result.history.sizes["generation"] == 5
    assert RunFolder(stopped).manifest()["state"] == "stopped"
    assert not (stopped / "report.html").exists()


def test_a_run_that_is_stopped_and_resumed_gives_the_result_of_one_that_never_was(stopped, whole):
    resume(stopped, threads=2)
    assert untimed(stopped) == untimed(whole)
    histories = [xr.open_zarr(folder / "history.zarr").load() for folder in (stopped, whole)]
    xr.testing.assert_identical(*histories)
    assert RunFolder(stopped).manifest()["state"] == "finished"


UNSEEN = {
    "scenario.agents": 2,
    "scenario.objects.count": 0,
    "scenario.trial.duration_s": 1.0,
    "models.population": 4,
    "classifiers.population": 4,
    "run.threads": 1,
}


def test_a_sensor_for_objects_that_are_not_there_is_refused_in_new_runs(tmp_path):
    with pytest.raises(
        ConfigurationError,
        match=r"`scenario.objects.count` must be at least 1 .* vl1 and vr1 cannot be inferred; got 0. Set it, or leave",
    ):
        tl.infer("object-clustering", settings=UNSEEN, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_a_stored_run_with_such_a_sensor_goes_on_and_is_checked(tmp_path, stop_after):
    configuration = load_configuration(
        None, "default", UNSEEN | {"run.generations": 4}, scenario="object-clustering"
    )
    stopped = start(configuration, tmp_path / "run", should_stop=stop_after(2))
    assert not stopped.complete
    result = resume(tmp_path / "run")
    assert result.complete
    quick = Effort(samples=10, points=0)
    assert len(result.check(effort=quick, recovery_generations=1).recoveries) == 1


def test_resuming_a_finished_run_changes_nothing(finished):
    before = contents(finished)
    result = resume(finished)
    assert result.complete
    assert contents(finished) == before


@pytest.mark.parametrize("lost", ["report.html", "figures/error.png"])
def test_a_run_that_was_killed_while_drawing_draws_again(finished, lost):
    before = untimed(finished)
    (finished / lost).unlink()
    RunFolder(finished).update_manifest(state="running", finished=None)
    resume(finished)
    assert (finished / lost).exists()
    assert untimed(finished) == before


def test_a_run_without_any_checkpoint_starts_at_generation_0(stopped):
    for path in (stopped / "checkpoints").iterdir():
        path.unlink()
    seen = []
    resume(stopped, observer=lambda progress: seen.append(progress.completed))
    assert seen == list(range(1, 8))


def test_resuming_removes_what_a_killed_process_left(stopped):
    left = [
        stopped / name for name in (".result.json.12.partial", "history.zarr/model/0.0.ab.partial")
    ]
    for path in left:
        path.write_bytes(b"half")
    resume(stopped)
    assert not [path for path in left if path.exists()]


def test_a_damaged_checkpoint_is_told_and_the_previous_one_is_used(stopped, whole, caplog):
    newest = max((stopped / "checkpoints").iterdir())
    newest.write_bytes(newest.read_bytes()[:100])
    seen = []
    with caplog.at_level(logging.WARNING, logger="turing_learning"):
        resume(stopped, observer=lambda progress: seen.append(progress.completed))
    assert seen == [4, 5, 6, 7]
    assert caplog.messages == [
        f"Checkpoint {newest.name} is damaged; the run is resumed from generation 3."
    ]
    assert untimed(stopped) == untimed(whole)


def test_a_damaged_history_is_told_and_the_run_begins_again(stopped, whole, caplog):
    (stopped / "history.zarr" / "model" / "0.0.0").unlink()
    with caplog.at_level(logging.WARNING, logger="turing_learning"):
        resume(stopped)
    assert caplog.messages == [
        f"The history in {stopped} is damaged; the run is resumed from generation 0."
    ]
    assert untimed(stopped) == untimed(whole)


@pytest.mark.parametrize("name", ["classifier/1.0.0", "model/1.0.0", "selection/1"])
def test_a_run_whose_history_is_damaged_late_goes_on_from_the_checkpoint_before(
    name, stopped, whole, caplog
):
    chunk = stopped / "history.zarr" / name
    chunk.write_bytes(chunk.read_bytes()[:-5])
    with caplog.at_level(logging.WARNING, logger="turing_learning"):
        resume(stopped)
    assert caplog.messages == [
        f"The history in {stopped} is damaged; the run is resumed from generation 3."
    ]
    assert untimed(stopped) == untimed(whole)
    assert xr.open_zarr(stopped / "history.zarr").identical(xr.open_zarr(whole / "history.zarr"))


@pytest.mark.parametrize("left", [None, b"", b"xx", b"[]", b'{"generations": 7}'])
def test_a_finished_run_that_lost_its_result_gets_it_back(left, finished, whole):
    (finished / "result.json").unlink()
    if left is not None:
        (finished / "result.json").write_bytes(left)
    changed = ("result.json", "seals.txt")
    others = {
        name: content for name, content in contents(finished).items() if name.name not in changed
    }
    assert tl.load_run(finished).to_json() == json.loads((whole / "result.json").read_text())
    resume(finished)
    assert tl.load_run(finished).to_json() == json.loads((whole / "result.json").read_text())
    found = {
        name: content for name, content in contents(finished).items() if name.name not in changed
    }
    assert found == others | ({} if left is None else {Path("result.json.damaged"): left})


def test_an_edited_result_is_made_again_and_the_edited_one_kept_beside_it(finished, whole, caplog):
    path = finished / "result.json"
    edited = path.read_text().replace('"vl0": ', '"vl0": 1', 1)
    path.write_text(edited)
    with caplog.at_level(logging.WARNING, logger="turing_learning"):
        assert tl.load_run(finished).estimate == tl.load_run(whole).estimate
    assert caplog.messages == [
        f"{path} is damaged; the result is made again from the last checkpoint."
    ]
    assert path.read_text() == edited
    resume(finished)
    assert path.read_bytes() == (whole / "result.json").read_bytes()
    assert (finished / "result.json.damaged").read_text() == edited


@pytest.mark.parametrize(
    "name", ["model/1.0.0", "classifier_fitness/0.0", "generation/0", "parameter/0", ".zmetadata"]
)
@pytest.mark.parametrize("damage", ["flip", "lose", "folder", "other"])
def test_a_history_that_is_not_as_it_was_written_is_not_read(finished, name, damage):
    path = finished / "history.zarr" / name
    content = path.read_bytes()
    path.unlink()
    if damage == "flip":
        path.write_bytes(bytes([content[0] ^ 1]) + content[1:])
    elif damage == "folder":
        path.mkdir()
    elif damage == "other":
        path.write_bytes(b"[]")
    result = tl.load_run(finished)
    with pytest.raises(RunFolderError, match="`run` must have its history"):
        result.history.load()


def test_a_run_whose_seals_are_removed_is_refused(finished):
    (finished / "seals.txt").unlink()
    for door in (tl.load_run, resume):
        with pytest.raises(RunFolderError, match=r"manifest\.json \(seals\.txt is missing\)"):
            door(finished)


def test_a_checkpoint_of_another_run_is_not_resumed(small, tmp_path, stop_after):
    for seed in (1, 2):
        start(small(seed=seed, history="thin"), tmp_path / f"{seed}", should_stop=stop_after(5))
    shutil.rmtree(tmp_path / "1" / "checkpoints")
    shutil.copytree(tmp_path / "2" / "checkpoints", tmp_path / "1" / "checkpoints")
    resume(tmp_path / "1")
    assert untimed(tmp_path / "1") == untimed_result(small(seed=1, history="thin"))


def untimed_result(configuration):
    return {
        key: value
        for key, value in tl.infer(config=configuration).to_json().items()
        if key not in TIMINGS
    }


def test_a_run_is_a_loop_that_is_left_to_stop_it(small, tmp_path, whole):
    run = Run.begin(small(), tmp_path / "run")
    for progress in run:
        if progress.completed == 5:
            break
    assert (run.result.generations, run.complete) == (5, False)
    with pytest.raises(
        RuntimeError,
        match=r"`run` must be open; got one that was closed\. Open it again: .*Run\.open",
    ):
        next(iter(run))
    with Run.open(tmp_path / "run") as again:
        assert [progress.completed for progress in again] == [6, 7]
    assert untimed(tmp_path / "run") == untimed(whole)
    assert list(Run.open(tmp_path / "run")) == []
    assert again.history.equals(tl.load_run(whole).history)


def test_a_run_in_memory_continues_where_its_loop_was_left(small):
    run = Run.begin(small())
    next(iter(run))
    assert run.result.generations == 1
    assert [progress.completed for progress in run] == [2, 3, 4, 5, 6, 7]
    assert run.result.estimate == tl.infer(config=small()).estimate


def test_a_loop_that_raises_has_saved_the_run(small, tmp_path, whole):
    def fail_at_five():
        with Run.begin(small(), tmp_path / "run") as run:
            for progress in run:
                1 / (5 - progress.completed)

    with pytest.raises(ZeroDivisionError):
        fail_at_five()
    assert stored_generations(tmp_path / "run" / "checkpoints") == 5
    resume(tmp_path / "run")
    assert untimed(tmp_path / "run") == untimed(whole)


def test_a_run_with_a_source_of_its_callers_is_not_resumed_in_plain_simulation(
    small, tmp_path, whole
):
    configuration = small()

    def source(_configuration):
        return configuration.system.open(Arguments())

    for progress in Run.begin(configuration, tmp_path / "run", source=source(configuration)):
        if progress.completed == 5:
            break
    for again in (resume, lambda path: list(Run.open(path))):
        with pytest.raises(
            RunFolderError,
            match=r"which began with a source of its caller's. Give it again: .*Run.open",
        ):
            again(tmp_path / "run")
    assert [progress.completed for progress in Run.open(tmp_path / "run", source)] == [6, 7]
    assert untimed(tmp_path / "run") == untimed(whole)


def test_a_folder_that_moves_while_a_run_writes_ends_the_run(small, tmp_path, whole):
    moved = tmp_path / "elsewhere"

    def move(progress):
        if progress.completed == 4:
            (tmp_path / "run").rename(moved)

    with pytest.raises(RunStorageError, match="must stay where it is while it is written"):
        start(small(), tmp_path / "run", observer=move)
    assert not (tmp_path / "run").exists()
    resume(moved)
    assert untimed(moved) == untimed(whole)


@pytest.mark.parametrize("name", ["config.toml", "manifest.json"])
def test_a_file_that_is_removed_while_a_run_writes_is_written_again(small, tmp_path, whole, name):
    def remove(progress):
        if progress.completed == 4:
            (tmp_path / "run" / name).unlink()

    start(small(), tmp_path / "run", observer=remove)
    assert untimed(tmp_path / "run") == untimed(whole)
    assert tl.load_run(tmp_path / "run").complete


def test_a_finished_run_that_lost_result_and_checkpoints_runs_again(finished, whole):
    (finished / "result.json").unlink()
    shutil.rmtree(finished / "checkpoints")
    resume(finished)
    assert untimed(finished) == untimed(whole)
    assert json.loads((finished / "manifest.json").read_text())["state"] == "finished"


def test_nothing_is_overwritten_without_force(finished, small):
    before = contents(finished)
    with pytest.raises(
        RunFolderError,
        match=r"must be a new or empty folder; got .* which holds a run. Resume it with",
    ):
        start(small(), finished)
    assert contents(finished) == before


def test_force_replaces_a_run_and_nothing_but_a_run(finished, small, tmp_path, stop_after):
    start(small(seed=5), finished, force=True, should_stop=stop_after(2))
    assert tl.load_run(finished).seed == 5
    assert not (finished / "report.html").exists()
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.txt").write_text("precious")
    with pytest.raises(
        RunFolderError,
        match=re.escape("holds 'thesis.txt' and is not a run. Choose another folder."),
    ):
        start(small(), other, force=True)
    assert (other / "thesis.txt").read_text() == "precious"
    assert len(list(other.iterdir())) == 1


def test_a_file_in_the_place_of_the_folder_is_refused(small, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match=r"must be a folder that can be written; got .*file"):
        start(small(), tmp_path / "file")
    with pytest.raises(RunFolderError, match=r"must be a folder that can be written; got .*below"):
        start(small(), tmp_path / "file" / "below")


def test_a_folder_that_is_not_a_run_is_refused(tmp_path):
    for door in (resume, tl.load_run):
        with pytest.raises(
            RunFolderError, match=re.escape(f"`run` must be a run folder; got {tmp_path} without")
        ):
            door(tmp_path)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format_version": "1"}', "\x00"])
def test_a_manifest_that_is_none_is_refused(text, tmp_path):
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(RunFolderError, match="`run` must be a run folder"):
        tl.load_run(tmp_path)


def test_a_manifest_without_a_state_is_refused(finished):
    RunFolder(finished).update_manifest(state=None)
    for door in (tl.load_run, resume):
        with pytest.raises(
            RunFolderError,
            match=r"whose manifest has no state \[.*manifest.json\]. Restore the file.",
        ):
            door(finished)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            {"generations": 2, "settings": {"run.generations": 3}},
            "`run.generations` must be given once; got generations=2 and settings={'run.generations': 3}. Leave one of them out.",
        ),
        (
            {"seed": 2, "settings": {"run": {"seed": 3}}},
            "`run.seed` must be given once; got seed=2 and settings={'run': {'seed': 3}}.",
        ),
        (
            {"threads": 1, "settings": {"run.threads": "all"}},
            "`run.threads` must be given once; got threads=1 and settings={'run.threads': 'all'}.",
        ),
        (
            {"settings": {"run.seed": 2, "run": {"seed": 3}}},
            "got settings={'run.seed': 2} and settings={'run': {'seed': 3}}.",
        ),
        ({"settings": {"run.seed": {}}}, "`run.seed` must be an integer; got a table"),
    ],
)
def test_what_is_said_twice_and_not_the_same_is_refused(given, message):
    with pytest.raises(ConfigurationError, match=re.escape(message)):
        tl.infer("aggregation", **given)


def test_what_is_said_twice_and_the_same_is_fine(small):
    settings = {
        "run.generations": 2,
        "run": {"threads": 1},
        "classifiers.input_scale": np.array([12.8, 5.0]),
    }
    result = tl.infer(config=small(), generations=2, threads=1, settings=settings)
    assert result.generations == 2
    assert settings["run"] == {"threads": 1}


def test_the_command_that_goes_on_can_be_pasted_whatever_the_folder(tmp_path):
    assert resume_command(tmp_path / "my run") == f"turing-learning resume '{tmp_path}/my run'"


def test_a_run_that_cannot_be_written_is_refused(stopped, monkeypatch):
    def read_only(self):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(RunFolder, "locked", read_only)
    with pytest.raises(
        RunFolderError,
        match=r"`run` must be a folder that can be written; got .* \(Permission denied\)",
    ):
        resume(stopped)


def test_a_format_from_the_future_is_refused_and_left_alone(finished):
    RunFolder(finished).update_manifest(format_version=2)
    before = contents(finished)
    for door in (resume, tl.load_run):
        with pytest.raises(
            RunFolderError, match=re.escape("`format_version` must be at most 1; got 2 [")
        ):
            door(finished)
    assert contents(finished) == before


def test_a_configuration_that_was_changed_is_refused(stopped):
    path = stopped / "config.toml"
    path.write_text(path.read_text().replace("seed = 1", "seed = 2"))
    with pytest.raises(RunFolderError, match=r"`config.toml` must be as it was when the run began"):
        resume(stopped)
    path.unlink()
    with pytest.raises(RunFolderError, match=r"without a readable config.toml. Restore the file."):
        resume(stopped)


def test_a_run_that_was_never_saved_has_no_result(stopped):
    for path in (stopped / "checkpoints").iterdir():
        path.unlink()
    with pytest.raises(RunFolderError, match="must have been saved at least once"):
        tl.load_run(stopped)


def test_a_folder_in_use_is_refused_and_names_who_uses_it(stopped, small):
    with RunFolder(stopped).locked():
        with pytest.raises(RunFolderError, match=r"to which process \d+ on .+ is writing"):
            resume(stopped)
        with pytest.raises(RunFolderError, match="`run` must not be in use"):
            start(small(), stopped, force=True)
    resume(stopped)


def test_a_full_disk_ends_with_a_message_and_a_run_that_can_be_resumed(
    small, whole, tmp_path, monkeypatch
):
    from turing_learning.runs import _folder as folders

    written = folders.write_atomically
    calls = []

    def filling_up(path, content):
        calls.append(path)
        if len(calls) == 3:  # the configuration, and two checkpoints
            raise OSError(28, "No space left on device")
        written(path, content)

    monkeypatch.setattr(folders, "write_atomically", filling_up)
    with pytest.raises(
        RunStorageError,
        match=r"\(No space left on device\). Make room, then resume with `turing-learning resume",
    ):
        start(small(), tmp_path / "run")
    assert tl.load_run(tmp_path / "run").generations == 3
    resume(tmp_path / "run")
    assert untimed(tmp_path / "run") == untimed(whole)


def test_a_result_in_memory_writes_its_report_where_it_is_told(small, tmp_path):
    result = tl.infer(config=small(generations=2))
    with pytest.raises(ValueError, match="`path` must be given for a run that is kept in memory"):
        result.report()
    page = result.report(tmp_path / "page.html").read_text(encoding="utf-8")
    assert "vl0" in page
    assert "checkpoint_every" in page


def test_a_loaded_result_writes_its_report_again(finished):
    (finished / "report.html").unlink()
    assert tl.load_run(finished).report() == finished / "report.html"
    assert (finished / "report.html").exists()


def test_a_result_prints_as_a_table(finished):
    lines = str(tl.load_run(finished)).splitlines()
    assert lines[0].startswith("aggregation, seed 1, 7 generations, ")
    headings = "parameter estimate 90 % true error best model its error"
    assert lines[1].split() == headings.split()
    assert [line.split()[0] for line in lines[2:6]] == ["vl0", "vr0", "vl1", "vr1"]


def test_estimate_and_interval_leave_out_the_first_half_of_a_short_run(finished):
    result = tl.load_run(finished)
    second_half = result.history["typical_model"].to_numpy()[-3:]  # of 7 generations
    assert list(result.estimate.values()) == np.median(second_half, axis=0).tolist()
    assert (second_half == second_half[0]).all()  # nothing has moved
    assert np.isnan(list(result.interval.values())).all()


def test_an_interval_that_is_not_known_is_null_in_the_file_and_a_dash_with_a_reason_in_text(
    finished,
):
    result = tl.load_run(finished)
    assert json.loads((finished / "result.json").read_text())["interval"] == {
        key: [None, None] for key in result.truth
    }
    assert result == tl.load_run(finished)
    lines = str(result).splitlines()
    assert [line.split()[2] for line in lines[2:6]] == ["-"] * 4
    assert lines[-1:] == [f"Verdict: still moving. {Verdict.MOVING.meaning}"]
    assert (result.verdict, result.verdicts) == ("still moving", (Verdict.MOVING,))
    page = result.report().read_text(encoding="utf-8")
    assert f"<b>{result.verdict}</b> <span>{Verdict.MOVING.meaning}</span>" in page
    assert ">nan" not in page


def test_a_run_that_still_moves_tells_what_it_wandered_over_and_no_interval(small, tmp_path):
    result = start(small(generations=20), tmp_path / "run")
    known = interval(result.history["typical_model"].to_numpy()[-6:], 6)
    np.testing.assert_array_equal(list(result.wandering.values()), known)
    assert np.isnan(list(result.interval.values())).all()
    assert tl.load_run(tmp_path / "run") == result
    assert "unknown" not in str(result)


@pytest.mark.parametrize(
    ("shrinks", "fitness", "found"),
    [(0.05, 0.5, Verdict.CONVERGED), (0.05, 0.6, Verdict.TOLD), (0.5, 0.5, Verdict.MOVING)],
)
def test_a_run_has_converged_if_its_models_have_contracted_and_classifiers_guess(
    small, shrinks, fitness, found
):
    configuration, rng = small(generations=100), np.random.default_rng(1)
    traces = Traces(100, 4)
    truth = np.array(configuration.scenario.truth)
    for k in range(100):
        scale = 1.0 if k < 50 else shrinks
        models = truth + scale * rng.standard_normal((8, 4))
        values = {
            "best_model": models[0],
            "typical_model": truth + 0.01 * rng.standard_normal(4),
            "selection": 0,
        }
        values |= {
            "model": models,
            "model_fitness": np.full(8, 0.5),
            "classifier_fitness": np.full(8, fitness),
        }
        traces.record(values, 0.1)
    ending = Ending(1.0, complete=True, spent=True, readout={})
    result = summarize(traces, ending, Record(configuration, 100))
    assert result.verdict == found
    assert np.isfinite(list(result.interval.values())).all() == (found == Verdict.CONVERGED)
    assert result.to_json()["verdict"] == found
    assert result.to_json()["verdicts"] == [found]


REJECTED = {
    "test": TwoSampleTest(0.9, 0.001, 0.55, 40, 40, 200, 200, "samples").to_json(),
    "recoveries": [
        Recovery(seed, 3, {}, {}, {}, {"vl0": 0.01}, 0.5, (0.48, 0.51, 0.52)).to_json()
        for seed in (1, 2)
    ],
    "parameters": [],
    "profiles": {},
    "quantities": [],
}


def test_checks_and_pools_say_theirs_beside_the_run(finished):
    result = tl.load_run(finished)
    folder = RunFolder(finished)
    folder.write("pool.json", {"estimate": result.estimate, "verdicts": ["runs disagree"]})
    content = {
        "settings": {"estimate": result.estimate},
        "verdicts": ["model rejected"],
        **REJECTED,
    }
    folder.write("check/check.json", content)
    assert result.verdicts == ("model rejected", "runs disagree", "still moving")
    assert result.verdict == "model rejected"
    folder.write(
        "check/check.json", content | {"settings": {"estimate": {}}}
    )  # of another estimate
    assert result.verdict == "runs disagree"
    assert json.loads((finished / "result.json").read_text())["verdicts"] == ["still moving"]


def test_a_report_replaces_an_earlier_one_and_no_other_file_unless_forced(finished, tmp_path):
    result, page = tl.load_run(finished), tmp_path / "page.html"
    page.write_text("mine")
    with pytest.raises(
        ConfigurationError,
        match=r"`path` must be a file that does not exist; got .*page.html. Choose",
    ):
        result.report(page)
    assert page.read_text() == "mine"
    written = result.report(page, force=True).read_bytes()
    page.write_bytes(written + b"<!-- older -->")
    assert result.report(page).read_bytes() == written


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("five.toml", "`path` must end with .html; got .*five.toml"),
        ("", "`path` must end with .html; got "),
        ("folder.html", "`path` must be a file; got .*folder.html, a folder"),
        (
            "nowhere/report.html",
            r"can be written; got .*report.html \(there is no folder .*nowhere\)",
        ),
        (
            f"{'a' * 300}.html",
            r"`path` must be a file that can be written; got .*\(File name too long\)",
        ),
    ],
)
def test_a_report_where_none_can_be_is_refused(finished, tmp_path, name, message):
    (tmp_path / "folder.html").mkdir()
    with pytest.raises(ConfigurationError, match=message):
        tl.load_run(finished).report(tmp_path / name, force=True)
    assert {path.name for path in tmp_path.iterdir()} == {"folder.html", finished.name}


def test_a_result_alone_has_no_history():
    result = tl.Evolution(
        "a",
        1,
        1,
        True,
        None,
        {"x": 0.0},
        {"x": 0.0},
        {"x": [-1.0, 2.0]},
        None,
        None,
        None,
        None,
        None,
        0,
        1.0,
        1.0,
        8,
    )
    with pytest.raises(RuntimeError, match="`history` must belong to a run; got a result alone"):
        _ = result.history
    assert str(result).splitlines()[2].split() == ["x", "0.000", "-1.000", "to", "2.000", "0.000"]


def test_the_observer_sees_every_generation(small):
    seen = []
    tl.infer(config=small(), observer=seen.append)
    assert [progress.completed for progress in seen] == [1, 2, 3, 4, 5, 6, 7]
    assert seen[-1].seconds_left == 0
    assert seen[0].seconds_left == pytest.approx(6 * seen[0].seconds_per_generation)
    assert seen[0].parameter_names == ("vl0", "vr0", "vl1", "vr1")


def test_new_folders_never_meet(small, tmp_path):
    first = new_run_path("aggregation", 1, tmp_path)
    assert re.fullmatch(r"aggregation-\d{8}-\d{6}-seed1", first.name)
    names = set()
    for _ in range(3):
        path = new_run_path("aggregation", 1, tmp_path)
        path.mkdir()
        names.add(path)
    assert len(names) == 3


def test_the_papers_errors_stand_only_beside_the_papers_scenarios():
    aggregation = replace(tl.swarm.AGGREGATION, title="Mine", description="")
    laboratory = replace(LABORATORY, name="aggregation")
    assert paper_absolute_errors(aggregation) == {
        "vl0": 0.01,
        "vr0": 0.01,
        "vl1": 0.07,
        "vr1": 0.06,
    }
    assert list(paper_absolute_errors(tl.swarm.OBJECT_CLUSTERING).values()) == [
        0.03,
        0.04,
        0.02,
        0.03,
        0.08,
        0.08,
    ]
    assert list(paper_absolute_errors(tl.swarm.AGGREGATION_VIEW_60).values()) == [
        0.04,
        0.03,
        0.05,
        0.05,
        0.20,
    ]
    assert paper_absolute_errors(laboratory) == {"vl0": 0.08, "vr0": 0.01, "vl1": 0.05, "vr1": 0.02}
    for change in (
        {"name": "mine"},
        {"agents": 3},
        {"grouping": "separated"},
        {"controller": (0.0, 0.0, 1.0, 1.0)},
        {"trial": replace(aggregation.trial, duration_s=7.0)},
    ):
        assert paper_absolute_errors(replace(aggregation, **change)) is None
        assert paper_absolute_errors(replace(laboratory, **change)) is None


def test_nothing_that_is_stored_holds_a_pickle(finished):
    for path, content in contents(finished).items():
        if path.suffix == ".npz":
            assert b"'|O'" not in content, path
        if path.name == ".zarray":
            assert json.loads(content)["filters"] is None, path


REPLACED = r"`run` must be in its folder; got .*same, where another run has taken its place\. Make it again, with an `out`"


def test_a_result_whose_folder_holds_another_run_by_now_neither_reads_nor_writes_there(
    small, tmp_path
):
    path = tmp_path / "same"
    first, second = (start(small(seed=seed), path, force=True) for seed in (1, 2))
    before = contents(path)
    uses = (lambda: first.history, first.report, lambda: first.check(effort=Effort(samples=40)))
    for use in (
        *uses,
        lambda: first.report(tmp_path / "page.html"),
        lambda: tl.pool([first, second]),
    ):
        with pytest.raises(RunFolderError, match=REPLACED):
            use()
    assert contents(path) == before
    assert not (tmp_path / "page.html").exists()
    assert second.history.sizes["generation"] == 7


def test_a_run_that_was_gone_on_with_is_still_the_one_that_an_earlier_result_is_of(stopped):
    earlier = tl.load_run(stopped)
    resume(stopped)
    assert earlier.history.sizes["generation"] == 5


def test_results_of_relative_folders_keep_theirs_when_the_process_goes_elsewhere(
    small, tmp_path, monkeypatch
):
    results = []
    for seed, name in ((1, "a"), (2, "b")):
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        results.append(start(small(seed=seed), "run"))
    assert [result.path for result in results] == [tmp_path / "a" / "run", tmp_path / "b" / "run"]
    first, second = (result.history["model"].to_numpy() for result in results)
    assert not np.array_equal(first, second)
    assert results[0].report() == tmp_path / "a" / "run" / "report.html"


def test_a_run_in_the_home_folder_is_there_and_has_its_history(small, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    result = start(small(), "~/run")
    assert result.path == tmp_path / "run"
    assert not (tmp_path / "~").exists()
    assert tl.load_run("~/run").history.equals(result.history)
    assert resume("~/run") == result


def crossed(result):
    return pickle.loads(pickle.dumps(result))  # noqa: S301 - our own


def test_a_result_crosses_processes_with_its_numbers_and_opens_its_folder_there(small, finished):
    result = tl.load_run(finished)
    there = crossed(crossed(result))
    assert (there.to_json(), there.path, there.configuration) == (
        result.to_json(),
        result.path,
        result.configuration,
    )
    assert there.history.equals(result.history)
    assert there.report() == result.report()
    start(small(seed=2), finished, force=True)
    with pytest.raises(RunFolderError, match="another run has taken its place"):
        there.history  # noqa: B018
    shutil.rmtree(finished)
    with pytest.raises(RunFolderError, match="where it is not any more"):
        crossed(there).history  # noqa: B018


def test_a_result_of_a_run_in_memory_crosses_processes_with_its_numbers_alone(small):
    result = tl.infer(config=small())
    assert crossed(result).to_json() == result.to_json()
    with pytest.raises(
        RuntimeError,
        match=r"got a result alone, as one of a run in memory .* a folder, with `out`\.",
    ):
        crossed(result).history  # noqa: B018


def test_copies_of_a_result_keep_all_of_it(whole):
    result = tl.load_run(whole)
    for copied in (copy.copy(result), copy.deepcopy(result)):
        assert copied.history.sizes == result.history.sizes
