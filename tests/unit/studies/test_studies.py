"""The doors of studies, with an executor in this process."""

import csv
import json
import re
import shutil
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.config import ConfigurationError
from turing_learning.runs import RunFolder, RunFolderError, start
from turing_learning.store import DamagedError, RunStorageError
from turing_learning.studies import (
    ExecutorError,
    StudyFolder,
    collect_study,
    is_study,
    load_study,
    new_study_path,
    plan_study,
    resume_study,
    run_one,
    study,
)
from turing_learning.studies._study import StudyExecution, create_study
from turing_learning.studies._table import paper_of

TABLES = ("runs.csv", "summary.csv", "convergence.csv")


def tables(path):
    return {name: (path / name).read_bytes() for name in TABLES}


def prepared(path, **arguments):
    """Make a study of which nothing has been run."""
    with ExitStack() as stack:
        create_study(plan_study("aggregation", **arguments), StudyFolder(path), stack)
    return path


def rows(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_study_is_a_set_of_runs_as_infer_makes_them(finished, small):
    assert [run.seed for run in finished.runs] == [5, 6, 7]
    alone = tl.infer(
        config=tl.studies.plan_study("aggregation", first_seed=6, runs=1, settings=small).base,
        generations=7,
    )
    assert finished.runs[1].result["best_model"] == alone.best_model
    assert finished.runs[1].result["estimate"] == alone.estimate


def test_a_study_of_trials_keeps_no_samples(executor, tmp_path):
    settings = {"scenario.agents": 2, "scenario.trial.duration_s": 1.0, "classifiers.population": 8}
    result = study(
        "aggregation",
        runs=2,
        trials=30,
        settings=settings,
        executor=executor,
        out=tmp_path / "study",
    )
    assert [run.result["trials"] for run in result.runs] == [30, 30]
    assert not list((tmp_path / "study").rglob("buffer/*.npz"))
    alone = tl.infer("aggregation", trials=30, seed=2, settings={**settings, "run.threads": 1})
    assert result.runs[1].result["estimate"] == alone.estimate
    assert len(rows(tmp_path / "study" / "convergence.csv")) == alone.generations
    assert [row["trials"] for row in rows(tmp_path / "study" / "runs.csv")] == ["30", "30"]
    with pytest.raises(RunFolderError, match="`run` must have its samples, to get more trials"):
        tl.resume(result.path / "runs" / "0001", trials=60)


def test_statistics_are_those_of_the_runs(finished):
    errors = [run.result["absolute_error"]["vl1"] for run in finished.runs]
    found = next(
        one for one in finished.summaries if one.parameter == "vl1" and one.model == "best_model"
    )
    assert found.runs == 3
    assert found.mean == pytest.approx(np.mean(errors))
    assert found.standard_deviation == pytest.approx(np.std(errors, ddof=1))
    assert found.median == np.median(errors)
    assert found.paper is None  # not the paper's number of agents


def test_the_papers_error_stands_beside_runs_of_its_scenario(finished):
    plan, papers = plan_study("aggregation", runs=3), {"paper_absolute_error": {"vl1": 0.07}}
    runs = [replace(run, result={**run.result, **papers}) for run in finished.runs]
    assert paper_of(plan, runs, "vl1") == 0.07
    assert paper_of(plan, [runs[0], *finished.runs[1:]], "vl1") is None


def test_a_study_is_sealed_from_the_start(small, executor, tmp_path, caplog):
    path = prepared(tmp_path / "study", runs=1, settings=small | {"run.generations": 2})
    assert all(StudyFolder(path).read_bytes(name) for name in ("study.json", "config.toml"))
    assert resume_study(path, executor=executor).complete
    assert all(StudyFolder(path).read_bytes(name) for name in TABLES)
    assert caplog.messages == []


def test_the_folder_holds_tables_figures_and_report(finished):
    assert {path.name for path in (finished.path / "figures").iterdir()} == {
        f"{name}.{kind}"
        for name in ("boxes", "convergence", "histogram")
        for kind in ("png", "svg")
    }
    page = (finished.path / "report.html").read_text()
    assert "Aggregation: a study of 3 runs" in page
    assert page.count("<svg") == 3
    found = rows(finished.path / "runs.csv")
    assert [row["seed"] for row in found] == ["5", "6", "7"]
    assert float(found[2]["estimate_vr0"]) == finished.runs[2].result["estimate"]["vr0"]
    assert len(rows(finished.path / "convergence.csv")) == 7


def test_convergence_is_the_median_over_the_runs(finished):
    histories = [
        tl.load_run(path).history["best_model"].to_numpy()
        for path in sorted(finished.path.glob("runs/*"))
    ]
    found = rows(finished.path / "convergence.csv")[4]
    assert float(found["best_model_vr1"]) == pytest.approx(
        np.median([history[4, 3] for history in histories])
    )
    maes = [np.abs(history[4] - [-0.7, -1, 1, -1]).mean() for history in histories]
    assert float(found["best_mae"]) == pytest.approx(np.median(maes))


def test_runs_of_a_study_are_small(finished):
    run = finished.path / "runs" / "0001"
    assert sorted(path.name for path in run.iterdir()) == [
        "checkpoints", "config.toml", "lock", "manifest.json", "result.json", "seals.txt"
    ]  # fmt: skip
    assert sum(path.stat().st_size for path in run.rglob("*") if path.is_file()) < 20_000


def test_a_notebook_shows_a_row_for_each_run(finished):
    table = finished.to_dataframe()
    assert table["seed"].tolist() == [5, 6, 7]
    assert table["estimate_mae"].tolist() == list(finished.maes)
    assert repr(finished).startswith("<StudyResult: ")
    assert finished._repr_html_().count("<tr") == 2 + 3


def test_the_table_does_not_depend_on_the_workers(finished, small, tmp_path):
    with ThreadPoolExecutor(3) as executor:
        study(
            "aggregation", runs=3, first_seed=5, generations=7, settings=small, executor=executor, out=tmp_path / "a"
        )  # fmt: skip
    assert tables(tmp_path / "a") == tables(finished.path)
    study(
        "aggregation",
        runs=3,
        first_seed=5,
        generations=7,
        settings=small,
        workers=2,
        out=tmp_path / "b",
    )
    assert tables(tmp_path / "b") == tables(finished.path)


def test_an_executor_of_processes_works(finished, small, tmp_path):
    import multiprocessing

    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as executor:
        result = study(
            "aggregation", runs=3, first_seed=5, generations=7, settings=small, executor=executor, out=tmp_path / "a"
        )  # fmt: skip
    assert result == finished


def test_a_study_is_loaded_and_resumed_without_change(finished, executor):
    assert load_study(finished.path) == finished
    before = tables(finished.path)
    assert resume_study(finished.path, executor=executor) == finished
    assert tables(finished.path) == before


def test_the_same_settings_go_on_and_others_are_refused_by_name(finished, small, executor):
    arguments = {
        "runs": 3,
        "first_seed": 5,
        "generations": 7,
        "executor": executor,
        "out": finished.path,
    }
    assert study("aggregation", settings=small, **arguments) == finished
    assert (
        study(
            "aggregation",
            settings=small | {"scenario.description": "11 robots gather."},
            **arguments,
        )
        == finished
    )
    for changes, named in [
        ({"settings": small | {"classifiers.hidden": 4}}, "`classifiers.hidden` must be 5"),
        ({"generations": 8}, "`run.generations` must be 7"),
        ({"runs": 4}, "`runs` must be 3"),
        ({"first_seed": 6}, "`run.seed` must be 5"),
    ]:
        with pytest.raises(
            RunFolderError,
            match=f"^{re.escape(named)}.* as in the study that is in the folder; got ",
        ):
            study("aggregation", **({"settings": small} | arguments | changes))


def test_force_replaces_a_study(small, executor, tmp_path):
    for generations in (2, 3):
        result = study(
            "aggregation", runs=1, generations=generations, settings=small, executor=executor, out=tmp_path / "a",
            force=True,
        )  # fmt: skip
        assert result.runs[0].result["generations"] == generations


def test_a_folder_of_something_else_is_refused(executor, tmp_path):
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(
        RunFolderError, match=r"hold this study; got .* which holds 'letter.txt' and is not a study"
    ):
        study("aggregation", runs=1, executor=executor, out=tmp_path, force=True)
    assert [path.name for path in tmp_path.iterdir()] == ["letter.txt"]


def test_a_folder_that_cannot_be_made_is_refused(executor, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(
        RunFolderError, match=r"^`out` must be a folder that can be written; got .*file/study"
    ):
        study("aggregation", runs=1, executor=executor, out=tmp_path / "file" / "study")


def test_a_grid_is_summarized_configuration_by_configuration(small, executor, tmp_path):
    result = study(
        "aggregation", runs=2, generations=3, settings=small, grid={"run.estimate_window": [1, 2]}, executor=executor,
        out=tmp_path / "grid",
    )  # fmt: skip
    assert result.groups == ({"run.estimate_window": 1}, {"run.estimate_window": 2})
    assert len(result.summaries) == 2 * 4 * 2
    assert [row["run.estimate_window"] for row in rows(tmp_path / "grid" / "runs.csv")] == [
        "1",
        "1",
        "2",
        "2",
    ]
    assert (tmp_path / "grid" / "figures" / "configurations.svg").exists()
    assert "estimate_window 2" in (tmp_path / "grid" / "report.html").read_text()


def test_random_behaviors_have_their_own_figures(small, executor, tmp_path):
    result = study(
        "random-behaviors",
        runs=3,
        generations=3,
        settings=small,
        executor=executor,
        out=tmp_path / "study",
    )
    assert {path.stem for path in (tmp_path / "study" / "figures").iterdir()} == {
        "histogram",
        "errors",
        "convergence",
    }
    truths = {tuple(run.result["truth"].values()) for run in result.runs}
    assert len(truths) == 3


def test_the_papers_errors_stand_only_beside_the_papers_random_behaviors(small, executor, tmp_path):
    papers = {"vl0": 0.01, "vr0": 0.02, "vl1": 0.07, "vr1": 0.05}
    grid = {"scenario.agents": [10, 2]}
    sizes = {key: value for key, value in small.items() if not key.startswith("scenario.")}
    sizes["scenario.description"] = "11 robots"
    result = study(
        "random-behaviors",
        runs=1,
        generations=1,
        settings=sizes,
        grid=grid,
        executor=executor,
        out=tmp_path / "s",
    )
    found = [
        {one.parameter: one.paper for one in result.summaries if one.group["scenario.agents"] == n}
        for n in (10, 2)
    ]
    assert found == [papers, dict.fromkeys(papers)]


def test_a_study_in_the_home_folder_is_found(finished, monkeypatch):
    monkeypatch.setenv("HOME", str(finished.path.parent))
    path = f"~/{finished.path.name}"
    assert is_study(path)
    assert load_study(path) == finished


def test_a_failed_run_is_named_and_tried_again(small, executor, tmp_path):
    path = prepared(tmp_path / "study", runs=3, settings=small | {"run.generations": 3})
    obstacle = path / "runs" / "0002" / "notes.txt"
    obstacle.parent.mkdir(parents=True)
    obstacle.write_text("not a run")
    result = resume_study(path, executor=executor)
    assert [run.state for run in result.runs] == ["complete", "failed", "complete"]
    assert result.failed[0].reason.startswith("RunFolderError: `out` must be a new or empty folder")
    assert result.kinds()["failed (RunFolderError)"] == 1
    assert "1 failed" in str(result)
    assert "1 run failed: the statistics are of the others." in (path / "report.html").read_text()
    assert rows(path / "runs.csv")[1]["reason"].startswith("RunFolderError")
    obstacle.unlink()
    assert resume_study(path, executor=executor).complete


def test_a_stopped_study_goes_on_to_the_same_table(finished, small, executor, tmp_path):
    seen = []
    result = study(
        "aggregation", runs=3, first_seed=5, generations=7, settings=small, executor=executor, out=tmp_path / "study",
        observer=seen.append, should_stop=lambda: True,
    )  # fmt: skip
    assert result.unfinished
    assert not (tmp_path / "study" / "summary.csv").exists()
    assert load_study(tmp_path / "study").unfinished
    assert resume_study(tmp_path / "study", executor=executor) == finished
    assert tables(tmp_path / "study") == tables(finished.path)


def test_an_observer_is_told_of_every_run(small, executor, tmp_path):
    seen = []
    study(
        "aggregation", runs=3, generations=4, settings=small, executor=executor, out=tmp_path / "a", observer=seen.append
    )  # fmt: skip
    assert sorted(run.number for progress in seen for run in progress.finished) == [1, 2, 3]
    last = seen[-1]
    assert (last.total, last.done, last.failed, last.running) == (3, 3, 0, 0)
    assert last.generations == last.generations_total == 12
    assert last.seconds_left == 0.0
    assert len(last.maes) == 3


def test_generations_of_a_run_that_has_ended_count_once(tmp_path):
    folder = StudyFolder(prepared(tmp_path / "study", runs=2, settings={"run.generations": 100}))
    for number in (1, 2):
        checkpoints = folder.run_path(number) / "checkpoints"
        checkpoints.mkdir(parents=True)
        (checkpoints / f"generation-000090-{number:016x}.npz").touch()
    counter = StudyExecution(folder, folder.plan())
    assert counter.progress(2).generations == 180
    counter.end(1)
    assert counter.progress(1).generations == 190
    counter.end(2)
    assert counter.progress(0).generations == counter.progress(0).generations_total == 200


def test_a_run_of_a_study_is_executed_by_its_number(finished, small, tmp_path):
    path = prepared(
        tmp_path / "study", runs=3, first_seed=5, settings=small | {"run.generations": 7}
    )
    for number in (3, 1):
        assert run_one(path, number).result is not None
    assert not collect_study(path).complete
    assert "1 run is not complete" in (path / "report.html").read_text()
    assert run_one(path, 2).complete
    assert collect_study(path) == finished
    with pytest.raises(ConfigurationError, match=r"^`number` must be between 1 and 3; got 4\.$"):
        run_one(path, 4)


def test_a_study_of_full_histories_has_the_report_of_each_run(small, executor, tmp_path):
    settings = small | {"run.history": "full"}
    study(
        "aggregation",
        runs=1,
        generations=3,
        settings=settings,
        executor=executor,
        out=tmp_path / "study",
    )
    assert (tmp_path / "study" / "runs" / "0001" / "report.html").exists()
    assert tl.load_run(tmp_path / "study" / "runs" / "0001").history["model"].shape == (3, 8, 4)


@pytest.mark.parametrize("history", ["thin", "full"])
def test_a_run_killed_after_its_result_is_not_complete_and_is_finished_without_another_generation(
    history, small, executor, tmp_path, monkeypatch
):
    def kill():
        raise KeyboardInterrupt

    path = prepared(
        tmp_path / "study", runs=1, settings=small | {"run.generations": 3, "run.history": history}
    )
    with monkeypatch.context() as patch:
        patch.setattr("turing_learning.runs._run.now", kill)
        with pytest.raises(KeyboardInterrupt):
            run_one(path, 1)
    run = path / "runs" / "0001"
    assert (run / "result.json").exists()
    assert load_study(path).runs[0].state == "stopped"
    monkeypatch.setattr("turing_learning.runs._run.Run._step", kill)
    assert resume_study(path, executor=executor).complete
    assert RunFolder(run).manifest()["state"] == "finished"
    assert (run / "report.html").exists() == (history == "full")


class Broken(ThreadPoolExecutor):
    def submit(self, *arguments):
        future = Future()
        future.set_exception(BrokenExecutor("a process died"))
        return future


def test_an_executor_that_breaks_ends_the_study_which_can_be_resumed(small, executor, tmp_path):
    with pytest.raises(
        ExecutorError,
        match=r"stay alive until the study ends; got BrokenExecutor: a process died\. Go on .* resume '.*/my study'`\.$",
    ):
        study(
            "aggregation",
            runs=1,
            generations=3,
            settings=small,
            executor=Broken(),
            out=tmp_path / "my study",
        )
    assert resume_study(tmp_path / "my study", executor=executor).complete


def test_an_executor_that_is_shut_down_is_named(small, executor, tmp_path):
    executor.shutdown()
    with pytest.raises(
        ExecutorError,
        match=r"^`executor` must stay alive until the study ends; got RuntimeError: cannot",
    ):
        study(
            "aggregation",
            runs=1,
            generations=3,
            settings=small,
            executor=executor,
            out=tmp_path / "study",
        )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"workers": 0}, r"^`workers` must be an integer of at least 1; got 0\.$"),
        ({"workers": 1.5}, r"^`workers` must be an integer of at least 1; got 1\.5\.$"),
        (
            {"workers": 2, "cluster": "tcp://x:1"},
            r"^`workers` must be left out beside `cluster`; got both",
        ),
    ],
)
def test_wrong_hands_are_refused(arguments, message, tmp_path):
    with pytest.raises(ConfigurationError, match=message):
        study("aggregation", runs=1, out=tmp_path / "study", **arguments)
    assert not (tmp_path / "study").exists()


