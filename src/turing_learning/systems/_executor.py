"""Calls of a simulator by any executor of `concurrent.futures`: threads, processes, Dask, MPI."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from typing import Any

from ._calls import Answer, Failed
from ._system import CustomSystemError

WORKERS_DIED = ("KilledWorker",)
"""Names of exceptions of a call whose workers died: of Dask. It alone has failed."""
_RESUME = "A run in a folder can be resumed, with another executor, too"


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
            try:
                futures.append(executor.submit(function, *call))
            except Exception as error:
                # Whatever an executor raises that is closed, or cannot pickle
                raise CustomSystemError(
                    f"`executor` must take calls; got {_described(error)}. {_RESUME}."
                ) from None
        for future in futures:
            yield _answer_of(future)
    finally:
        for future in futures:
            future.cancel()


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
