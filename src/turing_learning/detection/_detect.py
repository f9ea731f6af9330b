"""The door of detection: a run, motion, and recordings of normal individuals, to a ranking."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from turing_learning.errors import RefusedError, check, reject
from turing_learning.report import counted
from turing_learning.swarm import Scenario, Trials, alone

from ._alike import Case, judge_alike
from ._company import paths_of, usual_motion
from ._methods import CLASSIFIERS, MOTION_STATISTICS, ONE_CLASS, WINDOW_STATISTICS, Method, Windows
from ._motion import Motion, RecordedMotion
from ._planted import PLANTED_KINDS, SOCIAL_KINDS, plant
from ._ranking import Detection
from ._run import RunClassifiers, motion_of
from ._simulated import ALIKE, CASES, by_individual, simulate_behaviors, stream

AnyMotion = Motion | RecordedMotion
SIMULATED_CASES = 96
"""Simulated robots with other parameters."""
SIMULATED_NORMAL = 600
"""Simulated normal individuals, about; their number depends on the size of a swarm."""
PARAMETER_DEVIATION = 0.2
"""Standard deviation of the parameters of simulated cases around the agents'."""
PLANTED_INDIVIDUALS = 4
"""Individuals of the normal recordings, in whose stead each kind is planted."""
PLANTED_S = 180.0
"""Duration (s) of the recordings that individuals are planted into, at most: more takes time, and tells no more."""


@dataclass(frozen=True, eq=False)
class _Normal:
    """What motion is compared with."""

    recordings: list[Windows]
    cases: list[Case]
    cases_in_words: str
    promised: bool = True
    relative: bool | None = False


def detect(
    run: RunClassifiers, motion: AnyMotion, *, genuine: Sequence[AnyMotion] = (),
    abnormal: Sequence[AnyMotion] = (), learned: Sequence[AnyMotion] = (), false_alarms: float = 0.01,
    seed: int = 0, threads: int | None = None,
) -> Detection:  # fmt: skip
    """Rank individuals by how unlike normal ones they move, by several methods.

    Source: docs/decisions/0031-judged-alike.md.

    Parameters
    ----------
    run
        From `run_classifiers`.
    motion
        Of the individuals that are judged.
    genuine
        Recordings of normal individuals, several if possible: each is judged by what was learned
        from the others. None: simulated robots are simulated; samples that a run has stored are
        taken; a recording is ranked and nobody called abnormal.
    abnormal
        Motion of individuals that are known to be abnormal, by which the methods are compared. None
        plants some.
    learned
        Recordings that the run has learned from. Individuals are ranked beside these where no
        `genuine` is given.
    false_alarms
        Share of normal individuals that may be called abnormal, in (0, 1).
    seed
        Of all that is drawn or simulated, >= 0.
    threads
        Number of threads of a simulation; None takes every processor.
    """
    recordings = genuine or learned
    with_company = bool(recordings) and all(map(_has_company, (motion, *recordings, *abnormal)))
    windows = _windows(motion, with_company)
    lengths = [len(individual) for individual in windows if len(individual)]
    check(lengths, "motion", "hold a window", "none", "Record for longer.")
    # Normal motion, in this order: the user's, simulated, or stored by the run
    samples = int(np.median(lengths))
    if recordings:
        cases, in_words = _planted(recordings, run, seed, with_company)
        normal_windows: list[Windows] = [
            _windows(recording, with_company) for recording in recordings
        ]
        normal = _Normal(normal_windows, cases, in_words, promised=bool(genuine), relative=None)
    elif run.scenario is not None:
        normal = _simulated(run.scenario, samples, seed, threads)
    elif run.calibration is not None:
        normal = _stored(run, run.calibration[0], isinstance(motion, RecordedMotion), samples, seed)
    else:
        remedy = "Give motion of normal individuals, or let the run end."
        reject("genuine", "be given for a run that has stored no motion", "none", remedy)
    # Without company, statistics of the run's few signals learn nothing from planted individuals.
    planted = normal.cases if with_company else []
    # The user's own cases say more than planted ones. They have no fellows: beside the median of themselves alone
    # they would not differ.
    if abnormal:
        cases = []
        for recording in abnormal:
            cases += map(Case, filter(len, _windows(recording, with_company)))
        in_words = f"{len(cases)} individuals that are known to be abnormal"
        normal = replace(normal, cases=cases, cases_in_words=in_words, relative=False)
    return judge_alike(
        _methods(run, with_company),
        windows,
        normal.recordings,
        names=motion.individuals,
        cases=normal.cases,
        planted=planted,
        cases_in_words=normal.cases_in_words,
        false_alarms=false_alarms,
        relative=normal.relative,
        promised=normal.promised,
        recordings=len(recordings),
    )


def _methods(run: RunClassifiers, with_company: bool) -> list[Method]:
    """Return the methods; signals of the run come first, those of company after them."""
    own_columns = slice(None)
    # statistics of motion are those of company where that is known, of all signals otherwise
    of_motion = slice(None)
    if with_company:
        own_columns = slice(run.signals)
        of_motion = slice(run.signals, None)
    return [
        Method(CLASSIFIERS, run.outputs, columns=own_columns),
        replace(WINDOW_STATISTICS, columns=own_columns),
        replace(ONE_CLASS, columns=own_columns),
        replace(MOTION_STATISTICS, columns=of_motion),
    ]


def _has_company(motion: AnyMotion) -> bool:
    return isinstance(motion, RecordedMotion) and bool(motion.company)


