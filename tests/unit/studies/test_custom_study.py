"""Studies of custom systems, whose simulator a worker imports by its name."""

import csv
import sys
from pathlib import Path

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.config import ConfigurationError
from turing_learning.runs import RunFolderError
from turing_learning.store import DamagedError
from turing_learning.studies import load_study, plan_study, resume_study, study

sys.path.insert(0, str(Path(__file__).parent))
import imitators

DATA = imitators.walk(np.tile([0.3, 0.2], (20, 1)), np.random.default_rng(1))
RANGES = {"drift": (-1.0, 1.0), "noise": (0.0, 1.0)}
SIZES = {"models.population": 8, "classifiers.population": 8}
SYSTEM = {"genuine": DATA, "parameters": RANGES, "name": "walk", "signals": ("step",)}


def walks(out, **arguments):
    given = {
        "runs": 2,
        "first_seed": 5,
        "generations": 4,
        "settings": SIZES,
        "simulate": "imitators:walk",
        "out": out,
    }
    return study(**(SYSTEM | given | arguments))


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return walks(tmp_path_factory.mktemp("walks") / "study", workers=2)


def test_the_runs_are_those_of_infer(found):
    alone = tl.infer(**SYSTEM, simulate=imitators.walk, generations=4, seed=6, settings=SIZES)
    assert found.complete
    assert found.runs[1].result["estimate"] == alone.estimate
    assert found.runs[1].verdict == "no truth"


def test_the_table_does_not_depend_on_who_executes_the_runs(found, executor, tmp_path):
    again = walks(tmp_path / "a", executor=executor, simulate=imitators.walk)
    assert again == found
    for name in ("runs.csv", "summary.csv", "convergence.csv"):
        assert (tmp_path / "a" / name).read_bytes() == (found.path / name).read_bytes()
    with (found.path / "runs.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[1]["estimate_drift"]) == found.runs[1].result["estimate"]["drift"]
    assert rows[1]["truth_drift"] == ""


def test_the_page_shows_how_much_the_estimates_differ(found):
    page = (found.path / "report.html").read_text()
    assert "The truth is not known." in page
    assert page.count("<svg") == 1
    assert {path.name for path in (found.path / "figures").iterdir()} == {"boxes.png", "boxes.svg"}


def test_a_stopped_study_is_resumed_from_its_folder_alone(found, executor, tmp_path):
    assert walks(tmp_path / "a", executor=executor, should_stop=lambda: True).unfinished
    assert resume_study(tmp_path / "a", executor=executor) == found
    assert load_study(tmp_path / "a") == found


def test_simulators_of_several_calls_and_instances_of_modules_work(executor, tmp_path):
    result = walks(tmp_path / "a", executor=executor, simulate="imitators:WALKS", batches=2, runs=1)
    assert result.complete


def test_another_simulator_or_other_samples_are_another_study(found, executor):
    with pytest.raises(
        RunFolderError, match=r"^`simulate` must be 'imitators:walk', as in the study that is in"
    ):
        walks(found.path, executor=executor, simulate="imitators:failing")
    with pytest.raises(
        RunFolderError, match=r"^`scenario\.\w+` must be .*, as in the study that is in the folder"
    ):
        walks(found.path, executor=executor, genuine=DATA + 1)


def test_a_simulator_that_fails_is_named_by_each_run(executor, tmp_path):
    result = walks(tmp_path / "a", executor=executor, simulate="imitators:failing")
    assert "it raised ArithmeticError: never" in result.failed[0].reason


def test_damaged_samples_are_named(executor, tmp_path):
    walks(tmp_path / "a", executor=executor, should_stop=lambda: True)
    np.save(tmp_path / "a" / "genuine.npy", DATA + 1)
    result = resume_study(tmp_path / "a", executor=executor)
    assert result.failed[0].reason.startswith(
        "DamagedError: `study` must hold genuine.npy as it was written"
    )
    with pytest.raises(DamagedError):
        tl.studies.StudyFolder(tmp_path / "a").read("genuine.npy")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"simulate": "imitators:none"},
            r"^`simulate` must be \"module:function\", .* got 'imitators:none' \(module",
        ),
        (
            {"simulate": "no_such_module:walk"},
            r"^`simulate` must .* got 'no_such_module:walk' \(No module named",
        ),
        ({"simulate": "imitators"}, r"^`simulate` must be \"module:function\""),
        ({"simulate": "imitators:NUMBER"}, r"^`simulate` must .* got 'imitators:NUMBER', a int"),
        (
            {"simulate": lambda parameters, rng: None},
            r"^`simulate` must be \"module:function\", or a function of a module",
        ),
        ({"simulate": None}, r"^`simulate` must be given for a custom system; got nothing"),
        (
            {"scenario": "aggregation"},
            r"^`scenario` must be left out for a custom system; got 'aggregation'",
        ),
        (
            {"genuine": lambda rng: DATA, "held_out": None},
            r"^`genuine` must be samples in a study, whose workers",
        ),
        ({"genuine": DATA[:, :, 0]}, r"^`genuine` must be samples \(K, T, D\)"),
        (
            {"wrokers": 2},
            r"^`wrokers` must be a known option of a study; got 2\. Did you mean `workers`\?",
        ),
        ({"timeout_s": 1.0}, r"^`timeout_s` must be a known option of a study; got 1\.0"),
    ],
)
def test_what_no_worker_could_execute_is_refused(changes, message, tmp_path):
    with pytest.raises(ConfigurationError, match=message):
        study(**(SYSTEM | {"simulate": "imitators:walk", "out": tmp_path / "a"} | changes))
    assert not (tmp_path / "a").exists()


def test_a_configuration_file_of_a_custom_system_needs_its_simulator(found):
    with pytest.raises(
        ConfigurationError, match="a custom system, whose simulator no file can hold"
    ):
        plan_study(config=found.path / "config.toml")
