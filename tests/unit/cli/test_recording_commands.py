import json
import os
import signal
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

import turing_learning as tl
from turing_learning.config import ConfigurationError

pytestmark = pytest.mark.usefixtures("few_kernels", "few_moves", "wide")

TERMITES = Path(__file__).parents[2] / "reference/data/tracktor/termite_video_idtracked.txt"
RECORDED = [
    "--trajectories", str(TERMITES), "--fps", "25", "--pixels-per-cm", "20", "--model", "burst-and-coast", "--window", "2",
]  # fmt: skip
OTHER_MODEL = ["boids" if word == "burst-and-coast" else word for word in RECORDED]


def without(options, name):
    """Options without one of them and its value."""
    place = options.index(name)
    return options[:place] + options[place + 2 :]


SMALL = ["--set", "models.population=8", "--set", "classifiers.population=8", "--threads", "1"]


def test_a_recording_and_a_family_of_models_make_a_run(call):
    code, out, _ = call("infer", *RECORDED, *SMALL, "--generations", "3", "--out", "run")
    assert code == 0
    assert "kick_interval" in out
    assert "paper" not in out
    result = json.loads(Path("run/result.json").read_text())
    assert result["scenario"] == "burst-and-coast"
    assert result["truth"] is None
    assert set(result["interval"]) == {"speed", "kick_interval", "glide_time", "turn"}


def test_the_folder_of_a_run_is_named_after_the_seed_of_the_file_unless_one_is_given(call):
    Path("c.toml").write_text("[run]\nseed = 7\n")
    command = ("infer", *RECORDED, *SMALL, "--config", "c.toml", "--generations", "1")
    assert call(*command)[0] == call(*command, "--seed", "8")[0] == 0
    folders = sorted(Path("runs").iterdir(), key=lambda path: path.name[-1])
    assert [path.name[-6:] for path in folders] == ["-seed7", "-seed8"]
    assert [json.loads((path / "result.json").read_text())["seed"] for path in folders] == [7, 8]


def given(table, fps):
    """Return the options for a plain table in cm, y upwards."""
    return [
        "--trajectories",
        table,
        "--fps",
        str(fps),
        "--pixels-per-cm",
        "1",
        "--y-axis",
        "up",
        "--model",
        "burst-and-coast",
    ]


def test_individuals_are_kept_for_testing(call):
    rng = np.random.default_rng(1)
    steps = np.cumsum(rng.normal(0.6, 0.2, (1500, 4, 2)), axis=0)
    rows = [
        f"{t},{'abcd'[k]},{x},{y}" for t, each in enumerate(steps) for k, (x, y) in enumerate(each)
    ]
    Path("four.csv").write_text("\n".join(["frame,id,x,y", *rows]) + "\n")
    four = given("four.csv", 10)
    apart = ["--hold-out-individuals", "b, d"]
    assert call("infer", *four, *apart, *SMALL, "--generations", "1", "--out", "run")[0] == 0
    assert call("resume", "run", *four, *apart)[0] == 0
    code, _, err = call("resume", "run", *four, "--hold-out-individuals", "a")
    assert code == 2
    assert "that the run began with" in err
    code, _, err = call("infer", *four, "--hold-out-individuals", "a,,b", "--out", "other")
    assert (
        err
        == "error: `--hold-out-individuals` must be names, separated by commas; got 'a,,b', where one is empty.\n"
    )
    code, _, err = call("resume", "run", *four, *apart, "--every", "2")
    assert "must have the time step of the samples, 0.1 s; got 0.2 s" in err
    quick = ["--samples", "10", "--points", "0", "--recoveries", "0"]
    assert call("check", "run", *quick)[0] == 0
    test = json.loads(Path("run/check/check.json").read_text())["test"]
    assert (test["genuine_groups"], test["grouping"]) == (2, "individuals")
    code, _, err = call("infer", *four, "--hold-out-individuals", "b,e", "--out", "other")
    assert (code, err) == (
        2,
        "error: `--hold-out-individuals` must be a list of names, some of a, b, c, d but not all; got ['b', 'e'].\n",
    )


