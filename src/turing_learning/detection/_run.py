"""What a run has learned to see."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from turing_learning.coevolution import Classifier
from turing_learning.config import ConfigurationError, classifier_of, load_configuration
from turing_learning.errors import Setting, check, reject
from turing_learning.swarm import Scenario
from turing_learning.systems import System, same_time_step
from turing_learning.trajectories import SIGNALS, Trajectories

from ._company import Usual, company, paths_of
from ._motion import RecordedMotion
from ._simulated import CALIBRATION, JURORS, random_controllers, simulate_behaviors, stream

ARCHIVED_GENERATIONS = 100
"""Generations whose best classifiers are among the voters of rules by votes."""
JURORS_DRAWN = 300
"""Classifiers of a run by generations that judge, each of another generation."""
FITTEST = 20
"""The best classifiers of a generation, of which one judges: the best one alone is too often the same."""
LAST_BATCH = 20
"""Classifiers of a run of trials that stand for its last generation: those of its last batch."""


class StoredRun(Protocol):
    """What the room needs of a run: `turing_learning.Result` has it."""

    @property
    def path(self) -> Path | None: ...
    @property
    def in_laboratory(self) -> bool: ...
    @property
    def complete(self) -> bool: ...
    @property
    def system(self) -> System: ...
    @property
    def history(self) -> Any: ...
    @property
    def jury(self) -> Sequence[tuple[Classifier, np.ndarray]]: ...
    @property
    def calibration(self) -> Mapping[str, np.ndarray] | None: ...


@dataclass(frozen=True, eq=False)
class RunClassifiers:
    """The classifiers that a run leaves."""

    classifier: Classifier  #: Judges
    last: np.ndarray  #: (N, Q), the last generation; of a run of trials the last 20 jurors
    #: (up to 100, Q), the subjectively best of generations that are evenly spread over the run, the last included; of a
    #: run of trials the jurors
    best: np.ndarray
    #: (up to 300, Q), one of the 20 fittest of each of as many generations, drawn at random from the whole run; of a
    #: run of trials all evolved ones that judged at its end
    jurors: np.ndarray
    steps: int  #: Steps T of a sample
    signals: int  #: Signals D of a sample
    #: The simulated swarm of the run; None where the computer cannot simulate its individuals
    scenario: Scenario | None
    names: tuple[str, ...]  #: Of the D signals
    interval_s: float  #: Duration of a time step (s); 0 if it is not known
    #: Whether samples are measured "with" headings or "without"; empty if that is not known, or makes no difference
    headings: str
    #: Genuine and abnormal motion (individuals, 1, T, D) that the run has stored; None if there is none
    calibration: tuple[np.ndarray, np.ndarray] | None = None
    complete: bool = True  #: Whether the run has come to its end
    in_laboratory: bool = False  #: Whether robots in a laboratory were observed
    kind: str = "one on a custom system"  #: What the run is, in messages
    smooth_frames: int = 1  #: Frames over which positions were averaged for the run
    #: Of a run of trials its random classifiers, too: what judges by them, and their genomes (R, S)
    observers: tuple[Classifier, np.ndarray] | None = None

    def outputs(self, windows: np.ndarray) -> np.ndarray:
        """Return what all jurors say (K, J) of windows (K, T, D)."""
        outputs = [self.classifier.judge(self.jurors, windows).T]
        if self.observers is not None:
            classifier, genomes = self.observers
            outputs.append(classifier.judge(genomes, windows).T)
        return np.concatenate(outputs, axis=1).astype(np.float64)

    def voters(self, rule: str) -> np.ndarray:
        """Return the classifiers (N, Q) among which a rule of `Detector` chooses."""
        voters = {
            "fittest": self.best[-1:],
            "unanimous": self.last,
            "discriminant": np.concatenate((self.last, self.best)),
        }
        return voters[rule]

    def simulated_scenario(self) -> Scenario:
        """Return the scenario; reject a run that has none."""
        if self.scenario is None:
            rule = "be on simulated robots for individuals to be simulated"
            reject("run", rule, self.kind, "Give motion that was observed.")
        return self.scenario


def run_classifiers(result: StoredRun) -> RunClassifiers:
    """Return the classifiers of a run that is stored in a folder with its full history."""
    if result.path is None:
        reject("run", "be stored in a folder", "one that is kept in memory", "Run it with `out`.")
    path = result.path / "config.toml"
    configuration = load_configuration(path)
    system = result.system
    observers = None
    jury = result.jury
    # A run of trials keeps random classifiers that were trained; one of generations evolved ones
    if jury:
        (network, jurors), (random_network, random_genomes) = jury
        observers = (system.classifier(random_network), random_genomes)
        last_jurors = jurors[-LAST_BATCH:]
        best = jurors
    else:
        history = result.history
        if "classifier" not in history:
            got = f'{result.path} with run.history = "thin", which keeps no classifiers'
            reject("run", "have a full history", got, system.again(str(path)))
        network = classifier_of(configuration)
        last_jurors, best, jurors = _evolved_classifiers(history)
    calibration = None
    stored = result.calibration
    if stored is not None:
        calibration = (stored["genuine"][:, None], stored["abnormal"][:, None])
    return RunClassifiers(
        classifier=system.classifier(network),
        last=last_jurors,
        best=best,
        jurors=jurors,
        observers=observers,
        steps=system.steps,
        signals=len(configuration.input_scale),
        scenario=system.simulated,
        names=system.signals,
        interval_s=system.interval_s,
        headings=system.headings,
        calibration=calibration,
        complete=result.complete,
        in_laboratory=result.in_laboratory,
        kind=system.noun,
        smooth_frames=system.smooth_frames,
    )


def _evolved_classifiers(history: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the last generation, the best of generations over the run, and jurors."""
    populations = history["classifier"]
    fitness = np.asarray(history["classifier_fitness"])
    total = len(fitness)
    spread = np.linspace(total - 1, 0, min(ARCHIVED_GENERATIONS, total))
    archived = np.unique(spread.round().astype(int))
    best = np.asarray(populations[archived])[
        np.arange(len(archived)), fitness[archived].argmax(axis=1)
    ]
    rng = stream(0, JURORS)
    drawn = np.sort(rng.permutation(total)[:JURORS_DRAWN])
    ranks = rng.integers(min(FITTEST, fitness.shape[1]), size=len(drawn))
    order = np.argsort(-fitness[drawn], axis=1, kind="stable")
    rows = np.arange(len(drawn))
    jurors = np.asarray(populations[drawn])[rows, order[rows, ranks]]
    return np.asarray(populations[-1]), best, jurors


