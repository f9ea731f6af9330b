"""Runs with a simulator of one's own: killed with their workers, resumed, and left by nobody."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from own_run import genuine, simulate, start

import turing_learning as tl
from turing_learning.runs import TIMINGS, stored_generations

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs SIGKILL")


def untimed(folder):
    content = json.loads((folder / "result.json").read_text())
    return {name: value for name, value in content.items() if name not in TIMINGS}


def until(condition, seconds=30):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.02)
    assert condition()


def alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="looks at /proc")
def test_a_killed_run_leaves_no_worker_behind_and_ends_with_the_bits_of_one_that_never_was(
    tmp_path,
):
    run, pids = tmp_path / "run", tmp_path / "pids"
    pids.mkdir()
    script = Path(__file__).with_name("own_run.py")
    process = subprocess.Popen(
        [sys.executable, str(script), str(run), str(pids)], stderr=subprocess.DEVNULL
    )
    try:
        until(lambda: stored_generations(run / "checkpoints") >= 5)
    finally:
        process.kill()
        process.wait()
    workers = [int(path.name) for path in pids.iterdir()]
    assert len(workers) == 2
    until(lambda: not any(alive(pid) for pid in workers))
    assert stored_generations(run / "checkpoints") < 300
    tl.resume(run, genuine=genuine(), simulate=simulate)
    start(tmp_path / "whole")
    assert untimed(run) == untimed(tmp_path / "whole")