def write_group(path, seed, individuals=3):
    """Write a plain table of a group that moves for 30 s."""
    steps = np.cumsum(np.random.default_rng(seed).normal(0.3, 0.2, (300, individuals, 2)), axis=0)
    rows = [f"{t},{k},{x},{y}" for t, each in enumerate(steps) for k, (x, y) in enumerate(each)]
    Path(path).parent.mkdir(exist_ok=True)
    Path(path).write_text("\n".join(["frame,id,x,y", *rows]) + "\n")


def test_several_recordings_make_one_run(call):
    for k, day in enumerate(("monday", "tuesday", "friday")):
        write_group(f"{day}/fish.csv", k, individuals=3 + k // 2)
    options = [
        *given("monday/fish.csv", 10),
        "--trajectories",
        "tuesday/fish.csv",
        "--trajectories",
        "friday/fish.csv",
    ]
    options = [
        *without(options, "--model"),
        "--model",
        "kicks+walls+social",
        "--signals",
        "speed, neighbor_distance",
    ]
    options += [
        "--tank",
        "recorded",
        "--smooth",
        "3",
        "--bridge",
        "2",
        "--hold-out-recordings",
        "2",
    ]
    code, out, err = call("infer", *options, *SMALL, "--generations", "2", "--out", "run")
    assert (code, err) == (0, "")
    config = Path("run/config.toml").read_text()
    assert 'title = "monday/fish.csv and 2 more, as kicks+walls+social"' in config
    assert 'signals = ["speed", "neighbor_distance"]' in config
    assert call("resume", "run", *options)[0] == 0
    assert call("resume", "run", *without(options, "--signals"))[0] == 0
    code, _, err = call("resume", "run", *without(options, "--smooth"), "--smooth", "5")
    assert "that the run began with" in err
    quick = ["--samples", "10", "--points", "0", "--recoveries", "0"]
    assert call("check", "run", *options, *quick)[0] == 0
    assert json.loads(Path("run/check/check.json").read_text())["test"]["grouping"] == "individuals"
    detect = [
        "detect",
        "run",
        "friday/fish.csv",
        "--genuine",
        "monday/fish.csv",
        "--genuine",
        "tuesday/fish.csv",
    ]
    code, out, _ = call(*detect, *given("", 10)[2:8], "--json")
    assert code == 0
    found = json.loads(out)
    assert sorted(each["rank"] for each in found["individuals"]) == [1, 2, 3, 4]
    assert "judged by the recordings of the others" in " ".join(found["remarks"])


@pytest.mark.parametrize(
    ("model", "individuals", "signals"),
    [
        ("couzin", 3, ("speed", "turn", "neighbor_distance", "neighbor_bearing")),
        ("vicsek", 3, ("speed", "turn", "neighbor_distance", "neighbor_bearing")),
        ("couzin", 1, ("speed", "turn")),
        ("burst-and-coast", 3, ("speed", "turn")),
    ],
)
def test_signals_of_neighbors_are_the_default_where_models_have_them(
    tmp_path, model, individuals, signals
):
    from turing_learning.cli._options import Recording

    write_group(tmp_path / "group" / "fish.csv", 1, individuals=individuals)
    files = [tmp_path / "group" / "fish.csv"]
    options = {"trajectories": files, "fps": 10.0, "scale": 1.0, "y_axis": "up", "model": model}
    windows, family, _ = Recording(**options).motion().opened()
    assert windows.names == family.signals == signals
    assert Recording(**options).motion().opened(20, ("speed",))[0].names == ("speed",)
    assert (family.tank_cm is None) == (len(signals) == 2)
    assert Recording(**options, tank=["none"]).motion().opened()[1].tank_cm is None
    if family.tank_cm is not None:
        places = np.loadtxt(files[0], delimiter=",", skiprows=1)[:, 2:]
        np.testing.assert_allclose(family.tank_cm, np.ptp(places, axis=0))


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (
            ["--tank", "40"],
            "`--tank` must be width x height in cm, recorded, or none; got '40'. For example: --tank 40x30",
        ),
        (["--tank", "0x30"], "`--tank` must be two finite numbers above 0"),
        (
            ["--signals", "speed,distance"],
            "`--signals` must be some of speed, turn, neighbor_distance, neighbor_bearing",
        ),
        (
            ["--hold-out-recordings", "3"],
            "`--hold-out-recordings` must be numbers of some of the 2 recordings, from 1",
        ),
        (["--hold-out-recordings", "1,2"], "from 1, but not of all; got '1,2'."),
        (["--bridge", "0"], "`--bridge` must be an integer of at least 1; got 0."),
        (["--smooth", "2"], "`--smooth` must be odd and 1 or more; got 2"),
        (
            ["--tank", "9x9", "--tank", "9x9", "--tank", "9x9"],
            "`--tank` must be one, or one for each of 2 recordings; got 3",
        ),
    ],
)
def test_options_of_several_recordings_that_make_no_sense_are_refused(call, more, message):
    write_group("a.csv", 1)
    options = without([*given("a.csv", 10), "--trajectories", "a.csv"], "--model")
    code, _, err = call("infer", *options, "--model", "couzin", *more, "--out", "run")
    assert code == 2
    assert message in err


