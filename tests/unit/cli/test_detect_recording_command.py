"""What `detect` says of a recording, and what `check` says of a run, from the command line."""

import csv
import json
import os
import re
import shutil
from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("wide")

SMALL = [
    "--set",
    "models.population=8",
    "--set",
    "classifiers.population=8",
    "--threads",
    "1",
    "--generations",
    "6",
]
OPTIONS = ["--fps", "10", "--pixels-per-cm", "1"]


def write_recording(path, seed=0, frames=500):
    rng = np.random.default_rng(seed)
    positions = np.cumsum(rng.normal(0.6, 0.2, (frames, 6, 2)), axis=0)
    rows = [
        f"{f},{k},{x:.4f},{y:.4f}" for f in range(frames) for k, (x, y) in enumerate(positions[f])
    ]
    Path(path).write_text("frame,id,x,y\n" + "\n".join(rows) + "\n")
    return path


@pytest.fixture(scope="module")
def fish(tmp_path_factory):
    """A small run on windows that do not say what they were cut from, named as the command line names it."""
    from turing_learning.families import BurstAndCoast
    from turing_learning.runs import infer
    from turing_learning.trajectories import load_trajectories

    folder = tmp_path_factory.mktemp("fish")
    path = write_recording(folder / "fish.csv")
    windows = load_trajectories(path, fps=10, pixels_per_cm=1, y_axis="up").windows(length_s=2)
    windows = replace(windows, sources=())
    walk = BurstAndCoast(individuals=6, steps=20, interval_s=0.1)
    settings = {"models.population": 8, "classifiers.population": 8, "run.threads": 1}
    infer(
        name="burst-and-coast",
        genuine=windows,
        simulate=walk,
        parameters=walk.parameters,
        generations=6,
        settings=settings,
        out=folder / "run",
    )
    return folder / "run"


@pytest.fixture
def trial():
    """A recording in the form of idTracker, which states the direction of y."""

    def write(name="trial.txt", frames=300):
        rng = np.random.default_rng(1)
        pixels = np.cumsum(rng.normal(0.6, 0.2, (frames, 3, 2)), axis=0)
        rows = np.concatenate((pixels, np.ones((frames, 3, 1))), axis=2).reshape(frames, 9)
        header = "\t".join(f"X{k}\tY{k}\tProbId{k}" for k in (1, 2, 3))
        np.savetxt(name, rows, fmt="%.4f", delimiter="\t", header=header, comments="")
        return name

    return write


VOTES = ["--rule", "discriminant"]


def test_the_table_names_everybody_and_the_files_hold_each_window(fish, trial, call):
    code, out, err = call("detect", fish, trial(), *OPTIONS, *VOTES, "--out", "found.csv")
    assert (code, err) == (0, "")
    for text in (
        "individual",
        "windows",
        "evidence",
        "threshold",
        "when (s)",
        "of 3 abnormal, by windows of 20 steps",
    ):
        assert text in out
    rows = list(csv.DictReader(Path("found.csv").read_text().splitlines()))
    assert len(rows) == 3 * 14
    assert {row["individual"] for row in rows} == {"1", "2", "3"}
    assert float(rows[1]["begin_s"]) == pytest.approx(float(rows[0]["end_s"]))
    assert Path("found.png").stat().st_size > 1000
    assert Path("found.svg").exists()


def test_json_holds_what_the_table_holds(fish, trial, call):
    code, out, _ = call(
        "detect", fish, trial(), *OPTIONS, *VOTES, "--json", "--false-alarms", "0.05"
    )
    content = json.loads(out)
    assert (code, content["false_alarms"], content["steps"]) == (0, 0.05, 20)
    for each in content["individuals"]:
        assert each["windows"] == 14
        assert each["abnormal"] == (each["strength"] > each["threshold"])
        assert bool(each["spells_s"]) == each["abnormal"]


