"""Whole runs in a laboratory: what is kept, kills in every state, the post-evaluation, the commands."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from program_laboratory import CALIBRATION, FILE, NAMES, ScriptedLaboratory

from turing_learning.config import ConfigurationError
from turing_learning.detection import Detector, run_classifiers
from turing_learning.robots import load_laboratory
from turing_learning.runs import (
    RunFolder,
    RunFolderError,
    awaits_robots,
    is_laboratory_run,
    load_run,
    read_events,
    read_post_evaluation,
    read_trials,
    resume,
    resume_laboratory,
    start,
    start_laboratory,
    stored_laboratory,
    trust_laboratory,
)
from turing_learning.runs._methods import methods_text
from turing_learning.store import DamagedError

SHORT = FILE.replace("duration_s = 1.0", "duration_s = 0.5")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("laboratory")
    CALIBRATION.save(folder / "camera.json")
    (folder / "lab.toml").write_text(SHORT)
    (folder / "evaluated.toml").write_text(
        SHORT.replace("repeats = 0", "repeats = 2").replace("generations = 3", "generations = 1")
    )
    return folder


def begin(folder, out, file="lab.toml", lab=None, **options):
    lab = lab or ScriptedLaboratory()
    return start_laboratory(
        load_laboratory(folder / file), out, equipment=lab.equipment(), **options
    )


@pytest.fixture(scope="module")
def finished(folder):
    begin(folder, folder / "finished")
    return folder / "finished"


def state_of(path):
    """The optimizers' state in the last checkpoint."""
    (last,) = sorted((path / "checkpoints").glob("*.npz"))[-1:]
    with np.load(last) as arrays:
        return {
            name: arrays[name]
            for name in arrays.files
            if name.startswith(("coevolution/", "traces/")) and "seconds" not in name
        }


def require_same_state(path, expected):
    found, wanted = state_of(path), state_of(expected)
    assert found.keys() == wanted.keys()
    for name, array in wanted.items():
        np.testing.assert_array_equal(found[name], array, err_msg=name)


def test_a_run_is_a_run_like_any_other(finished):
    result = load_run(finished)
    assert (result.generations, result.complete) == (3, True)
    assert result.truth == {"vl0": -0.7, "vr0": -1.0, "vl1": 1.0, "vr1": -1.0}
    assert all(-1 < value < 1 for value in result.best_model.values())
    assert result.history["model"].shape == (3, 4, 4)
    assert float(np.abs(result.history["model"]).max()) < 1
    assert (finished / "report.html").is_file()


def test_every_trial_is_stored_as_it_was_observed(finished):
    paths = sorted((finished / "trials").rglob("*.npz"))
    assert [str(path.relative_to(finished / "trials")) for path in paths][-2:] == [
        "generation-0002/attempt-1/trial-00.npz",
        "generation-0002/attempt-1/trial-01.npz",
    ]
    history = load_run(finished).history
    with np.load(paths[-1], allow_pickle=False) as trial:
        assert trial["poses"].shape == (6, 4, 3)
        assert trial["present"].all()
        assert trial["labels"].tolist() == ["blue", "blue", "orange", "purple"]
        assert trial["faults"].size == 0
        np.testing.assert_allclose(trial["models"], history["model"].to_numpy()[2, 2:], atol=5e-5)


def test_the_log_names_what_happened(finished):
    events = read_events(finished)
    kinds = [event["kind"] for event in events]
    assert kinds == ["disturbed", "complete", "complete", "complete", "halted"]
    assert events[0]["fault"] == "replica r1 has not begun"
    assert events[0]["asked"] == "Put all robots in their places, and press the remote control."


def test_a_line_of_the_log_that_was_cut_is_left_out(tmp_path):
    from turing_learning.robots import Event
    from turing_learning.runs._trials import note_event

    folder = RunFolder(tmp_path)
    folder.events_path.write_text('{"kind": "complete"}\n{"kind": "dist')
    note_event(folder, Event("batteries", "generation-0025", 0, "P0"))
    assert [event["kind"] for event in read_events(folder.path)] == ["complete", "batteries"]