def motion_to_calibrate(
    run: RunClassifiers, behaviors: int, trials: int, seed: int, threads: int | None
) -> tuple[np.ndarray, np.ndarray]:
    """Simulate genuine and abnormal motion for a run that has stored none, if possible."""
    if run.scenario is None:
        rule = "have stored motion to calibrate with"
        otherwise = "give `genuine` and `abnormal`."
        if not run.complete:
            got = "one that was stopped before its end"
            reject("run", rule, got, f"Resume it first, or {otherwise}")
        if run.in_laboratory:
            remedy = "It does once its last models have been observed again: resume it, "
            remedy += "with `evaluation.repeats` of at least 1 in its laboratory.json, "
            reject("run", rule, "one in a laboratory that has not", f"{remedy}or {otherwise}")
        remedy = "Give motion (individuals, samples, T, D) of both kinds."
        reject("genuine", "be given for a run on a custom system", "one without", remedy)
    rng = stream(seed, CALIBRATION)
    controllers = random_controllers(run.scenario, behaviors, rng)
    simulated = simulate_behaviors(
        run.scenario, controllers, trials=trials, rng=rng, threads=threads
    )
    return simulated.genuine, simulated.abnormal


def recorded_motion(
    recording: Trajectories, run: RunClassifiers, *, smooth_frames: int | None = None
) -> RecordedMotion:
    """Cut a recording into windows of the length and the signals that a run's classifiers know.

    For a run without headings, those of the recording are left out of account. `smooth_frames` is
    by default that of the run.
    """
    _check_recording(recording, run)
    if run.headings == "without":
        recording = replace(recording, headings=None)
    smooth = run.smooth_frames if smooth_frames is None else smooth_frames
    # One that stands still may be the abnormal one.
    recording = recording.cleared(longest_rest_s=None)
    try:
        return motion_of(recording, run, smooth)
    except ValueError as error:
        if recording.every > 1:
            raise ConfigurationError(str(error)) from error
        rule = f"hold a window of {run.steps} steps ({run.steps / recording.fps:.4g} s) without gaps and jumps"
        got = f"{len(recording.positions)} frames, of which none does"
        remedy = ("Record for longer, or fill longer gaps: ", Setting("bridge"), ".")
        reject("motion", rule, got, remedy)