def test_normal_recordings_calibrate_and_the_strange_individual_comes_first(fish, call):
    from turing_learning.detection._planted import plant
    from turing_learning.trajectories import load_trajectories

    for k in range(4):
        write_recording(f"{k}.csv", seed=10 + k)
    whole = load_trajectories("3.csv", fps=10, pixels_per_cm=1, y_axis="up")
    moved = plant(whole, 2, "too slow", np.random.default_rng(0)).positions
    rows = [
        f"{f},{k},{x:.4f},{y:.4f}" for f in range(len(moved)) for k, (x, y) in enumerate(moved[f])
    ]
    Path("3.csv").write_text("frame,id,x,y\n" + "\n".join(rows) + "\n")
    genuine = [each for k in range(3) for each in ("--genuine", f"{k}.csv")]
    code, out, err = call(
        "detect",
        fish,
        "3.csv",
        *genuine,
        *OPTIONS,
        "--y-axis",
        "up",
        "--json",
        "--out",
        "found.csv",
    )
    assert code == 0, err
    content = json.loads(out)
    assert content["normal"] == {"recordings": 3, "individuals": 18}
    assert content["promised"] == pytest.approx(1 / 19)
    ranks = {each["individual"]: each["rank"] for each in content["individuals"]}
    assert ranks["2"] == 1
    strange = content["individuals"][2]
    assert strange["abnormal"]
    assert len(strange["spells_s"]) == 1
    found = list(csv.DictReader(Path("found.csv").read_text().splitlines()))
    shares = [float(row["score"]) for row in found if row["individual"] == "2"]
    assert np.mean(shares) == pytest.approx(strange["score"])
    page = Path("found.html").read_text()
    assert re.search(r'<th scope="row">2</th><td>1</td>.*?<td>stands out</td>', page)
    said = (
        "Scores over time",
        "Paths",
        "2 (rank 1)",
        "1 of 6 individuals: stands out",
        "/3.csv: who",
    )
    for text in (*said, content["remarks"][0]):
        assert escape(text) in page


def test_without_normal_recordings_there_is_a_ranking_and_no_verdict(fish, trial, call):
    content = json.loads(call("detect", fish, trial(), *OPTIONS, "--json")[1])
    assert content["promised"] is None
    assert sorted(each["rank"] for each in content["individuals"]) == [1, 2, 3]
    assert {each["abnormal"] for each in content["individuals"]} == {None}
    assert content["remarks"][0].startswith(
        "Nobody is called abnormal, as no recordings of normal individuals are given"
    )
    headings = call("detect", fish, trial(), *OPTIONS)[1].splitlines()[0].split()
    assert headings == ["individual", "rank", "windows", "score"]  # nothing is known of the others


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["trial.txt", "--fps", "25", "--pixels-per-cm", "1"],
            "fps` must be that of the run, 10; got 25",
        ),
        (["trial.txt", "--fps", "10"], "`--pixels-per-cm` must be given; got none"),
        (
            ["trial.txt", "--fps", "10", "--pixels-per-cm", "1e-12"],
            r"`--pixels-per-cm` must be a finite number of at least 1e-09 and .*; got 1e-12\.",
        ),
        (["short.txt", *OPTIONS], r"`motion` must hold a window of 20 steps .* got 15 frames"),
        (["none.txt", *OPTIONS], r"`motion` must be a readable file; got none.txt"),
        (["trial.txt", *OPTIONS, "--out", "x.txt"], "`out` must end with .csv; got x.txt"),
        (
            ["trial.txt", *OPTIONS, "--out", "no/x.csv"],
            r"`out` must be a file that can be written; got no/x.csv \(there is no folder no\)",
        ),
        (
            ["trial.txt", *OPTIONS, "--out", "taken.csv"],
            r"`out` must be a file that does not exist; got taken\.png\. Choose another name, or replace it with --force\.",
        ),
        (
            ["motion.npy", "--out", "x.csv"],
            r"`--out` must be left out where there is no recording; got x\.csv",
        ),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(fish, trial, call, arguments, message):
    trial()
    trial("short.txt", frames=15)
    Path("taken.png").touch()
    code, out, err = call("detect", fish, *arguments)
    assert (code, out) == (2, "")
    assert re.search(message, err), err
    assert err.count("\n") == 1
    assert not Path("x.csv").exists()


@pytest.mark.parametrize("name", ["samples.npy", "samples.npz", "samples.csv"])
@pytest.mark.parametrize(
    ("option", "value"), [("--pixels-per-cm", "3.0"), ("--fps", "10.0"), ("--y-axis", "up")]
)
def test_samples_have_neither_scale_nor_rate(fish, call, name, option, value):
    samples = np.random.default_rng(0).normal(size=(2, 20, 2))
    np.save("samples.npy", samples)
    np.savez("samples.npz", samples=samples)
    rows = [f"{k},{t},{samples[k, t, 0]},{samples[k, t, 1]}" for k in range(2) for t in range(20)]
    Path("samples.csv").write_text("\n".join(["individual,step,speed,turn", *rows]) + "\n")
    assert call("detect", fish, name)[0] == 0
    assert call("detect", fish, name, option, value) == (
        *(2, ""),
        f"error: `{option}` must be left out where there is no recording; got {value}. {name} holds samples of "
        "the run's signals, in their units.\n",
    )


