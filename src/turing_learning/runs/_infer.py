"""The doors: infer, resume, load a run."""

import json
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack, cast

from turing_learning.config import Configuration, ConfigurationError, OwnConfiguration, load_configuration, to_toml
from turing_learning.robots import LaboratoryError
from turing_learning.sources import FailureLog, OwnSource, OwnSystem, OwnSystemError, Simulator
from turing_learning.swarm import Scenario

from ._check import complete_check
from ._checkpoints import Checkpoint, latest_checkpoint, replace_checkpoints
from ._errors import RunFolderError
from ._files import remove_partial, write_json
from ._folder import RunFolder, resume_command
from ._history import dataset_in_memory, dataset_on_disk, thin_dataset
from ._manifest import FINISHED, RUNNING, STOPPED, manifest_rows, new_manifest, now, this_process
from ._own import (
    OwnOptions,
    Range,
    describe_system,
    open_source,
    refuse_without_source,
    refuse_without_system,
    reopen_source,
)
from ._result import Attachments, Result, result_from_json, summarize
from ._session import FAILURES, Observer, Session, part, storage
from ._traces import Traces

if TYPE_CHECKING:
    import xarray

    from turing_learning.identifiability import Check
    from turing_learning.robots import LaboratorySource

    from ._assemble import GivenSource

RUNS = Path("runs")


def infer(
    scenario: str | Scenario | None = None,
    *,
    genuine: Any = None,
    simulate: Simulator | None = None,
    parameters: Mapping[str, Range] | None = None,
    generations: int | None = None,
    seed: int | None = None,
    preset: str = "default",
    config: str | Path | Configuration | None = None,
    settings: Mapping[str, Any] | None = None,
    threads: int | None = None,
    out: str | Path | None = None,
    force: bool = False,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
    **options: Unpack[OwnOptions],
) -> Result:
    """Infer the behavior of a swarm, or of any system that was observed, by Turing Learning.

    Parameters
    ----------
    scenario
        Name of a preset scenario, or a scenario; by default that of the configuration, else "aggregation". Left out for a
        system of one's own, which is given by `genuine`, `simulate` and `parameters` together.
    genuine
        Samples (K, T, D) of a system of one's own, or K arrays (T, D), or windows of recorded motion, or a function
        rng -> (K, T, D) that observes it, or a scenario or the name of one, whose agents are observed anew in every generation.
    simulate
        Simulates models of it: a function (parameters (M, P), rng) -> samples (M, T, D), or (M, C, T, D) with C samples
        of each model. The columns are in the order of `parameters`; all randomness comes from `rng`.
    parameters
        Name -> (low, high), the range of the first models and the space of the search, where None leaves a side open;
        or name -> `Parameter`, with a unit or on a logarithmic scale.
    generations
        Number of generations, >= 1.
    seed
        Seed of all random numbers, >= 0. The same seed gives the same result for any number of threads.
    preset
        "default", or "paper" to keep to the text of the paper.
    config
        A TOML file, or a resolved configuration. The other arguments come before it.
    settings
        Dotted key -> value, any setting of a configuration, for example ``{"models.parents": 20}``.
    threads
        Number of threads; None takes the configuration's, which is all by default.
    out
        A new or empty folder for the run; None keeps it in memory.
    force
        Whether a run that is in the folder already may be replaced.
    observer
        Called with a `Progress` after every generation.
    should_stop
        Called after every generation; if it returns True, the run stops there and can be resumed.
    **options
        More about a system of one's own: name, title, signals, length, held_out, samples_per_generation, vectorized,
        batches, workers, timeout_s; see docs/own-system.md.

    Returns
    -------
    Result
        What was inferred, with the whole history.

    Raises
    ------
    ConfigurationError
        If a setting is refused.
    RunFolderError
        If the folder is refused.
    RunStorageError
        If the folder cannot be written any more; the run can be resumed.
    OwnSystemError
        If the simulator of one's own raises or returns the wrong shape in the first generation, or fails for more than
        half of the models of a later one; what was inferred before is saved, and the run can be resumed.

    Examples
    --------
    >>> import turing_learning as tl
    >>> result = tl.infer("aggregation", generations=1000, seed=1)  # doctest: +SKIP
    >>> result.estimate  # doctest: +SKIP
    {'vl0': -0.70, 'vr0': -1.00, 'vl1': 1.01, 'vr1': -0.99}
    """
    given = {"run.generations": generations, "run.seed": seed, "run.threads": threads}
    overrides = dict(settings or {}) | {key: value for key, value in given.items() if value is not None}
    resolve = partial(_resolved, preset=preset, config=config, overrides=overrides)
    execute = partial(_execute, out=out, force=force, observer=observer, should_stop=should_stop)
    if genuine is None and simulate is None and parameters is None:
        refuse_without_system(**options)
        return execute(resolve(scenario))
    _refuse_half_a_system(scenario, genuine=genuine, simulate=simulate, parameters=parameters)
    assert parameters is not None
    system, data = describe_system(genuine, parameters, options)
    configuration = resolve(system)
    with open_source(system, data, simulate, options) as source:
        result = execute(configuration, source)
    return _remembering(result, configuration, genuine=genuine, simulate=simulate)


