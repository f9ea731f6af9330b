"""Trials as they were observed: their raw tracks, the log of a laboratory, and which model is best
when they are observed again."""

import json
import logging
import os
import re
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from turing_learning.analysis import absolute_error
from turing_learning.coevolution import Judgments, Samples, model_reward
from turing_learning.config import Configuration, classifier_of
from turing_learning.detection import observed_calibration
from turing_learning.provenance import now
from turing_learning.store import RunFolderError, check_folder

from ._folder import CALIBRATION, RunFolder
from ._result import Posterior, Result, named

if TYPE_CHECKING:
    from turing_learning.robots import Event, LaboratorySource
    from turing_learning.robots.program import ObservedTrial


_LOGGER = logging.getLogger("turing_learning")
_TRIAL = re.compile(
    r"trials/(?P<stage>[^/]+)/attempt-(?P<attempt>\d+)/(?:trial-(?P<number>\d+)|rejected-.*)\.npz"
)

POST_EVALUATION = "post-evaluation-"
"""Begin of the names of the stages in which the last models are observed again; their number
follows."""


def _keep_trial(folder: RunFolder, stage: str, attempt: int, trial: "ObservedTrial") -> None:
    """Write a trial as `trials/STAGE/attempt-N/trial-NN.npz`.

    With faults as rejected-NN-K.npz, the K-th time.
    """
    attempt_folder = f"{folder.trials_path.name}/{stage}/attempt-{attempt}"
    name = f"trial-{trial.number:02d}.npz"
    rejected = f"rejected-{trial.number:02d}"
    with folder.storage():
        if trial.faults:
            name = f"{rejected}-{len(list((folder.path / attempt_folder).glob(f'{rejected}-*.npz'))) + 1}.npz"
        folder.write(f"{attempt_folder}/{name}", trial.arrays())


def stored_trials(folder: RunFolder, stage: str) -> tuple[int, list["ObservedTrial"]]:
    """Return the number of the last attempt at a stage with a trial, or 0, and its trials without faults."""
    from turing_learning.robots.program import ObservedTrial

    attempt, names = _last_attempt(folder, stage)
    trials: list[ObservedTrial] = []
    while (name := names.get(len(trials))) and (folder.path / name).exists():
        trials.append(ObservedTrial.of(len(trials), folder.read(name)))
    return attempt, trials


def _last_attempt(folder: RunFolder, stage: str) -> tuple[int, dict[int, str]]:
    """Return the number of the last attempt at a stage, or 0, and number -> file of its trials without faults, lost ones too."""
    # a file that is lost still has a seal
    names = set(folder.seals.names())
    for file in folder.trials_path.glob("*/*/*.npz"):
        names.add(file.relative_to(folder.path).as_posix())
    matches = []
    for name in names:
        match = _TRIAL.fullmatch(name)
        if match and match["stage"] == stage:
            matches.append(match)
    attempt = max((int(match["attempt"]) for match in matches), default=0)
    files = {}
    for match in matches:
        if match["number"] and int(match["attempt"]) == attempt:
            files[int(match["number"])] = match[0]
    return attempt, files


@dataclass(frozen=True, eq=False)
class ObservedTrials:
    """What was observed of a laboratory's robots in the R trials of a generation, or of a post-evaluation.

    Attributes
    ----------
    poses : (R, T + 1, A, 3)
        x, y (cm), heading (rad, anticlockwise); agents first, then replicas.
    models : (R, n, P)
        What the n replicas executed, in wheel speeds, with the digits that were sent.
    labels
        Of the A robots' markers.
    interval_s
        Time between poses (s).
    """

    poses: np.ndarray
    models: np.ndarray
    labels: tuple[str, ...]
    interval_s: float

    def speeds(self) -> np.ndarray:
        """Return the samples (R, A, T, 2): linear speed (cm/s), angular speed (rad/s)."""
        from turing_learning.robots.tracking import signed_speeds

        return np.array([signed_speeds(poses, self.interval_s) for poses in self.poses])

    def samples(self) -> Samples:
        """Return the samples of agents (R x agents, T, 2), and one of each model (R x n, 1, T, 2)."""
        from turing_learning.robots.program import trial_samples

        return trial_samples(self.speeds(), self.models.shape[1])


