"""Open what a run has left behind."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from turing_learning.config import Configuration
from turing_learning.systems import FailureLog

from ._check import complete_check
from ._session import FAILURES, part
from .folder._checkpoints import Checkpoint, latest_checkpoint
from .folder._errors import RunFolderError, told
from .folder._files import write_json
from .folder._folder import RunFolder, going_on
from .folder._history import dataset_on_disk, thin_dataset
from .folder._manifest import FINISHED, manifest_rows
from .folder._traces import Traces
from .results._result import Attachments, Result, result_from_json, summarize

if TYPE_CHECKING:
    import xarray

    from turing_learning.identifiability import Check


def load_run(path: str | Path) -> Result:
    """Open a run that is finished, stopped, killed, or still running.

    Parameters
    ----------
    path
        The run folder.

    Returns
    -------
    Result
        What was inferred up to the last checkpoint.

    Raises
    ------
    RunFolderError
        If the folder is not a run, or has not been saved for the first time.
    """
    folder = RunFolder(Path(path))
    configuration = folder.configuration()
    finished = folder.manifest()["state"] == FINISHED
    stored = _stored_result(folder, configuration) if finished else None
    if stored is not None:
        return stored
    return _result_of(_stored_checkpoint(folder, configuration), folder, configuration)


def is_whole(folder: RunFolder, configuration: Configuration) -> bool:
    """Return whether a run is finished and has its result."""
    return folder.manifest()["state"] == FINISHED and _stored_result(folder, configuration) is not None


def restored_result(folder: RunFolder, configuration: Configuration) -> bool:
    """Write the result of a finished run again, if its checkpoint is left; the caller holds the lock."""
    if folder.manifest()["state"] != FINISHED:
        return False
    checkpoint = latest_checkpoint(folder.checkpoints_path).checkpoint
    if checkpoint is not None:
        write_json(folder.result_path, _result_of(checkpoint, folder, configuration).to_json())
    return checkpoint is not None


def _stored_result(folder: RunFolder, configuration: Configuration) -> Result | None:
    try:
        content = json.loads(folder.result_path.read_text(encoding="utf-8"))
        attachments = attachments_of(folder, configuration, content["generations"])
        return result_from_json(content, path=folder.path.absolute(), attachments=attachments)
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _result_of(checkpoint: Checkpoint, folder: RunFolder, configuration: Configuration) -> Result:
    traces = _traces_of(checkpoint, configuration)
    return summarize(
        configuration,
        traces,
        float(checkpoint.arrays["seconds"]),
        path=folder.path.absolute(),
        attachments=attachments_of(folder, configuration, traces.completed),
        failed_simulations=_failed_simulations(checkpoint, configuration),
    )


def _stored_checkpoint(folder: RunFolder, configuration: Configuration) -> Checkpoint:
    checkpoint = latest_checkpoint(folder.checkpoints_path).checkpoint
    if checkpoint is None:
        raise RunFolderError(
            f"`run` must have been saved at least once; got {folder.path} without a usable checkpoint. "
            f"Begin it with {going_on(folder.path, configuration)}."
        )
    return checkpoint


def _stored_traces(folder: RunFolder, configuration: Configuration) -> Traces:
    return _traces_of(_stored_checkpoint(folder, configuration), configuration)


def _traces_of(checkpoint: Checkpoint, configuration: Configuration) -> Traces:
    traces = Traces(configuration.run.generations, len(configuration.parameter_names))
    traces.restore(part(checkpoint.arrays, "traces/"))
    return traces


def _failed_simulations(checkpoint: Checkpoint, configuration: Configuration) -> dict[str, Any] | None:
    state = part(checkpoint.arrays, FAILURES)
    if not state:
        return None
    log = FailureLog(configuration.parameter_names)
    log.restore(state)
    return log.summary()


def attachments_of(folder: RunFolder, configuration: Configuration, completed: int) -> Attachments:
    """Return what the result of a run in a folder can open or make, from wherever the process is by then."""
    return _attached(RunFolder(folder.path.absolute()), configuration, completed, folder.begun())


def _attached(folder: RunFolder, configuration: Configuration, completed: int, begun: tuple[Any, Any]) -> Attachments:
    def history() -> "xarray.Dataset":
        if configuration.run.history == "thin":
            return thin_dataset(_stored_traces(folder, configuration), configuration.parameter_names)
        with told(
            RunFolderError,
            f"`run` must have its history; got {folder.path} without a readable {folder.history_path.name}",
            "Restore it, or run again.",
        ):
            return dataset_on_disk(folder.history_path, completed)

    return Attachments(
        configuration=configuration,
        history=history,
        report=reporter(configuration, folder.manifest, folder.report_path),
        check=checker(configuration),
        require_there=lambda: folder.require_there(begun),
        again=(_attached, (folder, configuration, completed, begun)),
    )


def reporter(
    configuration: Configuration, manifest: Callable[[], dict[str, Any]], default: Path | None
) -> Callable[[Result, Path | None], Path]:
    """Return what writes the report of a run, by default to a file of its folder."""

    def write(result: Result, path: Path | None) -> Path:
        from turing_learning.report import write_page

        from .results._present import draw, drawn_history, report_page

        target = path or default
        assert target is not None
        history = drawn_history(result)
        drawings = draw(history, configuration)
        rows, check = manifest_rows(manifest()), complete_check(result.path)
        return write_page(report_page(result, history, configuration, drawings, rows, check), target)

    return write


def checker(configuration: Configuration, **given: Any) -> "Callable[..., Check]":
    """Return what checks a run, whose own system may be given."""

    def check(result: Result, /, **options: Any) -> "Check":
        from ._check_run import check_run, refuse_unknown_part

        refuse_unknown_part(options)
        return check_run(result, configuration, **given | options)

    return check
