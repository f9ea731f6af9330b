"""Who executes the runs of a study: workers on this machine, an executor, a Dask cluster, or Slurm; and what a worker does."""

import logging
import os
import shlex
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from turing_learning._files import in_home, write_atomically, write_json
from turing_learning.config import Configuration, ConfigurationError
from turing_learning.errors import check, integer, reject
from turing_learning.kernels.parallel import default_threads
from turing_learning.runs import Result, RunFolder, resume, start
from turing_learning.store import check_folder
from turing_learning.systems import Arguments, imported
from turing_learning.targets import writing
from turing_learning.workers import Workers, asked_to_stop

from ._plan import FAILURE, SAMPLES, Plan, StudyFolder

if TYPE_CHECKING:
    from distributed import Client

COMPLETE = "complete"
FAILED = "failed"
STOPPED = "stopped"
"""Of a run that can go on."""
WAITING = "waiting"
"""Of a run that has not begun."""
LOOK_EVERY_S = 0.2
"""Time between two looks for the file that asks workers to stop (s)."""
LONGEST_WAIT_S = 30.0
"""Time to wait for the lock of a run whose worker was given up for lost, but lives (s)."""
RUN_ATTEMPTS = 3
"""Of a run whose worker dies."""
CONNECT_S = 4.0
"""Time that a scheduler has to answer (s)."""
WORKER_S = 10.0
"""Time that a first worker has to arrive (s)."""
SCHEMES = ("tcp", "tls", "ws", "wss")

SCRIPT = """#!/bin/bash
# Study {study}: {runs} runs.
# Submit:
#   {submit}
#SBATCH --job-name=turing-learning
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --mem=1G
#SBATCH --time=60
#SBATCH --output={log}
#SBATCH --signal=B:TERM@60
#SBATCH --requeue
# A run that is stopped or killed goes on from its checkpoint when it is submitted again.
set -eu
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1
if [ -n "${{SLURM_ARRAY_TASK_ID:-}}" ]; then
    exec {command} study-run {study} "$SLURM_ARRAY_TASK_ID"
fi
exec {command} study-collect {study}
"""


@dataclass(frozen=True)
class ExecutorChoice:
    """Who executes the runs; at most one of them is given.

    Parameters
    ----------
    workers
        Number of worker processes on this machine; None takes one for each processor.
    executor
        An executor of `concurrent.futures`.
    cluster
        Address of a Dask scheduler.
    """

    workers: int | None = None
    executor: Executor | None = None
    cluster: str | None = None

    def __post_init__(self) -> None:
        chosen = [name for name, value in vars(self).items() if value is not None]
        if len(chosen) > 1:
            raise ConfigurationError(
                f"`{chosen[0]}` must be left out beside `{chosen[1]}`; got both. Give one of them."
            )
        if self.workers is not None:
            integer("workers", self.workers, 1, error=ConfigurationError)


def _count_running(futures: Iterable["Future[str]"]) -> int:
    return sum(future.running() for future in futures)


@dataclass(frozen=True)
class Backend:
    """Who executes the runs."""

    # takes what `execute` does but for `should_stop`
    submit: "Callable[[str, int, str], Future[str]]"
    # how many are being executed
    running: Callable[[Iterable["Future[str]"]], int] = _count_running
    # Ends all at once, where that is possible
    kill: Callable[[], None] = lambda: None


@contextmanager
def backend_of(
    choice: ExecutorChoice,
    client: "Client | None",
    folder: StudyFolder,
    plan: Plan,
    numbers: Sequence[int],
) -> Iterator[Backend]:
    """Return who executes the runs of these numbers; `client` is that of the cluster, if one is given."""
    if client is not None and choice.cluster is not None:
        require_visible(client, folder.study_path.absolute(), choice.cluster)
        # Nothing is killed: the workers look for the file that stops them.
        # The run of a dead worker is executed again by another one.
        submit = partial(client.get_executor(pure=False).submit, execute)
        yield Backend(submit, partial(_count_running_on_cluster, client))
    elif choice.executor is not None:
        submit_any = choice.executor.submit
        yield Backend(lambda *arguments: submit_any(execute, *arguments))
    else:
        workers = Workers(
            partial(
                execute_in_worker, str(folder.path.absolute()), first_of_each_network(plan, numbers)
            ),
            max(1, min(choice.workers or default_threads(), len(numbers))),
            attempts=RUN_ATTEMPTS,
            warm_up=(None,),
            script=False,
            patient=True,
            one_thread=True,
        )
        try:
            yield Backend(
                lambda study, number, stop: workers.submit(number, stop), kill=workers.kill
            )
        finally:
            workers.close()


