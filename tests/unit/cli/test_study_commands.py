"""What the commands of studies print, and their exit codes."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from turing_learning.cli._live import study_picture, watching_study
from turing_learning.studies import StudyProgress, StudyResult, StudyRun

pytestmark = pytest.mark.usefixtures("wide")

SMALL = [
    "--set", "models.population=8", "--set", "classifiers.population=8", "--set", "scenario.agents=2",
    "--set", "scenario.trial.duration_s=1.0",
]  # fmt: skip


@pytest.fixture(scope="module")
def finished(tmp_path_factory, done):
    """A small study, made by the command line."""
    folder = tmp_path_factory.mktemp("studies") / "study"
    done(
        "study",
        "aggregation",
        *SMALL,
        "--runs",
        2,
        "--generations",
        3,
        "--workers",
        1,
        "--out",
        folder,
    )
    return folder


def test_show_prints_the_table_of_a_study(finished, call):
    code, out, _ = call("show", finished)
    assert code == 0
    for text in (
        "Aggregation: 2 of 2 runs",
        "estimate",
        "best model",
        "paper",
        "vr1",
        "2 of 2 runs complete",
        "report.html",
    ):
        assert text in out


def test_resume_of_a_finished_study_prints_the_table(finished, call):
    code, out, _ = call("resume", finished)
    assert code == 0
    assert "2 of 2 runs complete" in out


def test_collect_and_run_are_the_steps_of_a_cluster(finished, call):
    code, out, _ = call("study-run", finished, 2)
    assert code == 0
    assert out.startswith("run 2: poor (")
    code, out, _ = call("study-collect", finished)
    assert code == 0
    assert "2 of 2 runs complete" in out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("study", r"`SCENARIO` must be given, or a file .* random-behaviors"),
        (
            "study agregation",
            r"`scenario` must be a known scenario; got 'agregation'.*Did you mean `aggregation`",
        ),
        ("study aggregation --runs 0", r"`runs` must be an integer of at least 1; got 0"),
        ("study aggregation --runs x", r"Invalid value for --runs: must be an integer; got 'x'\."),
        ("study aggregation --first-seed 1.5", r"--first-seed: must be an integer; got '1\.5'\."),
        ("study aggregation --set run.seed=3", r"Give the seeds with `runs` and `first_seed`\."),
        (
            "study aggregation --config empty.toml",
            r"`grid` must name one setting .* \[empty.toml:1\]",
        ),
        ("study aggregation --workers 0", r"`workers` must be an integer of at least 1; got 0"),
        (
            "study aggregation --generations 0",
            r"`run.generations` must be .* got 0 \[--generations\]",
        ),
        ("study aggregation --set models.parents=0", r"got 0 \[--set models.parents\]"),
        (
            "study aggregation --workers 2 --cluster tcp://x:1",
            r"`workers` must be left out beside `cluster`",
        ),
        (
            "study aggregation --write-slurm no/where.sh",
            r"`write-slurm` must be a file in a folder that exists",
        ),
        (
            "study aggregation --write-slurm a.sh --workers 2",
            r"`write-slurm` must be given without workers",
        ),
        (
            "infer --config grid.toml",
            r"`grid` must be left out of the configuration of a single run.*\[grid.toml:2\]",
        ),
        (
            "study aggregation --config grid.toml",
            r"got 0 \[configuration 2 of the study: models.parents = 0\]",
        ),
        ("study-run nothing 1", r"`study` must be a study folder; got nothing"),
        ("study-collect nothing", r"`study` must be a study folder; got nothing"),
        ("resume nothing --workers 2", r"`run` must be a run folder; got nothing"),
    ],
)
def test_what_is_wrong_is_refused_before_anything_is_written(arguments, message, call, tmp_path):
    (tmp_path / "empty.toml").write_text("[grid]\n")
    (tmp_path / "grid.toml").write_text("# a study\n[grid]\nmodels.parents = [5, 0]\n")
    code, out, err = call(*arguments.split())
    assert code == 2
    assert out == ""
    assert re.search(message, err), err
    assert err.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty.toml", "grid.toml"]


def test_other_settings_are_refused_by_name(finished, call):
    code, _, err = call(
        "study", "aggregation", *SMALL, "--runs", 2, "--generations", 4, "--out", finished
    )
    assert code == 2
    assert err.startswith(
        "error: `run.generations` must be 3, as in the study that is in the folder; got 4 ["
    )


def test_threads_are_refused_for_a_study(finished, call):
    code, _, err = call("resume", finished, "--threads", 2)
    assert code == 2
    assert err.startswith(
        "error: `--threads` must be left out for a study, whose runs have one thread each; got 2"
    )


def test_a_study_has_no_recording(finished, call):
    for option, value in (("--fps", "25.0"), ("--y-axis", "up"), ("--trajectories", "fish.txt")):
        assert call("resume", finished, option, value) == (
            *(2, ""),
            f"error: `{option}` must be left out for a study, which needs nothing but its folder; got {value}.\n",
        )


def test_a_run_that_fails_ends_the_command_of_an_array_with_code_1(call, tmp_path):
    code, out, _ = call(
        "study", "aggregation", *SMALL, "--runs", 1, "--out", "study", "--write-slurm", "job.sh"
    )
    assert code == 0
    assert out.startswith(
        "job.sh: 1 run in study. Time and memory of a run stand at its head. Submit:\n  job=$(sbatch "
    )
    (tmp_path / "study" / "runs" / "0001").mkdir(parents=True)
    (tmp_path / "study" / "runs" / "0001" / "notes.txt").touch()
    code, _, err = call("study-run", "study", 1)
    assert code == 1
    assert err.startswith("run 1 failed: RunFolderError: `out` must be a new or empty folder")
    assert "kind" in json.loads((tmp_path / "study" / "runs" / "0001" / "failure.json").read_text())


def interrupt(*arguments, **options):
    raise KeyboardInterrupt


def test_how_to_go_on_can_be_pasted_into_a_shell(call, monkeypatch):
    def ended(state):
        run = StudyRun(1, {"run.seed": 1}, state, "OSError: disk" if state == "failed" else "")
        monkeypatch.setattr("turing_learning.studies.run_one", lambda *given, **options: run)
        result = StudyResult("aggregation", "Aggregation", (run,), (), Path("my study"))
        monkeypatch.setattr(
            "turing_learning.studies.resume_study", lambda *given, **options: result
        )

    one = ("study", "aggregation", *SMALL, "--runs", 1, "--out", "my study")
    assert call(*one, "--write-slurm", "job.sh")[0] == 0
    assert (
        "old study by `turing-learning resume 'my study'`, or" in call(*one, "--generations", 4)[2]
    )
    ended("stopped")
    alone, all_of_them = (
        "turing-learning study-run 'my study' 1\n",
        "turing-learning resume 'my study'\n",
    )
    assert call("study-run", "my study", 1)[2] == f"stopped; resume with: {alone}"
    assert call("resume", "my study")[2] == f"stopped after 0 of 1 runs; resume with: {all_of_them}"
    ended("failed")
    assert call("resume", "my study")[2] == f"1 run failed; try again with: {all_of_them}"
    for name in ("run_one", "resume_study"):
        monkeypatch.setattr(f"turing_learning.studies.{name}", interrupt)
    assert call("study-run", "my study", 1)[2] == f"interrupted; resume with: {alone}"
    assert call("resume", "my study")[2] == f"interrupted; resume with: {all_of_them}"


def progress(**changes):
    given = {
        "total": 10, "done": 2, "failed": 1, "running": 3, "maes": (0.01, 0.2), "finished": (),
        "generations": 300, "generations_total": 1000, "seconds": 30.0, "seconds_left": 70.0,
    }  # fmt: skip
    return StudyProgress(**given | changes)


def shown(picture):
    console = Console(width=120, record=True, file=open("/dev/null", "w"))  # noqa: SIM115, PTH123
    with console.file:
        console.print(picture)
        return console.export_text()


def test_the_live_view_counts_runs_and_says_how_good_they_are():
    failed = StudyRun(4, {"run.seed": 4}, "failed", "OSError: disk")
    text = shown(study_picture(progress(), [failed], stopping=False))
    for part in (
        "2 of 10 runs",
        "3 running",
        "1 failed",
        "1:10 left",
        "median 0.105",
        "1 below 0.05",
        "OSError: disk",
    ):
        assert part in text
    assert "stopping" not in text


def test_the_live_view_says_that_runs_are_stopping():
    text = shown(study_picture(progress(maes=(), seconds_left=None), [], stopping=True))
    assert "stopping after the present generation of each run" in text
    assert "no run has ended yet" in text


def test_elsewhere_than_on_a_terminal_each_run_is_a_line():
    lines = []
    console = SimpleNamespace(is_terminal=False, print=lambda text, **options: lines.append(text))
    with watching_study(console, lambda: False) as view:
        view(progress())
        view(progress(finished=(StudyRun(4, {"run.seed": 8}, "failed", "OSError: disk"),)))
    assert str(lines.pop(0)).startswith("getting ready; the first study")
    assert lines == ["3/10  run 4  seed 8  failed: OSError: disk  1:10 left"]
