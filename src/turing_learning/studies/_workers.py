"""Local worker processes; one that dies loses nothing but its present run."""

import json
import queue
import subprocess
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import asdict

from ._execute import Outcome, Task
from ._worker import WARM_UP

ATTEMPTS = 3  # of a run whose worker dies


class WorkerDied(Exception):
    """The workers that executed a run died, again and again."""


class _Gone(Exception):
    """The worker of this slot has died."""


class Workers:
    """Worker processes on this machine, each with one thread.

    A task whose worker dies, killed for its memory for example, is given to a new worker, which goes on from the run's
    checkpoint.

    Parameters
    ----------
    count
        Number of workers, >= 1.
    study
        The study folder.
    warm_up
        Numbers of runs that one worker runs for a generation before the others begin, so that the kernels are compiled
        once and not by all of them at the same time.
    """

    def __init__(self, count: int, study: str, warm_up: Sequence[int] = ()) -> None:
        self._study = study
        self._warm_up = list(warm_up)
        self._warm = threading.Event()
        self._tasks: queue.SimpleQueue[tuple[Task, Future[Outcome]] | None] = queue.SimpleQueue()
        self._slots = [_Slot() for _ in range(count)]
        self._threads = [
            threading.Thread(target=self._serve, args=(slot, k == 0), name="turing-learning-worker", daemon=True)
            for k, slot in enumerate(self._slots)
        ]
        for thread in self._threads:
            thread.start()

    def submit(self, task: Task) -> "Future[Outcome]":
        """Execute a task as soon as a worker is free."""
        future: Future[Outcome] = Future()
        self._tasks.put((task, future))
        return future

    def running(self, futures: Sequence["Future[Outcome]"]) -> int:
        """Return how many of the tasks are being executed."""
        return sum(future.running() for future in futures)

    def close(self) -> None:
        """End the workers; wait for those that execute a task."""
        for _ in self._threads:
            self._tasks.put(None)
        for thread in self._threads:
            thread.join()

    def kill(self) -> None:
        """End the workers at once."""
        for slot in self._slots:
            slot.kill()

    def _serve(self, slot: "_Slot", first: bool) -> None:
        try:
            self._prepare(slot, first)
            while (item := self._tasks.get()) is not None:
                task, future = item
                if future.set_running_or_notify_cancel():
                    self._execute(slot, task, future)
        finally:
            slot.end()

    def _prepare(self, slot: "_Slot", first: bool) -> None:
        """Start the worker; let one of them compile while the others wait."""
        try:
            slot.start()
            if first and self._warm_up:
                slot.ask({"study": self._study, WARM_UP: self._warm_up})
        except Exception:
            slot.drop()  # the tasks will say why
        finally:
            if first:
                self._warm.set()
        self._warm.wait()

    def _execute(self, slot: "_Slot", task: Task, future: "Future[Outcome]") -> None:
        end = ""
        for _ in range(ATTEMPTS):
            try:
                slot.start()
                outcome = Outcome(**slot.ask(asdict(task)))  # type: ignore[arg-type]
            except _Gone as gone:
                end = str(gone)
                continue
            except Exception as error:  # no process can be started, or what it says is no answer
                slot.drop()
                future.set_exception(error)
                return
            future.set_result(outcome)
            return
        future.set_exception(WorkerDied(f"{ATTEMPTS} workers died while they executed it ({end})"))


class _Slot:
    """A place for one worker process after the other."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None
        self._killed = False

    def start(self) -> None:
        """Start a worker if there is none that lives."""
        if self._killed:
            raise _Gone("killed on demand")
        if self._process is not None and self._process.poll() is None:
            return
        self._process = subprocess.Popen(
            [sys.executable, "-m", "turing_learning.studies._worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,  # Ctrl-C is for the study, which tells its workers
        )

    def ask(self, request: dict[str, object]) -> dict[str, object]:
        """Send a request and wait for the answer.

        Raises
        ------
        _Gone
            If the worker dies.
        ValueError
            If it says something else.
        """
        process = self._process
        assert process is not None
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps(request) + "\n")
            process.stdin.flush()
            answer = process.stdout.readline()
        except (OSError, ValueError):
            answer = ""
        if not answer.endswith("\n"):
            self.end()
            raise _Gone(f"exit status {process.returncode}")
        return _parsed(answer)

    def end(self) -> None:
        """Let the worker end, and wait for it."""
        process, self._process = self._process, None
        if process is None:
            return
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                try:
                    pipe.close()
                except OSError:
                    continue  # what was written last can no longer be sent
        process.wait()

    def drop(self) -> None:
        """End the worker at once; the next task gets another one."""
        if self._process is not None:
            self._process.kill()
        self.end()

    def kill(self) -> None:
        """End the worker at once, and start no other."""
        self._killed = True
        process = self._process
        if process is not None:
            process.kill()


def _parsed(answer: str) -> dict[str, object]:
    try:
        content = json.loads(answer)
    except ValueError:
        content = None
    if isinstance(content, dict):
        return content
    raise ValueError(
        f"a worker must print nothing but its answers, lines of JSON; got {answer.rstrip()!r}. "
        "Look for what prints when Python starts, such as a sitecustomize."
    )
