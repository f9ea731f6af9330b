"""What a worker does: one run of a study, begun or gone on with."""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ._folder import FAILURE, StudyFolder

COMPLETE, STOPPED, FAILED, WAITING = "complete", "stopped", "failed", "waiting"
LOOK_EVERY_S = 0.2  # between two looks for the file that asks workers to stop
LONGEST_WAIT_S = 30.0  # for the lock of a run whose worker was given up for lost, but lives


@dataclass(frozen=True)
class Task:
    """One run to execute; plain texts and numbers, so that it can travel.

    Parameters
    ----------
    study
        The study folder, at the same place for all workers.
    number
        Number of the run.
    stop
        A file: when it is there, the run stops after the present generation.
    """

    study: str
    number: int
    stop: str = ""


@dataclass(frozen=True)
class Outcome:
    """How it went.

    Parameters
    ----------
    number
        Number of the run.
    state
        "complete", "stopped" (it can go on), "failed", or "waiting" (it has not been begun).
    reason
        Why it failed.
    """

    number: int
    state: str
    reason: str = ""


def execute(task: Task, should_stop: Callable[[], bool] | None = None) -> Outcome:
    """Execute one run of a study in this process; what goes wrong is kept in the run's folder.

    Parameters
    ----------
    task
        Which.
    should_stop
        Called after every generation, beside the look for the task's file.
    """
    asked = _StopFile(task.stop, should_stop)
    if asked():
        return Outcome(task.number, WAITING)
    folder = StudyFolder(Path(task.study)).run_path(task.number)
    try:
        complete = _run(task, folder, asked)
    except Exception as error:
        return Outcome(task.number, FAILED, note_failure(folder, error))
    return Outcome(task.number, COMPLETE if complete else STOPPED)


def _run(task: Task, folder: Path, should_stop: Callable[[], bool]) -> bool:
    from turing_learning.runs import RunFolder, RunFolderError, resume, start

    configuration = StudyFolder(Path(task.study)).plan().configuration(task.number)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / FAILURE).unlink(missing_ok=True)
    run = RunFolder(folder)
    _await_lock(run)
    if not run.is_run():
        return start(configuration, folder, should_stop=should_stop).complete
    if run.configuration() != configuration:
        raise RunFolderError(f"`run` must be that of the study; got {folder} with another configuration. Remove it.")
    return resume(folder, should_stop=should_stop).complete


def _await_lock(run: object) -> None:
    from turing_learning.runs import RunFolder, RunFolderError

    assert isinstance(run, RunFolder)
    deadline = time.monotonic() + LONGEST_WAIT_S
    while True:
        try:
            with run.locked():
                return
        except RunFolderError:
            if time.monotonic() > deadline:
                raise
        time.sleep(LOOK_EVERY_S)


def note_failure(folder: Path, error: BaseException) -> str:
    """Write into a run's folder why it failed, and return it."""
    from turing_learning.runs import write_json

    reason = f"{type(error).__name__}: {' '.join(str(error).split())}".rstrip(": ")
    with contextlib.suppress(OSError):  # the disk may be the reason
        folder.mkdir(parents=True, exist_ok=True)
        write_json(folder / FAILURE, {"kind": type(error).__name__, "reason": reason})
    return reason


class _StopFile:
    """Whether somebody has asked for a stop; looks at the disk a few times a second at most."""

    def __init__(self, path: str, further: Callable[[], bool] | None) -> None:
        self._path = Path(path) if path else None
        self._further = further
        self._next = 0.0
        self._asked = False

    def __call__(self) -> bool:
        if not self._asked and self._further is not None:
            self._asked = self._further()
        if not self._asked and self._path is not None and time.monotonic() >= self._next:
            self._next = time.monotonic() + LOOK_EVERY_S
            self._asked = self._path.exists()
        return self._asked