def _remembering(result: Result, configuration: Configuration, **given: Any) -> Result:
    """Return a result that knows its system, so that it can be checked without being told again."""
    assert result.attachments is not None
    return replace(result, attachments=replace(result.attachments, check=_checker(configuration, **given)))


def _checker(configuration: Configuration, **given: Any) -> "Callable[..., Check]":
    def check(result: Result, **options: Any) -> "Check":
        from ._check_run import check_run

        return check_run(result, configuration, **given | options)

    return check


def _execute(
    configuration: Configuration,
    source: OwnSource | None = None,
    *,
    out: str | Path | None,
    force: bool,
    observer: Observer | None,
    should_stop: Callable[[], bool] | None,
) -> Result:
    if out is None:
        return in_memory(configuration, observer, should_stop, source)
    return start(configuration, out, force=force, observer=observer, should_stop=should_stop, source=source)


def _refuse_half_a_system(scenario: str | Scenario | None, **system: Any) -> None:
    missing = [name for name, value in system.items() if value is None]
    if missing:
        raise ConfigurationError(
            f"`{missing[0]}` must be given for a system of one's own; got nothing. It is given by `genuine`, `simulate` and "
            "`parameters` together."
        )
    if scenario is not None:
        raise ConfigurationError(f"`scenario` must be left out for a system of one's own; got {scenario!r}.")


def _resolved(
    scenario: str | Scenario | OwnSystem | None,
    preset: str,
    config: str | Path | Configuration | None,
    overrides: Mapping[str, Any],
) -> Configuration:
    labels = {key: f"argument {key.rpartition('.')[2]}" for key in overrides if key.startswith("run.")}
    if not isinstance(config, str | Path | Configuration | None):
        raise ConfigurationError(
            f"`config` must be a TOML file or a Configuration; got {type(config).__name__}. Give single settings to "
            "`turing_learning.config.load_configuration`, and its result here."
        )
    if isinstance(config, Configuration):
        flat = {
            f"{name}.{key}": value for name, section in config.model_dump().items() for key, value in section.items()
        }
        known = {key: value for key, value in flat.items() if not key.startswith("scenario.")} | dict(overrides)
        if isinstance(config, OwnConfiguration) and isinstance(scenario, OwnSystem):
            known = {key: value for key, value in known.items() if key != "classifiers.input_scale" or key in overrides}
        return load_configuration(None, preset, known, scenario=scenario or config.scenario, labels=labels)
    return load_configuration(config, preset, overrides, scenario=scenario, labels=labels)


def in_memory(
    configuration: Configuration,
    observer: Observer | None,
    should_stop: Callable[[], bool] | None,
    source: "GivenSource | None" = None,
) -> Result:
    """Run a configuration from generation 0 without a folder; see `start`."""
    refuse_without_source(configuration, source)
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
        configuration, history, _reporter(configuration, lambda: manifest, None), _checker(configuration)
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
    source: "GivenSource | None" = None,
    files: Mapping[str, bytes] | None = None,
) -> Result:
    """Run a configuration from generation 0 in a folder of its own; see `infer`.

    A system of one's own, or a laboratory, has its `source`, which the caller closes, and may have `files` of its own in the
    folder, name -> content.
    """
    refuse_without_source(configuration, source)
    folder = RunFolder(Path(out))
    with ExitStack() as lock:
        with _writable(folder, "out"):
            folder.refuse_if_taken(force=force)
            folder.path.mkdir(parents=True, exist_ok=True)
            lock.enter_context(folder.locked())
            folder.create(configuration, force=force, files=files)
            session = Session(configuration, folder, source)
        return _run(session, folder, configuration, observer, should_stop)


