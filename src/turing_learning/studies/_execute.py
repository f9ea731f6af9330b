"""What a worker does: one run of a study, begun or resumed."""

import contextlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from turing_learning._files import write_json
from turing_learning.config import Configuration
from turing_learning.errors import require
from turing_learning.results import Result, RunFolder, RunFolderError
from turing_learning.runs import resume, start
from turing_learning.systems import Given, imported
from turing_learning.workers import asked_to_stop

from ._folder import FAILURE, SAMPLES, StudyFolder
from ._plan import Plan

COMPLETE, FAILED = "complete", "failed"
STOPPED, WAITING = "stopped", "waiting"  # can go on; not begun
LOOK_EVERY_S = 0.2  # between two looks for the file that asks workers to stop
LONGEST_WAIT_S = 30.0  # for the lock of a run whose worker was given up for lost, but lives


def execute(study: str, number: int, stop: str = "", should_stop: Callable[[], bool] | None = None) -> str:
    """Execute a run of a study in this process until the file `stop` exists, or `should_stop` says so; note it if it fails."""
    asked, following = False, 0.0

    def is_asked() -> bool:
        nonlocal asked, following
        asked = asked or (should_stop is not None and should_stop())
        if not asked and stop and time.monotonic() >= following:
            following, asked = time.monotonic() + LOOK_EVERY_S, Path(stop).exists()
        return asked

    if is_asked():
        return WAITING
    folder = StudyFolder(study)
    path = folder.run_path(number)
    try:
        plan = folder.plan()
        configuration = plan.configuration(number)
        path.mkdir(parents=True, exist_ok=True)
        (path / FAILURE).unlink(missing_ok=True)
        run, deadline = RunFolder(path), time.monotonic() + LONGEST_WAIT_S
        while True:
            try:
                with run.locked():
                    break
            except RunFolderError:
                if time.monotonic() > deadline:
                    raise
            time.sleep(LOOK_EVERY_S)
        if run.is_run():
            same, got = run.configuration() == configuration, f"{path} with another configuration"
            require(same, "run", "be that of the study", got, "Remove it.", error=RunFolderError)
            complete = resume(path, **_given(folder, plan), should_stop=is_asked).complete
        else:
            complete = _start(folder, plan, configuration, path, is_asked).complete
    except Exception as error:
        note_failure(path, error)
        return FAILED
    return COMPLETE if complete else STOPPED


def execute_in_worker(study: str, warm_up: Sequence[int], number: int | None, stop: str = "") -> str:
    """Execute a run in a worker process; None runs one generation of some runs, so that all kernels are compiled and stored."""
    if number is not None:
        return execute(study, number, stop, asked_to_stop)
    for each in warm_up:
        # what fails here fails again later, and is noted then
        with contextlib.suppress(Exception), TemporaryDirectory() as folder:
            plan = StudyFolder(study).plan()
            configuration = plan.configuration(each)
            short = configuration.model_copy(update={"run": configuration.run.model_copy(update={"generations": 1})})
            _start(StudyFolder(study), plan, short, Path(folder) / "run", lambda: True)
    return WAITING


def _start(
    study: StudyFolder, plan: Plan, configuration: Configuration, path: Path, should_stop: Callable[[], bool]
) -> Result:
    if not plan.simulate:
        return start(configuration, path, should_stop=should_stop)
    with configuration.system.open(Given(**_given(study, plan))) as source:
        return start(configuration, path, should_stop=should_stop, source=source)


def _given(study: StudyFolder, plan: Plan) -> dict[str, Any]:
    """Return samples and simulator of a custom system, nothing else."""
    given = {"simulate": imported(plan.simulate)} if plan.simulate else {}
    return given | ({"genuine": study.read(SAMPLES)} if given and not plan.base.system.stimulated else {})


def note_failure(path: Path, error: BaseException) -> None:
    """Write into a run's folder why it failed."""
    reason = f"{type(error).__name__}: {' '.join(str(error).split())}".rstrip(": ")
    with contextlib.suppress(OSError):  # the disk may be the reason
        path.mkdir(parents=True, exist_ok=True)
        write_json(path / FAILURE, {"kind": type(error).__name__, "reason": reason})