def read_trials(path: str | Path, stage: str) -> ObservedTrials:
    """Return the trials of a stage of a run in a laboratory, those of its last attempt.

    Parameters
    ----------
    path
        The run folder.
    stage
        Name of a folder in ``trials``: "generation-0012", "post-evaluation-1". Of a stage that is
        not complete, see `read_events`, what there is.

    Raises
    ------
    RunFolderError
        If there are none, or one cannot be read.
    """
    folder = RunFolder(path)
    folder.manifest()
    _, names = _last_attempt(folder, stage)
    stored = any((folder.path / name).exists() for name in names.values())
    where = str(folder.trials_path)
    rule = "be one of which the run has trials"
    remedy = "Name a folder in it."
    check_folder(stored, "stage", rule, repr(stage), remedy, place=where)
    trials = [folder.read(names[number]) for number in sorted(names)]
    alike = len({(trial["poses"].shape, trial["models"].shape) for trial in trials}) == 1
    where = f"{where}/{stage}"
    rule = "have trials of one shape"
    remedy = "Restore the files."
    check_folder(alike, "stage", rule, "others", remedy, place=where)
    return ObservedTrials(
        poses=np.array([trial["poses"] for trial in trials]),
        models=np.array([trial["models"] for trial in trials]),
        labels=tuple(map(str, trials[0]["labels"])),
        interval_s=float(trials[0]["interval_s"]),
    )


def note_event(folder: RunFolder, event: "Event") -> None:
    """Store an event: a trial in a file of its own, all else but changes of state in `events.jsonl`.

    A disturbance is logged, too.
    """
    if event.trial is not None:
        _keep_trial(folder, event.stage, event.attempt, event.trial)
    if event.trial is not None or event.kind == "state":
        return
    if event.kind == "disturbed":
        _LOGGER.info(
            "%s, attempt %d, %s: %s.",
            event.stage,
            event.attempt,
            event.state,
            event.fault.rstrip("."),
        )
    entry: dict[str, object] = {"time": now()}
    for name in ("kind", "stage", "attempt", "state", "fault", "asked"):
        entry[name] = getattr(event, name)
    with folder.storage(), folder.events_path.open("a+b") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - 1))
        # a kill may have cut the last line
        if file.read(1) not in (b"", b"\n"):
            file.write(b"\n")
        file.write(json.dumps(entry).encode() + b"\n")
        file.flush()
        os.fsync(file.fileno())


def read_events(path: str | Path) -> list[dict[str, object]]:
    """Return the events of a run in a laboratory, without a line that a kill has cut.

    Each has "time", and what `robots.Event` has.
    """
    file = RunFolder(path).events_path
    events: list[dict[str, object]] = []
    if not file.exists():
        return events
    for line in file.read_text(encoding="utf-8").splitlines():
        with suppress(ValueError):
            events.append(json.loads(line))
    return events


@dataclass(frozen=True, eq=False)
class ModelEvaluation:
    """What the models of a run's last generation are worth when they are observed again.

    Attributes
    ----------
    repeats
        How often they are to be observed again.
    fitness : (observed, M)
        Of the M models, as in equation 1, each time that they have been observed again so far, at most
        `repeats` times.
    best_model
        Name -> parameter of the model of the highest mean fitness; None until all repeats are done.
    absolute_error
        Name -> its absolute error; None also where there is no truth.

    Source
    ------
    Paper, section 5.4.
    """

    repeats: int
    fitness: np.ndarray
    best_model: dict[str, float] | None
    absolute_error: dict[str, float] | None

    @property
    def complete(self) -> bool:
        """Whether all repeats are done."""
        return len(self.fitness) == self.repeats


def read_post_evaluation(path: str | Path) -> ModelEvaluation | None:
    """Return what is known of a run's last models from observing them again.

    None if they have not been observed again yet.
    """
    folder = RunFolder(path)
    file = folder.post_evaluation_path
    if not file.exists():
        return None
    try:
        stored = dict(folder.read(file.name))
        return ModelEvaluation(
            **stored | {"fitness": np.array(stored["fitness"], dtype=np.float64)}
        )
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        trouble = f"`run` must have a readable {file.name}; got {file}, which holds something else."
        raise RunFolderError(f"{trouble} Restore the file, or remove it and resume.") from error