def resume(
    path: str | Path,
    *,
    genuine: Any = None,
    simulate: Simulator | None = None,
    workers: int | None = None,
    timeout_s: float | None = None,
    threads: int | None = None,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Result:
    """Go on with a run that was stopped or killed; the result is that of a run that never was.

    Parameters
    ----------
    path
        The run folder. One that is finished is left as it is.
    genuine, simulate
        Of a system of one's own: the samples that the run began with, and the simulator, neither of which is in the folder.
    workers, timeout_s
        As in `infer`.
    threads
        Number of threads; None takes that of the configuration.
    observer, should_stop
        As in `infer`.

    Returns
    -------
    Result
        What was inferred.

    Raises
    ------
    RunFolderError
        If the folder is not a run, has been changed, or is in use; if a system of one's own lacks its samples or simulator,
        or the samples are others.
    RunStorageError
        If the folder cannot be written; the run can be resumed.
    """
    given = {"workers": workers, "timeout_s": timeout_s}
    options = cast(OwnOptions, {name: value for name, value in given.items() if value is not None})

    def reopen(folder: RunFolder, configuration: Configuration) -> OwnSource | None:
        _refuse_laboratory(folder)
        return reopen_source(folder, configuration, genuine, simulate, options)

    return go_on(path, reopen, threads=threads, observer=observer, should_stop=should_stop)


def _refuse_laboratory(folder: RunFolder) -> None:
    if folder.laboratory_path.exists():
        raise RunFolderError(
            f"`run` must be one that the computer can go on with alone; got {folder.path}, which takes place in a "
            f"laboratory. Go on with `{resume_command(folder.path)}`."
        )


def go_on(
    path: str | Path,
    reopen: "Callable[[RunFolder, Configuration], OwnSource | LaboratorySource | None]",
    *,
    threads: int | None = None,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Result:
    """Go on with a run whose source `reopen` opens, while the folder is locked; see `resume`."""
    folder = RunFolder(Path(path))
    configuration = folder.configuration()
    if _is_whole(folder, configuration):
        return load_run(path)
    here = configuration if threads is None else _resolved(None, "default", configuration, {"run.threads": threads})
    with ExitStack() as lock:
        with _writable(folder, "run"):
            lock.enter_context(folder.locked())
            if _is_whole(folder, configuration) or _restored_result(folder, configuration):
                return load_run(path)
            source = reopen(folder, configuration)
            if source is not None:
                lock.enter_context(source)
            remove_partial(folder.path)
            folder.update_manifest(state=RUNNING, process=this_process())
            session = Session(here, folder, source)
        return _run(session, folder, configuration, observer, should_stop)


def _is_whole(folder: RunFolder, configuration: Configuration) -> bool:
    """Return whether a run is finished and has its result."""
    return folder.manifest()["state"] == FINISHED and _stored_result(folder, configuration) is not None


def _restored_result(folder: RunFolder, configuration: Configuration) -> bool:
    """Write the result of a finished run again, if its checkpoint is left; the caller holds the lock."""
    if folder.manifest()["state"] != FINISHED:
        return False
    checkpoint = latest_checkpoint(folder.checkpoints_path).checkpoint
    if checkpoint is not None:
        write_json(folder.result_path, _result_of(checkpoint, folder, configuration).to_json())
    return checkpoint is not None


def _run(
    session: Session,
    folder: RunFolder,
    configuration: Configuration,
    observer: Observer | None,
    should_stop: Callable[[], bool] | None,
) -> Result:
    try:
        session.run(observer, should_stop)
    except (OwnSystemError, LaboratoryError):
        folder.update_manifest(state=STOPPED, seconds=session.seconds)
        raise
    result = summarize(
        configuration,
        session.traces,
        session.seconds,
        path=folder.path,
        attachments=_attachments(folder, configuration, session.traces.completed),
        failed_simulations=session.failed_simulations,
    )
    with storage(folder):
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

    from ._present import draw, drawn_history, report_page, save_figures

    history = drawn_history(result)
    drawings = draw(history, configuration)
    save_figures(drawings, folder.figures_path)
    closed = {"state": FINISHED, "finished": now()}
    rows = manifest_rows(folder.manifest() | closed)
    write_page(report_page(result, history, configuration, drawings, rows), folder.report_path)
    folder.update_manifest(**closed)


def _attachments(folder: RunFolder, configuration: Configuration, completed: int) -> Attachments:
    def history() -> "xarray.Dataset":
        if configuration.run.history == "thin":
            return thin_dataset(_stored_traces(folder, configuration), configuration.parameter_names)
        return dataset_on_disk(folder.history_path, completed)

    return Attachments(
        configuration=configuration,
        history=history,
        report=_reporter(configuration, folder.manifest, folder.report_path),
        check=_checker(configuration),
    )


def _reporter(
    configuration: Configuration, manifest: Callable[[], dict[str, Any]], default: Path | None
) -> Callable[[Result, Path | None], Path]:
    def write(result: Result, path: Path | None) -> Path:
        from turing_learning.report import write_page

        from ._present import draw, drawn_history, report_page

        target = path or default
        assert target is not None
        history = drawn_history(result)
        drawings = draw(history, configuration)
        rows, check = manifest_rows(manifest()), complete_check(result.path)
        return write_page(report_page(result, history, configuration, drawings, rows, check), target)

    return write


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
    return _result_of(_stored_checkpoint(folder), folder, configuration)


def _stored_checkpoint(folder: RunFolder) -> Checkpoint:
    checkpoint = latest_checkpoint(folder.checkpoints_path).checkpoint
    if checkpoint is None:
        raise RunFolderError(
            f"`run` must have been saved at least once; got {folder.path} without a usable checkpoint. "
            f"Begin it with `{resume_command(folder.path)}`."
        )
    return checkpoint


def _stored_traces(folder: RunFolder, configuration: Configuration) -> Traces:
    return _traces_of(_stored_checkpoint(folder), configuration)


def _traces_of(checkpoint: Checkpoint, configuration: Configuration) -> Traces:
    traces = Traces(configuration.run.generations, len(configuration.parameter_names))
    traces.restore(part(checkpoint.arrays, "traces/"))
    return traces


def _stored_result(folder: RunFolder, configuration: Configuration) -> Result | None:
    try:
        content = json.loads(folder.result_path.read_text(encoding="utf-8"))
        attachments = _attachments(folder, configuration, content["generations"])
        return result_from_json(content, path=folder.path, attachments=attachments)
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _result_of(checkpoint: Checkpoint, folder: RunFolder, configuration: Configuration) -> Result:
    traces = _traces_of(checkpoint, configuration)
    return summarize(
        configuration,
        traces,
        float(checkpoint.arrays["seconds"]),
        path=folder.path,
        attachments=_attachments(folder, configuration, traces.completed),
        failed_simulations=_failed_simulations(checkpoint, configuration),
    )


def _failed_simulations(checkpoint: Checkpoint, configuration: Configuration) -> dict[str, Any] | None:
    if not isinstance(configuration, OwnConfiguration):
        return None
    log = FailureLog(configuration.scenario.parameter_names)
    log.restore(part(checkpoint.arrays, FAILURES))
    return log.summary()


def new_run_path(name: str, seed: int, parent: Path = RUNS) -> Path:
    """Return a folder for a run that does not exist, named after scenario, time and seed.

    Parameters
    ----------
    name, seed
        Of the scenario, and of the run.
    parent
        The folder of all runs.
    """
    name = f"{name}-{time.strftime('%Y%m%d-%H%M%S')}-seed{seed}"
    path, number = parent / name, 2
    while path.exists():
        path, number = parent / f"{name}-{number}", number + 1
    return path


@contextmanager
def _writable(folder: RunFolder, name: str) -> Iterator[None]:
    """Turn what the operating system says before generation 0 into one message."""
    try:
        yield
    except OSError as error:
        raise RunFolderError(
            f"`{name}` must be a folder that can be written; got {folder.path} ({error.strerror or error}). "
            "Choose another folder, or make room."
        ) from error
