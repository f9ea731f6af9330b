"""Pieces of work done side by side, each in a process of its own."""

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from typing import Any

import numpy as np

Compute = Callable[..., Mapping[str, np.ndarray] | None]
"""A function of a module: `should_stop`, then what it is given -> arrays by name, None if it was stopped."""
_POLL_S = 0.5


def side_by_side(
    compute: Compute, given: Mapping[str, tuple[Any, ...]], *, workers: int, should_stop: Callable[[], bool]
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield name, and seconds and arrays found, of each piece as it is done; those that were stopped are left out.

    Parameters
    ----------
    compute
        What does a piece.
    given
        Name of the piece -> arguments.
    workers
        Number of processes, each of which does one piece at a time.
    should_stop
        Asked twice a second; the processes then stop where they can.
    """
    context = multiprocessing.get_context("spawn")
    stopping = context.Event()
    if should_stop():  # asked before: nothing begins
        stopping.set()
    with ProcessPoolExecutor(workers, context, _begin, (stopping, os.getpid())) as executor:
        names: dict[Future[dict[str, Any] | None], str] = {
            executor.submit(_timed, compute, arguments): name for name, arguments in given.items()
        }
        left = set(names)
        try:
            while left:
                done, left = wait(left, _POLL_S, FIRST_COMPLETED)
                for future in done:
                    if (stored := future.result()) is not None:
                        yield names[future], stored
                if should_stop():
                    stopping.set()
        finally:
            stopping.set()
            executor.shutdown(cancel_futures=True)


_asked: Callable[[], bool] = lambda: False  # noqa: E731 # replaced in a worker process


def _begin(stopping: Any, parent: int) -> None:
    """Prepare a worker: Ctrl-C is the parent's business; a worker whose parent is gone stops."""
    global _asked
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def asked() -> bool:
        return stopping.is_set() or os.getppid() != parent

    _asked = asked


def _timed(compute: Compute, arguments: tuple[Any, ...]) -> dict[str, Any] | None:
    if _asked():
        return None
    begun = time.perf_counter()
    found = compute(_asked, *arguments)
    return None if found is None else {"seconds": round(time.perf_counter() - begun, 3), "found": dict(found)}
