"""Runs in a laboratory: the same loop, with robots as the source of samples."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning import robots
from turing_learning.config import Configuration, ConfigurationError
from turing_learning.config.parts import give_again, part_named
from turing_learning.errors import reject
from turing_learning.robots.emulation import SimulatedLaboratory
from turing_learning.robots.program import (
    laboratory_calibration,
    read_setup,
    refuse_without_history,
)
from turing_learning.store import DamagedError, RunFolderError, reject_folder, writable

from ._folder import CAMERA, FINISHED, LABORATORY, RunFolder, resume_command, stored_generations
from ._infer import start
from ._progress import Observer, Progress
from ._result import Posterior, Result
from ._run import Run, conduct
from ._trials import (
    POST_EVALUATION,
    judged_again,
    note_event,
    post_evaluate,
    read_post_evaluation,
    stored_trials,
)

EventObserver = Callable[[robots.Event], None]


def start_laboratory(
    laboratory: robots.Laboratory,
    out: str | Path,
    *,
    open_replica: Callable[[str], robots.Replica] | str | None = None,
    tracker: Callable[[robots.LaboratorySetup], robots.PoseSource] | str | None = None,
    equipment: robots.Equipment | None = None,
    force: bool = False,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
    on_event: EventObserver | None = None,
) -> Result:
    """Run Turing Learning with real robots, from generation 0; then evaluate the last models again.

    Parameters
    ----------
    laboratory
        See `robots.load_laboratory`.
    out, force, observer, should_stop
        As in `infer`.
    open_replica
        Address -> `robots.Replica`, for robots that are no e-pucks: a function, its name
        "module:function", or the name of an entry point in the group "turing_learning.robots". In
        place of `open_replica` in the file.
    tracker
        Setup -> `robots.PoseSource`, for anything but a camera; likewise.
    equipment
        Its devices; the real ones by default.
    on_event
        Called with every `robots.Event`: states of the program, trials, disturbances, new
        batteries.

    Raises
    ------
    LaboratoryError
        If the laboratory cannot go on and nobody helps. The generations before are saved.

    Source
    ------
    Paper, section 5.
    """
    named = {}
    if open_replica is not None:
        named["open_replica"] = part_named(open_replica)
    if tracker is not None:
        named["tracker"] = part_named(tracker)
    laboratory = replace(laboratory, setup=laboratory.setup.model_copy(update=named))
    folder = RunFolder(out)
    setup = laboratory.setup
    files = {}
    stored = setup
    calibration = setup.camera.calibration
    with _source(laboratory, folder, equipment, on_event) as source:
        if calibration:
            laboratory_calibration(setup)
            files[CAMERA] = Path(calibration).read_bytes()
            stored = _calibrated(setup, CAMERA)
        files[LABORATORY] = (stored.model_dump_json(indent=1) + "\n").encode()
        watch: dict[str, Any] = {"observer": observer, "should_stop": should_stop}
        result = start(
            laboratory.configuration, out, force=force, source=source, files=files, **watch
        )
        post_evaluate(result, folder, source, setup.evaluation.repeats, should_stop)
    return result


def resume_laboratory(
    path: str | Path,
    *,
    open_replica: Callable[[str], robots.Replica] | None = None,
    tracker: Callable[[robots.LaboratorySetup], robots.PoseSource] | None = None,
    equipment: robots.Equipment | None = None,
    trials: int | None = None,
    tolerance: float | None = None,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
    on_event: EventObserver | None = None,
) -> Result:
    """Go on with a run in a laboratory. See `start_laboratory`.

    Trials that were executed are not executed again. With `trials`, and `tolerance`, a finished run
    of trials gets more of them, see `Run.open`. The folder's `laboratory.json` may have been edited
    meanwhile, for example an address: then `trust_laboratory` comes first. A rehearsal (see
    `robots.as_emulated`) is refused without `equipment`. Functions that have names need not be
    given again.
    """
    folder = RunFolder(path)
    setup = stored_setup(folder)
    configuration = folder.configuration()
    refuse_without_history(setup, configuration, str(folder.laboratory_path))
    if setup.emulated and equipment is None:
        rule = "be given for a rehearsal, which must not meet real robots"
        where = str(folder.path)
        remedy = "Give robots.rehearse(runs.stored_laboratory(path))."
        reject("equipment", rule, "none", remedy, place=where)
    give_again("open_replica", setup.open_replica or "", open_replica)
    give_again("tracker", setup.tracker or "", tracker)
    with _source(robots.Laboratory(setup, configuration), folder, equipment, on_event) as source:
        run = Run.open(path, lambda _configuration: source, trials=trials, tolerance=tolerance)
        result = conduct(run, observer, should_stop)
        post_evaluate(result, folder, source, setup.evaluation.repeats, should_stop)
    return result


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """What a run has inferred from a laboratory's trials in plain simulation.

    Attributes
    ----------
    result
        As of any run, kept in memory.
    fitness : (repeats, M)
        Of the models of the last generation, observed again and judged by all its classifiers; none
        of a run of trials.
    best_model : (P,)
        That of the highest mean fitness, in wheel speeds; of a run of trials the estimate.
    """

    result: Result
    fitness: np.ndarray
    best_model: np.ndarray


def simulate_laboratory(
    configuration: Configuration,
    repeats: int = 5,
    *,
    observer: Observer | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> SimulatedRun | None:
    """Run Turing Learning with a laboratory's setup in plain simulation, in seconds.

    To see what a laboratory adds, or costs: the same numbers of robots, models, classifiers and
    trials, the same observed time, the hyperbolic tangent on the models, the same post-evaluation.
    None if it was stopped.

    Parameters
    ----------
    configuration
        Of the laboratory; see `robots.load_laboratory`.
    repeats
        How often the models of the last generation are observed again, >= 1.
    observer, should_stop
        As in `infer`.

    Source
    ------
    Paper, section 5.4.
    """
    of_trials = configuration.run.trials > 0
    source = SimulatedLaboratory(configuration.swarm, configuration.run.seed, of_trials=of_trials)
    populations: list[tuple[np.ndarray, np.ndarray]] = []

    def watch(progress: Progress) -> None:
        populations[:] = [(progress.scored.models, progress.scored.classifiers)]
        if observer is not None:
            observer(progress)

    result = conduct(Run.begin(configuration, source=source), watch, should_stop)
    if not result.complete:
        return None
    models, classifiers = populations[0]
    if isinstance(result, Posterior):
        return SimulatedRun(
            result, np.empty((0, len(models))), np.array(list(result.estimate.values()))
        )
    observed = (source.observe(models, f"{POST_EVALUATION}{k + 1}") for k in range(repeats))
    fitness = np.array([judged_again(configuration, classifiers, samples) for samples in observed])
    return SimulatedRun(result, fitness, models[int(np.argmax(fitness.mean(axis=0)))])


def is_laboratory_run(path: str | Path) -> bool:
    """Return whether a run takes place in a laboratory."""
    folder = RunFolder(path)
    # Which one has before it is a run
    return folder.is_run() and folder.laboratory_path.exists()


def trust_laboratory(path: str | Path) -> None:
    """Seal `laboratory.json` and `camera.json` of a run as they are now, after they were edited.

    `laboratory.json` names functions, `open_replica` and `tracker`, that are executed when the run is resumed. So
    read it before you trust it.
    """
    folder = RunFolder(path)
    _require_laboratory(folder)
    with writable("run", folder.path), folder.locked():
        for name in (LABORATORY, CAMERA):
            # Another tracker needs no camera
            if (folder.path / name).exists():
                folder.write(name, (folder.path / name).read_bytes())


def stored_setup(folder: RunFolder) -> robots.LaboratorySetup:
    """Return the laboratory of a run.

    A RunFolderError says that it cannot be read, or was edited and not trusted.
    """
    _require_laboratory(folder)
    try:
        text = folder.read_bytes(LABORATORY).decode()
        setup = read_setup(text)
        if (folder.path / CAMERA).exists():
            folder.read_bytes(CAMERA)
    except DamagedError as error:
        trust = f"`{resume_command(folder.path)} --trust`"
        call = f"`turing_learning.runs.trust_laboratory({str(folder.path)!r})`"
        remedy = f"Or read it, as {LABORATORY} names functions that are executed, and trust it: {trust}, or {call}."
        raise RunFolderError(f"{error} {remedy}") from error
    except (UnicodeDecodeError, ConfigurationError) as error:
        raise RunFolderError(f"{error} [{folder.laboratory_path}]") from error
    calibration = setup.camera.calibration
    if calibration:
        return _calibrated(setup, str(folder.path / calibration))
    return setup


def _require_laboratory(folder: RunFolder) -> None:
    folder.manifest()
    if not folder.laboratory_path.exists():
        got = f"{folder.path} without {LABORATORY}"
        remedy = f"Go on with `{resume_command(folder.path)}`"
        remedy += " if it is a run of another kind."
        reject_folder("run", "take place in a laboratory", got, remedy)


def _calibrated(setup: robots.LaboratorySetup, path: str) -> robots.LaboratorySetup:
    return setup.model_copy(
        update={"camera": setup.camera.model_copy(update={"calibration": path})}
    )


def stored_laboratory(path: str | Path) -> robots.Laboratory:
    """Return the laboratory of a run, and the run that it is to do.

    A RunFolderError says that they cannot be read.
    """
    folder = RunFolder(path)
    return robots.Laboratory(stored_setup(folder), folder.configuration())


def awaits_robots(path: str | Path) -> bool:
    """Return whether robots are needed to resume a run in a laboratory.

    For generations, or to observe its last models again.
    """
    folder = RunFolder(path)
    setup = stored_setup(folder)
    again = read_post_evaluation(path)
    configuration = folder.configuration()
    unfinished = stored_generations(folder.checkpoints_path) < configuration.length
    if unfinished or configuration.run.trials:
        # With a tolerance also before its length
        return unfinished and folder.manifest()["state"] != FINISHED
    observed = 0 if again is None else len(again.fitness)
    return setup.evaluation.repeats > observed


def _source(
    laboratory: robots.Laboratory,
    folder: RunFolder,
    equipment: robots.Equipment | None,
    on_event: EventObserver | None,
) -> robots.LaboratorySource:
    def spent(batches: int) -> int:
        # The run may have got more of them
        if batches > 0:
            return folder.configuration().trials_after(batches)
        return 0

    def watch(event: robots.Event) -> None:
        note_event(folder, event)
        if on_event is not None:
            on_event(event)

    return robots.LaboratorySource(
        laboratory.setup,
        laboratory.configuration.swarm,
        equipment or robots.real_equipment(laboratory),
        watch=watch,
        stored=partial(stored_trials, folder),
        spent=spent if laboratory.configuration.run.trials else None,
    )