@pytest.mark.parametrize("option", ["--genuine", "--abnormal"])
def test_by_votes_a_recording_to_calibrate_with_has_to_be_cut_into_samples(
    fish, trial, call, option
):
    code, out, err = call("detect", fish, trial(), *OPTIONS, *VOTES, option, trial("normal.txt"))
    assert (code, out) == (2, "")
    assert (
        f"`{option}` must be a file that ends with one of .npy, .npz, .csv; got normal.txt." in err
    )


def test_a_table_of_a_tracker_without_options_is_told_of_them(fish, call):
    assert call("detect", fish, write_recording("table.csv")) == (
        *(2, ""),
        "error: `motion` must begin with individual,step or individual,sample,step and the names of signals; got 'frame,id,x,y' "
        "[table.csv:1]. If a tracker wrote it, give --fps and --pixels-per-cm, or --format where it states them.\n",
    )


def test_without_normal_recordings_individuals_are_ranked_beside_those_that_the_run_has_learned_from(
    call,
):
    how = [
        "--fps",
        "10",
        "--pixels-per-cm",
        "2",
        "--y-axis",
        "up",
        "--model",
        "burst-and-coast",
        "--window",
        "2",
    ]
    fish = write_recording("fish.csv")
    assert call("infer", "--trajectories", fish, *how, *SMALL, "--out", "run")[0] == 0
    command = ["detect", "run", write_recording("table.csv", seed=1), "--json"]
    alone = json.loads(call(*command)[1])
    beside = json.loads(call(*command, "--genuine", fish)[1])
    assert [each["score"] for each in alone["individuals"]] == [
        each["score"] for each in beside["individuals"]
    ]
    assert {each["abnormal"] for each in alone["individuals"]} == {None}
    assert "individuals but those that the run has learned from are given" in alone["remarks"][0]
    for gone in (
        ["detect", "run", fish, "--json"],
        command,
    ):  # it is judged itself; it is not there
        assert (
            "recordings of normal individuals are given" in json.loads(call(*gone)[1])["remarks"][0]
        )
        Path(fish).unlink(missing_ok=True)


def write_spots(path, seed):
    """Spots as TrackMate exports them: the file states frame rate, scale and direction of y."""
    _, *rows = Path(write_recording(path, seed)).read_text().splitlines()
    names = "LABEL,FRAME,TRACK_ID,POSITION_X,POSITION_Y,POSITION_T"
    spots = [names, *["Label,Frame,Track ID,X,Y,T"] * 2, ",,,(cm),(cm),(sec)"]
    for row in rows:
        spots.append(f"ID,{row},{int(row.split(',')[0]) / 10}")
    Path(path).write_text("\n".join(spots) + "\n")
    return path


def test_tables_that_state_all_are_recordings_to_a_run_that_has_learned_from_one(call):
    run = ["--model", "burst-and-coast", "--window", "2", *SMALL, "--out", "run"]
    assert call("infer", "--trajectories", write_spots("fish.csv", seed=0), *run)[0] == 0
    code, out, err = call("detect", "run", write_spots("table.csv", seed=1), "--out", "odd.csv")
    assert code == 0, err
    assert "of 6 abnormal, by windows of 20 steps" in out
    assert "What files do not state" not in out


@pytest.mark.parametrize(
    "rate", [("--fps", "10.0"), ("--fps", "20.0", "--every", "2", "--bridge", "3")]
)
def test_recordings_are_read_as_that_of_the_run_unless_they_or_options_say_otherwise(
    rate, trial, call
):
    how = [*rate, "--pixels-per-cm", "2.0", "--y-axis", "up"]
    run = ["--model", "burst-and-coast", "--window", "2", *SMALL, "--out", "run"]
    assert call("infer", "--trajectories", write_recording("fish.csv"), *how, *run)[0] == 0
    files = [
        write_recording("table.csv", seed=1),
        "--genuine",
        write_recording("normal.csv", seed=2),
    ]
    told, line = (
        call("detect", "run", *files, *how)[1],
        "What files do not state is as in the recording of the run: ",
    )
    code, out, err = call("detect", "run", *files)
    assert (code, out, err) == (0, f"{told}{line}{' '.join(how)}\n", "")
    assert call("detect", "run", *files, *how[:-4])[1].endswith(
        f"{line}--pixels-per-cm 2.0 --y-axis up\n"
    )
    found = json.loads(
        call("detect", "run", trial(), "--genuine", trial("normal.txt"), "--json")[1]
    )
    assert found["as_in_the_run"]["scale"] == 2.0
    assert len(found["individuals"]) == 3
    code, _, err = call("detect", "run", *files, "--fps", "11")
    assert (code, "`--fps` must be that of the run, 10; got 11" in err) == (2, True)


