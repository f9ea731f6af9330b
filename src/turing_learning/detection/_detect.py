"""The door of detection: a run, motion, and recordings of normal individuals, to a ranking."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.util import find_spec

import numpy as np

from turing_learning.config import ConfigurationError
from turing_learning.errors import choice
from turing_learning.report import counted
from turing_learning.swarm import Scenario, Trials, alone
from turing_learning.trajectories import Trajectories

from ._alike import CLASSIFIERS, ONE_CLASS_EYE, STATISTICS_EYE, TRAINED_EYE, Case, Detection, Eye, Windows, judge_alike
from ._motion import Motion, RecordedMotion, check, paths_of, reject
from ._run import RunClassifiers, motion_of
from ._simulated import ALIKE, CASES, by_individual, simulate_behaviors, stream

SMOOTH_S = 2.0


def plant(recording: Trajectories, individual: int, kind: str, rng: np.random.Generator) -> Trajectories:
    """Return a recording in which one individual, by its place, moves otherwise, by one of `KINDS`; gaps stay where they were."""
    choice("kind", kind, KINDS, noun="kind of planted individual", error=ConfigurationError)
    paths = paths_of(recording)
    moved = KINDS[kind](paths, individual, recording.fps, rng)
    low, high = paths.min(axis=(0, 1)), paths.max(axis=(0, 1))
    size = np.maximum(high - low, 1e-9)
    places = np.mod(moved - low, 2 * size)  # folded back into the space that all move in
    moved = low + np.where(places > size, 2 * size - places, places)
    positions = recording.positions.copy()
    positions[:, individual] = np.where(recording.present[:, individual, None], moved, 0.0)
    return replace(recording, positions=positions)


Kind = Callable[[np.ndarray, int, float, np.random.Generator], np.ndarray]
"""How an individual moves otherwise: from paths (F, A, 2), its place among them, frames per second, and random numbers."""


def _walked(start: np.ndarray, steps: np.ndarray) -> np.ndarray:
    return start + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def _paced(turning: float = 1.0, jitter: float = 0.0, pace: float = 1.0, drift: float = 0.0) -> Kind:
    """Return a kind with its turns and speed scaled, noise in its direction, and a drift to the left, in its own turns' spread."""

    def moved(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
        step = np.diff(paths[:, k], axis=0)
        speed, course = np.hypot(step[:, 0], step[:, 1]), np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
        turn = np.diff(course)
        spread = float(np.std((turn + np.pi) % (2 * np.pi) - np.pi))
        course = course[0] + np.append(0.0, np.cumsum(turning * turn + drift * spread))
        course = course + rng.normal(0.0, jitter * spread, len(course)) if jitter else course
        return _walked(paths[0, k], pace * speed[:, None] * np.stack([np.cos(course), np.sin(course)], axis=1))

    return moved


def _smooth(path: np.ndarray, fps: float) -> np.ndarray:
    width = min(int(SMOOTH_S * fps) | 1, (len(path) - 1) | 1)
    padded = np.pad(path, ((width // 2, width // 2), (0, 0)), mode="edge")
    return np.stack([np.convolve(column, np.ones(width) / width, "valid") for column in padded.T], axis=1)


def _near(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    way = np.delete(paths, k, axis=1) - paths[:, k, None]
    nearest = np.hypot(way[..., 0], way[..., 1]).argmin(axis=1)
    return paths[:, k] + 0.7 * _smooth(way[np.arange(len(way)), nearest], fps)


def _far(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    away = _smooth(paths[:, k] - np.delete(paths, k, axis=1).mean(axis=1), fps)
    length = np.maximum(np.hypot(away[:, :1], away[:, 1:]), 1e-9)
    return paths[:, k] + 0.3 * float(np.hypot(*np.ptp(paths, axis=(0, 1)))) * away / length


def _behind(paths: np.ndarray, k: int, frames: float, rng: np.random.Generator) -> np.ndarray:
    """Return where somebody else was so many frames ago."""
    leader = rng.integers(paths.shape[1] - 1)
    return np.roll(np.delete(paths, k, axis=1)[:, leader], int(frames), axis=0)


def _always(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    followed = _behind(paths, k, 0.5 * fps, rng)
    return _smooth(followed, fps / 4) + rng.normal(0.0, 0.01, followed.shape)


def _stopping(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    length = max(1, int(2 * fps))
    rests = np.repeat(rng.random(len(paths) // length + 1) < 0.3, length)[: len(paths) - 1]
    return _walked(paths[0, k], np.where(rests[:, None], 0.02, 1.0) * np.diff(paths[:, k], axis=0))


KINDS: dict[str, Kind] = {
    "too jittery": _paced(jitter=1.0),
    "too slow": _paced(pace=0.5),
    "too near": _near,
    "follows nobody": lambda paths, k, fps, rng: np.roll(paths[:, k], len(paths) // 2, axis=0),
    "too straight": _paced(turning=0.25),
    "too fast": _paced(pace=2.0),
    "too far": _far,
    "follows always": _always,
    "delayed copy": lambda paths, k, fps, rng: _behind(paths, k, 3 * fps, rng),
    "circling": _paced(drift=0.3),
    "stopping": _stopping,
}
"""Kinds of planted individuals, all of which `detect` plants itself; its settings were tuned on the first four."""

SOCIAL = ("too near", "follows nobody", "too far", "follows always", "delayed copy")
"""Kinds that need others."""


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
    false_alarms: float = 0.01, seed: int = 0, threads: int | None = None,
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
    false_alarms
        Share of normal individuals that may be called abnormal, in (0, 1).
    seed
        Of all that is drawn or simulated, >= 0.
    threads
        Number of threads of a simulation; None takes every processor.
    """
    everybody = (motion, *genuine, *abnormal)
    beside = bool(genuine) and all(isinstance(each, RecordedMotion) and each.company for each in everybody)
    own = slice(run.signals if beside else None)  # the last columns are those of company
    eyes = [Eye(CLASSIFIERS, run.outputs, columns=own), replace(STATISTICS_EYE, columns=own)]
    if find_spec("sklearn") is not None:
        eyes.append(replace(ONE_CLASS_EYE, columns=own))
    if beside:
        eyes.append(replace(TRAINED_EYE, columns=slice(run.signals, None)))
    windows = _windows(motion, beside)
    lengths = [len(each) for each in windows if len(each)]
    check(lengths, "motion", "hold a window", "none", "Record for longer.")
    samples = int(np.median(lengths))
    normal: list[Windows]
    cases: list[Case] = []
    said, promised = "", True
    relative: bool | None = False
    if genuine:
        normal, relative = [_windows(each, beside) for each in genuine], None
        cases, said = _planted(genuine, run, seed, beside)
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
        false_alarms=false_alarms, relative=relative, promised=promised, recordings=len(genuine),
    )  # fmt: skip


def _windows(motion: Moved, beside: bool) -> list[np.ndarray]:
    """Return the windows (W, T, D) of each individual, or (W, T, D + 9) with what it does beside others."""
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
            for kind in KINDS:
                if len(one.individuals) > 1 or kind not in SOCIAL:
                    moved = motion_of(plant(early, k, kind, rng), run, run.smooth_frames, [k], jump_factor=None)
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
