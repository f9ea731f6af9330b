"""Calls of a simulator in worker processes, which can be ended when they hang."""

import multiprocessing
import signal
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.reduction import ForkingPickler
from typing import Any

from ._calls import Answer, Call, Failed, Simulator, answer
from ._errors import OwnSystemError

_READY = "ready"


class InWorkers:
    """Call a simulator in worker processes, which are started on the first call and kept.

    Parameters
    ----------
    simulate
        The simulator; a process that is started afresh must be able to import it.
    vectorized
        Whether it takes several models at once.
    workers
        Number of processes, >= 1. The answers do not depend on it.
    timeout_s
        A call that takes longer is given up, and its process ended; None waits for ever.

    Raises
    ------
    ValueError
        If the simulator cannot be sent to another process.
    """

    def __init__(self, simulate: Simulator, *, vectorized: bool, workers: int, timeout_s: float | None = None) -> None:
        self._content = _packed(simulate)
        self._vectorized = vectorized
        self._timeout_s = timeout_s
        self._workers: list[_Worker | None] = [None] * workers

    def run(self, calls: Sequence[Call]) -> Iterator[Answer]:
        """Yield the answers in the order of the calls.

        Raises
        ------
        OwnSystemError
            If a worker cannot load the simulator.
        """
        waiting = deque(range(len(calls)))
        answers: dict[int, Answer] = {}
        for number in range(len(calls)):
            while number not in answers:
                self._hand_out(waiting, calls)
                for done, found in self._received():
                    answers[done] = found
            yield answers.pop(number)

    def close(self) -> None:
        """End all workers."""
        for worker in self._workers:
            if worker is not None:
                worker.end()
        self._workers = [None] * len(self._workers)

    def _hand_out(self, waiting: "deque[int]", calls: Sequence[Call]) -> None:
        for slot, worker in enumerate(self._workers):
            if not waiting:
                return
            if worker is None:
                self._workers[slot] = worker = _Worker(self._content, self._vectorized)
            if worker.idle and worker.begin(waiting[0], calls[waiting[0]], self._timeout_s):
                waiting.popleft()

    def _received(self) -> Iterator[tuple[int, Answer]]:
        """Wait for news; yield answers, also of those calls that took too long or killed their worker."""
        busy = {worker.connection: slot for slot, worker in enumerate(self._workers) if worker and not worker.idle}
        deadlines = [worker.deadline for worker in self._workers if worker and worker.deadline is not None]
        patience = max(0.0, min(deadlines) - time.monotonic()) if deadlines else None
        for connection in wait(list(busy), patience):
            yield from self._news(busy[connection])  # type: ignore[index]
        for slot, worker in enumerate(self._workers):
            if worker and worker.deadline is not None and worker.deadline <= time.monotonic():
                yield self._dropped(slot, f"it took longer than {self._timeout_s:g} s")

    def _news(self, slot: int) -> Iterator[tuple[int, Answer]]:
        worker = self._workers[slot]
        assert worker is not None
        try:
            news = worker.connection.recv()
        except (EOFError, OSError):
            if worker.call is not None:
                yield self._dropped(slot, "its worker process died")
            elif worker.loaded:
                worker.end()
                self._workers[slot] = None
            else:
                raise OwnSystemError(
                    "`simulate` must be importable by a worker process; the process ended before its first call. A script "
                    'that is run with workers keeps its calls under `if __name__ == "__main__":`.'
                ) from None
            return
        if not worker.loaded:
            worker.accept(news)
        elif worker.call is not None:
            yield worker.finish(), news

    def _dropped(self, slot: int, reason: str) -> tuple[int, Answer]:
        worker = self._workers[slot]
        assert worker is not None
        worker.end()
        self._workers[slot] = None
        assert worker.call is not None
        return worker.call, Failed(reason)


class _Worker:
    """One process: starting, idle, or at a call."""

    def __init__(self, content: bytes, vectorized: bool) -> None:
        context = multiprocessing.get_context("spawn")
        self.connection, other = context.Pipe()
        self.loaded = self.ready = False
        self.call: int | None = None
        self.deadline: float | None = None
        self._process = context.Process(target=_serve, args=(other, content, vectorized), daemon=True)
        self._process.start()
        other.close()

    @property
    def idle(self) -> bool:
        """Whether it waits for a call."""
        return self.ready and self.call is None

    def begin(self, number: int, call: Call, timeout_s: float | None) -> bool:
        """Hand a call over; return whether the process was there to take it."""
        try:
            self.connection.send((call.parameters, call.rng))
        except OSError:
            self.ready = False  # the end of the connection is the next news
            return False
        self.call = number
        self.deadline = None if timeout_s is None else time.monotonic() + timeout_s
        return True

    def finish(self) -> int:
        """Become idle; return the number of the call."""
        number, self.call, self.deadline = self.call, None, None
        assert number is not None
        return number

    def accept(self, news: Any) -> None:
        """Become idle after the start, unless the simulator could not be loaded."""
        if news != _READY:
            raise OwnSystemError(
                f"`simulate` must be importable by a worker process; got {news}. Define it at the top level of a module, or "
                "leave `workers` out."
            )
        self.loaded = self.ready = True

    def end(self) -> None:
        """End the process at once."""
        self._process.kill()
        self._process.join()
        self._process.close()
        self.connection.close()


def _packed(simulate: Simulator) -> bytes:
    try:
        return bytes(ForkingPickler.dumps(simulate))
    except Exception as error:  # pickle raises what the object's own methods raise
        raise ValueError(
            f"`simulate` must be a function that another process can import; got {simulate!r} ({error}). Define it at the "
            "top level of a module, or leave `workers` out."
        ) from error


def _serve(connection: Connection, content: bytes, vectorized: bool) -> None:
    """Answer calls until the other end is closed; the body of a worker process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that started this one decides
    try:
        simulate = ForkingPickler.loads(content)
    except Exception as error:
        _send(connection, f"{type(error).__name__}: {error}")
        return
    _send(connection, _READY)
    while True:
        try:
            parameters, rng = connection.recv()
        except (EOFError, OSError):
            return
        _send(connection, answer(simulate, Call(parameters, rng), vectorized))


def _send(connection: Connection, content: Any) -> None:
    with suppress(OSError):  # the other process has gone, which the next look at the connection tells
        connection.send(content)
