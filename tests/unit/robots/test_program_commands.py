"""The commands `robots check`, `robots run` and `robots track`, and `resume` for a run in a laboratory."""

import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from program_laboratory import ARENA, CALIBRATION, FILE, HOMES, LABELS, ScriptedLaboratory

from turing_learning.config import ConfigurationError
from turing_learning.robots import EmulatedCamera, Optics, TriangleMarkers, rehearse
from turing_learning.runs import load_run, resume_laboratory, start_laboratory
from turing_learning.trajectories import load_trajectories

PAGE = (Path(__file__).parents[3] / "docs" / "robots" / "laboratory.md").read_text(encoding="utf-8")
(PRINTED,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)

BRIEF = [
    "--set",
    "models.population=4",
    "--set",
    "classifiers.population=4",
    "--set",
    "scenario.trial.duration_s=0.5",
]


@pytest.fixture
def laboratory(tmp_path):
    CALIBRATION.save(tmp_path / "camera.json")
    (tmp_path / "lab.toml").write_text(FILE)
    return tmp_path


@pytest.fixture
def doors(monkeypatch):
    """Let the commands find a scripted laboratory where they look for the real one."""
    lab = ScriptedLaboratory(noise=2.0)
    monkeypatch.setattr("turing_learning.robots.real_equipment", lambda laboratory: lab.equipment())
    return lab


def test_check_says_what_is_good(laboratory, doors, call):
    code, out, _ = call("robots", "check")
    assert code == 0
    assert out.count("good") >= 5
    assert "BAD" not in out


def test_check_leaves_a_picture_with_the_markers_that_were_found(laboratory, doors, call):
    assert "good  picture: seen.png" in call("robots", "check", "--picture", "seen.png")[1]
    assert cv2.imread(str(laboratory / "seen.png")).shape == (384, 448, 3)
    code, _, err = call("robots", "check", "--picture", "none/seen.png")
    assert code == 2
    assert "must be a .png or .jpg file in a folder that exists; got none/seen.png" in err


def test_check_says_what_is_bad_and_refuses(laboratory, doors, call):
    doors.wires["r-orange"].cut = True
    code, out, _ = call("robots", "check", "--config", "lab.toml")
    assert code == 2
    assert "BAD   replica r1: " in out
    assert "good  markers: all 4 in sight" in out


def test_run_and_resume_leave_a_complete_run(laboratory, doors, call, monkeypatch):
    answers = iter([False, True])
    monkeypatch.setattr(
        "turing_learning.cli._stopping.StopRequest.__call__", lambda self: next(answers, False)
    )
    code, out, err = call(
        "robots",
        "run",
        "--generations",
        "3",
        "--out",
        "run",
        "--set",
        "scenario.trial.duration_s=0.5",
    )
    assert code == 130
    assert "stopped after 2 generations; resume with: turing-learning resume run" in err
    assert "generation 2/3" in out
    code, _, err = call("resume", "run", "--fps", "25")
    assert code == 2
    assert err.startswith(
        "error: `--fps` must be left out for a run in a laboratory, which needs nothing but its folder;"
    )
    code, out, _ = call("resume", "run")
    assert code == 0
    assert "estimate" in out


def test_a_run_with_a_budget_in_trials_is_stopped_resumed_and_extended(
    laboratory, doors, call, monkeypatch
):
    answers = iter([False, True])
    monkeypatch.setattr(
        "turing_learning.cli._stopping.StopRequest.__call__", lambda self: next(answers, False)
    )
    short = ("--out", "run", "--set", "scenario.trial.duration_s=0.5")
    code, _, err = call("robots", "run", "--trials", "20", "--generations", "3", *short)
    assert (code, "`--trials` must be given without --generations; got 20 beside 3" in err) == (
        2,
        True,
    )
    code, out, err = call("robots", "run", "--trials", "20", *short)
    assert code == 130
    assert re.search(r"stopped after \d+ trials; resume with: turing-learning resume run", err)
    assert re.search(r"trial \d+/20  \d+ s each batch", out)
    assert call("resume", "run")[0] == 0
    code, out, _ = call("resume", "run", "--trials", "22")
    assert code == 0
    assert "trial 22/22" in out
    assert "trial 20/22" not in out
    assert load_run("run").trials == 22
    assert (
        "`trials` must be more than the 22 that the run has spent"
        in call("resume", "run", "--trials", "22")[2]
    )


