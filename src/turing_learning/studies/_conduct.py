"""Conduct a study: hand out the runs that are not complete, watch, and stop when asked to."""

import contextlib
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from concurrent.futures import TimeoutError as FutureTimeout
from pathlib import Path
from uuid import uuid4

from turing_learning._files import PARTIAL
from turing_learning.runs import resume_command

from ._backends import Backend
from ._errors import ExecutorError
from ._execute import FAILED, Outcome, Task, note_failure
from ._folder import StudyFolder
from ._plan import Plan
from ._progress import ProgressCounter, StudyObserver
from ._table import read_run

STOPS = f"stop-*{PARTIAL}"
TICK_S = 0.2  # between two looks at the observer and at who asks for a stop


def conduct(
    folder: StudyFolder,
    plan: Plan,
    backend: Backend,
    observer: StudyObserver | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> None:
    """Execute all runs that are not complete; failed ones are tried again.

    Parameters
    ----------
    folder
        The study, locked by the caller.
    plan
        What runs.
    backend
        Who executes.
    observer
        Told a few times a second.
    should_stop
        Asked a few times a second; once it says so, the runs stop after their present generation.

    Raises
    ------
    ExecutorError
        If the workers cannot go on.
    """
    complete = [run for number in plan.numbers if (run := read_run(folder, plan, number)).complete]
    counter = ProgressCounter(folder, plan, complete)
    stop = folder.path.absolute() / f"stop-{uuid4().hex}{PARTIAL}"
    left = sorted(set(plan.numbers) - {run.number for run in complete})
    try:
        _conduct(folder, left, stop, backend, _Watch(counter, observer, should_stop))
    except BaseException:
        _touch(stop)  # it stays: whoever executes a run still has to see it
        backend.kill()
        raise
    for path in folder.path.glob(STOPS):
        path.unlink(missing_ok=True)


class _Watch:
    """The observer, and who asks for a stop."""

    def __init__(
        self, counter: ProgressCounter, observer: StudyObserver | None, should_stop: Callable[[], bool] | None
    ) -> None:
        self.counter = counter
        self._observer = observer
        self._should_stop = should_stop
        self.stopped = False

    def look(self, backend: Backend, futures: list["Future[Outcome]"]) -> None:
        """Tell the one, and ask the other."""
        if self._observer is not None:
            self._observer(self.counter.progress(backend.running(futures)))
        self.stopped = self.stopped or (self._should_stop is not None and self._should_stop())


def _conduct(folder: StudyFolder, left: list[int], stop: Path, backend: Backend, watch: _Watch) -> None:
    tasks = [Task(str(folder.path.absolute()), number, str(stop)) for number in left]
    futures = {_submitted(backend, task): task for task in tasks}
    while futures:
        watch.look(backend, list(futures))
        if watch.stopped:
            _touch(stop)
        done, _ = wait(futures, timeout=TICK_S, return_when=FIRST_COMPLETED)
        for future in done:
            _take(folder, futures.pop(future), future, watch.counter)
    watch.look(backend, [])


def _submitted(backend: Backend, task: Task) -> "Future[Outcome]":
    try:
        return backend.submit(task)
    except (BrokenExecutor, RuntimeError) as error:
        raise ExecutorError(_broken(error, task)) from error


def _take(folder: StudyFolder, task: Task, future: "Future[Outcome]", counter: ProgressCounter) -> None:
    try:
        outcome = future.result()
    except (BrokenExecutor, CancelledError, FutureTimeout) as error:
        raise ExecutorError(_broken(error, task)) from error
    except Exception as error:
        outcome = Outcome(task.number, FAILED, note_failure(folder.run_path(task.number), error))
    if outcome.state in ("complete", FAILED):
        counter.end(outcome.number)


def _broken(error: BaseException, task: Task) -> str:
    return (
        f"`executor` must stay alive until the study ends; got {type(error).__name__}"
        f"{': ' if str(error) else ''}{' '.join(str(error).split())}. "
        f"Go on with `{resume_command(Path(task.study))}`."
    )


def _touch(path: Path) -> None:
    with contextlib.suppress(OSError):  # the disk is full: the runs will stop for that
        path.touch()
