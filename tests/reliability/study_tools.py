"""What the tests of whole studies share: a small study, its command line, and how to wait."""

import io
import json
import os
import signal
import subprocess
import sys
import time
from contextlib import redirect_stderr, redirect_stdout
from types import SimpleNamespace

from turing_learning.cli import main

COMMAND = [sys.executable, "-m", "turing_learning"]
SETTINGS = {
    "models.population": 8,
    "classifiers.population": 8,
    "scenario.agents": 2,
    "scenario.trial.duration_s": 1.0,
    "run.checkpoint_every": 20,
}
SMALL = [part for key, value in SETTINGS.items() for part in ("--set", f"{key}={value}")]
TABLES = ("runs.csv", "summary.csv", "convergence.csv")


def begin(*arguments):
    """Start the command line."""
    command = [*COMMAND, *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def call(*arguments):
    """Run the command line to its end in this process, which has imported all that it needs."""
    out, err = io.StringIO(), io.StringIO()
    code = None
    with redirect_stdout(out), redirect_stderr(err):
        try:
            main([str(argument) for argument in arguments])
        except SystemExit as ended:
            code = ended.code
    return SimpleNamespace(returncode=code, stdout=out.getvalue(), stderr=err.getvalue())


def wait_until(holds, what, process=None, seconds=90):
    """Wait until `holds` returns something true, and return it."""
    deadline = time.monotonic() + seconds
    while not (found := holds()):
        assert process is None or process.poll() is None, process.communicate()
        assert time.monotonic() < deadline, f"{what}: not after {seconds} s"
        time.sleep(0.02)
    return found


def tables(folder):
    """Return the bytes of all tables."""
    return {name: (folder / name).read_bytes() for name in TABLES}


def going(folder):
    """Return run -> process id of the runs that have been saved and are not finished."""
    found = {}
    for run in sorted(folder.glob("runs/*")):
        manifest = run / "manifest.json"
        if list(run.glob("checkpoints/*.npz")) and manifest.exists():
            content = json.loads(manifest.read_text())
            if content["state"] == "running":
                found[run.name] = content["process"]["pid"]
    return found


def kill_in_mid_run(folder, is_victim):
    """Kill a worker that is in the middle of a run; return the run, or None if no worker is just now."""
    for pid in filter(is_victim, going(folder).values()):
        os.kill(pid, signal.SIGSTOP)  # so that the run cannot end between the look and the kill
        for run, other in going(folder).items():
            if other == pid and not (folder / "runs" / run / "result.json").exists():
                os.kill(pid, signal.SIGKILL)
                return run, pid
        os.kill(pid, signal.SIGCONT)
    return None


def executed_by(folder, run):
    """Return the id of the process that worked on a run last."""
    return json.loads((folder / "runs" / run / "manifest.json").read_text())["process"]["pid"]
