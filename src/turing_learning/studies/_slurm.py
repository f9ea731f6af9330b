"""A job script for Slurm: an array with one job for each run, and a step that collects."""

import os
import shlex
import sys
from pathlib import Path

from turing_learning._files import in_home, write_atomically
from turing_learning.config import ConfigurationError
from turing_learning.errors import require
from turing_learning.store import told

MINUTES = 60  # asked for each run; the script says where to change it

SCRIPT = """#!/bin/bash
# Study {study}: {runs} runs.
# Submit:
#   {submit}
#SBATCH --job-name=turing-learning
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --mem=1G
#SBATCH --time={minutes}
#SBATCH --output={log}
#SBATCH --signal=B:TERM@60
#SBATCH --requeue
# A run that is stopped or killed goes on from its checkpoint when it is submitted again.
set -eu
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1
if [ -n "${{SLURM_ARRAY_TASK_ID:-}}" ]; then
    exec {command} study-run {study} "$SLURM_ARRAY_TASK_ID"
fi
exec {command} study-collect {study}
"""


def write_slurm(script: str | Path, study: str | Path, runs: int, *, force: bool = False) -> str:
    """Write a job script for a study and return the line that submits it.

    With ``SLURM_ARRAY_TASK_ID`` the script executes the run of that number, without it the step that makes the table.

    Parameters
    ----------
    script
        The file to write.
    study
        The study folder, on a disk that all nodes share.
    runs
        Number of runs.
    force
        Whether a file that exists is replaced.

    Returns
    -------
    str
        A shell command: the array, and after its end the collecting step.

    Raises
    ------
    ConfigurationError
        If the file exists or cannot be written.
    """
    path, folder = Path(script).absolute(), in_home(study).absolute()
    refuse_script(path, force=force)
    _require_plain("study", folder)
    submit = submission(path, runs)
    text = SCRIPT.format(
        study=shlex.quote(str(folder)),
        runs=runs,
        submit=submit,
        minutes=MINUTES,
        log=str(folder / "slurm-%A-%a.log").replace(" ", "\\ "),
        command=f"{shlex.quote(sys.executable)} -m turing_learning",
    )
    what = f"`write-slurm` must be a file that can be written; got {path}"
    with told(ConfigurationError, what, "Choose another place."):
        write_atomically(path, text.encode())
        path.chmod(0o755)
    return submit


def refuse_script(path: Path, *, force: bool) -> None:
    """Raise ConfigurationError unless a job script may be written to a path."""
    name = "write-slurm"
    _require_plain(name, path)
    there = path.parent.is_dir() and not path.is_dir()
    require(there, name, "be a file in a folder that exists", str(path), error=ConfigurationError)
    require(os.access(path.parent, os.W_OK), name, "be a file that can be written", str(path), "Choose another place.",
            error=ConfigurationError)  # fmt: skip
    require(force or not path.exists(), name, "be a file that does not exist", str(path),
            "Choose another name, or replace it with --force.", error=ConfigurationError)  # fmt: skip


def _require_plain(name: str, path: Path) -> None:
    """Reject a path with control characters: in a script the rest of a line would be executed."""
    require(str(path).isprintable(), name, "have a path without control characters", ascii(str(path)),
            "Choose another place.", error=ConfigurationError)  # fmt: skip


def submission(script: Path, runs: int) -> str:
    """Return the shell command that submits the array and, when it has ended, the collecting step."""
    quoted = shlex.quote(str(script))
    return f"job=$(sbatch --parsable --array=1-{runs} {quoted}) && sbatch --dependency=afterany:${{job%%;*}} {quoted}"
