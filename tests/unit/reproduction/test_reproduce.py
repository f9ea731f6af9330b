"""The experiments in their fast form, and the door."""

import csv
import json
from dataclasses import replace

import pytest

from turing_learning._files import write_atomically
from turing_learning.config import ConfigurationError
from turing_learning.reproduction import Stopped, default_folder, reproduce, standings
from turing_learning.reproduction import _reproduce as door
from turing_learning.reproduction._page import ExperimentFolder
from turing_learning.reproduction.experiments import EXPERIMENTS
from turing_learning.store import RunFolderError, RunStorageError
from turing_learning.studies import StudyFolder

POSSIBLE = [name for name, one in EXPERIMENTS.items() if not one.missing]
"""Those whose packages are installed: the others are left out of all."""


def files(folder):
    """Return name -> content of what is committed, without the time and place of the run."""
    kept = [path for kind in ("tables", "figures") for path in sorted((folder / kind).iterdir())]
    contents = {path.name: path.read_bytes() for path in kept}
    results = json.loads((folder / "results.json").read_text())
    return contents | {"verdicts": results["verdicts"]}


@pytest.mark.parametrize("name", POSSIBLE)
def test_every_claim_of_an_experiment_gets_a_verdict(conducted, name):
    results = ExperimentFolder(conducted / name).results()
    assert [results.verdict(claim).claim for claim in EXPERIMENTS[name].claims] == list(
        EXPERIMENTS[name].claims
    )


@pytest.mark.parametrize("name", POSSIBLE)
def test_tables_and_figures_are_there_in_print_and_for_the_screen(conducted, name):
    results = ExperimentFolder(conducted / name).results()
    tables = {f"{one.name}.csv" for one in results.tables}
    figures = {f"{one.name}.{kind}" for one in results.pictures for kind in ("svg", "png")}
    assert {path.name for path in (conducted / name / "tables").iterdir()} == tables
    assert {path.name for path in (conducted / name / "figures").iterdir()} == figures


def test_what_was_done_is_not_done_again_and_the_results_are_the_same(conducted, tmp_path):
    before, said = files(conducted / "4.5"), []
    (tmp_path / "4.5").mkdir()
    for path in ("configuration.json", "pieces"):
        (tmp_path / "4.5" / path).symlink_to(conducted / "4.5" / path)
    reproduce("4.5", fast=True, out=tmp_path, say=said.append)
    assert said == []
    assert files(tmp_path / "4.5") == before


def test_an_experiment_that_is_stopped_goes_on_to_the_same_results(conducted, tmp_path):
    said = []
    with pytest.raises(Stopped):
        reproduce(
            "4.5", fast=True, out=tmp_path, say=said.append, should_stop=lambda: len(said) == 2
        )
    (standing,) = (one for one in standings(tmp_path) if one.experiment.id == "4.5")
    assert standing.state == "begun, 2 pieces of work"
    reproduce("4.5", fast=True, out=tmp_path)
    assert files(tmp_path / "4.5") == files(conducted / "4.5")


def test_common_initial_configurations_and_other_noise_for_every_model(rows):
    found = rows("4.3", "aggregation-dispersion")
    assert [row["preset"] for row in found] == ["", *["default"] * 6, *["paper"] * 6]
    assert [row["model"] for row in found] == [
        "agents",
        *(["best_model"] * 3 + ["estimate"] * 3) * 2,
    ]
    assert all(float(row["trial_1"]) > 0 for row in found)


def test_the_models_that_are_judged_are_the_best_of_the_last_generation(conducted, rows):
    found = rows("4.3", "aggregation-models")
    with (conducted / "4.3" / "pieces" / "study-aggregation-default" / "runs.csv").open(
        newline=""
    ) as file:
        studied = list(csv.DictReader(file))
    own = [row for row in found if row["preset"] == "default" and row["model"] == "best_model"]
    assert [float(row["vl1"]) for row in own] == pytest.approx(
        [float(row["best_model_vl1"]) for row in studied], rel=1e-5
    )


def test_the_sensor_shares_are_between_those_of_the_paper_and_of_its_simulator(rows):
    found = rows("4.3", "sensor-shares")
    seeing_nothing = float(found[0]["share"])
    # 1000 trials give 0.935; the standard error over 5 trials is about 0.01
    assert seeing_nothing == pytest.approx(0.935, abs=0.04)


def test_predictions_are_weighted_means_of_the_true_speeds(rows):
    found = {(row["scenario"], row["parameter"]): row for row in rows("4.5", "predictions")}
    assert float(found["aggregation", "vr0"]["theorem_1"]) == pytest.approx(-1.0)
    assert found["aggregation", "vl0"]["theorem_1"] == found["aggregation", "vl1"]["theorem_1"]
    assert -0.7 < float(found["aggregation", "vl0"]["theorem_1"]) < -0.5