def test_a_rehearsal_that_was_stopped_is_gone_on_with_as_a_rehearsal(laboratory, call, monkeypatch):
    answers = iter([False, True])
    monkeypatch.setattr(
        "turing_learning.cli._stopping.StopRequest.__call__", lambda self: next(answers, False)
    )
    code, _, err = call(
        "robots",
        "run",
        "--emulated",
        "--generations",
        "3",
        "--out",
        "run",
        "--set",
        "scenario.trial.duration_s=0.5",
    )
    assert code == 130
    command = err.strip().partition("resume with: turing-learning ")[2].split()
    assert command == ["resume", "run"]
    with pytest.raises(
        ConfigurationError,
        match="`equipment` must be given for a rehearsal, which must not meet real robots",
    ):
        resume_laboratory("run")
    monkeypatch.setattr(
        "turing_learning.robots.real_equipment", lambda laboratory: pytest.fail("real robots")
    )
    assert call(*command)[0] == 0


@pytest.fixture
def evaluated(laboratory):
    """A laboratory whose last models are observed again, twice."""
    (laboratory / "lab.toml").write_text(FILE.replace("repeats = 0", "repeats = 2"))
    return laboratory


def test_a_finished_run_is_resumed_without_robots(evaluated, doors, call):
    given = ("robots", "run", "--generations", "1", "--out", "run", *BRIEF)
    assert call(*given)[0] == 0
    doors.wires["r-orange"].cut = True
    code, out, _ = call("resume", "run")
    assert code == 0
    assert "BAD" not in out
    assert "the last models, observed again 2 times; the best: " in out
    assert call(*given, "--force")[0] == 2  # begins anew, and needs them


def test_a_run_stopped_while_its_last_models_are_observed_again_says_so_and_goes_on(
    evaluated, call, monkeypatch
):
    answers = iter([False, False, True])
    monkeypatch.setattr(
        "turing_learning.cli._stopping.StopRequest.__call__", lambda self: next(answers, False)
    )
    code, out, err = call(
        "robots", "run", "--emulated", "--generations", "1", "--out", "run", *BRIEF
    )
    assert code == 130
    assert "the last models have been observed again 1 of 2 times" in out
    assert (
        "stopped before the last models had been observed again; resume with: turing-learning resume run"
        in err
    )
    code, out, _ = call("resume", "run")
    assert code == 0
    assert "last models observed again, 1/2" not in out
    assert "last models observed again, 2/2\n" in out
    best = re.compile(
        r"the last models, observed again 2 times; the best: vl0 \S+ vr0 .*; absolute errors: vl0 \d"
    )
    assert best.search(out)
    assert best.search(call("show", "run")[1])
    stored = evaluated / "run" / "laboratory.json"
    stored.write_text(stored.read_text().replace('"emulated": true', '"emulated": false'))
    code, _, err = call("robots", "run", "--resume", "run", "--emulated", "--trust")
    assert code == 2
    assert (
        err
        == "error: `--emulated` must be left out for a run with real robots; got it [run]. Rehearse in another folder.\n"
    )


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (["--config", "nothing.toml"], "a file"),
        (["--force"], "--force"),
        (["--seed", "2", "--out", "other"], "settings and a folder"),
    ],
)
def test_what_a_run_has_is_refused_where_it_is_gone_on_with(laboratory, doors, call, given, told):
    assert call("robots", "run", "--generations", "1", "--out", "run", *BRIEF)[0] == 0
    code, _, err = call("robots", "run", "--resume", "run", *given)
    assert code == 2
    assert err == (
        "error: `resume` must be given without a file, settings or a folder, which the run has, and without --force; got "
        f"{told}. Its laboratory may be edited in run/laboratory.json; then add --trust.\n"
    )


def test_robots_that_a_stored_run_does_not_find_are_said_to_be_in_its_folder(
    evaluated, doors, call, monkeypatch
):
    answers = iter([True])
    monkeypatch.setattr(
        "turing_learning.cli._stopping.StopRequest.__call__", lambda self: next(answers, False)
    )
    assert call("robots", "run", "--generations", "2", "--out", "run", *BRIEF)[0] == 130
    doors.wires["r-orange"].cut = True
    code, out, err = call("robots", "run", "--resume", "run")
    assert code == 2
    assert "BAD   replica r1: " in out
    assert err == (
        "The addresses of replicas and camera are those in run/laboratory.json. Edit them there, and resume with --trust.\n"
    )
    assert "laboratory.json" not in call("robots", "check")[2]


