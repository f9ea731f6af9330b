"""What a run has learned to see."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from turing_learning.coevolution import Classifier
from turing_learning.config import ConfigurationError, classifier_of, load_configuration
from turing_learning.errors import check, reject
from turing_learning.swarm import Scenario
from turing_learning.systems import System, same_time_step
from turing_learning.trajectories import SIGNALS, Trajectories

from ._company import Usual, company, paths_of
from ._motion import RecordedMotion
from ._simulated import CALIBRATION, JURORS, random_controllers, simulate_behaviors, stream

ARCHIVE = 100
JURY = 300
FITTEST = 20
LATEST = 20  # of the jury of a run of trials: those of its last batch


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
    last: np.ndarray  #: (N, Q), the last generation
    #: (up to 100, Q), the subjectively best of generations that are evenly spread over the run, the last included
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
        juries = [(self.classifier, self.jurors), *([] if self.observers is None else [self.observers])]
        found = [classifier.judge(genomes, windows).T for classifier, genomes in juries]
        return np.concatenate(found, axis=1).astype(np.float64)

    def voters(self, rule: str) -> np.ndarray:
        """Return the classifiers (N, Q) among which a rule of `Detector` chooses."""
        both = (self.last, self.best)
        return {"fittest": self.best[-1:], "unanimous": self.last, "discriminant": np.concatenate(both)}[rule]

    def simulated_scenario(self) -> Scenario:
        """Return the scenario; reject a run that has none."""
        if self.scenario is None:
            rule = "be on simulated robots for individuals to be simulated"
            reject("run", rule, self.kind, "Give motion that was observed.")
        return self.scenario


def run_classifiers(result: StoredRun) -> RunClassifiers:
    """Return the classifiers of a run that is stored in a folder with its full history: ``turing_learning.load_run(path)``."""
    if result.path is None:
        reject("run", "be stored in a folder", "one that is kept in memory", "Run it with `out`.")
    path, history = result.path / "config.toml", result.history
    configuration = load_configuration(path)
    system, stored, jury = result.system, result.calibration, result.jury
    if jury:
        (network, jurors), (random, drawn) = jury
        last, best = jurors[-LATEST:], jurors
    else:
        if "classifier" not in history:
            got = f'{result.path} with run.history = "thin", which keeps no classifiers'
            reject("run", "have a full history", got, system.again(str(path)))
        network, random = classifier_of(configuration), None
        populations, fitness = history["classifier"], np.asarray(history["classifier_fitness"])
        total, rng = len(fitness), stream(0, JURORS)
        archived = np.unique(np.linspace(total - 1, 0, min(ARCHIVE, total)).round().astype(int))
        some = np.sort(rng.permutation(total)[:JURY])
        ranks = rng.integers(min(FITTEST, fitness.shape[1]), size=len(some))
        order = np.argsort(-fitness[some], axis=1, kind="stable")
        chosen = (archived, fitness[archived].argmax(axis=1)), (some, order[np.arange(len(some)), ranks])
        last = np.asarray(populations[-1])
        best, jurors = (np.asarray(populations[g])[np.arange(len(g)), places] for g, places in chosen)
    return RunClassifiers(
        classifier=system.classifier(network),
        last=last,
        best=best,
        jurors=jurors,
        observers=None if random is None else (system.classifier(random), drawn),
        steps=system.steps,
        signals=len(configuration.input_scale),
        scenario=system.simulated,
        names=system.signals,
        interval_s=system.interval_s,
        headings=system.headings,
        calibration=None if stored is None else (stored["genuine"][:, None], stored["abnormal"][:, None]),
        complete=result.complete,
        in_laboratory=result.in_laboratory,
        kind=system.kind,
        smooth_frames=system.smooth_frames,
    )


def motion_to_calibrate(
    run: RunClassifiers, behaviors: int, trials: int, seed: int, threads: int | None
) -> tuple[np.ndarray, np.ndarray]:
    """Simulate genuine and abnormal motion for a run that has stored none; reject one that cannot be simulated."""
    if run.scenario is None:
        rule, given = "have stored motion to calibrate with", "give `genuine` and `abnormal`."
        if not run.complete:
            reject("run", rule, "one that was stopped before its end", f"Resume it first, or {given}")
        if run.in_laboratory:
            remedy = "It does once its last models have been observed again: resume it, with `evaluation.repeats` of at least 1 "
            remedy += f"in its laboratory.json, or {given}"
            reject("run", rule, "one in a laboratory that has not", remedy)
        remedy = "Give motion (individuals, samples, T, D) of both kinds."
        reject("genuine", "be given for a run on a custom system", "one without", remedy)
    rng = stream(seed, CALIBRATION)
    controllers = random_controllers(run.scenario, behaviors, rng)
    simulated = simulate_behaviors(run.scenario, controllers, trials=trials, rng=rng, threads=threads)
    return simulated.genuine, simulated.abnormal


def recorded_motion(
    recording: Trajectories, run: RunClassifiers, *, smooth_frames: int | None = None
) -> RecordedMotion:
    """Cut a recording, at the frame rate of a run, into windows of the length and the signals that its classifiers know.

    For a run without headings, those of the recording are left out of account. `smooth_frames` is
    by default that of the run.
    """
    files = "motion in a .npy, .npz or .csv file, see docs/detection.md."
    unknown = [name for name in run.names if name not in SIGNALS]
    rule = f"have signals that a recording yields, {', '.join(SIGNALS)}"
    check(not unknown, "run", rule, ", ".join(unknown), f"Give {files}")
    headings = run.headings != "with" or recording.headings is not None
    rule = "have headings, as the run has, whose speeds are negative backwards"
    check(headings, "motion", rule, "a recording without", f"Give one with headings, or {files}")
    check(recording.unit == "cm", "motion", "be in cm", recording.unit, "Say how many pixels are 1 cm.")
    rule = "know its time step, as runs on windows of recorded motion do"
    check(run.interval_s != 0, "run", rule, "one on samples alone", f"Give {files}")
    remedy = "Speeds and turns of another frame rate have other noise. "
    remedy += "Thin the faster recording, and infer again if that is the run's."
    same, rule = same_time_step(run.interval_s, 1 / recording.fps), f"be that of the run, {1 / run.interval_s:.6g}"
    check(same, "fps", rule, f"{recording.fps:.6g}", remedy)
    if run.headings == "without":
        recording = replace(recording, headings=None)
    smooth = run.smooth_frames if smooth_frames is None else smooth_frames
    recording = recording.cleared(longest_rest_s=None)  # one who stands still may be the abnormal one
    try:
        return motion_of(recording, run, smooth)
    except ValueError as error:
        if recording.every > 1:
            raise ConfigurationError(str(error)) from error
        rule = f"hold a window of {run.steps} steps ({run.steps / recording.fps:.4g} s) without gaps and jumps"
        got = f"{len(recording.positions)} frames, of which none does"
        reject("motion", rule, got, "Record for longer, or bridge gaps.")


def motion_of(
    recording: Trajectories, run: RunClassifiers, smooth_frames: int, whose: Sequence[int] | None = None,
    usual: Usual | None = None, **options: Any,
) -> RecordedMotion:  # fmt: skip
    """Return the windows of some individuals of a recording, all by default, and what they do beside the others.

    `usual` is what they are compared with, see `company`.
    """
    whose = range(len(recording.individuals)) if whose is None else whose
    names = tuple(recording.individuals[k] for k in whose)
    windows = recording.windows(
        run.steps, signals=run.names, individuals=names, hold_out=0.0, smooth_frames=smooth_frames,
        longest_rest_s=None, **options,
    )  # fmt: skip
    who, first = windows.learning_index.T
    places = [np.flatnonzero(who == k) for k in whose]
    paths, steps = paths_of(recording, smooth_frames), np.arange(run.steps)
    beside = zip(company(paths, whose, recording.fps, usual), places, strict=True) if paths.shape[1] > 1 else ()
    return RecordedMotion(
        individuals=names,
        samples=tuple(windows.learning[place] for place in places),
        times=tuple(np.stack((first[p], first[p] + run.steps), axis=1) / recording.fps for p in places),
        duration_s=recording.duration_s,
        recording=recording,
        company=tuple(each[first[p, None] + steps] for each, p in beside),
    )
