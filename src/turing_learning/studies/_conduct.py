"""Conduct a study: hand out the runs that are not complete, say how far they are, and stop when asked to."""

import contextlib
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Future, wait
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass
from uuid import uuid4

from turing_learning._files import PARTIAL
from turing_learning.results import resume_command, stored_generations

from ._execute import COMPLETE, FAILED, note_failure
from ._folder import ExecutorError, StudyFolder
from ._plan import Plan
from ._table import StudyRun, read_run

TICK_S = 0.2  # between two reports of progress
LOOK_EVERY_S = 1.0  # between two looks at the checkpoints


@dataclass(frozen=True)
class StudyProgress:
    """How far a study is.

    Attributes
    ----------
    total, done, failed, running
        Numbers of runs.
    maes
        MAE of the estimate of every run that is done.
    finished
        The runs that have ended since the last call.
    generations, generations_total
        Generations of all runs, completed up to the last checkpoints and asked for.
    seconds
        Time since the study was begun or resumed (s).
    seconds_left
        Time until the end at the mean rate (s); None until the rate is known.
    """

    total: int
    done: int
    failed: int
    running: int
    maes: tuple[float, ...]
    finished: tuple[StudyRun, ...]
    generations: int
    generations_total: int
    seconds: float
    seconds_left: float | None


StudyObserver = Callable[[StudyProgress], None]


@dataclass(frozen=True)
class Backend:
    """Who executes: how to submit a run, count the futures that are being executed, and end all at once where that is possible.

    A run is submitted by the study folder, its number, and a file that stops it; see `execute`, whose answer is in the future.
    """

    submit: Callable[[str, int, str], "Future[str]"]
    running: Callable[[Iterable["Future[str]"]], int]
    kill: Callable[[], None] = lambda: None


class Conduct:
    """Execute all runs of a study that are not complete; failed ones are tried again. The caller holds the lock of the folder."""

    def __init__(self, folder: StudyFolder, plan: Plan) -> None:
        self._folder, self._plan = folder, plan
        runs = (read_run(folder, plan, number) for number in plan.numbers)
        self._ended = {run.number: run for run in runs if run.complete}
        base = plan.base.run
        self._asked = {
            number: plan.configuration(number).length
            if own.get("run.trials", base.trials)
            else int(own.get("run.generations", base.generations))
            for number, own in enumerate(plan.settings, start=1)
        }
        self._stop = folder.path.absolute() / f"stop-{uuid4().hex}{PARTIAL}"
        self._new: list[StudyRun] = []
        self._begun = time.monotonic()
        self._look()
        self._before = self._generations()

    @property
    def left(self) -> list[int]:
        """Numbers of the runs that are not complete."""
        return [number for number in self._plan.numbers if number not in self._ended]

    def stop(self) -> None:
        """Let all runs stop after their present generation."""
        with contextlib.suppress(OSError):  # the disk is full: the runs will stop for that
            self._stop.touch()

    def by(self, backend: Backend) -> Iterator[StudyProgress]:
        """Execute the runs that are left, with progress a few times a second, and at the end.

        An ExecutorError says that the workers cannot go on.
        """
        futures: dict[Future[str], int] = {}
        try:
            for number in self.left:
                try:
                    futures[backend.submit(str(self._folder.path.absolute()), number, str(self._stop))] = number
                except (BrokenExecutor, RuntimeError) as error:
                    raise self._broken(error) from error
            while futures:
                yield self.progress(backend.running(futures))
                done, _ = wait(futures, timeout=TICK_S, return_when=FIRST_COMPLETED)
                for future in done:
                    number = futures.pop(future)
                    try:
                        state = future.result()
                    except (BrokenExecutor, CancelledError, FutureTimeout) as error:
                        raise self._broken(error) from error
                    except Exception as error:
                        state = FAILED
                        note_failure(self._folder.run_path(number), error)
                    if state in (COMPLETE, FAILED):
                        self.end(number)
            yield self.progress(0)
        except BaseException:
            self.stop()  # the file stays: whoever executes a run still has to see it
            backend.kill()
            raise
        for path in self._folder.path.glob(f"stop-*{PARTIAL}"):
            path.unlink(missing_ok=True)

    def end(self, number: int) -> None:
        """Take note that a run has ended, one way or the other."""
        self._ended[number] = read_run(self._folder, self._plan, number)
        self._partial.pop(number, None)
        self._new.append(self._ended[number])

    def progress(self, running: int) -> StudyProgress:
        """Return how far the study is."""
        if time.monotonic() >= self._next_look:
            self._look()
        finished, self._new = tuple(self._new), []
        done = [run for run in self._ended.values() if run.complete]
        seconds, generations, total = time.monotonic() - self._begun, self._generations(), sum(self._asked.values())
        made = generations - self._before
        return StudyProgress(
            total=len(self._plan),
            done=len(done),
            failed=sum(bool(run.reason) for run in self._ended.values()),
            running=running,
            maes=tuple(run.estimate_mae for run in done if run.estimate_mae is not None),
            finished=finished,
            generations=generations,
            generations_total=total,
            seconds=seconds,
            seconds_left=None if made <= 0 else max(0.0, (total - generations) * seconds / made),
        )

    def _look(self) -> None:
        self._next_look = time.monotonic() + LOOK_EVERY_S
        self._partial = {n: stored_generations(self._folder.run_path(n) / "checkpoints") for n in self.left}

    def _generations(self) -> int:
        return sum(self._partial.values()) + sum(self._asked[number] for number in self._ended)

    def _broken(self, error: BaseException) -> ExecutorError:
        path = self._folder.path.absolute()
        return ExecutorError(
            f"`executor` must stay alive until the study ends; got {type(error).__name__}"
            f"{': ' if str(error) else ''}{' '.join(str(error).split())}. Go on with `{resume_command(path)}`."
        )
