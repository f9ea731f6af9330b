"""The door of detection: a run, motion, and recordings of normal individuals, to a ranking."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from turing_learning.errors import check, reject
from turing_learning.report import counted
from turing_learning.swarm import Scenario, Trials, alone

from ._alike import CLASSIFIERS, MOTION_EYE, ONE_CLASS_EYE, STATISTICS_EYE, Case, Detection, Eye, Windows, judge_alike
from ._company import paths_of, usual_motion
from ._kinds import KINDS, SOCIAL, plant
from ._motion import Motion, RecordedMotion
from ._run import RunClassifiers, motion_of
from ._simulated import ALIKE, CASES, by_individual, simulate_behaviors, stream

Moved = Motion | RecordedMotion
SIMULATED = 96  # robots with other parameters
PLACES = 4  # individuals of recordings that each kind is planted into
PLANTED_S = 180.0
"""Of the recordings that individuals are planted into, at most."""
NORMAL = 600  # simulated individuals, about
UNLIKE = 0.2
"""Standard deviation of the parameters of simulated cases around the agents'."""


def detect(
    run: RunClassifiers, motion: Moved, *, genuine: Sequence[Moved] = (), abnormal: Sequence[Moved] = (),
    learned: Sequence[Moved] = (), false_alarms: float = 0.01, seed: int = 0, threads: int | None = None,
) -> Detection:  # fmt: skip
    """Rank individuals by how unlike normal ones a run's classifiers judge them, beside baselines; read the first ranking.

    Source: docs/decisions/0031-judged-alike.md.

    Parameters
    ----------
    run
        From `run_classifiers`.
    motion
        Of the individuals that are judged.
    genuine
        Recordings of normal individuals, several if possible: each is judged by what was learned from the
        others. None: simulated robots are simulated; samples that a run has stored are taken; a recording is
        ranked and nobody called abnormal.
    abnormal
        Motion of individuals that are known to be abnormal, by which the ways to look are compared. None plants
        some.
    learned
        Recordings that the run has learned from. Individuals are ranked beside these where no `genuine` is given.
    false_alarms
        Share of normal individuals that may be called abnormal, in (0, 1).
    seed
        Of all that is drawn or simulated, >= 0.
    threads
        Number of threads of a simulation; None takes every processor.
    """
    recordings = genuine or learned
    everybody = (motion, *recordings, *abnormal)
    beside = bool(recordings) and all(isinstance(each, RecordedMotion) and each.company for each in everybody)
    own = slice(run.signals if beside else None)  # the last columns are those of company
    eyes = [Eye(CLASSIFIERS, run.outputs, columns=own), replace(STATISTICS_EYE, columns=own)]
    eyes.append(replace(ONE_CLASS_EYE, columns=own))
    eyes.append(replace(MOTION_EYE, columns=slice(run.signals, None) if beside else own))
    windows = _windows(motion, beside)
    lengths = [len(each) for each in windows if len(each)]
    check(lengths, "motion", "hold a window", "none", "Record for longer.")
    samples = int(np.median(lengths))
    normal: list[Windows]
    cases: list[Case] = []
    said, promised = "", True
    relative: bool | None = False
    if recordings:
        normal, relative, promised = [_windows(each, beside) for each in recordings], None, bool(genuine)
        cases, said = _planted(recordings, run, seed, beside)
    elif run.scenario is not None:
        normal, cases = _simulated(run.scenario, samples, seed, threads)
        said = f"{len(cases)} simulated robots with other parameters"
    elif run.calibration is not None:
        pool = run.calibration[0][len(run.calibration[0]) // 2 :, 0]  # the run has not learned from these
        # windows of one recording are not independent
        alike = run.in_laboratory or not isinstance(motion, RecordedMotion)
        promised = alike and len(pool) >= 2 * samples
        order, size = stream(seed, ALIKE).permutation(len(pool)), samples if promised else 1
        normal = [[pool[order[k : k + size]]] for k in range(0, len(pool) - size + 1, size)]
    else:
        remedy = "Give motion of normal individuals, or let the run end."
        reject("genuine", "be given for a run that has stored no motion", "none", remedy)
    planted = cases if beside else []
    if abnormal:
        cases = [Case(each) for some in abnormal for each in _windows(some, beside) if len(each)]
        said, relative = f"{len(cases)} individuals that are known to be abnormal", False
    return judge_alike(
        eyes, windows, normal, names=motion.individuals, cases=cases, planted=planted, said_of_cases=said,
        false_alarms=false_alarms, relative=relative, promised=promised, recordings=len(recordings),
    )  # fmt: skip


def _windows(motion: Moved, beside: bool) -> list[np.ndarray]:
    """Return the windows (W, T, D) of each individual, or (W, T, D + 16) with what it does beside others."""
    if not (beside and isinstance(motion, RecordedMotion)):
        return list(motion.samples)
    return [np.concatenate(both, axis=2) for both in zip(motion.samples, motion.company, strict=True)]


def _planted(genuine: Sequence[Moved], run: RunClassifiers, seed: int, beside: bool) -> tuple[list[Case], str]:
    """Plant individuals that behave otherwise into recordings of normal ones."""
    rng = stream(seed, CASES)
    places = [(r, k) for r, each in enumerate(genuine) for k, own in enumerate(each.samples) if len(own)]
    drawn = [places[k] for k in rng.permutation(len(places))]
    drawn = sorted(drawn, key=lambda one: [r for r, _ in drawn[: drawn.index(one)]].count(one[0]))  # recordings in turn
    cases = []
    for recording, k in drawn[:PLACES]:
        one = genuine[recording]
        if isinstance(one, RecordedMotion) and one.recording is not None:
            whole, begin = one.recording, max(0, round(one.times[k][0, 0] * one.recording.fps) - 1)
            early = replace(whole, **whole._arrays(slice(begin, begin + int(PLANTED_S * whole.fps))))
            usual = usual_motion(paths_of(early, run.smooth_frames), early.fps) if beside else None
            for kind in KINDS:
                if len(one.individuals) > 1 or kind not in SOCIAL:
                    moved = motion_of(plant(early, k, kind, rng), run, run.smooth_frames, [k], usual, jump_factor=None)
                    cases.append(Case(_windows(moved, beside)[0], recording, k, kind))
        else:
            mean = one.samples[k].mean(axis=(0, 1))
            for change in (0.5, 2.0):
                cases.append(Case(mean + change * (one.samples[k] - mean), recording, k, "scatter"))
                cases.append(Case(one.samples[k] - (1 - change) * mean, recording, k, "mean"))
    kinds = {each.kind for each in cases}
    said = "signals halved or doubled" if "mean" in kinds else counted(len(kinds), "kind")
    return cases, f"{len(cases)} planted individuals ({said})"


def _simulated(scenario: Scenario, samples: int, seed: int, threads: int | None) -> tuple[list[Windows], list[Case]]:
    """Return swarms of agents, with as many samples of each, and replicas of models that are not quite the agents."""
    rng = stream(seed, ALIKE)
    swarms = -(-NORMAL // scenario.individuals)
    speeds = Trials.draw(scenario, alone(scenario, swarms * samples), rng).observe(None, threads)
    truth = np.asarray(scenario.controller)
    models = truth + UNLIKE * rng.standard_normal((SIMULATED, len(truth)))
    others = simulate_behaviors(scenario, models, trials=samples, rng=rng, threads=threads).abnormal
    groups = by_individual(speeds, samples)
    return [list(group) for group in groups], [Case(each) for each in others[:: scenario.replicas]]
