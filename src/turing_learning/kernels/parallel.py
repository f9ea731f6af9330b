"""Run a compiled range function on several threads; the results do not depend on how many."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

CHUNKS_PER_THREAD = 4
"""Pieces of work for each thread, so that none has to wait long for the slowest."""


def default_threads() -> int:
    """Return the number of processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@lru_cache(maxsize=8)
def _pool(threads: int, process: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix=f"turing-learning-{process}")


def run_range(
    function: Callable[..., None], count: int, threads: int | None, *arguments: Any, grain: int = 1
) -> None:
    """Call ``function(start, stop, *arguments)`` for pieces that cover ``range(count)``.

    The function is compiled, releases the interpreter lock, and its iterations are independent.
    There is at least one of `threads`; None takes every processor that the process may use. Pieces
    are not made smaller than `grain` unless a thread would have nothing to do.
    """
    if threads is None:
        threads = default_threads()
    if threads == 1 or count < 2:
        function(0, count, *arguments)
        return
    chunks = min(count, max(threads, min(threads * CHUNKS_PER_THREAD, count // grain)))
    bounds = [count * k // chunks for k in range(chunks + 1)]
    # Drawing the next one is one step of the interpreter: no two threads get the same.
    pieces = iter(range(chunks))

    def work() -> None:
        for k in pieces:
            function(bounds[k], bounds[k + 1], *arguments)

    pool = _pool(threads - 1, os.getpid())
    futures = [pool.submit(work) for _ in range(min(threads, chunks) - 1)]
    try:
        work()
    finally:
        for future in futures:
            future.result()