def test_the_laboratory_lies_in_the_run_folder(finished):
    assert is_laboratory_run(finished)
    assert (
        json.loads((finished / "laboratory.json").read_text())["camera"]["calibration"]
        == "camera.json"
    )
    assert (finished / "camera.json").read_bytes() == (finished.parent / "camera.json").read_bytes()


def test_a_run_killed_while_its_folder_is_made_is_none_yet_and_begins_there(folder, monkeypatch):
    write = RunFolder.write

    def kill(folder, name, content):
        if name == "manifest.json":
            raise KeyboardInterrupt
        return write(folder, name, content)

    path = folder / "unborn"
    with monkeypatch.context() as patch:
        patch.setattr(RunFolder, "write", kill)
        with pytest.raises(KeyboardInterrupt):
            begin(folder, path)
    assert (path / "laboratory.json").exists()
    assert not is_laboratory_run(path)
    begin(folder, path, should_stop=lambda: True)
    assert is_laboratory_run(path)


@pytest.mark.parametrize(
    ("emulated", "who"),
    [
        ("false", "robots in a laboratory"),
        ("true", "emulated robots, in the rehearsal of a laboratory"),
    ],
)
def test_the_text_on_methods_says_which_robots_were_observed(emulated, who, finished, tmp_path):
    path = shutil.copytree(finished, tmp_path / "run")
    stored = path / "laboratory.json"
    stored.write_text(stored.read_text().replace('"emulated": false', f'"emulated": {emulated}'))
    text = methods_text(load_run(path), {})
    assert f"Genuine samples are those of {who}; each is of 0.5 s (5 steps), with" in text
    assert "Models were executed by replicas, robots as well" in text
    assert "simulated" not in text


@pytest.mark.parametrize("edited", ["laboratory.json", "camera.json"])
def test_an_edited_laboratory_is_resumed_once_it_is_trusted(folder, edited):
    path = folder / f"edited-{edited}"
    begin(folder, path, should_stop=lambda: True)
    with (path / edited).open("a") as file:
        file.write("\n")
    assert load_run(path).generations == 1
    for door in (resume_laboratory, stored_laboratory, awaits_robots):
        with pytest.raises(
            RunFolderError,
            match=rf"{edited} \(it has been changed\).* trust it: `.* --trust`, or `turing_",
        ):
            door(path)
    trust_laboratory(path)
    assert (
        resume_laboratory(
            path, equipment=ScriptedLaboratory().equipment(), should_stop=lambda: True
        ).generations
        == 2
    )


def test_functions_that_an_edited_laboratory_names_are_not_imported(folder, tmp_path, monkeypatch):
    path = folder / "renamed"
    begin(folder, path, should_stop=lambda: True)
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "evil_robots.py").write_text("raise SystemExit('imported')")
    content = json.loads((path / "laboratory.json").read_text())
    (path / "laboratory.json").write_text(
        json.dumps(content | {"open_replica": "evil_robots:open"})
    )
    with pytest.raises(RunFolderError, match="trust it"):
        resume_laboratory(path)
    assert "evil_robots" not in sys.modules


def test_what_is_no_run_in_a_laboratory_is_not_trusted(tmp_path, small):
    start(small(), tmp_path / "run")
    with pytest.raises(
        RunFolderError, match=r"must take place in a laboratory; got .*run without laboratory\.json"
    ):
        trust_laboratory(tmp_path / "run")


def test_the_computer_alone_does_not_go_on_with_it(folder):
    begin(folder, folder / "stopped", should_stop=lambda: True)
    with pytest.raises(RunFolderError, match=r"which takes place in a laboratory\. Resume it with"):
        resume(folder / "stopped")


def test_a_run_that_was_stopped_ends_as_one_that_was_not(folder, finished):
    begin(folder, folder / "halted", should_stop=lambda: True)
    resume_laboratory(folder / "halted", equipment=ScriptedLaboratory().equipment())
    require_same_state(folder / "halted", finished)