def test_a_folder_that_is_no_study_is_named(tmp_path):
    with pytest.raises(
        RunFolderError,
        match=r"^`study` must be a study folder; got .* without a readable study\.json",
    ):
        load_study(tmp_path)


def test_changed_and_later_studies_are_refused(small, executor, tmp_path):
    path = tmp_path / "study"
    study("aggregation", runs=1, generations=2, settings=small, executor=executor, out=path)
    content = json.loads((path / "study.json").read_text())
    (path / "study.json").write_text(json.dumps(content | {"format_version": 99}))
    with pytest.raises(RunFolderError, match=r"^`format_version` must be at most 1; got 99"):
        load_study(path)
    for changed in ({"format_version": 1}, content | {"scenario": "other"}):
        (path / "study.json").write_text(json.dumps(changed))
        with pytest.raises(
            DamagedError, match=r"^`study` must hold study\.json as it was written; got "
        ):
            load_study(path)
    StudyFolder(path).create({})
    with pytest.raises(
        RunFolderError, match=r"^`study` must be as it was when it began; got .* cannot be read"
    ):
        load_study(path)
    StudyFolder(path).create(content)
    with (path / "config.toml").open("a") as file:
        file.write("\n")
    with pytest.raises(
        RunFolderError, match=r"^`config.toml` must be as it was when the study began"
    ):
        load_study(path)