def test_what_is_no_run_in_a_laboratory_is_not_gone_on_with(laboratory, call):
    code, _, err = call("robots", "run", "--resume", "nothing")
    assert code == 2
    assert err.startswith(
        "error: `run` must be a run folder; got nothing without a readable manifest.json."
    )
    small = [
        "--set",
        "models.population=4",
        "--set",
        "classifiers.population=4",
        "--set",
        "scenario.agents=2",
    ]
    short = ["--set", "scenario.trial.duration_s=0.5", "--threads", "1", "--generations", "1"]
    assert call("infer", "aggregation", *small, *short, "--out", "other")[0] == 0
    code, _, err = call("robots", "run", "--resume", "other")
    assert code == 2
    assert err == (
        "error: `run` must take place in a laboratory; got other without laboratory.json. Go on with "
        "`turing-learning resume other` if it is a run of another kind.\n"
    )


def test_a_rehearsal_needs_neither_a_calibration_nor_landmarks(tmp_path, call):
    (tmp_path / "lab.toml").write_text(PRINTED.replace("repeats = 5", "repeats = 0"))
    code, out, err = call("robots", "check", "--emulated")
    assert (code, "BAD" in out) == (0, False)
    assert err.startswith("rehearsal with a calibration of its own, as there is none yet: ")
    assert call("robots", "run", "--emulated", "--generations", "1", "--out", "run", *BRIEF)[0] == 0
    assert (tmp_path / "run" / "camera.json").exists()


