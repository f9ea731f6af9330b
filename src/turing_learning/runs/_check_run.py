"""The door of a check: from a result, and what is given of its system, to all that is said of it."""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import fields
from functools import partial
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from turing_learning.config import Configuration, ConfigurationError
from turing_learning.errors import refusing_as
from turing_learning.systems import CustomOptions, CustomSystem, Simulator, Source, System, same_time_step
from turing_learning.systems import Given as GivenSystem

from ._check import Checker, Given, Stage, held_out_groups, kept, require_numbers
from ._execute import in_memory, start
from ._infer import infer, refuse_unknown, resume
from .folder._errors import RunFolderError, RunStorageError, writable
from .folder._folder import RunFolder
from .results._result import Result

if TYPE_CHECKING:
    from turing_learning.identifiability import Check, Effort
    from turing_learning.trajectories import Trajectories


def check_run(
    result: Result,
    configuration: Configuration,
    *,
    genuine: Any = None,
    simulate: Simulator | None = None,
    recording: "Trajectories | None" = None,
    groups: Any = None,
    effort: "Effort | None" = None,
    recoveries: int = 1,
    recovery_generations: int | None = None,
    seed: int = 0,
    workers: int | None = None,
    timeout_s: float | None = None,
    force: bool = False,
    stage: Stage | None = None,
) -> "Check":
    """Check whether the estimate of a run can be believed; call it as `Result.check`.

    Parameters
    ----------
    result, configuration
        Of the run.
    genuine, simulate
        Of a custom system, as when the run began; needed where the run was loaded from a folder.
    recording
        The recording that the samples are from, to compare distances of neighbors and polarization, too. The simulator has
        to say where everybody was, as model families do.
    groups : (K,)
        Labels of the samples, of any kind; those with the same one are alike, for example of one individual. None takes the
        individuals of windows of recorded motion, and each sample for itself otherwise.
    effort
        How much is simulated and trained.
    recoveries, recovery_generations
        Number of runs whose truth is the estimate, 0 for none, and their length; None takes that of the run.
    seed
        Of all random numbers of the check, >= 0.
    workers, timeout_s
        As in `infer`.
    force
        Whether to look anew, and to replace the check that is there, whatever its settings.
    stage
        Called with a word on what comes next.

    Returns
    -------
    Check
        Of a run in a folder it is also in ``check/check.json``, in figures, and in the report.

    Raises
    ------
    ConfigurationError
        If a setting is refused, or the run does not allow a check.
    RunFolderError
        If the folder is in use or holds a check with other settings, or the samples are not those of the run.
    CustomSystemError
        If the simulator fails for most of the samples.
    """
    from turing_learning.identifiability import Effort

    length = result.generations if recovery_generations is None else recovery_generations
    require_numbers(recoveries=recoveries, recovery_generations=length, seed=seed)
    if not isinstance(effort, Effort | None):
        raise ConfigurationError(
            f"`effort` must be an Effort; got {type(effort).__name__}. For example "
            "turing_learning.identifiability.Effort(samples=100)."
        )
    _refuse_laboratory(result)
    folder = None if result.path is None else RunFolder(result.path)
    options: CustomOptions = {}
    if workers is not None:
        options["workers"] = workers
    if timeout_s is not None:
        options["timeout_s"] = timeout_s
    with ExitStack() as stack:
        if folder is not None:
            with writable("run", folder.path):
                stack.enter_context(folder.locked())
        source, given = _given(configuration, genuine, simulate, groups, options)
        stack.enter_context(source)
        if given is not None:
            _refuse_other_rate(recording, given.system)
        elif recording is not None:
            raise ConfigurationError("`recording` must be left out for simulated robots; got one.")
        found = Checker(
            result=result,
            configuration=configuration,
            source=source,
            given=given,
            effort=effort or Effort(),
            seed=seed,
            recoveries=recoveries,
            recovery_generations=length,
            recording=recording,
            recover=partial(_recover, options=options),
            stage=stage or _say_nothing,
        ).run(folder, force=force)
        if folder is not None:
            _draw(result, configuration, found, folder, stage or _say_nothing)
    return found


def refuse_unknown_part(options: Mapping[str, Any]) -> None:
    """Raise ConfigurationError if there is an option that no check has."""
    from turing_learning.identifiability import Effort

    for each in fields(Effort):
        if each.name in options:
            raise ConfigurationError(
                f"`{each.name}` must be a part of the effort; got {options[each.name]!r} beside it. Give "
                f"effort=turing_learning.identifiability.Effort({each.name}={options[each.name]!r})."
            )
    refuse_unknown(options, list(signature(check_run).parameters)[2:])


def _say_nothing(stage: str) -> None:
    pass


def _refuse_other_rate(recording: "Trajectories | None", system: System) -> None:
    """Raise ConfigurationError if a recording has another frame rate than the samples, which are from it."""
    if recording is not None and system.interval_s > 0 and not same_time_step(system.interval_s, 1 / recording.fps):
        raise ConfigurationError(
            f"`recording` must have the frame rate of the samples, {1 / system.interval_s:.6g} per second; got "
            f"{recording.fps:.6g}. Give the recording that the samples are from."
        )


def _refuse_laboratory(result: Result) -> None:
    """Raise ConfigurationError for robots that nobody can simulate: a check would compare two simulations."""
    if result.in_laboratory:
        raise ConfigurationError(
            f"`run` must be of a system that can be simulated; got one in a laboratory [{result.path}]. What its models are worth "
            "there is in post_evaluation.json; `turing_learning.runs.simulate_laboratory` says what its setup could infer at all."
        )


def _given(
    configuration: Configuration, genuine: Any, simulate: Any, groups: Any, options: CustomOptions
) -> tuple[Source, Given | None]:
    given = GivenSystem(genuine, simulate, options.get("workers"), options.get("timeout_s"), groups)
    with refusing_as(ConfigurationError):
        source = configuration.system.open(given)
    if source.genuine is None:
        return source, None
    labels, grouping = held_out_groups(genuine, source.genuine, groups)
    system = cast(CustomSystem, configuration.scenario)
    return source, Given(source.genuine, system, simulate, options, labels, grouping)


def _recover(
    configuration: Configuration, path: Path | None, system: Mapping[str, Any], options: CustomOptions
) -> Result:
    try:
        if path is not None and RunFolder(path).is_run():
            return resume(
                path,
                genuine=system.get("genuine"),
                simulate=system.get("simulate"),
                workers=options.get("workers"),
                timeout_s=options.get("timeout_s"),
            )
        if system:
            return infer(config=configuration, out=path, **system)
        return in_memory(configuration, None, None) if path is None else start(configuration, path)
    except (RunFolderError, RunStorageError) as error:
        if path is None or not isinstance(error.__cause__, OSError):
            raise
        with kept(path.parent.parent):  # goes on as a check, not as a run of its own
            raise error.__cause__ from None


def _draw(result: Result, configuration: Configuration, found: "Check", folder: RunFolder, stage: Stage) -> None:
    """Write the figures of a check, and the report of the run again where there is one and the history that it shows."""
    from .results._check_present import draw_check
    from .results._present import save_figures

    drawings = draw_check(found, result, configuration)
    with kept(folder.path):
        save_figures(drawings, folder.figures_path)
        if folder.report_path.exists():
            try:
                result.report()
            except RunFolderError as error:
                stage(f"the report is left as it was: {error}")