def test_a_run_of_another_configuration_is_not_taken_for_one_of_the_study(
    small, executor, tmp_path
):
    path = prepared(tmp_path / "study", runs=1, settings=small | {"run.generations": 2})
    other = plan_study("aggregation", first_seed=2, settings=small | {"run.generations": 2}).base
    start(other, path / "runs" / "0001", should_stop=lambda: True)
    result = resume_study(path, executor=executor)
    assert "must be that of the study" in result.failed[0].reason


def test_two_studies_in_one_second_get_two_folders(tmp_path, monkeypatch):
    monkeypatch.setattr("time.strftime", lambda pattern: "20260101-000000")
    plan = plan_study("aggregation", runs=1)
    first = new_study_path(plan, tmp_path)
    first.mkdir()
    assert (first.name, new_study_path(plan, tmp_path).name) == (
        "aggregation-study-20260101-000000",
        "aggregation-study-20260101-000000-2",
    )


def test_verdicts_say_how_a_run_misses_the_truth(finished):
    run = finished.runs[0]
    truth = run.result["truth"]

    def verdict(**changes):
        estimate = truth | changes
        mae = float(np.mean([abs(estimate[name] - truth[name]) for name in truth]))
        return replace(run, result=run.result | {"estimate": estimate, "estimate_mae": mae}).verdict

    assert verdict() == "good"
    assert verdict(vl0=-0.4) == "fair"
    assert verdict(vl0=1.0, vr0=-1.0) == "poor (I = 0 as I = 1)"
    assert verdict(vl0=50.0) == "poor (runaway)"
    assert replace(run, result=run.result | {"estimate_mae": None}).verdict == "no truth"


