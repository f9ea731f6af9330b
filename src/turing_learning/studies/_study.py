"""The doors: study, resume_study, load_study, and the steps of a study on a Slurm cluster; and what conducts a study."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    wait,
)
from concurrent.futures import TimeoutError as FutureTimeout
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast
from uuid import uuid4

from turing_learning._files import PARTIAL, unused
from turing_learning.config import ConfigurationError
from turing_learning.config.settings import single_settings
from turing_learning.errors import check, nearest
from turing_learning.report import write_page
from turing_learning.runs import resume_command, save_figures, stored_generations
from turing_learning.store import storage, writable
from turing_learning.swarm import Scenario
from turing_learning.systems import CustomOptions, Range, imported

from ._backends import (
    COMPLETE,
    FAILED,
    Backend,
    ExecutorChoice,
    backend_of,
    dask_cluster,
    execute,
    note_failure,
)
from ._plan import Plan, StudyFolder, plan_study
from ._present import draw_study, study_report
from ._table import StudyResult, StudyRun, convergences, read_run, read_study, write_tables

if TYPE_CHECKING:
    from distributed import Client

RUNS = Path("runs")
TICK_S = 0.2
"""Time between two reports of progress (s)."""
LOOK_EVERY_S = 1.0
"""Time between two looks at the checkpoints (s): they are files."""


class ExecutorError(RuntimeError):
    """The workers cannot go on; what the runs have saved stays, and the study can be resumed."""


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


def study(
    scenario: str | Scenario | None = None,
    *,
    runs: int = 30,
    first_seed: int | None = None,
    generations: int | None = None,
    trials: int | None = None,
    preset: str = "default",
    config: str | Path | None = None,
    settings: Mapping[str, Any] | None = None,
    grid: Mapping[str, Sequence[Any]] | None = None,
    genuine: Any = None,
    simulate: Any = None,
    parameters: Mapping[str, Range] | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    cluster: str | None = None,
    out: str | Path | None = None,
    force: bool = False,
    observer: StudyObserver | None = None,
    should_stop: Callable[[], bool] | None = None,
    **options: Any,
) -> StudyResult:
    """Execute many runs and summarize them.

    Each run has one thread and a folder of its own in the study folder. The table does not depend
    on who executes the runs, nor in what order.

    Parameters
    ----------
    scenario
        As in `infer`; "random-behaviors" draws the agents' parameters uniformly in [-1, 1] from the
        seed of each run.
    runs
        Number of runs of each configuration, >= 1, with the seeds `first_seed`, `first_seed` + 1,
        ...
    first_seed
        >= 0; None takes `run.seed` of the file, 1 by default.
    generations, trials
        Of each run, as in `infer`. Samples of a run of trials are kept while it lasts; with the
        setting
        ``run.history`` "full" they stay, so that the run can be extended.
    preset, config
        As in `infer`; the file may hold a ``[grid]`` or a ``[[list]]``.
    settings
        Dotted key -> value, over preset and file.
    grid
        Dotted key -> values: all combinations are run.
    genuine, parameters
        Of a custom system, as in `infer`; the samples are stored in the folder.
    simulate
        Its simulator: "module:function", or a function that can be imported by that name.
    options
        `systems.CustomOptions` of a custom system, as in `infer`.
    workers, executor, cluster
        Who executes the runs, see `ExecutorChoice`. An executor stays open; workers of a cluster
        must see the study folder.
    out
        The study folder; a new one under runs/ by default. If it holds the same study, that is
        resumed.
    force
        Whether another study that is in the folder may be replaced.
    observer
        Called with a `StudyProgress` a few times a second.
    should_stop
        Asked a few times a second; once it returns True, all runs stop after their present
        generation and can be resumed.

    Raises
    ------
    ConfigurationError
        If a setting is refused, or the cluster is not there.
    RunFolderError
        If the folder is refused, for example because it holds a study of other settings.
    RunStorageError
        If the table cannot be written; the study can be resumed.
    ExecutorError
        If the executor or cluster breaks; the study can be resumed.

    Examples
    --------
    >>> import turing_learning as tl
    >>> result = tl.study("aggregation", runs=30)  # doctest: +SKIP
    >>> result.below(0.05)  # doctest: +SKIP
    30
    """
    executors = ExecutorChoice(workers, executor, cluster)
    for name, value in options.items():
        is_option = (
            genuine is not None and name in CustomOptions.__annotations__ and name != "timeout_s"
        )
        remedy = nearest(name, signature(study).parameters)
        check(is_option, name, "be a known option of a study", value, remedy)
    # Refused values are named as the caller has given them
    lengths = {"generations": generations, "trials": trials}
    labels = {}
    for name, value in lengths.items():
        if value is not None:
            labels[f"run.{name}"] = f"argument {name}"
    plan = plan_study(
        scenario,
        runs=runs,
        first_seed=first_seed,
        preset=preset,
        config=config,
        settings=single_settings(settings, **lengths),
        labels=labels,
        grid=grid,
        genuine=genuine,
        simulate=simulate,
        parameters=parameters,
        options=cast(CustomOptions, options),
    )
    path = new_study_path(plan) if out is None else out
    return execute_study(
        plan, path, executors, force=force, observer=observer, should_stop=should_stop
    )


def execute_study(
    plan: Plan,
    out: str | Path,
    executors: ExecutorChoice,
    *,
    force: bool = False,
    observer: StudyObserver | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> StudyResult:
    """Execute a plan in a folder; see `study`."""
    folder = StudyFolder(out)
    with writable("out", folder.path):
        folder.refuse_if_taken(plan, force=force)
    with dask_cluster(executors.cluster) as client, ExitStack() as stack:
        create_study(plan, folder, stack, force=force)
        return _execute(folder, folder.plan(), executors, client, observer, should_stop)


def create_study(plan: Plan, folder: StudyFolder, stack: ExitStack, *, force: bool = False) -> None:
    """Make the folder of a study, or take the one that is there, and hold its lock until the stack is closed."""
    with writable("out", folder.path):
        folder.refuse_if_taken(plan, force=force)
        folder.path.mkdir(parents=True, exist_ok=True)
        stack.enter_context(folder.locked())
        folder.begin(plan, force=force)


def resume_study(
    path: str | Path,
    *,
    workers: int | None = None,
    executor: Executor | None = None,
    cluster: str | None = None,
    observer: StudyObserver | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> StudyResult:
    """Resume a study: runs that are not complete go on from their checkpoints, failed ones are tried again.

    Parameters
    ----------
    path
        The study folder.
    workers, executor, cluster, observer, should_stop
        As in `study`.

    Raises
    ------
    RunFolderError
        If the folder is not a study, or is in use.
    ConfigurationError, RunStorageError, ExecutorError
        As in `study`.
    """
    executors = ExecutorChoice(workers, executor, cluster)
    folder = StudyFolder(path)
    plan = folder.plan()
    if plan.simulate:
        # Refuses before anything is done what no worker could load.
        imported(plan.simulate, error=ConfigurationError)
    with dask_cluster(executors.cluster) as client, _locked(folder):
        return _execute(folder, plan, executors, client, observer, should_stop)


@contextmanager
def _locked(folder: StudyFolder) -> Iterator[None]:
    with ExitStack() as stack:
        with writable("study", folder.path):
            stack.enter_context(folder.locked())
        yield


class StudyExecution:
    """Execute all runs of a study that are not complete; failed ones are tried again. The caller holds the folder's lock."""

    def __init__(self, folder: StudyFolder, plan: Plan) -> None:
        self._folder = folder
        self._plan = plan
        runs = (read_run(folder, plan, number) for number in plan.numbers)
        self._ended = {run.number: run for run in runs if run.complete}
        self._wanted = {number: _generations_of(plan, number) for number in plan.numbers}
        self._path = folder.path.absolute()
        self._stop = self._path / f"stop-{uuid4().hex}{PARTIAL}"
        self._ended_since_report: list[StudyRun] = []
        self._begin = time.monotonic()
        self._next_look = 0.0
        self._stored = dict.fromkeys(self.numbers, 0)
        self._generations_before = self._generations()

    @property
    def numbers(self) -> list[int]:
        """Numbers of the runs that are not complete."""
        return [number for number in self._plan.numbers if number not in self._ended]

    def stop(self) -> None:
        """Let all runs stop after their present generation."""
        # Where the disk is full, the runs will stop for that.
        with suppress(OSError):
            self._stop.touch()

    def execute_by(self, backend: Backend) -> Iterator[StudyProgress]:
        """Execute the runs that are not complete, with progress a few times a second, and at the end."""
        number_of: dict[Future[str], int] = {}
        try:
            with self._explaining_broken_workers(RuntimeError):
                for number in self.numbers:
                    number_of[backend.submit(str(self._path), number, str(self._stop))] = number
            while number_of:
                yield self.progress(backend.running(number_of))
                done, _ = wait(number_of, timeout=TICK_S, return_when=FIRST_COMPLETED)
                for future in done:
                    self._note_result(number_of.pop(future), future)
            yield self.progress(0)
        except BaseException:
            # The file stays: whoever executes a run still has to see it.
            self.stop()
            backend.kill()
            raise
        for path in self._folder.path.glob(f"stop-*{PARTIAL}"):
            path.unlink(missing_ok=True)

    def _note_result(self, number: int, future: "Future[str]") -> None:
        """Take note of what became of the future of a run."""
        try:
            with self._explaining_broken_workers(CancelledError, FutureTimeout):
                state = future.result()
        except ExecutorError:
            raise
        except Exception as error:
            state = FAILED
            note_failure(self._folder.run_path(number), error)
        if state in (COMPLETE, FAILED):
            self.end(number)

    def end(self, number: int) -> None:
        """Take note that a run has ended, one way or the other."""
        self._ended[number] = read_run(self._folder, self._plan, number)
        self._ended_since_report.append(self._ended[number])

    def progress(self, running: int) -> StudyProgress:
        finished = tuple(self._ended_since_report)
        self._ended_since_report = []
        complete = [run for run in self._ended.values() if run.complete]
        seconds = time.monotonic() - self._begin
        generations = self._generations()
        total = sum(self._wanted.values())
        made = generations - self._generations_before
        seconds_left = None
        if made > 0:
            seconds_left = max(0.0, (total - generations) * seconds / made)
        return StudyProgress(
            total=len(self._plan),
            done=len(complete),
            failed=sum(bool(run.reason) for run in self._ended.values()),
            running=running,
            maes=tuple(run.estimate_mae for run in complete if run.estimate_mae is not None),
            finished=finished,
            generations=generations,
            generations_total=total,
            seconds=seconds,
            seconds_left=seconds_left,
        )

    def _generations(self) -> int:
        """Return how many generations the runs have, by a look at their checkpoints now and then."""
        if time.monotonic() >= self._next_look:
            self._next_look = time.monotonic() + LOOK_EVERY_S
            # Files of runs that have ended are not looked at: their length is known.
            for number in self.numbers:
                checkpoints = self._folder.run_path(number) / "checkpoints"
                self._stored[number] = stored_generations(checkpoints)
        total = 0
        for number in self._plan.numbers:
            lengths = self._wanted if number in self._ended else self._stored
            total += lengths[number]
        return total

    @contextmanager
    def _explaining_broken_workers(self, *errors: type[Exception]) -> Iterator[None]:
        """Say of workers that break inside the block how to go on."""
        broken: tuple[type[Exception], ...] = (BrokenExecutor, *errors)
        try:
            yield
        except broken as error:
            reason = ": ".join(filter(None, (type(error).__name__, " ".join(str(error).split()))))
            text = f"`executor` must stay alive until the study ends; got {reason}."
            raise ExecutorError(f"{text} Go on with `{resume_command(self._path)}`.") from error


