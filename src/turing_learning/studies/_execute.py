"""What a worker does: one run of a study, begun or resumed."""

import contextlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from turing_learning.workers import asked_to_stop

from ._folder import FAILURE, SAMPLES, StudyFolder

if TYPE_CHECKING:
    from turing_learning.config import Configuration
    from turing_learning.results import Result

    from ._plan import Plan

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
    """Execute one run of a study in this process; what goes wrong is written into the run's folder.

    Parameters
    ----------
    task
        Which.
    should_stop
        Called after every generation, beside the look for the task's file.
    """
    from turing_learning.results import RunFolder, RunFolderError
    from turing_learning.runs import resume

    asked = _StopFile(task.stop, should_stop)
    if asked():
        return Outcome(task.number, WAITING)
    study = StudyFolder(task.study)
    folder = study.run_path(task.number)
    try:
        plan = study.plan()
        configuration = plan.configuration(task.number)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / FAILURE).unlink(missing_ok=True)
        run = RunFolder(folder)
        _await_lock(run)
        if not run.is_run():
            complete = _start(study, plan, configuration, folder, asked).complete
        elif run.configuration() != configuration:
            raise RunFolderError(  # noqa: TRY301 - is written like everything that goes wrong
                f"`run` must be that of the study; got {folder} with another configuration. Remove it."
            )
        else:
            complete = resume(folder, **_given(study, plan), should_stop=asked).complete
    except Exception as error:
        return Outcome(task.number, FAILED, note_failure(folder, error))
    return Outcome(task.number, COMPLETE if complete else STOPPED)


def execute_in_worker(study: str, warm_up: Sequence[int], task: Task | None) -> Outcome | None:
    """Execute a task in a worker process; None runs one generation of some runs, so that all kernels are compiled and stored."""
    if task is not None:
        return execute(task, asked_to_stop)
    for number in warm_up:
        # what fails here fails again later, and is noted then
        with contextlib.suppress(Exception), TemporaryDirectory() as folder:
            plan = StudyFolder(study).plan()
            configuration = plan.configuration(number)
            short = configuration.model_copy(update={"run": configuration.run.model_copy(update={"generations": 1})})
            _start(StudyFolder(study), plan, short, Path(folder) / "run", lambda: True)
    return None


def _start(
    study: StudyFolder, plan: "Plan", configuration: "Configuration", folder: Path, should_stop: Callable[[], bool]
) -> "Result":
    from turing_learning.runs import start
    from turing_learning.systems import Given

    if not plan.simulate:
        return start(configuration, folder, should_stop=should_stop)
    with configuration.system.open(Given(**_given(study, plan))) as source:
        return start(configuration, folder, should_stop=should_stop, source=source)


def _given(study: StudyFolder, plan: "Plan") -> dict[str, Any]:
    """Return samples and simulator of a custom system, nothing else."""
    from turing_learning.systems import imported

    given = {"simulate": imported(plan.simulate)} if plan.simulate else {}
    return given | ({"genuine": study.read(SAMPLES)} if given and not plan.base.system.stimulated else {})


def note_failure(folder: Path, error: BaseException) -> str:
    """Write into a run's folder why it failed, and return it."""
    from turing_learning._files import write_json

    reason = f"{type(error).__name__}: {' '.join(str(error).split())}".rstrip(": ")
    with contextlib.suppress(OSError):  # the disk may be the reason
        folder.mkdir(parents=True, exist_ok=True)
        write_json(folder / FAILURE, {"kind": type(error).__name__, "reason": reason})
    return reason


def _await_lock(run: object) -> None:
    from turing_learning.results import RunFolder, RunFolderError

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


class _StopFile:
    """Whether somebody has asked for a stop; looks at the disk a few times a second at most."""

    def __init__(self, path: str, further: Callable[[], bool] | None) -> None:
        self._path = Path(path) if path else None
        self._further = further or (lambda: False)
        self._next = 0.0
        self._asked = False

    def __call__(self) -> bool:
        self._asked = self._asked or self._further()
        if not self._asked and self._path is not None and time.monotonic() >= self._next:
            self._next = time.monotonic() + LOOK_EVERY_S
            self._asked = self._path.exists()
        return self._asked