def test_who_names_a_simulator_as_a_family_is_told_where_it_goes(call):
    write_group("a.csv", 1)
    options = without(given("a.csv", 10), "--model")
    code, _, err = call("infer", *options, "--model", "mine:simulate", "--out", "run")
    assert code == 2
    assert "simulate=" in err
    assert "--simulate-command" in err


def test_what_is_found_in_a_recording_is_told_before_it_is_learned_from(call):
    rng = np.random.default_rng(1)
    steps = np.cumsum(rng.normal(0.6, 0.2, (400, 20, 2)), axis=0)
    steps[:, 3:] = steps[0, 3:]
    rows = [f"{t},{k},{x},{y}" for t, each in enumerate(steps) for k, (x, y) in enumerate(each)]
    Path("still.csv").write_text("\n".join(["frame,id,x,y", *rows]) + "\n")
    options = given("still.csv", 10)
    code, out, _ = call(
        "infer", *options, "--window", "2", *SMALL, "--generations", "1", "--out", "run"
    )
    assert code == 0
    first, second, _ = out.split("\n", maxsplit=2)
    assert first.startswith(
        "still.csv: 6800 positions at exactly one point, as if for missing ones, such as ("
    )
    assert second == "still.csv: 3: never moves, in 400 frames"
    assert "still.csv: and 6 more; all by `recording.check()` in Python\n" in out


def test_a_table_of_ones_own_says_where_y_points(call):
    rows = [
        f"{t},{who},{(0.1 + 0.1 * who) * t},{0.01 * t * t}" for t in range(200) for who in range(3)
    ]
    Path("own.csv").write_text("\n".join(["frame,id,x,y", *rows]) + "\n")
    table = [
        "--trajectories",
        "own.csv",
        "--fps",
        "10",
        "--pixels-per-cm",
        "1",
        "--model",
        "burst-and-coast",
        "--window",
        "2",
    ]
    code, _, err = call("infer", *table, "--out", "run")
    assert code == 2
    assert "`--y-axis` must be given; got none" in err
    code, _, err = call(
        "infer", *table, "--y-axis", "up", *SMALL, "--generations", "1", "--out", "run"
    )
    assert (code, err) == (0, "")
    code, out, err = call("detect", "run", "own.csv", "--fps", "10", "--pixels-per-cm", "1")
    assert (code, err) == (0, "")
    assert out.endswith("is as in the recording of the run: --y-axis up\n")