def _generations_of(plan: Plan, number: int) -> int:
    """Return how many generations a run shall have; the batches of a run of trials count as such."""
    settings = plan.settings[number - 1]
    if settings.get("run.trials", plan.base.run.trials):
        return plan.configuration(number).length
    return int(settings.get("run.generations", plan.base.run.generations))


def _execute(
    folder: StudyFolder,
    plan: Plan,
    executors: ExecutorChoice,
    client: "Client | None",
    observer: StudyObserver | None,
    should_stop: Callable[[], bool] | None,
) -> StudyResult:
    execution = StudyExecution(folder, plan)
    with (
        backend_of(executors, client, folder, plan, execution.numbers) as backend,
        _storage(folder),
    ):
        for progress in execution.execute_by(backend):
            if observer is not None:
                observer(progress)
            if should_stop is not None and should_stop():
                execution.stop()
            # A folder that is gone would be made anew, piece by piece, by its workers.
            folder.require_here()
    result = read_study(folder, plan)
    if result.unfinished:
        return result
    return _written(folder, plan, result)


def _written(folder: StudyFolder, plan: Plan, result: StudyResult) -> StudyResult:
    """Write tables, figures and report of what has been read."""
    medians = convergences(folder, plan, result.runs)
    with _storage(folder):
        write_tables(folder, result, medians, plan.base.scenario.parameter_names)
        pictures = draw_study(result, plan, medians)
        save_figures(pictures, folder.figures_path)
        write_page(study_report(result, plan, pictures), folder.report_path)
    return result