def test_the_python_of_the_page_runs_as_it_stands(laboratory, monkeypatch):
    """With emulated robots, and 20 trials instead of 300."""
    (block,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    (laboratory / "lab.toml").write_text(f"{FILE}trials = 20\n")
    monkeypatch.chdir(laboratory)

    def rehearsed(given, out):
        return start_laboratory(given, out, equipment=rehearse(given))

    monkeypatch.setattr("turing_learning.runs.start_laboratory", rehearsed)
    names = {}
    exec(block, names)  # noqa: S102 - our own page
    assert names["result"].trials == 20
    assert load_run("runs/first").complete


def test_a_calibration_that_is_there_is_that_of_the_rehearsal(laboratory, call):
    (laboratory / "camera.json").write_text("{}")
    code, _, err = call("robots", "check", "--emulated")
    assert code == 2
    assert err.startswith(
        "error: `calibration` must be a turing-learning camera calibration of version 1; got something else ["
    )


def test_without_a_calibration_nothing_real_is_looked_at(laboratory, call):
    (laboratory / "camera.json").unlink()
    for command in (["check"], ["run"]):
        code, _, err = call("robots", *command)
        assert code == 2
        assert err.startswith("error: `camera.calibration` must be a readable file; got ")
        assert err.endswith(
            "camera.json (No such file or directory). Calibrate the camera first.\n"
        )


def test_a_table_that_cannot_be_written_is_refused_in_one_line(laboratory, call):
    _film(laboratory / "trial.avi", covered=False)
    code, _, err = call("robots", "track", "trial.avi", "--out", "none/trial.csv")
    assert code == 2
    assert err.startswith(
        "error: `out` must be a file that can be written; got none/trial.csv (No such file or dir"
    )


def test_nothing_runs_in_a_laboratory_that_is_not_in_order(laboratory, doors, call):
    doors.dead_camera = True
    code, out, _ = call("robots", "run", "--out", "run")
    assert code == 2
    assert "BAD   camera" in out
    assert not (laboratory / "run").exists()
    assert doors.asked == []


def test_a_file_that_is_wrong_is_refused_in_one_line(laboratory, call):
    (laboratory / "lab.toml").write_text(FILE.replace("[camera]", "[camra]"))
    code, _, err = call("robots", "run")
    assert code == 2
    assert "Did you mean `camera`?" in err
    assert err.count("\n") == 1


def _film(path, covered):
    render = EmulatedCamera(
        CALIBRATION,
        TriangleMarkers(),
        LABELS,
        arena_cm=ARENA,
        wall_cm=5.0,
        optics=Optics(noise=2.0),
    )
    writer = cv2.VideoWriter(
        str(path), cv2.VideoWriter_fourcc(*"MJPG"), 10, CALIBRATION.lens.image_size
    )
    writer.set(cv2.VIDEOWRITER_PROP_QUALITY, 100)
    for frame in range(6):
        poses = HOMES + np.array([0.3 * frame, 0.0, 0.05 * frame])
        writer.write(render.render(poses, (2,) if frame == 4 and covered else ()))
    writer.release()


def test_track_writes_a_table_that_trajectories_reads(laboratory, call):
    _film(laboratory / "trial.avi", covered=False)
    code, out, err = call("robots", "track", "trial.avi")
    assert code == 0, err
    assert "6 images, 4 robots, seen in 100.00 %: trial.csv" in out
    recording = load_trajectories(laboratory / "trial.csv", fps=10, pixels_per_cm=1, y_axis="up")
    assert recording.positions.shape == (6, 4, 2)
    homes = HOMES[[0, 1, 2, 3], :2]
    np.testing.assert_allclose(recording.positions[0], homes, atol=0.2)
    np.testing.assert_allclose(recording.headings[5], HOMES[:, 2] + 0.25, atol=0.1)


def test_track_lists_what_went_wrong_and_replaces_nothing(laboratory, call):
    _film(laboratory / "trial.avi", covered=True)
    code, out, _ = call("robots", "track", "trial.avi", "--out", "table.csv")
    assert code == 0
    assert "image 4: marker missing: individual 2 (orange) is out of sight" in out
    assert "seen in 95.83 %" in out
    code, _, err = call("robots", "track", "trial.avi", "--out", "table.csv")
    assert code == 2
    assert "`out` must be a new file; got table.csv" in err


def test_track_refuses_a_video_of_another_frame_rate(laboratory, call):
    _film(laboratory / "trial.avi", covered=False)
    slow = FILE.replace("[camera]", "[camera]\nfps = 5.0")
    (laboratory / "slow.toml").write_text(slow)
    code, _, err = call("robots", "track", "trial.avi", "--config", "slow.toml")
    assert code == 2
    assert "`camera.fps` must be the frame rate of the video, 10; got 5." in err


def test_track_refuses_what_is_no_video(laboratory, call):
    code, _, err = call("robots", "track", "none.avi")
    assert code == 2
    assert "must be a camera's number, a video file or a URL; got 'none.avi'" in err


MISSING = {"cv2": ("OpenCV", "vision"), "serial": ("pyserial", "robot")}


@pytest.mark.parametrize(
    ("hidden", "command"),
    [
        ("cv2", "arena --out new"),
        ("cv2", "robots check"),
        ("cv2", "robots run --emulated --out new"),
        ("cv2", "robots track trial.avi"),
        ("serial", "robots check"),
        ("serial", "robots run --out new"),
    ],
)
def test_a_library_that_is_not_installed_is_named_in_one_line(
    hidden, command, laboratory, call, monkeypatch
):
    monkeypatch.setitem(sys.modules, hidden, None)
    (laboratory / "trial.avi").touch()
    code, out, err = call(*command.split())
    name, extra = MISSING[hidden]
    told = f"error: {name} must be installed; got no such module. Run: pip install 'turing-learning[{extra}]'"
    assert (code, err.splitlines()) == (2, [told])
    assert out == ""  # nothing is prepared, or compiled, before
    assert not (laboratory / "new").exists()


def test_an_extra_is_named_before_a_calibration_that_is_missing(laboratory, call, monkeypatch):
    (laboratory / "camera.json").unlink()
    monkeypatch.setitem(sys.modules, "cv2", None)
    for command in ("robots check", "robots run --out new", "robots track trial.avi"):
        assert call(*command.split())[2].startswith("error: OpenCV must be installed;")


def test_after_a_plain_installation_the_commands_need_no_extra_before_they_name_it(laboratory):
    hide = "".join(f"sys.modules[{name!r}] = None; " for name in MISSING)
    program = f"import sys; {hide}from turing_learning.cli import main; main(['robots', 'check'])"
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=laboratory, capture_output=True, text=True, check=False
    )
    both = "error: OpenCV and pyserial must be installed; got no such modules. Run: pip install 'turing-learning[vision,robot]'"
    assert (done.returncode, done.stderr.splitlines()[-1]) == (2, both)
    assert "Traceback" not in done.stderr