def test_a_recording_in_which_nobody_moves_is_refused(call):
    rows = [f"{t},{who},{who},1" for t in range(200) for who in range(3)]
    Path("still.csv").write_text("\n".join(["frame,id,x,y", *rows]) + "\n")
    read = [
        "--fps",
        "10",
        "--pixels-per-cm",
        "1",
        "--y-axis",
        "up",
        "--model",
        "burst-and-coast",
        "--window",
        "2",
    ]
    code, _, err = call("infer", "--trajectories", "still.csv", *read, "--out", "run")
    assert code == 2
    assert (
        "`positions` must be of somebody who moves; got 600 positions at exactly one point, as if for missing ones"
        in err
    )
    assert "If they rest, give a longer --longest-rest." in err
    code, _, err = call(
        "infer", "--trajectories", "still.csv", *read, "--longest-rest", "1e6", "--out", "run"
    )
    assert (
        "must be windows of motion that varies; got the same at every step of all of them: speed is 0,"
        in err
    )
    assert not Path("run").exists()


def test_headings_are_on_both_sides_or_on_none(call):
    rows = [
        f"{t},{who},{(0.1 + 0.1 * who) * t},{0.01 * t * t}" for t in range(200) for who in range(3)
    ]
    for name, column, heading in (("plain.csv", "", ""), ("facing.csv", ",heading", ",3.1")):
        Path(name).write_text(
            "\n".join([f"frame,id,x,y{column}", *(row + heading for row in rows)]) + "\n"
        )
    read = ["--fps", "10", "--pixels-per-cm", "1", "--y-axis", "up"]
    more = [*read, "--window", "2", *SMALL, "--generations", "1"]
    code, _, err = call(
        "infer", "--trajectories", "plain.csv", "--model", "robots", *more, "--out", "run"
    )
    assert code == 2
    assert (
        "must have no headings, as the samples have none; got Robots, whose speeds are negative backwards."
        in err
    )
    assert not Path("run").exists()
    for model, headings in (("robots", "with"), ("burst-and-coast", "without")):
        assert (
            call("infer", "--trajectories", "facing.csv", "--model", model, *more, "--out", model)[
                0
            ]
            == 0
        )
        assert f'headings = "{headings}"\n' in Path(model, "config.toml").read_text()
    assert "`motion` must have headings" in call("detect", "robots", "plain.csv", *read)[2]
    refused = [
        call("detect", "burst-and-coast", name, *read)[2] for name in ("plain.csv", "facing.csv")
    ]
    assert not any("headings" in err for err in refused)


@pytest.fixture
def stopped(call, monkeypatch):
    """Begin a run on the recording that somebody stops after some generations; return what it says."""

    def stopped(*options, after):
        def interrupt(self, progress):
            if progress.completed == after:
                os.kill(os.getpid(), signal.SIGINT)

        with monkeypatch.context() as patch:
            patch.setattr("turing_learning.cli._live.RunView.__call__", interrupt)
            code, _, err = call("infer", *RECORDED, *SMALL, *options, "--out", "run")
        assert code == 130
        return err

    return stopped


def test_a_stopped_run_is_resumed_with_the_options_that_the_message_names(call, stopped):
    assert call("infer", *RECORDED, *SMALL, "--generations", "4", "--out", "whole")[0] == 0
    err = stopped("--generations", "4", after=2)
    command = err.strip().partition("resume with: turing-learning ")[2].split()
    assert command == ["resume", "run"]
    code, _, err = call("resume", "run", *OTHER_MODEL)
    assert code == 2
    assert "must have the parameters of the run, speed, " in err
    assert call(*command)[0] == 0
    first, second = (json.loads(Path(name, "result.json").read_text()) for name in ("whole", "run"))
    assert first["estimate"] == second["estimate"]