def test_the_states_of_all_experiments_are_listed(conducted):
    states = {one.experiment.id: one.state for one in standings(conducted)}
    assert list(states) == list(EXPERIMENTS)
    assert states["3.2"].endswith("of 1 claims agree, fast form")


def test_experiments_in_the_home_folder_are_found(conducted, monkeypatch):
    monkeypatch.setenv("HOME", str(conducted))
    assert standings("~") == standings(conducted)


def test_nothing_has_been_run_in_an_empty_folder(tmp_path):
    assert {one.state for one in standings(tmp_path)} == {"not run yet"}


def test_the_fast_form_does_not_go_where_full_results_go():
    assert default_folder().as_posix() == "experiments"
    assert default_folder(fast=True).as_posix() == "runs/reproduction-fast"


def test_as_printed_has_the_papers_algorithm_in_the_papers_world(tmp_path):
    (standing,) = reproduce("4.6.3", fast=True, as_printed=True, out=tmp_path)
    assert {verdict.variant for verdict in standing.results.verdicts} == {"", "estimate"}
    study = next(tmp_path.glob("4.6.3/pieces/study-mixed-*"))
    run = StudyFolder(study).plan().configuration(1)
    assert (run.scenario.world, run.coevolution.archive) == ("paper", 0)
    assert (run.classifiers.renewal, run.models.minimum_step_size) == (0, 0)
    assert "--as-printed" in (tmp_path / "4.6.3" / "README.md").read_text()
    assert default_folder(as_printed=True).as_posix() == "experiments/as-printed"


def test_an_unknown_experiment_is_refused(tmp_path):
    with pytest.raises(
        ConfigurationError, match=r"`experiment` must be one of 3\.2, 4\.3, .*all; got '9'"
    ):
        reproduce("9", out=tmp_path)


def test_a_share_of_a_worker_is_refused_before_anything_is_done(tmp_path):
    with pytest.raises(
        ConfigurationError, match=r"^`workers` must be an integer of at least 1; got 1\.5\.$"
    ):
        reproduce("4.5", fast=True, out=tmp_path / "all", workers=1.5)
    assert not (tmp_path / "all").exists()


def test_a_folder_of_the_fast_form_is_refused_for_the_full_one(conducted):
    with pytest.raises(
        RunFolderError, match=r"`out` must be a folder of the same form, 'full'; got 'fast'"
    ):
        reproduce("3.2", out=conducted)


def test_a_folder_of_other_sizes_is_refused(conducted, monkeypatch):
    other = replace(EXPERIMENTS["3.2"], fast=EXPERIMENTS["3.2"].fast | {"trials": 99})
    monkeypatch.setitem(EXPERIMENTS, "3.2", other)
    with pytest.raises(
        RunFolderError, match=r"`out` must be a folder of the same sizes, .*'trials': 99.*; got"
    ):
        reproduce("3.2", fast=True, out=conducted)


def test_an_unreadable_result_is_refused(tmp_path):
    (tmp_path / "3.2").mkdir()
    (tmp_path / "3.2" / "results.json").write_text("{")
    with pytest.raises(RunFolderError, match=r"`results\.json` must be readable JSON; got"):
        standings(tmp_path)


@pytest.mark.parametrize(
    "content", ["[]", '{"format_version": 1}', '{"format_version": 0}', "[" * 100_000]
)
def test_results_that_hold_something_else_are_refused(content, tmp_path):
    (tmp_path / "3.2").mkdir()
    (tmp_path / "3.2" / "results.json").write_text(content)
    with pytest.raises(RunFolderError, match=r"^`(results\.json|format_version)` must "):
        standings(tmp_path)


def test_an_experiment_in_use_is_refused(conducted):
    store = ExperimentFolder(conducted / "3.2").begin(EXPERIMENTS["3.2"], fast=True)
    with store.locked(), pytest.raises(RunFolderError, match="`experiment` must not be in use"):
        reproduce("3.2", fast=True, out=conducted)


def test_results_of_a_later_version_are_refused(tmp_path):
    (tmp_path / "3.2").mkdir()
    (tmp_path / "3.2" / "results.json").write_text('{"format_version": 99}')
    with pytest.raises(RunFolderError, match="`format_version` must be at most 1; got 99"):
        standings(tmp_path)


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="`out` must be a folder that can be written; got"):
        reproduce("3.2", fast=True, out=tmp_path / "file")


def test_a_full_disk_ends_an_experiment_that_can_go_on(tmp_path, monkeypatch):
    def full(path, content):
        if path.parent.name == "pieces" and path.name != "store.json":
            raise OSError(28, "No space left on device")
        write_atomically(path, content)

    monkeypatch.setattr("turing_learning.store.write_atomically", full)
    with pytest.raises(
        RunStorageError, match=r"`out` must be a folder with space left; .*No space left"
    ):
        door.reproduce("3.2", fast=True, out=tmp_path)
