"""Who executes the runs: local workers, any executor, or a Dask cluster."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from turing_learning.config import ConfigurationError

from ._execute import Outcome, Task, execute

if TYPE_CHECKING:
    from distributed import Client

CONNECT_S = 4.0  # that a scheduler has to answer
SCHEMES = ("tcp", "tls", "ws", "wss")


class Backend(Protocol):
    """Executes tasks."""

    def submit(self, task: Task) -> "Future[Outcome]":
        """Execute a task as soon as possible."""
        ...

    def running(self, futures: Sequence["Future[Outcome]"]) -> int:
        """Return how many of the tasks are being executed, about."""
        ...

    def kill(self) -> None:
        """Give up what is being executed, where that is possible."""
        ...


class ExecutorBackend:
    """Any executor of `concurrent.futures`; it stays open."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor

    def submit(self, task: Task) -> "Future[Outcome]":
        """Execute a task."""
        return self._executor.submit(execute, task)

    def running(self, futures: Sequence["Future[Outcome]"]) -> int:
        """Return how many futures say that they run."""
        return sum(future.running() for future in futures)

    def kill(self) -> None:
        """Do nothing: the executor is not ours."""


class DaskBackend:
    """A Dask cluster that exists; a run whose worker dies is executed again by another one."""

    def __init__(self, client: "Client") -> None:
        self._client = client
        self._executor = client.get_executor(pure=False)

    def submit(self, task: Task) -> "Future[Outcome]":
        """Execute a task on any worker."""
        return self._executor.submit(execute, task)

    def running(self, futures: Sequence["Future[Outcome]"]) -> int:
        """Return how many tasks fit on the cluster at once."""
        left = sum(not future.done() for future in futures)
        return min(left, sum(self._client.ncores().values()))

    def kill(self) -> None:
        """Do nothing: the workers look for the file that stops them."""


@contextmanager
def dask_cluster(address: str) -> Iterator["Client"]:
    """Connect to a Dask scheduler.

    Parameters
    ----------
    address
        For example "tcp://10.0.0.1:8786".

    Raises
    ------
    ConfigurationError
        If the extra is not installed, nobody answers, or the cluster has no workers.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise ConfigurationError(
            f"`cluster` must be left out without the extra `cluster`; got {address!r}. "
            'Install it: pip install "turing-learning[cluster]"'
        ) from error
    client = _connected(Client, address)
    try:
        _require_workers(client, address)
        yield client
    finally:
        client.close(timeout=CONNECT_S)


def _connected(kind: Any, address: str) -> "Client":
    try:
        _require_address(address)
        return kind(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError, ImportError) as error:
        raise ConfigurationError(
            f"`cluster` must be the address of a Dask scheduler that answers; got {address!r} "
            f"({' '.join(str(error).split())}). Start one with `dask scheduler`, and give the address that it prints."
        ) from error


def _require_address(address: str) -> None:
    """Raise ValueError or OSError where a client would raise, too, and complain once more when it is collected."""
    from distributed import Security
    from distributed.comm import parse_address, resolve_address

    scheme, _ = parse_address(address)
    if scheme not in SCHEMES:
        raise ValueError(f"it begins with none of {', '.join(f'{one}://' for one in SCHEMES)}")
    if scheme in ("tls", "wss") and Security().get_connection_args("client")["ssl_context"] is None:
        raise ValueError("the configuration of Dask names no certificates")
    resolve_address(address)


def _require_workers(client: "Client", address: str) -> None:
    if not client.ncores():
        raise ConfigurationError(
            f"`cluster` must have at least one worker; got {address!r} with none. "
            f"Start one: dask worker {address} --nthreads 1"
        )


def require_visible(client: "Client", path: Path, address: str) -> None:
    """Raise ConfigurationError unless all workers of a cluster can run the package and see a file.

    Parameters
    ----------
    client
        From `dask_cluster`.
    path
        A file of the study.
    address
        For the message.
    """
    try:
        seen = client.run(_sees, str(path), on_error="return")
    except Exception as error:  # whatever the cluster raises: the study cannot begin
        raise ConfigurationError(f"`cluster` must be able to work; got {address!r} ({error!r}).") from error
    for worker, answer in seen.items():
        if isinstance(answer, BaseException):
            raise ConfigurationError(
                f"`cluster` must have turing-learning installed on all workers; got {answer!r} from {worker}."
            )
        if not answer:
            raise ConfigurationError(
                f"`out` must be a folder that all workers of the cluster share; got {path.parent}, which {worker} "
                "does not see. Choose a shared folder."
            )


def _sees(path: str) -> bool:
    return Path(path).is_file()