def _storage(folder: StudyFolder) -> AbstractContextManager[None]:
    return storage(folder.path, f"go on with `{resume_command(folder.path)}`.")


def load_study(path: str | Path) -> StudyResult:
    """Open a study that is finished, stopped, or still running.

    Parameters
    ----------
    path
        The study folder.

    Returns
    -------
    StudyResult
        All runs, those that are complete with their results, and statistics of these.

    Raises
    ------
    RunFolderError
        If the folder is not a study.
    """
    folder = StudyFolder(path)
    return read_study(folder, folder.plan())


def run_one(
    path: str | Path, number: int, should_stop: Callable[[], bool] | None = None
) -> StudyRun:
    """Execute one run of a study in this process, or resume it.

    Parameters
    ----------
    path
        The study folder.
    number
        Number of the run, from 1.
    should_stop
        Called after every generation.

    Raises
    ------
    RunFolderError
        If the folder is not a study.
    ConfigurationError
        If there is no run of that number.
    """
    folder = StudyFolder(path)
    plan = folder.plan()
    if number not in plan.numbers:
        raise ConfigurationError(f"`number` must be between 1 and {len(plan)}; got {number}.")
    execute(str(folder.path.absolute()), number, should_stop=should_stop)
    return read_run(folder, plan, number)


def collect_study(path: str | Path) -> StudyResult:
    """Make tables, figures and report of the runs that are complete.

    Parameters
    ----------
    path
        The study folder.

    Raises
    ------
    RunFolderError
        If the folder is not a study, or is in use.
    RunStorageError
        If they cannot be written.
    """
    folder = StudyFolder(path)
    plan = folder.plan()
    with _locked(folder):
        return _written(folder, plan, read_study(folder, plan))


def new_study_path(plan: Plan, parent: Path = RUNS) -> Path:
    """Return a folder for a study that does not exist, named after scenario and time."""
    return unused(parent / f"{plan.base.scenario.name}-study-{time.strftime('%Y%m%d-%H%M%S')}")
