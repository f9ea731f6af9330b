import json
import os
import signal
from pathlib import Path

import pytest

pytestmark = pytest.mark.usefixtures("wide")

TERMITES = Path(__file__).parents[2] / "reference/data/tracktor/termite_video_idtracked.txt"
RECORDED = [
    "--trajectories",
    str(TERMITES),
    "--fps",
    "25",
    "--scale",
    "20",
    "--model",
    "burst-and-coast",
    "--window",
    "2",
]
OTHER_MODEL = ["boids" if word == "burst-and-coast" else word for word in RECORDED]
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


def test_a_table_of_ones_own_says_where_y_points(call):
    rows = [f"{t},{who},{(0.1 + 0.1 * who) * t},{0.01 * t * t}" for t in range(200) for who in range(3)]
    Path("own.csv").write_text("\n".join(["frame,id,x,y", *rows]) + "\n")
    table = ["--trajectories", "own.csv", "--fps", "10", "--scale", "1", "--model", "burst-and-coast", "--window", "2"]
    code, _, err = call("infer", *table, "--out", "run")
    assert code == 2
    assert "`--y-axis` must be given; got none" in err
    code, _, err = call("infer", *table, "--y-axis", "up", *SMALL, "--generations", "1", "--out", "run")
    assert (code, err) == (0, "")
    code, _, err = call("detect", "run", "own.csv", "--fps", "10", "--scale", "1")
    assert code == 2
    assert "`--y-axis` must be given; got none" in err


def test_a_stopped_run_is_resumed_with_the_options_that_the_message_names(call, monkeypatch):
    whole, _, _ = call("infer", *RECORDED, *SMALL, "--generations", "4", "--out", "whole")
    assert whole == 0
    import turing_learning.cli._live as live

    def interrupt(self, progress):
        if progress.completed == 2:
            os.kill(os.getpid(), signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(live.LineView, "__call__", interrupt)
        code, _, err = call("infer", *RECORDED, *SMALL, "--generations", "4", "--out", "run")
    assert code == 130
    command = err.strip().partition("go on with: turing-learning ")[2].split()
    assert command[:2] == ["resume", "run"]
    code, _, err = call("resume", "run", *OTHER_MODEL)
    assert code == 2
    assert "`simulate` must have the parameters of the run, speed, " in err
    assert call(*command)[0] == 0
    first, second = (json.loads(Path(name, "result.json").read_text()) for name in ("whole", "run"))
    assert first["estimate"] == second["estimate"]


def test_another_family_than_that_of_the_run_is_not_checked(call):
    assert call("infer", *RECORDED, *SMALL, "--generations", "2", "--out", "run")[0] == 0
    code, _, err = call("check", "run", *OTHER_MODEL)
    assert code == 2
    assert "`simulate` must have the parameters of the run, speed, " in err
    assert not Path("run", "check").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--model", "couzin"], "`--trajectories` must be given for recorded motion; got none."),
        (["--trajectories", TERMITES], "`--model` must be given for recorded motion; got none."),
        (["--trajectories", TERMITES, "--model", "couzn"], "got 'couzn'. Did you mean `couzin`?"),
        (["--trajectories", TERMITES, "--model", "couzin", "--scale", "20"], "`--fps` must be given; got none"),
        (["--trajectories", TERMITES, "--model", "couzin", "--fps", "25"], "`--scale` must be given; got none"),
        (["--trajectories", "none.txt", "--model", "couzin"], "must be a readable file; got none.txt (No such file or"),
        (["aggregation", "--fps", "25"], "`SCENARIO` must be left out for recorded motion; got 'aggregation'."),
        ([*RECORDED, "--window", "1e9"], "must"),
        ([*RECORDED, "--y-axis", "left"], "`--y-axis` must be 'up' or 'down'; got 'left'."),
    ],
)
def test_what_does_not_fit_is_refused(call, arguments, message):
    code, _, err = call("infer", *arguments, "--out", "run")
    assert code == 2
    assert message in err
    assert not Path("run").exists()
