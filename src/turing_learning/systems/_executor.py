"""Calls of a simulator by any executor of `concurrent.futures`: threads, processes, Dask, MPI."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from contextlib import suppress
from typing import Any

from ._calls import Answer, Failed
from ._system import CustomSystemError

WORKERS_DIED = ("KilledWorker",)
"""Names of exceptions of a call whose workers died: of Dask. It alone has failed."""
COUNTS = ("_max_workers", "num_workers")
"""Where executors of `concurrent.futures` and of mpi4py have the number of their workers."""
_RESUME = "A run in a folder can be resumed, with another executor, too"


def workers_of(executor: Any) -> int | None:
    """Return how many calls an executor makes at once; None if it does not say it."""
    for name in COUNTS:
        if isinstance(count := getattr(executor, name, None), int):
            return count
    # of Dask
    client = getattr(executor, "_client", None)
    with suppress(Exception):
        return sum(client.nthreads().values()) if client is not None else None
    return None


def answers_by(
    executor: Executor, function: Callable[..., Answer], calls: Sequence[tuple[Any, ...]]
) -> Iterator[Answer]:
    """Submit all calls at once; yield their answers in the order of the calls, which does not depend on the executor.

    Raises
    ------
    CustomSystemError
        If the executor is broken or closed, or cannot send the function to its workers.
    """
    futures: list[Future[Answer]] = []
    try:
        for call in calls:
            futures.append(_submitted(executor, function, call))
        for number, call in enumerate(calls):
            if _may_be_lost(futures[number]):
                futures[number] = _submitted(executor, function, call)
            yield _answer_of(futures[number])
    finally:
        for future in futures:
            future.cancel()


def _submitted(
    executor: Executor, function: Callable[..., Answer], call: tuple[Any, ...]
) -> "Future[Answer]":
    try:
        return executor.submit(function, *call)
    except Exception as error:
        # Whatever an executor raises that is closed, or cannot pickle
        raise CustomSystemError(
            f"`executor` must take calls; got {_described(error)}. {_RESUME}."
        ) from None


def _may_be_lost(future: "Future[Answer]") -> bool:
    """Return whether a worker may have died while it sent an answer, so that the call is made again."""
    try:
        error = future.exception()
    except CancelledError:
        return False
    has_ended = isinstance(error, (BrokenExecutor, CancelledError))
    return error is not None and not has_ended and type(error).__name__ not in WORKERS_DIED


def _answer_of(future: "Future[Answer]") -> Answer:
    try:
        return future.result()
    except (BrokenExecutor, CancelledError) as error:
        raise CustomSystemError(
            f"`executor` must stay; it broke: {_described(error)}. {_RESUME}."
        ) from None
    except Exception as error:
        # The function catches what the simulator raises
        if type(error).__name__ in WORKERS_DIED:
            return Failed("its workers died")
        rule = "be a function that its workers can import"
        raise CustomSystemError(
            f"`simulate` must {rule}; got {_described(error)}. {_RESUME}."
        ) from None


def _described(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}".rstrip(": ")