def test_another_family_than_that_of_the_run_is_not_checked(call):
    assert call("infer", *RECORDED, *SMALL, "--generations", "2", "--out", "run")[0] == 0
    code, _, err = call("check", "run", *OTHER_MODEL)
    assert code == 2
    assert "must have the parameters of the run, speed, " in err
    assert not Path("run", "check").exists()


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (["resume", "run", *RECORDED[:-1], "3"], "; got 75"),
        (["check", "run", *RECORDED[:-1], "3"], "; got 75"),
        (
            ["check", "run", *without(RECORDED, "--pixels-per-cm"), "--pixels-per-cm", "10"],
            "that the run began with",
        ),
        (["infer", *RECORDED, "--out", "run"], "Resume it with `turing-learning resume run`, "),
        (
            ["infer", "--config", "run/config.toml", "--out", "new"],
            "must be given for a custom system",
        ),
        (
            ["study", "--config", "run/config.toml", "--out", "new"],
            "a custom system, whose simulator no file can hold",
        ),
        (["detect", "run", "--simulate", "1"], "run.history"),
    ],
)
def test_whatever_is_refused_of_a_run_on_a_recording_names_options(call, stopped, command, message):
    stopped("--set", "run.history=thin", "--generations", "3", after=1)
    code, _, err = call(*command)
    assert code == 2
    assert message in err
    assert err.count("\n") == 1


def test_detectors_of_runs_on_recordings_say_what_helps(call, stopped):
    stopped("--generations", "3", after=1)
    motion = ["detect", "run", TERMITES, "--fps", "25", "--pixels-per-cm", "20"]
    assert "must be given for a run that has stored no motion" in call(*motion)[2]
    assert (
        "must be on simulated robots for individuals to be simulated"
        in call("detect", "run", "--simulate", "1")[2]
    )


def test_a_short_recording_of_one_individual_is_not_checked(call):
    rng = np.random.default_rng(1)
    rows = [
        f"{t},0,{x},{y}"
        for t, (x, y) in enumerate(np.cumsum(rng.normal(0.6, 0.2, (450, 2)), axis=0))
    ]
    Path("one.csv").write_text("\n".join(["frame,id,x,y", *rows]) + "\n")
    one = [
        "--trajectories",
        "one.csv",
        "--fps",
        "10",
        "--pixels-per-cm",
        "1",
        "--y-axis",
        "up",
        "--model",
        "burst-and-coast",
    ]
    assert (
        call("infer", *one, "--window", "1.2", *SMALL, "--generations", "1", "--out", "run")[0] == 0
    )
    code, _, err = call("check", "run", *one)
    assert code == 2
    assert "must tell at least 2 groups of held-out samples apart; got 1" in err
    assert not Path("run/check").exists()