def _windows(motion: AnyMotion, with_company: bool) -> list[np.ndarray]:
    """Return the windows of each individual (W, T, D), or with its company (W, T, D + 16)."""
    if not (with_company and isinstance(motion, RecordedMotion)):
        return list(motion.samples)
    pairs = zip(motion.samples, motion.company, strict=True)
    return [np.concatenate(pair, axis=2) for pair in pairs]


def _planted(
    recordings: Sequence[AnyMotion], run: RunClassifiers, seed: int, with_company: bool
) -> tuple[list[Case], str]:
    """Plant individuals into recordings of normal ones; return them, and what they are."""
    rng = stream(seed, CASES)
    cases: list[Case] = []
    for r, k in _individuals_in_turn(recordings, rng)[:PLANTED_INDIVIDUALS]:
        motion = recordings[r]
        if isinstance(motion, RecordedMotion) and motion.recording is not None:
            cases += _planted_into_recording(motion, run, r, k, with_company, rng)
        else:
            cases += _planted_into_samples(motion.samples[k], r, k)
    planted_kinds = {case.kind for case in cases}
    in_words = "signals halved or doubled"
    if "mean" not in planted_kinds:
        in_words = counted(len(planted_kinds), "kind")
    return cases, f"{len(cases)} planted individuals ({in_words})"


def _individuals_in_turn(
    recordings: Sequence[AnyMotion], rng: np.random.Generator
) -> list[tuple[int, int]]:
    """Return recording and index of individuals in random order, the recordings in turn."""
    candidates = []
    for r, motion in enumerate(recordings):
        candidates += [(r, k) for k, samples in enumerate(motion.samples) if len(samples)]
    drawn: Counter[int] = Counter()
    in_turn = []
    for number in rng.permutation(len(candidates)):
        recording = candidates[number][0]
        in_turn.append((drawn[recording], candidates[number]))
        drawn[recording] += 1
    in_turn.sort(key=lambda entry: entry[0])
    return [candidate for _, candidate in in_turn]


def _planted_into_recording(
    motion: RecordedMotion,
    run: RunClassifiers,
    r: int,
    k: int,
    with_company: bool,
    rng: np.random.Generator,
) -> list[Case]:
    """Plant each kind in the stead of the k-th individual, while it is there.

    A kind that leaves it no window is left out: some move as others do, who may be away then.
    """
    recording = motion.recording
    assert recording is not None
    fps = recording.fps
    # from one frame before the first window, which its first turn needs
    begin = max(0, round(motion.times[k][0, 0] * fps) - 1)
    last_frame = int(np.flatnonzero(recording.present[:, k])[-1])
    frames = slice(begin, min(begin + int(PLANTED_S * fps), last_frame + 1))
    recording = replace(recording, **recording._arrays(frames))
    usual = None
    if with_company:
        usual = usual_motion(paths_of(recording, run.smooth_frames), fps)
    cases = []
    for planted_kind in PLANTED_KINDS:
        if len(motion.individuals) == 1 and planted_kind in SOCIAL_KINDS:
            continue
        changed = plant(recording, k, planted_kind, rng)
        try:
            planted = motion_of(changed, run, run.smooth_frames, [k], usual, jump_factor=None)
        except RefusedError as error:
            # too few frames for a window are expected; anything else is a mistake
            if error.refusal is None or error.refusal.name != "steps":
                raise
            continue
        cases.append(Case(_windows(planted, with_company)[0], r, k, planted_kind))
    return cases


def _planted_into_samples(samples: np.ndarray, r: int, k: int) -> list[Case]:
    """Halve and double the scatter and the mean of signals: there are no positions."""
    mean = samples.mean(axis=(0, 1))
    cases = []
    for factor in (0.5, 2.0):
        cases.append(Case(mean + factor * (samples - mean), r, k, "scatter"))
        cases.append(Case(samples - (1 - factor) * mean, r, k, "mean"))
    return cases


def _simulated(scenario: Scenario, samples: int, seed: int, threads: int | None) -> _Normal:
    """Simulate swarms of agents, and replicas of models that are not quite the agents."""
    rng = stream(seed, ALIKE)
    swarms = -(-SIMULATED_NORMAL // scenario.individuals)
    trials = Trials.draw(scenario, alone(scenario, swarms * samples), rng)
    agents = by_individual(trials.observe(None, threads), samples)
    truth = np.asarray(scenario.controller)
    models = truth + PARAMETER_DEVIATION * rng.standard_normal((SIMULATED_CASES, len(truth)))
    replicas = simulate_behaviors(
        scenario, models, trials=samples, rng=rng, threads=threads
    ).abnormal
    # One replica of each model: the others are much like it.
    cases = list(map(Case, replicas[:: scenario.replicas]))
    in_words = f"{len(cases)} simulated robots with other parameters"
    return _Normal(list(map(list, agents)), cases, in_words)


def _stored(
    run: RunClassifiers, genuine: np.ndarray, recorded: bool, samples: int, seed: int
) -> _Normal:
    """Take genuine samples that a run has stored, in groups as large as an individual."""
    # The run has learned from the first half.
    pool = genuine[len(genuine) // 2 :, 0]
    # Windows of one recording are not independent.
    independent = run.in_laboratory or not recorded
    promised = independent and len(pool) >= 2 * samples
    size = samples if promised else 1
    order = stream(seed, ALIKE).permutation(len(pool))
    begins = range(0, len(pool) - size + 1, size)
    return _Normal([[pool[order[k : k + size]]] for k in begins], [], "", promised)
