"""Kill runs at random moments, resume them, and compare with a run that was never killed."""

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import xarray as xr

from turing_learning.runs import TIMINGS

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork and SIGKILL")

KILLS, KILLS_PER_RUN = 12, 6


class KillingGround:
    def __init__(self):
        script = Path(__file__).with_name("killing_ground.py")
        self._process = subprocess.Popen(
            [sys.executable, str(script)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._answer() == "ready"

    def _answer(self):
        return self._process.stdout.readline().strip()

    def call(self, verb, folder, kill_after=None):
        """Run in a child, kill it after some seconds; return whether it came to its end, and how long it took."""
        self._process.stdin.write(f"{verb} {folder}\n")
        self._process.stdin.flush()
        child, begun = int(self._answer()), time.monotonic()
        killer = (
            threading.Timer(kill_after, os.kill, (child, signal.SIGKILL))
            if kill_after is not None
            else None
        )
        if killer:
            killer.start()
        status = int(self._answer())
        if killer:
            killer.cancel()
        assert status in (0, signal.SIGKILL), status
        return status == 0, time.monotonic() - begun

    def close(self):
        self._process.stdin.close()
        self._process.wait(timeout=10)
        self._process.stdout.close()


@pytest.fixture(scope="module")
def ground():
    ground = KillingGround()
    yield ground
    ground.close()


def untimed(folder):
    content = json.loads((folder / "result.json").read_text())
    return {name: value for name, value in content.items() if name not in TIMINGS}


def test_a_run_that_is_killed_at_random_moments_ends_with_the_bits_of_one_that_never_was(
    ground, tmp_path
):
    finished, duration = ground.call("start", tmp_path / "whole")
    assert finished
    expected = xr.open_zarr(tmp_path / "whole" / "history.zarr").load()
    figures = {path.name for path in (tmp_path / "whole" / "figures").iterdir()}
    moments, kills = random.Random(20160829), 0
    for number in range(KILLS):
        folder, own = tmp_path / f"{number}", 0
        while own < KILLS_PER_RUN:
            verb = "resume" if (folder / "manifest.json").exists() else "start"
            ended, _ = ground.call(verb, folder, kill_after=moments.uniform(0, 0.5 * duration))
            if ended:
                duration *= 0.8  # the moments were late, as the first run was slow
                break
            own += 1
        else:
            ground.call("resume" if (folder / "manifest.json").exists() else "start", folder)
        assert untimed(folder) == untimed(tmp_path / "whole")
        xr.testing.assert_identical(xr.open_zarr(folder / "history.zarr").load(), expected)
        assert json.loads((folder / "manifest.json").read_text())["state"] == "finished"
        assert {path.name for path in (folder / "figures").iterdir()} == figures
        assert not list(folder.rglob("*.partial"))
        kills += own
        if kills >= KILLS:
            return
    raise AssertionError(f"most runs had ended: {kills} kills")