def post_evaluate(
    result: Result,
    folder: RunFolder,
    source: "LaboratorySource",
    repeats: int,
    should_stop: Callable[[], bool] | None = None,
) -> None:
    """Observe the last models of a complete run of generations `repeats` times.

    Write what they are worth, see `ModelEvaluation`.

    What is written already is not observed again, and what was observed more often is left out. In
    the end what detectors need is written, too. Source: paper, section 5.4.
    """
    if isinstance(result, Posterior) or not (result.complete and repeats):
        return
    with folder.locked():
        final = result.history.isel(generation=-1)
        stored = read_post_evaluation(folder.path)
        models = final["model"].to_numpy()
        classifiers = final["classifier"].to_numpy()
        fitness = [] if stored is None else stored.fitness[:repeats].tolist()

        # After each repetition: a laboratory may be stopped between two
        def write() -> None:
            best = error = None
            if len(fitness) == repeats:
                names = tuple(result.best_model)
                truth = result.truth
                chosen = models[int(np.argmax(np.mean(fitness, axis=0)))]
                best = named(names, chosen)
                error = truth and named(
                    names, absolute_error(chosen, np.array([truth[name] for name in names]))
                )
            document = {
                "repeats": repeats,
                "fitness": fitness,
                "best_model": best,
                "absolute_error": error,
            }
            with folder.storage():
                folder.write(folder.post_evaluation_path.name, document)

        # Another number of repetitions than before: of fewer, the first ones count
        changed = stored is not None and stored.repeats != repeats
        if changed:
            write()
        while len(fitness) < repeats and not (should_stop is not None and should_stop()):
            samples = source.observe(models, f"{POST_EVALUATION}{len(fitness) + 1}")
            fitness.append(judged_again(folder.configuration(), classifiers, samples).tolist())
            changed = True
            write()
        if len(fitness) == repeats and (changed or folder.find(CALIBRATION) is None):
            _keep_observed_motion(result, folder, repeats)


def judged_again(
    configuration: Configuration, classifiers: np.ndarray, samples: Samples
) -> np.ndarray:
    """Return the fitness (M,) as in equation 1 that classifiers (N, Q) give the models of samples, one of each model."""
    classifier = classifier_of(configuration)
    genomes = np.asarray(classifiers, dtype=np.float64)
    judged = classifier.judge(genomes, samples.counterfeit[:, 0])[..., None]
    return model_reward(Judgments(classifier.judge(genomes, samples.genuine), judged))


def _keep_observed_motion(result: Result, folder: RunFolder, repeats: int) -> None:
    """Write ``calibration.npz``, by which detectors are calibrated, from the agents of all trials.

    Held out are those of the trials in which the last models were observed again.
    """
    try:
        learned, replicas, models = _motion(
            folder, [f"generation-{g:04d}" for g in range(result.generations)]
        )
        held_out, _, _ = _motion(folder, [f"{POST_EVALUATION}{k + 1}" for k in range(repeats)])
    except RunFolderError as error:
        _LOGGER.warning("Nothing is kept to calibrate detectors with: %s", error)
        return
    estimate = np.array(list(result.estimate.values()))
    calibration = observed_calibration(
        learned=learned, held_out=held_out, replicas=replicas, models=models, estimate=estimate
    )
    if calibration is None:
        why = "too few samples, or all models are near the estimate."
        _LOGGER.warning("Nothing is kept to calibrate detectors with: %s", why)
        return
    with folder.storage():
        folder.write(CALIBRATION, calibration)


def _motion(folder: RunFolder, stages: Sequence[str]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return samples of agents (S, T, 2) and of replicas (M, T, 2), and their models (M, P), of all trials of some stages."""
    trials = [read_trials(folder.path, stage) for stage in stages]
    samples = [trial.samples() for trial in trials]
    return (
        np.concatenate([trial.genuine for trial in samples]),
        np.concatenate([trial.counterfeit[:, 0] for trial in samples]),
        np.concatenate([trial.models.reshape(-1, trial.models.shape[2]) for trial in trials]),
    )