def _check_recording(recording: Trajectories, run: RunClassifiers) -> None:
    """Reject a recording that the classifiers of a run cannot judge."""
    files = "motion in a .npy, .npz or .csv file, see docs/detection.md."
    unknown = [name for name in run.names if name not in SIGNALS]
    rule = f"have signals that a recording yields, {', '.join(SIGNALS)}"
    check(not unknown, "run", rule, ", ".join(unknown), f"Give {files}")
    headings = run.headings != "with" or recording.headings is not None
    rule = "have headings, as the run has, whose speeds are negative backwards"
    check(headings, "motion", rule, "a recording without", f"Give one with headings, or {files}")
    remedy = "Say how many pixels are 1 cm."
    check(recording.unit == "cm", "motion", "be in cm", recording.unit, remedy)
    rule = "know its time step, as runs on windows of recorded motion do"
    check(run.interval_s != 0, "run", rule, "one on samples alone", f"Give {files}")
    remedy = "Speeds and turns of another frame rate have other noise. "
    remedy += "Thin the faster recording, and infer again if that is the run's."
    same = same_time_step(run.interval_s, 1 / recording.fps)
    rule = f"be that of the run, {1 / run.interval_s:.6g}"
    check(same, "fps", rule, f"{recording.fps:.6g}", remedy)


def motion_of(
    recording: Trajectories, run: RunClassifiers, smooth_frames: int, individuals: Sequence[int] | None = None,
    usual: Usual | None = None, **options: Any,
) -> RecordedMotion:  # fmt: skip
    """Return the windows of some individuals, all by default, and what they do beside the others.

    `usual` is what they are compared with, see `company`.
    """
    if individuals is None:
        individuals = range(len(recording.individuals))
    names = tuple(recording.individuals[k] for k in individuals)
    windows = recording.windows(
        run.steps, signals=run.names, individuals=names, hold_out=0.0, smooth_frames=smooth_frames,
        longest_rest_s=None, **options,
    )  # fmt: skip
    individual_of, begin_of = windows.learning_index.T
    samples = []
    begins = []
    for k in individuals:
        samples.append(windows.learning[individual_of == k])
        begins.append(begin_of[individual_of == k])
    beside: list[np.ndarray] = []
    paths = paths_of(recording, smooth_frames)
    if paths.shape[1] > 1:
        steps = np.arange(run.steps)
        related = company(paths, individuals, recording.fps, usual)
        for relation, begin in zip(related, begins, strict=True):
            beside.append(relation[begin[:, None] + steps])
    times = (np.stack((begin, begin + run.steps), axis=1) / recording.fps for begin in begins)
    return RecordedMotion(
        individuals=names,
        samples=tuple(samples),
        times=tuple(times),
        duration_s=recording.duration_s,
        recording=recording,
        company=tuple(beside),
    )