def test_a_disturbed_run_has_as_many_generations_and_the_same_outcome(folder, finished):
    lab = ScriptedLaboratory()
    faults = iter(
        [
            lambda: setattr(lab.wires[NAMES[0]], "cut", True),
            lambda: setattr(lab, "covered", (1,)),
            lambda: setattr(lab.wires[NAMES[1]], "silent", True),
            lambda: setattr(lab, "dead_camera", True),
        ]
    )
    seen = []

    def disturb(event):
        seen.append(event.state if event.kind == "state" else "")
        if seen[-1] == "P4" and seen.count("P4") in (2, 4, 7, 9):
            next(faults)()

    result = begin(folder, folder / "disturbed", lab=lab, on_event=disturb)
    assert result.complete
    events = read_events(folder / "disturbed")
    assert [event["stage"] for event in events if event["kind"] == "complete"] == [
        "generation-0000", "generation-0001", "generation-0002",
    ]  # fmt: skip
    told = " ".join(event["fault"] for event in events)
    rejected = list((folder / "disturbed" / "trials").rglob("rejected-*.npz"))
    reasons = " ".join(str(np.load(path)["faults"][0]) for path in rejected)
    assert "1 blue markers in the first image, 2 expected" in reasons
    assert "STOP has not come from r2" in reasons
    for stage in ("generation-0000", "generation-0001", "generation-0002"):
        assert len(read_trials(folder / "disturbed", stage).poses) == 2
    for words in (
        "the link to replica r1 is lost",
        "1 blue markers in the first image",
        "STOP has not come from r2",
        "got none more",
    ):
        assert words in told
    np.testing.assert_allclose(
        result.history["model"].to_numpy(),
        load_run(finished).history["model"].to_numpy(),
        atol=1e-9,
    )


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")
def test_a_run_killed_in_every_state_ends_as_one_that_was_not(folder, finished):
    path, script = folder / "killed", Path(__file__).with_name("program_killed.py")
    killed = subprocess.run(
        [sys.executable, script, folder, path],
        timeout=300,
        capture_output=True,
        text=True,
        check=False,
    )
    assert killed.returncode == 0, killed.stderr
    assert killed.stdout.split() == [
        "P1",
        "0",
        "P2",
        "1",
        "P3",
        "2",
        "P4",
        "3",
        "P5",
        "4",
    ]  # those that STOP confirmed
    assert not load_run(path).complete
    result = resume_laboratory(path, equipment=ScriptedLaboratory().equipment())
    assert result.complete
    require_same_state(path, finished)
    completed = [event["stage"] for event in read_events(path) if event["kind"] == "complete"]
    assert sorted(set(completed)) == ["generation-0000", "generation-0001", "generation-0002"]
    assert len(list((path / "trials").rglob("trial-*.npz"))) == 6  # those before a kill count
    assert not list((path / "trials").rglob("rejected-*.npz"))
    assert not list(path.rglob("*.partial"))


@pytest.mark.parametrize(("ends", "rejected"), [("P1", 0), ("disturbed", 1)])
def test_a_trial_without_a_stop_is_executed_again_by_a_run_that_is_resumed(
    folder, tmp_path, finished, ends, rejected
):
    lab, path, seen = ScriptedLaboratory(), tmp_path / "unconfirmed", []

    def die(event):
        seen.append(event.state if event.kind == "state" else event.kind)
        if seen[-1] == "P4":
            lab.wires[NAMES[0]].silent = True
        if "P5" in seen and seen[-1] == ends:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        begin(folder, path, lab=lab, on_event=die)
    names = [file.name.split("-")[0] for file in (path / "trials").rglob("*.npz")]
    assert names == ["rejected"] * rejected
    resume_laboratory(path, equipment=ScriptedLaboratory().equipment())
    require_same_state(path, finished)


def test_the_last_models_are_observed_again_and_the_best_is_named(folder):
    path = folder / "evaluated"
    result = begin(folder, path, file="evaluated.toml")
    found = read_post_evaluation(path)
    assert found.complete
    assert found.fitness.shape == (2, 4)
    best = result.history["model"].to_numpy()[-1][np.argmax(found.fitness.mean(axis=0))]
    assert list(found.best_model.values()) == best.tolist()
    assert found.absolute_error["vl0"] == pytest.approx(abs(best[0] + 0.7))
    assert len(list((path / "trials").glob("post-evaluation-*/attempt-1/*.npz"))) == 4