def test_a_study_that_is_moved_while_it_runs_stops_and_says_so(small, executor, tmp_path):
    path = tmp_path / "study"

    def move(progress):
        if progress.done == 2 and path.exists():
            path.rename(tmp_path / "elsewhere")

    with pytest.raises(
        RunStorageError, match=r"^`study` must stay where it is while it is written; got "
    ):
        study(
            "aggregation",
            runs=2,
            generations=2,
            settings=small,
            executor=executor,
            out=path,
            observer=move,
        )
    assert resume_study(tmp_path / "elsewhere", executor=executor).complete


def test_a_study_whose_seals_are_removed_is_refused(finished, tmp_path):
    shutil.copytree(finished.path, tmp_path / "study")
    (tmp_path / "study" / "seals.txt").unlink()
    with pytest.raises(DamagedError, match=r"\(seals\.txt is missing\)"):
        load_study(tmp_path / "study")


def written(content):
    return lambda runs: (runs / "0002" / "result.json").write_text(content)


def another_digit(runs):
    path = runs / "0002" / "result.json"
    path.write_text(
        re.sub(
            r'(?<="vl0": )(-?)(\d)',
            lambda found: f"{found[1]}{(int(found[2]) + 1) % 10}",
            path.read_text(),
        )
    )


def result_of_another_run(runs):
    shutil.copy(runs / "0001" / "result.json", runs / "0002" / "result.json")