def test_a_recording_of_every_second_frame_is_told_and_kept_by_an_option(fish, call):
    header, *rows = Path(write_recording("whole.csv", seed=1)).read_text().splitlines()
    sparse = [row for row in rows if int(row.split(",")[0]) % 2 == 0]
    Path("sparse.csv").write_text("\n".join([header, *sparse]) + "\n")
    command = ("detect", fish, "sparse.csv", "--pixels-per-cm", "1", "--y-axis", "up")
    assert "only one in 2 is there: 5 per second" in call(*command, "--fps", "10")[2]
    code, out, err = call(*command, "--fps", "20", "--every", "2")
    assert (code, err) == (0, "")
    assert "of 6 abnormal, by windows of 20 steps" in out
    assert "Thin the faster recording" in call(*command, "--fps", "40", "--every", "2")[2]
    code, _, err = call(*command, "--fps", "20", "--every", "0")
    assert (code, err) == (2, "error: `--thin` must be an integer from 1 to 499; got 0.\n")


def test_a_table_without_room_is_left_out_whole_and_the_same_command_may_be_repeated(
    fish, trial, call, monkeypatch
):
    command = ("detect", fish, trial(), *OPTIONS, "--out", "found.csv")
    with monkeypatch.context() as patch:

        def full(*arguments):
            raise OSError(28, "No space left on device")

        patch.setattr("turing_learning.figures.save_figure", full)
        code, _, err = call(*command)
    assert code == 1
    assert err.startswith(
        "error: `out` must be a file that can be written; could not write to found.csv (No space left"
    )
    assert err.count("\n") == 1
    assert not Path("found.csv").exists()
    assert call(*command)[0] == 0
    assert call(*command)[0] == 2
    Path("found.csv").write_text("old")
    assert call(*command, "--force")[0] == 0
    assert Path("found.csv").read_text().startswith("individual,")


def test_a_table_in_a_folder_that_is_not_ones_own_is_refused_before_anything_runs(
    fish, trial, call, monkeypatch
):
    monkeypatch.setattr("os.access", lambda path, mode: mode != os.W_OK)
    code, out, err = call("detect", fish, trial(), *OPTIONS, "--out", "found.csv")
    assert (code, out) == (2, "")
    assert err.startswith("error: `out` must be in a folder that can be written; got found.csv.")


def test_a_run_that_has_lost_its_history_is_named(fish, trial, call):
    shutil.copytree(fish, "lost")
    shutil.rmtree("lost/history.zarr")
    code, _, err = call("detect", "lost", trial(), *OPTIONS)
    assert code == 2
    assert err.startswith(
        "error: `run` must have its history as it was written; got files that cannot be read"
    )
    assert err.count("\n") == 1


@pytest.fixture(scope="module")
def swarm(tmp_path_factory, done):
    """A small run on robots, made by the command line."""
    folder, few = (
        tmp_path_factory.mktemp("runs") / "run",
        ["scenario.agents=2", "scenario.trial.duration_s=1.0"],
    )
    done("infer", "aggregation", *SMALL, "--set", few[0], "--set", few[1], "--out", folder)
    return folder


CHEAP = ["--samples", "20", "--points", "0", "--recovery-generations", "2"]


def test_check_prints_a_row_for_each_parameter_and_goes_into_the_report(swarm, call):
    code, out, err = call("check", swarm, *CHEAP)
    assert code == 0
    for text in ("vl0", "vr1", "left open", "missed by", "Fresh classifiers can"):
        assert text in out
    assert "a run whose truth is the estimate, 1 of 1" in err
    assert "Can it be believed?" in (swarm / "report.html").read_text(encoding="utf-8")
    again = call("check", swarm, *CHEAP)
    assert again[0] == 0
    assert again[1] == out
    assert again[2] == ""  # nothing was done again


@pytest.mark.parametrize(
    ("run", "options", "message"),
    [
        (
            "swarm",
            "--points 7",
            "`run` must be checked with the settings that its check began with",
        ),
        ("swarm", "--points 2", "`points` must be at least 6, or 0 for no profiles; got 2"),
        ("fish", "", "must be given for a custom system"),
        (
            "swarm",
            "--recoveries -1 --force",
            "`recoveries` must be an integer of at least 0; got -1",
        ),
    ],
)
def test_check_refuses_what_does_not_fit(swarm, fish, call, run, options, message):
    if not (swarm / "check").exists():
        call("check", swarm, *CHEAP)
    code, _, err = call("check", {"swarm": swarm, "fish": fish}[run], *options.split())
    assert code == 2
    assert message in err
