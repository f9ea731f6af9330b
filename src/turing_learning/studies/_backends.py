"""A Dask cluster that executes the runs of a study."""

import logging
from collections.abc import Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from turing_learning.config import ConfigurationError
from turing_learning.errors import require

from ._conduct import Backend
from ._execute import execute

if TYPE_CHECKING:
    from distributed import Client

CONNECT_S = 4.0  # that a scheduler has to answer
SCHEMES = ("tcp", "tls", "ws", "wss")


def dask_backend(client: "Client") -> Backend:
    """Return a cluster as who executes; a run whose worker dies is executed again by another one."""
    executor = client.get_executor(pure=False)

    def running(futures: Iterable["Future[Any]"]) -> int:
        try:
            cores = sum(client.ncores().values())
        except OSError:  # the scheduler does not answer; if it stays away, the futures end with an error of their own
            cores = 0
        return min(sum(not future.done() for future in futures), cores)

    # nothing is killed: the workers look for the file that stops them
    return Backend(lambda task: executor.submit(execute, task), running)


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
    with _quiet():
        try:
            _require_address(address)
            client = Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TypeError, ImportError) as error:
            raise ConfigurationError(
                f"`cluster` must be the address of a Dask scheduler that answers; got {address!r} "
                f"({' '.join(str(error).split())}). Start one with `dask scheduler`, and give the address that it prints."
            ) from error
        try:
            require(client.ncores(), "cluster", "have at least one worker", f"{address!r} with none",
                    f"Start one: dask worker {address} --nthreads 1", error=ConfigurationError)  # fmt: skip
            yield client
        finally:
            client.close(timeout=CONNECT_S)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the logs of Dask, which has a traceback for a scheduler that is gone."""
    loggers = (
        logging.getLogger(name) for name in list(logging.root.manager.loggerDict) if name.startswith("distributed")
    )
    talking = [logger for logger in loggers if not logger.disabled]
    for logger in talking:
        logger.disabled = True
    try:
        yield
    finally:
        for logger in talking:
            logger.disabled = False


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
        require(not isinstance(answer, BaseException), "cluster", "have turing-learning installed on all workers",
                f"{answer!r} from {worker}", error=ConfigurationError)  # fmt: skip
        require(answer, "out", "be a folder that all workers of the cluster share",
                f"{path.parent}, which {worker} does not see", "Choose a shared folder.", error=ConfigurationError)  # fmt: skip


def _sees(path: str) -> bool:
    return Path(path).is_file()