def another_run(runs):
    shutil.rmtree(runs / "0002")
    shutil.copytree(runs / "0001", runs / "0002")


@pytest.mark.parametrize(
    "damage",
    [
        *map(written, ["[]", '{"complete": true}', '{"complete": true, "estimate": 3}', "[" * 100_000, "\x00"]),
        another_digit, result_of_another_run, another_run,
    ],
)  # fmt: skip
def test_a_run_that_is_not_as_it_was_written_is_left_out_and_made_again(
    damage, finished, executor, tmp_path, caplog
):
    path = shutil.copytree(finished.path, tmp_path / "study")
    damage(path / "runs")
    assert [run.state for run in load_study(path).runs] == ["complete", "stopped", "complete"]
    assert caplog.messages[0].startswith("Run 2 of the study is left out until it is resumed: ")
    again = resume_study(path, executor=executor)
    if damage is another_run:
        assert "must be that of the study" in again.failed[0].reason
    else:
        assert again == finished
        assert tables(path) == tables(finished.path)


def test_medians_are_not_read_from_checkpoints_of_other_runs(finished, tmp_path):
    path = shutil.copytree(finished.path, tmp_path / "study")
    (own,) = (path / "runs" / "0002" / "checkpoints").iterdir()
    (other,) = (path / "runs" / "0001" / "checkpoints").iterdir()
    own.unlink()
    shutil.copy(other, own.parent)
    assert RunFolder(path / "runs" / "0002").traces() is None


@pytest.mark.parametrize("runs", [[], [1, 2], [{}], [{"run.seed": "1"}], 3])
def test_runs_that_are_none_are_refused(runs, finished, tmp_path):
    shutil.copytree(finished.path, tmp_path / "study", ignore=shutil.ignore_patterns("runs"))
    folder = StudyFolder(tmp_path / "study")
    folder.create(folder.head() | {"runs": runs})
    with pytest.raises(
        RunFolderError, match=r"^`study` must be as it was when it began; got .* cannot be read"
    ):
        load_study(tmp_path / "study")
