"""Execute a configuration: in memory, in a folder from generation 0, or on from where it was stopped."""

from collections.abc import Callable, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from turing_learning.config import Configuration, ConfigurationError, to_toml
from turing_learning.errors import refusing_as
from turing_learning.systems import Given, Source, SystemFailedError

from ._open import attachments_of, checker, is_whole, load_run, reporter, restored_result
from ._resolve import resolved
from ._session import Observer, Session
from .folder._checkpoints import replace_checkpoints
from .folder._errors import writable
from .folder._files import remove_partial, write_json
from .folder._folder import RunFolder
from .folder._history import dataset_in_memory, thin_dataset
from .folder._manifest import FINISHED, RUNNING, STOPPED, manifest_rows, new_manifest, now, this_process
from .results._result import Attachments, Result, summarize

if TYPE_CHECKING:
    import xarray


def in_memory(
    configuration: Configuration,
    observer: Observer | None,
    should_stop: Callable[[], bool] | None,
    source: Source | None = None,
) -> Result:
    """Run a configuration from generation 0 without a folder; see `start`."""
    source = source or _opened(configuration)
    manifest = new_manifest(to_toml(configuration), configuration.run.seed)
    session = Session(configuration, source=source)
    session.run(observer, should_stop)
    completed = session.traces.completed

    def history() -> "xarray.Dataset":
        if configuration.run.history == "thin":
            return thin_dataset(session.traces, session.layout.parameters)
        return dataset_in_memory(session.layout, session.arrays, completed)

    manifest |= {"state": FINISHED if session.complete else STOPPED, "finished": now(), "seconds": session.seconds}
    attachments = Attachments(
        configuration, history, reporter(configuration, lambda: manifest, None), checker(configuration)
    )
    return summarize(
        configuration,
        session.traces,
        session.seconds,
        attachments=attachments,
        failed_simulations=session.failed_simulations,
    )


def start(
    configuration: Configuration,
    out: str | Path,
    *,
    force: bool = False,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
    source: Source | None = None,
    files: Mapping[str, bytes] | None = None,
) -> Result:
    """Run a configuration from generation 0 in a folder of its own; see `infer`.

    A custom system, or a laboratory, has its `source`, which the caller closes, and may have more `files` in the folder,
    name -> content.
    """
    source = source or _opened(configuration)
    folder = RunFolder(Path(out))
    with ExitStack() as lock:
        with writable("out", folder.path):
            folder.refuse_if_taken(force=force)
            folder.path.mkdir(parents=True, exist_ok=True)
            lock.enter_context(folder.locked())
            folder.create(configuration, force=force, files=files)
            session = Session(configuration, folder, source=source)
        return _run(session, folder, configuration, observer, should_stop)


def _opened(configuration: Configuration) -> Source:
    """Return the samples of a configuration that needs nothing else."""
    with refusing_as(ConfigurationError):
        return configuration.system.open(Given())


def go_on(
    path: str | Path,
    reopen: Callable[[Configuration], Source],
    *,
    threads: int | None = None,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Result:
    """Go on with a run whose source `reopen` opens, while the folder is locked; see `resume`."""
    folder = RunFolder(Path(path))
    configuration = folder.configuration()
    if is_whole(folder, configuration):
        return load_run(path)
    here = configuration if threads is None else resolved(None, "default", configuration, {"run.threads": threads})
    with ExitStack() as lock:
        with writable("run", folder.path):
            lock.enter_context(folder.locked())
            if is_whole(folder, configuration) or restored_result(folder, configuration):
                return load_run(path)
            source = lock.enter_context(reopen(here))
            remove_partial(folder.path)
            folder.update_manifest(state=RUNNING, process=this_process())
            session = Session(here, folder, source=source)
        return _run(session, folder, configuration, observer, should_stop)


def _run(
    session: Session,
    folder: RunFolder,
    configuration: Configuration,
    observer: Observer | None,
    should_stop: Callable[[], bool] | None,
) -> Result:
    try:
        session.run(observer, should_stop)
    except SystemFailedError:
        with session.storage():
            folder.update_manifest(state=STOPPED, seconds=session.seconds)
        raise
    result = summarize(
        configuration,
        session.traces,
        session.seconds,
        path=folder.path.absolute(),
        attachments=attachments_of(folder, configuration, session.traces.completed),
        failed_simulations=session.failed_simulations,
    )
    with session.storage():
        write_json(folder.result_path, result.to_json())
        folder.update_manifest(state=RUNNING if session.complete else STOPPED, seconds=session.seconds)
        if session.complete and configuration.run.history == "thin":
            folder.update_manifest(state=FINISHED, finished=now())
            replace_checkpoints(folder.checkpoints_path, session.outcome())
        elif session.complete:
            session.keep_calibration(result)
            _finish(result, folder, configuration)
    return result


def _finish(result: Result, folder: RunFolder, configuration: Configuration) -> None:
    """Draw and write everything; the state comes last, so that a run that was killed here does it again."""
    from turing_learning.report import write_page

    from .results._present import draw, drawn_history, report_page, save_figures

    history = drawn_history(result)
    drawings = draw(history, configuration)
    save_figures(drawings, folder.figures_path)
    closed = {"state": FINISHED, "finished": now()}
    rows = manifest_rows(folder.manifest() | closed)
    write_page(report_page(result, history, configuration, drawings, rows), folder.report_path)
    folder.update_manifest(**closed)