def _count_running_on_cluster(client: "Client", futures: Iterable["Future[str]"]) -> int:
    """Return how many runs are being executed at most: Dask does not say of each whether it is."""
    cores = 0
    # A scheduler that stays away lets the futures end with errors of their own.
    with suppress(OSError):
        cores = sum(client.ncores().values())
    return min(sum(not future.done() for future in futures), cores)


def first_of_each_network(plan: Plan, numbers: Sequence[int]) -> list[int]:
    """Return runs that together need all kernels that the runs need.

    Kernels that judge are made for the size of the network, those that simulate for reactive models
    or networks.
    """
    chosen: dict[Any, int] = {}
    for number in numbers:
        settings = plan.settings[number - 1]
        kernels = (settings.get("classifiers.hidden"), settings.get("models.hidden", 0) > 0)
        chosen.setdefault(kernels, number)
    return list(chosen.values())


@contextmanager
def dask_cluster(address: str | None) -> Iterator["Client | None"]:
    """Connect to a Dask scheduler, for example "tcp://10.0.0.1:8786", with at least one worker; None connects to nothing."""
    if address is None:
        yield None
        return
    try:
        from distributed import Client
    except ImportError:
        remedy = 'Install it: pip install "turing-learning[cluster]"'
        reject("cluster", "be left out without the extra `cluster`", repr(address), remedy)
    # Dask would write a traceback for a scheduler that does not answer.
    with _quiet():
        try:
            _require_address(address)
            client = Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TypeError, ImportError) as error:
            rule = "be the address of a Dask scheduler that answers"
            got = f"{address!r} ({' '.join(str(error).split())})"
            remedy = "Start one with `dask scheduler`, and give the address that it prints."
            reject("cluster", rule, got, remedy)
        try:
            # Workers may have been started just before.
            with suppress(TimeoutError):
                client.wait_for_workers(1, timeout=WORKER_S)
            remedy = f"Start one: dask worker {address} --nthreads 1"
            got = f"{address!r} with none"
            check(client.ncores(), "cluster", "have at least one worker", got, remedy)
            yield client
        finally:
            client.close(timeout=CONNECT_S)


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence the logs of Dask, which has a traceback for a scheduler that is gone."""
    names = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    talking = [logger for logger in map(logging.getLogger, names) if not logger.disabled]
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
    from distributed.comm.addressing import parse_address, resolve_address

    scheme, _ = parse_address(address)
    if scheme not in SCHEMES:
        beginnings = ", ".join(f"{scheme}://" for scheme in SCHEMES)
        raise ValueError(f"it begins with none of {beginnings}")
    if scheme in ("tls", "wss") and Security().get_connection_args("client")["ssl_context"] is None:
        raise ValueError("the configuration of Dask names no certificates")
    resolve_address(address)


def require_visible(client: "Client", path: Path, address: str) -> None:
    """Raise ConfigurationError unless all workers of a cluster can run the package and see a file of the study."""
    try:
        answers = client.run(os.path.isfile, str(path), on_error="return")
    # Whatever the cluster raises: the study cannot begin.
    except Exception as error:
        raise ConfigurationError(
            f"`cluster` must be able to work; got {address!r} ({error!r})."
        ) from error
    for worker, answer in answers.items():
        works = not isinstance(answer, BaseException)
        rule = "have turing-learning installed on all workers"
        check(works, "cluster", rule, f"{answer!r} from {worker}")
        rule = "be a folder that all workers of the cluster share"
        got = f"{path.parent}, which {worker} does not see"
        check(answer, "out", rule, got, "Choose a shared folder.")


def write_slurm(script: str | Path, study: str | Path, runs: int, *, force: bool = False) -> str:
    """Write a job script for a study and return the line that submits it.

    With ``SLURM_ARRAY_TASK_ID`` the script executes the run of that number, without it the step
    that makes the table.

    Parameters
    ----------
    script
        The file to write.
    study
        The study folder, on a disk that all nodes share.
    runs
        Number of runs.
    force
        Whether a file that exists is replaced.

    Returns
    -------
    str
        A shell command: the array, and after its end the collecting step.

    Raises
    ------
    ConfigurationError
        If the file exists or cannot be written.
    """
    path = Path(script).absolute()
    folder = in_home(study).absolute()
    refuse_script(path, force=force)
    _require_plain("study", folder)
    quoted = shlex.quote(str(path))
    submit = f"job=$(sbatch --parsable --array=1-{runs} {quoted}) && "
    submit += f"sbatch --dependency=afterany:${{job%%;*}} {quoted}"
    text = SCRIPT.format(
        study=shlex.quote(str(folder)),
        runs=runs,
        submit=submit,
        log=str(folder / "slurm-%A-%a.log").replace(" ", "\\ "),
        command=f"{shlex.quote(sys.executable)} -m turing_learning",
    )
    with writing(path, "write-slurm"):
        write_atomically(path, text.encode())
        path.chmod(0o755)
    return submit


def refuse_script(path: Path, *, force: bool) -> None:
    """Raise ConfigurationError unless a job script may be written to a path."""
    name = "write-slurm"
    _require_plain(name, path)
    in_folder = path.parent.is_dir() and not path.is_dir()
    check(in_folder, name, "be a file in a folder that exists", str(path))
    remedy = "Choose another place."
    check(os.access(path.parent, os.W_OK), name, "be a file that can be written", str(path), remedy)
    remedy = "Choose another name, or replace it with --force."
    check(force or not path.exists(), name, "be a file that does not exist", str(path), remedy)


def _require_plain(name: str, path: Path) -> None:
    """Reject a path with control characters: in a script the rest of a line would be executed."""
    rule = "have a path without control characters"
    check(str(path).isprintable(), name, rule, ascii(str(path)), "Choose another place.")


# What a worker does: one run of a study, begun or resumed


def execute(
    study: str, number: int, stop: str = "", should_stop: Callable[[], bool] | None = None
) -> str:
    """Execute a run of a study in this process until the file `stop` exists, or `should_stop` says so; note it if it fails."""
    asked = False
    next_look = 0.0

    def is_asked() -> bool:
        nonlocal asked, next_look
        asked = asked or (should_stop is not None and should_stop())
        if not asked and stop and time.monotonic() >= next_look:
            next_look = time.monotonic() + LOOK_EVERY_S
            asked = Path(stop).exists()
        return asked

    if is_asked():
        return WAITING
    folder = StudyFolder(study)
    path = folder.run_path(number)
    try:
        plan = folder.plan()
        configuration = plan.configuration(number)
        path.mkdir(parents=True, exist_ok=True)
        (path / FAILURE).unlink(missing_ok=True)
        run = RunFolder(path)
        # A worker that was given up for lost may hold the lock.
        with run.locked(wait_s=LONGEST_WAIT_S):
            pass
        if run.is_run():
            same = run.configuration() == configuration
            got = f"{path} with another configuration"
            check_folder(same, "run", "be that of the study", got, "Remove it.")
            result = resume(path, **_custom_parts(folder, plan), should_stop=is_asked)
        else:
            result = _start(folder, plan, configuration, path, is_asked)
    except Exception as error:
        note_failure(path, error)
        return FAILED
    return COMPLETE if result.complete else STOPPED


def execute_in_worker(
    study: str, warm_up: Sequence[int], number: int | None, stop: str = ""
) -> str:
    """Execute a run in a worker process.

    None runs one generation of the runs to warm up with, so that all kernels are compiled and
    stored.
    """
    if number is not None:
        return execute(study, number, stop, asked_to_stop)
    for warm_up_number in warm_up:
        # What fails here fails again later, and is noted then.
        with suppress(Exception), TemporaryDirectory() as folder:
            plan = StudyFolder(study).plan()
            configuration = plan.configuration(warm_up_number)
            one_generation = configuration.run.model_copy(update={"generations": 1})
            short = configuration.model_copy(update={"run": one_generation})
            _start(StudyFolder(study), plan, short, Path(folder) / "run", lambda: True)
    return WAITING


def _start(
    study: StudyFolder,
    plan: Plan,
    configuration: Configuration,
    path: Path,
    should_stop: Callable[[], bool],
) -> Result:
    if not plan.simulate:
        return start(configuration, path, should_stop=should_stop)
    with configuration.system.open(Arguments(**_custom_parts(study, plan))) as source:
        return start(configuration, path, should_stop=should_stop, source=source)


def _custom_parts(study: StudyFolder, plan: Plan) -> dict[str, Any]:
    """Return samples and simulator of a custom system; nothing of another one."""
    if not plan.simulate:
        return {}
    content: dict[str, Any] = {"simulate": imported(plan.simulate)}
    if not plan.base.system.stimulated:
        content["genuine"] = study.read(SAMPLES)
    return content


def note_failure(path: Path, error: BaseException) -> None:
    """Write into a run's folder why it failed."""
    reason = f"{type(error).__name__}: {' '.join(str(error).split())}".rstrip(": ")
    # The disk may be the reason.
    with suppress(OSError):
        path.mkdir(parents=True, exist_ok=True)
        write_json(path / FAILURE, {"kind": type(error).__name__, "reason": reason})