def test_a_post_evaluation_that_was_interrupted_goes_on(folder):
    path, asked = folder / "interrupted", iter([False, False, True])
    begin(folder, path, file="evaluated.toml", should_stop=lambda: next(asked))
    first = read_post_evaluation(path)
    assert (first.complete, len(first.fitness), first.best_model) == (False, 1, None)
    resume_laboratory(path, equipment=ScriptedLaboratory().equipment())
    second = read_post_evaluation(path)
    np.testing.assert_array_equal(second.fitness[0], first.fitness[0])
    assert len(second.fitness) == 2
    assert second.best_model is not None


def document(fitness, repeats=1):
    return f'{{"repeats": {repeats}, "fitness": {fitness}, "best_model": null, "absolute_error": null}}'


@pytest.mark.parametrize(
    "content",
    [
        "{",
        "[]",
        "{}",
        document("1"),
        document("[[]", 2),
        document('[["a"]]'),
        document("[1]"),
        document("[[1]]", '"x"'),
    ],
)
def test_a_post_evaluation_that_cannot_be_read_is_refused(tmp_path, content):
    assert read_post_evaluation(tmp_path) is None
    file = tmp_path / "post_evaluation.json"
    file.write_text(content)
    with pytest.raises(
        RunFolderError,
        match=r"`run` must have a readable post_evaluation.json; got .*, which holds",
    ) as told:
        read_post_evaluation(tmp_path)
    assert str(told.value).endswith("Restore the file, or remove it and resume.")


def test_detectors_are_calibrated_with_what_was_observed(folder, monkeypatch):
    path = folder / "observed"
    result = begin(folder, path, file="evaluated.toml")
    assert result.in_laboratory
    monkeypatch.setattr(
        "turing_learning.detection._run.simulate_behaviors", lambda *_: pytest.fail("simulated")
    )
    with np.load(path / "calibration.npz") as kept:
        genuine, abnormal = kept["genuine"], kept["abnormal"]
    learned = read_trials(path, "generation-0000").speeds()[:, :-2].reshape(-1, 5, 2)
    held_out = np.concatenate(
        [read_trials(path, f"post-evaluation-{k}").speeds()[:, :-2] for k in (1, 2)]
    )
    assert len(genuine) == 2 * len(learned)  # one generation, two post-evaluations
    np.testing.assert_array_equal(genuine[: len(learned)], learned)
    assert all(
        (sample == held_out.reshape(-1, 5, 2)).all(axis=(1, 2)).any()
        for sample in genuine[len(learned) :]
    )
    models = result.history["model"].to_numpy()[0]
    far = np.abs(models - list(result.estimate.values())).mean(axis=1) >= 0.2
    assert len(abnormal) == np.count_nonzero(far)
    run = run_classifiers(result)
    for found, written in zip(run.calibration, (genuine, abnormal), strict=True):
        np.testing.assert_array_equal(found[:, 0], written)
    with pytest.raises(
        ConfigurationError, match="for individuals to be simulated; got one in a laboratory"
    ):
        run.simulated_scenario()


def with_repeats(path, repeats):
    """Change how often the last models are to be observed again, as one does between sessions."""
    file = path / "laboratory.json"
    file.write_text(re.sub(r'"repeats": \d', f'"repeats": {repeats}', file.read_text()))
    trust_laboratory(path)


def test_repeats_may_be_changed_between_sessions(folder):
    path, asked = folder / "changed", iter([False, False, True])
    begin(folder, path, file="evaluated.toml", should_stop=lambda: next(asked))
    assert awaits_robots(path)
    with_repeats(path, 1)
    assert not awaits_robots(path)
    resume_laboratory(path, equipment=ScriptedLaboratory().equipment())
    fewer = read_post_evaluation(path)
    assert (fewer.complete, fewer.repeats, fewer.fitness.shape) == (True, 1, (1, 4))
    assert (path / "calibration.npz").exists()
    with_repeats(path, 3)
    assert awaits_robots(path)
    resume_laboratory(
        path, equipment=ScriptedLaboratory().equipment(), should_stop=iter([False, True]).__next__
    )
    more = read_post_evaluation(path)
    assert (more.complete, more.repeats, more.best_model, len(more.fitness)) == (False, 3, None, 2)
    np.testing.assert_array_equal(more.fitness[0], fewer.fitness[0])