def test_a_disk_that_is_full_says_how_the_command_line_goes_on(call, monkeypatch):
    def full(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("turing_learning.runs._folder.save_checkpoint", full)
    code, _, err = call("infer", *RECORDED, *SMALL, "--generations", "2", "--out", "my run")
    assert code == 1
    assert err.startswith(
        f"error: `out` must be a folder with space left; could not write to {Path('my run').absolute()}"
    )


def test_a_run_on_robots_needs_no_recording(call):
    small = [
        "--set",
        "scenario.agents=2",
        "--set",
        "scenario.trial.duration_s=1.0",
        "--generations",
        "1",
    ]
    assert call("infer", "aggregation", *SMALL, *small, "--out", "run")[0] == 0
    for command in ("check", "resume"):
        for options in (RECORDED, ["--trajectories", str(TERMITES)], ["--fps", "25"]):
            code, _, err = call(command, "run", *options)
            assert (code, err.count("\n")) == (2, 1)
            assert (
                "` must be left out for a run on simulated robots, which needs nothing but its folder; got"
                in err
            )


def test_a_finished_run_is_resumed_with_its_own_recording_and_model_only(call):
    assert call("infer", *RECORDED, *SMALL, "--generations", "1", "--out", "run")[0] == 0
    assert call("resume", "run")[0] == 0
    assert call("resume", "run", *without(RECORDED, "--window"))[0] == 0
    code, _, err = call(
        "resume", "run", *without(RECORDED, "--pixels-per-cm"), "--pixels-per-cm", "10"
    )
    assert code == 2
    assert "that the run began with" in err
    code, _, err = call("resume", "run", *OTHER_MODEL)
    assert code == 2
    assert "must have the parameters of the run" in err


def test_a_recording_of_every_second_frame_is_inferred_from_at_its_own_rate(call):
    rng = np.random.default_rng(1)
    walk = np.cumsum(rng.normal(0.6, 0.2, (200, 3, 2)), axis=0)
    rows = [f"{2 * t},{who},{x},{y}" for t in range(200) for who, (x, y) in enumerate(walk[t])]
    Path("sparse.csv").write_text("\n".join(["frame,id,x,y", *rows]) + "\n")
    options = given("sparse.csv", 20)
    small = [*SMALL, "--generations", "1", "--window", "2", "--out", "run"]
    code, _, err = call("infer", *options, *small)
    assert code == 2
    assert (
        "only one in 2 is there: 10 per second. If that is the rate of what was tracked, keep those by `thinned(2)` or --thin 2."
        in err
    )
    assert call("infer", *options, "--thin", "2", *small)[0] == 0
    assert "interval_s = 0.1\n" in Path("run/config.toml").read_text()
    assert call("resume", "run", *options, "--every", "2")[0] == 0


def test_a_column_names_the_individuals_by_an_option(call, caplog):
    rng = np.random.default_rng(1)
    walk = np.cumsum(rng.normal(0.6, 0.2, (200, 3, 2)), axis=0)
    rows = [
        f"{t},{who},{(who + t) % 7},{x},{y},{t % 2}"
        for t in range(200)
        for who, (x, y) in enumerate(walk[t])
    ]
    Path("birds.csv").write_text("\n".join(["frame,bird,bush,x,y,confidence", *rows]) + "\n")
    small = [*SMALL, "--generations", "1", "--window", "2", "--out", "run"]
    options = given("birds.csv", 10)
    code, _, err = call("infer", *options, *small)
    assert (code, err.count("\n")) == (2, 1)
    assert "say so: --column id=bush.\n" in err
    code, out, _ = call("infer", *options, "--column", "id=bird", *small)
    assert code == 0
    assert "birds.csv: 50.0% of all positions have a confidence below 0.5" in out
    assert call("resume", "run")[0] == 0
    assert call("detect", "run", "birds.csv", "--column", "id=bird")[0] == 0
    assert "birds.csv: 50.0% of all positions have a confidence below 0.5" in caplog.text
    for text, message in (
        ("bird", "`--column` must be WHAT=NAME, once for each; got 'bird'."),
        ("name=bird", "`--column` must be one of frame, time, id, "),
    ):
        assert message in call("infer", *options, "--column", text, *small)[2]
    surer = ["--column", "id=bird", "--min-confidence", "0.5", "--every", "2", "--force"]
    assert "count as missing" in call("infer", *options, *surer, *small)[1]


def test_a_file_says_by_options_of_which_format_it_is_and_which_point_counts(call):
    rows = [
        f"{t},{who},{(0.1 + 0.1 * who) * t},{0.01 * t * t},{0.02 * t * t},{t}"
        for t in range(200)
        for who in range(3)
    ]
    Path("both.csv").write_text("\n".join(["frame,id,x,y,pos_x,pos_y", *rows]) + "\n")
    header = [
        "scorer" + ",a" * 6,
        "bodyparts" + ",nose" * 3 + ",tail" * 3,
        "coords" + ",x,y,likelihood" * 2,
    ]
    points = [f"{t},{0.1 * t},{0.01 * t * t},1,0,0,1" for t in range(200)]
    Path("points.csv").write_text("\n".join([*header, *points]) + "\n")
    model = [
        "--fps",
        "10",
        "--pixels-per-cm",
        "1",
        "--model",
        "burst-and-coast",
        "--window",
        "2",
        *SMALL,
        "--generations",
        "1",
    ]
    for file, message, options in (
        (
            "both.csv",
            "got what fits tracktor and tidy [both.csv]. Give --format.",
            ["--format", "tracktor"],
        ),
        ("points.csv", "`--keypoint` must be one of nose, tail; got None", ["--keypoint", "nose"]),
    ):
        run = f"{file}-run"
        code, _, err = call("infer", "--trajectories", file, *model, "--out", run)
        assert code == 2
        assert message in err
        code, _, err = call("infer", "--trajectories", file, *model, *options, "--out", run)
        assert (code, err) == (0, "")
        recording = ["detect", run, file, "--fps", "10", "--pixels-per-cm", "1"]
        assert message in call(*recording)[2]
        assert message not in call(*recording, *options)[2]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--model", "couzin"], "`--trajectories` must be given for recorded motion; got none."),
        (["--trajectories", TERMITES], "`--model` must be given for recorded motion; got none."),
        (
            ["--trajectories", TERMITES],
            "--model couzin. Give --fps, too. Give --pixels-per-cm, too: 1 for a file in cm.",
        ),
        (["--trajectories", TERMITES, "--model", "couzn"], "got 'couzn'. Did you mean `couzin`?"),
        (
            ["--trajectories", TERMITES, "--model", "couzin", "--pixels-per-cm", "20"],
            "`--fps` must be given; got none",
        ),
        (
            ["--trajectories", TERMITES, "--model", "couzin", "--fps", "25"],
            "`--pixels-per-cm` must be given; got none",
        ),
        (
            ["--trajectories", "none.txt", "--model", "couzin"],
            "must be a readable file; got none.txt (No such file or",
        ),
        (
            ["aggregation", "--fps", "25"],
            "`SCENARIO` must be left out for recorded motion; got 'aggregation'.",
        ),
        (
            [*without(RECORDED, "--window"), "--window", "1e9"],
            "`--window` must leave at least one window for learning; got 25000000000 steps",
        ),
        ([*RECORDED, "--format", "tidi"], "`--format` must be one of idtracker, "),
        (
            ["--trajectories", "pickle.npy", *RECORDED[2:]],
            "Opening it can run any code it holds. Let idtracker.ai write h5 or csv",
        ),
        (
            [*without(RECORDED, "--pixels-per-cm"), "--pixels-per-cm", "1e-12"],
            "`--pixels-per-cm` must be a finite number of at least 1e-09 and of at most 1e+09; got 1e-12.",
        ),
        (
            [*without(RECORDED, "--pixels-per-cm"), "--pixels-per-cm", "1e-7"],
            "`--pixels-per-cm` must leave coordinates within +-1e+09 cm",
        ),
        (
            [*without(RECORDED, "--fps"), "--fps", "1e12"],
            "`--fps` must be a finite number of at least 1e-09 and of at most 1e+09; got 1000000000000.0.",
        ),
        (
            [
                *RECORDED[:2],
                *RECORDED[6:8],
                "--pixels-per-cm",
                "1e-5",
                "--fps",
                "1e9",
                "--window",
                "2e-7",
            ],
            "must be finite and at most 1e+09 in size; got ",
        ),
        ([*RECORDED, "--y-axis", "left"], "`--y-axis` must be 'up' or 'down'; got 'left'."),
    ],
)
def test_what_does_not_fit_is_refused(call, arguments, message):
    np.save("pickle.npy", {"trajectories": np.zeros((3, 1, 2))}, allow_pickle=True)
    code, _, err = call("infer", *arguments, "--out", "run")
    assert code == 2
    assert message in err
    assert not Path("run").exists()


