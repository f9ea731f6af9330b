"""Ctrl-C, SIGTERM, a full disk and two processes, through the command line."""

import json
import os
import shutil
import signal
import subprocess

import pytest
import study_tools
from study_tools import COMMAND, call, wait_until

import turing_learning as tl
from turing_learning.runs import TIMINGS

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals and limits")

SETTINGS = study_tools.SETTINGS | {"run.threads": 1}
SMALL = [*study_tools.SMALL, "--set", "run.threads=1"]


def begin(folder, generations):
    return study_tools.begin(
        "infer", "aggregation", *SMALL, "--generations", generations, "--out", folder
    )


def wait_for_checkpoint(folder, process):
    wait_until(lambda: list(folder.glob("checkpoints/generation-*.npz")), "a checkpoint", process)


def untimed(content):
    return {name: value for name, value in content.items() if name not in TIMINGS}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_after_the_present_generation_and_says_how_to_go_on(number, tmp_path):
    folder = tmp_path / "run"
    process = begin(folder, 1_000_000)
    wait_for_checkpoint(folder, process)
    process.send_signal(number)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    result = json.loads((folder / "result.json").read_text())
    assert (
        err
        == f"stopped after {result['generations']} generations; resume with: turing-learning resume {folder}\n"
    )
    assert not result["complete"]
    assert json.loads((folder / "manifest.json").read_text())["state"] == "stopped"


def test_a_second_process_is_refused_and_the_lock_dies_with_the_first(tmp_path):
    folder = tmp_path / "run"
    process = begin(folder, 1_000_000)
    wait_for_checkpoint(folder, process)
    for arguments in (
        ["resume", folder],
        ["infer", "aggregation", *SMALL, "--generations", 5, "--out", folder, "--force"],
    ):
        done = call(*arguments)
        assert done.returncode == 2
        assert done.stderr.startswith(
            f"error: `run` must not be in use; got {folder}, to which process {process.pid} on "
        )
    process.kill()
    process.communicate()
    thin = ("--set", "run.history=thin")
    done = call(
        "infer", "aggregation", *SMALL, *thin, "--generations", 5, "--out", folder, "--force"
    )
    assert done.returncode == 0, done.stderr
    assert json.loads((folder / "result.json").read_text())["generations"] == 5


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash for its ulimit")
def test_a_disk_that_is_full_ends_with_code_1_and_a_run_that_can_be_resumed(tmp_path):
    folder, whole = (
        tmp_path / "run",
        tl.infer("aggregation", generations=45, settings=SETTINGS).to_json(),
    )
    arguments = ["infer", "aggregation", *SMALL, "--generations", "45", "--out", str(folder)]
    limited = ["bash", "-c", 'ulimit -f 12; exec "$@"', "bash", *COMMAND, *arguments]
    done = subprocess.run(limited, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith(
        f"error: `out` must be a folder with space left; could not write to {folder} ("
    )
    assert done.stderr.endswith(f"Make room, then resume with `turing-learning resume {folder}`.\n")
    assert done.stderr.count("\n") == 1
    done = call("resume", folder)
    assert done.returncode == 0, done.stderr
    assert untimed(json.loads((folder / "result.json").read_text())) == untimed(whole)