def test_a_finished_run_goes_without_its_trials(folder, caplog):
    path = folder / "tidied"
    begin(folder, path, file="evaluated.toml")
    shutil.rmtree(path / "trials")
    kept = (path / "calibration.npz").read_bytes()
    assert resume_laboratory(path, equipment=ScriptedLaboratory().equipment()).complete
    assert (path / "calibration.npz").read_bytes() == kept
    assert caplog.text == ""
    (path / "calibration.npz").write_bytes(b"PK")
    with pytest.raises(
        DamagedError, match=r"calibration.npz as it was written; got .*it has been changed"
    ):
        Detector.from_run(load_run(path))
    assert resume_laboratory(path, equipment=ScriptedLaboratory().equipment()).complete
    assert (path / "calibration.npz.damaged").read_bytes() == b"PK"
    with pytest.raises(
        ConfigurationError,
        match="`run` must have stored motion to calibrate with; got one in a laboratory that",
    ):
        Detector.from_run(load_run(path))
    assert (
        "Nothing is kept to calibrate detectors with: `stage` must be one of which the run has trials"
        in caplog.text
    )


def test_the_last_models_of_a_thin_history_cannot_be_observed_again(folder):
    path = folder / "thin"
    lab = ScriptedLaboratory()
    thin = load_laboratory(folder / "lab.toml", {"run.history": "thin", "run.generations": 1})
    start_laboratory(thin, path, equipment=lab.equipment())
    with pytest.raises(
        ConfigurationError,
        match=r"got .* with run.history = \"thin\".* Run it again in the laboratory",
    ):
        run_classifiers(load_run(path))
    with_repeats(path, 2)
    with pytest.raises(
        ConfigurationError,
        match=r'`run.history` must be "full" for a post-evaluation; got "thin" \[.*laboratory',
    ):
        resume_laboratory(path, equipment=lab.equipment())


def test_a_run_that_was_not_observed_again_has_nothing_to_calibrate_detectors_with(finished):
    assert not (finished / "calibration.npz").exists()
    with pytest.raises(
        ConfigurationError,
        match=r"must have stored motion .* resume it, with `evaluation.repeats` of at least 1",
    ):
        Detector.from_run(load_run(finished))


def test_a_run_in_a_laboratory_is_not_checked_by_simulations(finished):
    with pytest.raises(
        ConfigurationError,
        match="`run` must be of a system that can be simulated; got one in a laboratory",
    ):
        load_run(finished).check()
    assert not (finished / "check").exists()


def test_trials_can_be_read_as_they_were_observed(finished, tmp_path):
    trials = read_trials(finished, "generation-0001")
    rounds, replicas, _ = trials.models.shape
    assert trials.poses.shape == (rounds, 6, len(trials.labels), 3)
    assert trials.interval_s == pytest.approx(0.1)
    sent = trials.models.reshape(rounds * replicas, 4)
    np.testing.assert_allclose(
        sent, load_run(finished).history["model"][1], atol=5e-5
    )  # four digits go over the lines
    with pytest.raises(
        RunFolderError, match=r"`stage` must be one of which the run has trials; got 'generation-9'"
    ):
        read_trials(finished, "generation-9")
    with pytest.raises(RunFolderError, match=r"`run` must be a run folder; got"):
        read_trials(tmp_path, "generation-0001")
    copy = shutil.copytree(finished, tmp_path / "copy")
    place = copy / "trials" / "generation-0001" / "attempt-1"
    first, second, *_ = sorted(place.iterdir())
    for damage, reason in [
        (lambda: shutil.copy(first, place / "trial-100.npz"), "seals.txt does not know it"),
        (lambda: first.write_bytes(b"PK"), "it has been changed"),
        (lambda: shutil.copy(second, first), "it has been changed"),
        (first.unlink, "No such file"),
    ]:
        damage()
        with pytest.raises(DamagedError, match=reason):
            read_trials(copy, "generation-0001")
        (place / "trial-100.npz").unlink(missing_ok=True)


def test_a_calibration_that_is_not_there_is_refused_before_anything_moves(folder, tmp_path):
    (tmp_path / "lab.toml").write_text(SHORT)
    with pytest.raises(
        ConfigurationError,
        match=r"`camera\.calibration` must be a readable file; got .*camera\.json",
    ):
        begin(tmp_path, tmp_path / "run")
    assert not (tmp_path / "run").exists()