@pytest.mark.parametrize("told", [[], RECORDED], ids=["bare", "with options"])
def test_a_run_that_python_began_is_left_to_python(call, told):
    from turing_learning import infer, load_trajectories
    from turing_learning.families import BurstAndCoast

    windows = load_trajectories(TERMITES, fps=25, pixels_per_cm=20).windows(length_s=2.0)
    swim = BurstAndCoast(individuals=2, steps=50, interval_s=windows.interval_s, tank_cm=(12, 12))
    settings = {
        "models.population": 8,
        "classifiers.population": 8,
        "run.threads": 1,
        "run.history": "thin",
    }
    run = {
        "genuine": windows,
        "simulate": swim,
        "parameters": swim.parameters,
        "generations": 3,
        "settings": settings,
    }
    infer(**run, out="run", should_stop=lambda: True)
    before = Path("run/manifest.json").read_text()
    for command, there in (
        ("resume", "resume('run', genuine=..., simulate=...)"),
        ("check", "load_run('run').check(genuine=..., simulate=...)"),
    ):
        code, _, err = call(command, "run", *told)
        assert (code, err) == (
            2,
            "error: `run` must be on recorded motion, or have samples and a simulator that can be imported; got 'own-system', to "
            f"which Python gave them [run]. In Python call turing_learning.{there}.\n",
        )
    assert Path("run/manifest.json").read_text() == before
    infer(**run, out="done")
    assert call("resume", "done")[0] == 0


def test_a_run_knows_its_recording_and_says_where_it_was(call):
    motion = Path("fish.txt")
    motion.write_bytes(TERMITES.read_bytes())
    here = [str(motion) if word == str(TERMITES) else word for word in RECORDED]
    assert call("infer", *here, *SMALL, "--generations", "2", "--out", "run")[0] == 0
    stored = json.loads(Path("run/manifest.json").read_text())["recording"]
    assert stored["options"] == {
        "fps": 25.0, "scale": 20.0, "model": "burst-and-coast", "window": 2.0, "trajectories": [str(motion.absolute())]
    }  # fmt: skip
    quick = ["--samples", "10", "--points", "0", "--recoveries", "0"]
    assert (
        len(tl.load_run("run").plot.distributions(Figure().subplots(1, 2))) == 2
    )  # Python knows it, too
    motion.rename("moved.txt")
    with pytest.raises(ConfigurationError, match="not there any more"):
        tl.load_run("run").check()
    code, _, err = call("check", "run", *quick)
    where = f"got {motion.absolute()}, which is not there any more. Give its path with --trajectories.\n"
    assert (code, err) == (
        2,
        f"error: `--trajectories` must be the recording that the run began with; {where}",
    )
    assert call("check", "run", "--trajectories", "moved.txt", *quick)[0] == 0
    motion.write_text(Path("moved.txt").read_text() + "\n")
    assert "which has changed since. Give its path" in call("check", "run", *quick)[2]
    assert (
        "which has changed since. Give its path" not in call("resume", "run")[2]
    )  # is finished, and needs none


def test_of_one_individual_nothing_is_said_of_neighbors(call):
    steps = np.random.default_rng(0).normal(0.3, 0.2, (200, 2)).cumsum(axis=0)
    Path("one.csv").write_text(
        "frame,x,y\n" + "".join(f"{k},{x:.3f},{y:.3f}\n" for k, (x, y) in enumerate(steps))
    )
    options = [
        *without(given("one.csv", 10), "--model"),
        "--window",
        "1",
        "--trials",
        "20",
        "--model",
    ]
    remark = "there is one individual: what couzin says of neighbors cannot be inferred"
    assert remark in call("infer", *options, "couzin", "--out", "run")[1].splitlines()
    assert "one individual" not in call("infer", *options, "burst-and-coast", "--out", "other")[1]


def test_ranges_follow_from_the_recording_or_are_said(call):
    steps = np.cumsum(np.random.default_rng(1).normal(3, 0.5, (300, 3, 2)), axis=0)
    rows = [f"{t},{k},{x},{y}" for t, each in enumerate(steps) for k, (x, y) in enumerate(each)]
    Path("goats.csv").write_text("\n".join(["frame,id,x,y", *rows]) + "\n")
    goats = given("goats.csv", 10)
    code, out, _ = call("infer", *goats, *SMALL, "--generations", "1", "--out", "run")
    assert code == 0
    assert "range of speed by the recording: 0 to 1" in out
    code, out, _ = call(
        "infer", *goats, *SMALL, "--range", "speed=5:300", "--generations", "1", "--out", "said"
    )
    assert (code, "range of speed" in out) == (0, False)
    config = Path("said/config.toml").read_text()
    assert "high = 300.0" in config
    assert call("resume", "said")[0] == 0
    code, _, err = call("infer", *goats, "--range", "sped=1:2", "--out", "other")
    assert (code, "`--range` must name one of speed" in err) == (2, True)
