"""Measure detection: simulated swarms, planted individuals, recorded animals, and false alarms.

``python experiments/detection/measure.py WHAT --work FOLDER`` (swarm, grid, families, ...) appends rows to a table beside
this file, and leaves out what the table has already; runs are stored in FOLDER. Decision 0031 says what came out. With
``--trials N`` runs are by trials, as by default, in place of generations, and the tables end in -trials.
"""

import argparse
import csv
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice, pairwise
from pathlib import Path

import numpy as np
from blind import BLIND
from blind_second import SECOND

import turing_learning as tl
from turing_learning.analysis import area_under_curve
from turing_learning.detection import (
    Detector,
    RecordedMotion,
    RunClassifiers,
    _alike,
    _detect,
    detect,
    recorded_motion,
    run_classifiers,
)
from turing_learning.detection._alike import Case, NormalIndividuals, TrainedMethod, beside_fellows
from turing_learning.detection._detect import _planted, _windows
from turing_learning.detection._methods import (
    CLASSIFIERS,
    MOTION_STATISTICS,
    ONE_CLASS,
    WINDOW_STATISTICS,
    Features,
    Method,
)
from turing_learning.detection._planted import PLANTED_KINDS, Planting, plant
from turing_learning.families import FAMILIES
from turing_learning.models import Behavior
from turing_learning.swarm import Trials, alone, mixed

HERE = Path(__file__).parent
DATA = HERE.parents[1] / "tests" / "reference" / "data" / "tracktor"
UNLIKE = (0.05, 0.1, 0.2, 0.4, 1.0)
SIGNALS = {
    "own": ("speed", "turn"),
    "all": ("speed", "turn", "neighbor_distance", "neighbor_bearing"),
}
FPS, INDIVIDUALS, FRAMES, TANK = 10.0, 6, 3600, (40.0, 30.0)
NORMAL = {
    "couzin": {
        "speed": 6, "turning_rate": 2.5, "repulsion_radius": 1.5, "orientation_width": 4, "attraction_width": 8, "noise": 0.15,
    },
    "boids": {"speed": 8, "separation": 20, "alignment": 1.0, "cohesion": 0.5},
    "burst-and-coast": {"speed": 12, "kick_interval": 0.5, "glide_time": 0.8, "turn": 0.4},
}  # fmt: skip
RECORDED = {
    "zebrafish": ("zebrafish_video_idtracked.txt", 30.0, 20.0, 6),
    "termites": ("termite_video_idtracked.txt", 25.0, 30.0, 4),
}


def main() -> None:
    """Measure one thing."""
    parser = argparse.ArgumentParser()
    parser.add_argument("what", choices=MEASURED)
    parser.add_argument("--work", type=Path, default=Path("runs/detection"))
    parser.add_argument("--trials", type=int)
    asked = parser.parse_args()
    if asked.trials:
        BUDGET["trials"] = asked.trials
    columns, measure = MEASURED[asked.what]
    path = HERE / f"{asked.what}{'-trials' * bool(BUDGET)}.csv"
    rows = list(csv.DictReader(path.open())) if path.exists() else []
    known = {tuple(row.values())[:2] for row in rows}
    with path.open("a", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if file.tell() == 0:
            writer.writerow(columns)
        for key, found in measure(asked.work):
            if key not in known:
                writer.writerows([*key, *row] for row in found())
                file.flush()


Measured = Iterator[tuple[tuple[str, str], Callable[[], list[list[object]]]]]


BUDGET: dict[str, int] = {}  # of runs by trials


def run_on(path: Path, generations: int, **system: object) -> tl.Result:
    """Return the run in a folder, made if it is not there."""
    if BUDGET:
        path = path.with_name(f"{path.name}-{BUDGET['trials']}-trials")
    effort = BUDGET or {"generations": generations}
    return tl.load_run(path) if path.exists() else tl.infer(**system, **effort, out=path, threads=1)


def swarm(work: Path) -> Measured:
    """Robots whose controller differs by a normal amount, by single samples: area under the curve."""
    for name in ("aggregation", "object-clustering"):
        for seed in range(101, 104):
            yield (
                (name, str(seed)),
                lambda name=name, seed=seed: unlike(work / f"{name}-{seed}", name, seed),
            )


def unlike(path: Path, name: str, seed: int) -> list[list[object]]:
    """Return rows (way, difference, area)."""
    result = run_on(path, 1000, scenario=name, seed=seed)
    run, rng = run_classifiers(result), np.random.default_rng((31, seed))
    scenario = run.simulated_scenario()
    truth, agents = np.asarray(scenario.controller), scenario.agents
    normal = Trials.draw(scenario, alone(scenario, 100), rng).observe(None, 1)
    fresh = Trials.draw(scenario, alone(scenario, -(-2000 // scenario.individuals)), rng).observe(
        None, 1
    )
    others = {}
    for size in UNLIKE:
        models = Behavior(truth + size * rng.standard_normal((300, len(truth))))
        others[size] = Trials.draw(scenario, mixed(scenario, 300), rng).observe(models, 1)[
            :, agents
        ]
    rows: list[list[object]] = []
    flat = fresh.reshape(-1, *fresh.shape[2:])
    for method in methods_of(run):
        groups = [[each[None] for each in group] for group in normal]
        score = method.learn(
            [each for group in groups for each in features_alone(method, group)], False, ()
        )
        usual = np.concatenate(
            [score(each) for each in features_alone(method, [each[None] for each in flat])]
        )
        for size, motion in others.items():
            found = np.concatenate(
                [score(each) for each in features_alone(method, [each[None] for each in motion])]
            )
            rows.append([method.name, size, f"{area_under_curve(found, usual):.4f}"])
    for rule in ("discriminant", "fittest"):
        detector = Detector.from_run(result, rule=rule, threads=1)
        usual = -detector.judge(flat)
        rows += [
            [rule, size, f"{area_under_curve(-detector.judge(motion), usual):.4f}"]
            for size, motion in others.items()
        ]
    return rows


GRID_TRIALS, GRID_BLOCK = 10, 500
LEVELS = (0.01, 0.05)


def grid(work: Path) -> Measured:
    """Section 4.4 of the paper: who of 14,641 behaviors, observed in ten trials among agents, is told from the agents."""
    for name in ("aggregation", "object-clustering"):
        for seed in range(102, 105):
            yield (
                (name, str(seed)),
                lambda name=name, seed=seed: over_grid(work / f"{name}-{seed}", name, seed),
            )


def over_grid(path: Path, name: str, seed: int) -> list[list[object]]:
    """Return rows (way, samples, level, decision accuracy, sensitivity, specificity)."""
    result = run_on(path, 1000, scenario=name, seed=seed)
    run, rng = run_classifiers(result), np.random.default_rng((33, seed))
    scenario = run.simulated_scenario()
    dimension, agents = len(scenario.controller), scenario.agents
    axes = [np.linspace(-1, 1, 11 if dimension == 4 else 5)] * dimension
    models = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dimension)
    looks = methods_of(run)

    def observed(swarms: int) -> np.ndarray:
        """Return samples (individuals, 10, T, D) of agents in swarms of their own."""
        seen = Trials.draw(scenario, alone(scenario, swarms * GRID_TRIALS), rng).observe(None, 1)
        return (
            seen.reshape(swarms, GRID_TRIALS, *seen.shape[1:])
            .swapaxes(1, 2)
            .reshape(-1, GRID_TRIALS, *seen.shape[2:])
        )

    normal, calibration, fresh = observed(100), observed(200), observed(200)
    learned = {}
    for method in looks:
        for count in (1, GRID_TRIALS):
            seen = [Features(method.features([each])[0]) for each in normal[:, :count]]
            learned[method.name, count] = method, method.learn(seen, False, ())

    def scores(samples: np.ndarray) -> dict[tuple[str, int], np.ndarray]:
        return {
            (way, count): np.array(
                [score(each).mean() for each in features_alone(method, list(samples[:, :count]))]
            )
            for (way, count), (method, score) in learned.items()
        }

    usual, new = scores(calibration), scores(fresh)
    found: dict[tuple[str, int], list[np.ndarray]] = {key: [] for key in learned}
    for start in range(0, len(models), GRID_BLOCK):
        block = models[start : start + GRID_BLOCK]
        trials = Trials.draw(scenario, mixed(scenario, len(block), GRID_TRIALS), rng)
        moved = trials.observe(Behavior(block), 1)[:, agents].reshape(
            len(block), GRID_TRIALS, *fresh.shape[2:]
        )
        for key, each in scores(moved).items():
            found[key].append(each)
    rows: list[list[object]] = []
    for (way, count), values in found.items():
        for level in LEVELS:
            limit = np.quantile(usual[way, count], 1 - level)
            told = float(np.mean(np.concatenate(values) > limit))
            spared = float(np.mean(new[way, count] <= limit))
            rows.append(
                [way, count, level, f"{(told + spared) / 2:.4f}", f"{told:.4f}", f"{spared:.4f}"]
            )
    return rows


def group(name: str, recordings: int, seed: int) -> list[tl.Trajectories]:
    """Simulate recordings whose individuals differ lastingly, by about a tenth of each parameter."""
    truth, rng = NORMAL[name], np.random.default_rng(seed)
    family = FAMILIES[name](
        individuals=INDIVIDUALS, steps=FRAMES - 2, interval_s=1 / FPS, tank_cm=TANK
    )
    values = np.array(list(truth.values()))[:, None, None]
    own, shared = (rng.standard_normal((len(truth), recordings, size)) for size in (INDIVIDUALS, 1))
    values = values * np.exp(0.1 * own + 0.05 * shared)
    frames = np.stack(list(islice(family._move(values, rng.spawn(recordings)), FRAMES)), axis=1)
    places = frames.view(float).reshape(*frames.shape, 2) + rng.normal(0, 0.01, (*frames.shape, 2))
    names = tuple(str(k + 1) for k in range(INDIVIDUALS))
    return [tl.Trajectories(each, np.ones(each.shape[:2], bool), FPS, names) for each in places]


def learned(
    work: Path,
    recording: tl.Trajectories,
    model: str,
    signals: str,
    seed: int,
    label: str,
    tank: tuple[float, float] | None = None,
) -> tl.Result:
    """Return a run on one recording."""
    windows = recording.windows(length_s=4, signals=SIGNALS[signals])
    family = FAMILIES[model](
        individuals=len(recording.individuals), steps=windows.learning.shape[1], interval_s=windows.interval_s,
        signals=windows.names, tank_cm=tank,
    )  # fmt: skip
    given = {"genuine": windows, "simulate": family, "parameters": family.parameters, "name": model}
    return run_on(work / f"{label}-{model}-{signals}-{seed}", 500, **given, seed=seed)


def planted(
    result: tl.Result,
    normal: list[tl.Trajectories],
    cases: list[tuple[str, tl.Trajectories, tl.Trajectories, int]],
) -> list[list[object]]:
    """Return rows (kind, way, area, share in first place); cases are (kind, recording without, with, who).

    What learns from planted individuals has not seen the kind that is judged.
    """
    run = run_classifiers(result)
    genuine = [recorded_motion(each, run) for each in normal]
    said = detect(run, recorded_motion(cases[0][1], run), genuine=genuine).rankings
    known = {id(before): _windows(recorded_motion(before, run), True) for _, before, _, _ in cases}
    moved = [_windows(recorded_motion(after, run), True) for _, _, after, _ in cases]
    found: dict[str, list[np.ndarray]] = {}
    for method, _, score in looked_at(run, genuine):
        usual = {key: method.features(windows) for key, windows in known.items()}
        found[method.name] = [
            np.stack([score(usual[id(case[1])], case[0]), score(method.features(windows), case[0])])
            for case, windows in zip(cases, moved, strict=True)
        ]
    found["read first"] = found[said[0].name]
    rows: list[list[object]] = []
    for way, each in found.items():
        for kind in dict.fromkeys(case[0] for case in cases):
            some = [(both, case) for case, both in zip(cases, each, strict=True) if case[0] == kind]
            usual = np.concatenate(list({id(case[1]): both[0] for both, case in some}.values()))
            area = area_under_curve(np.array([both[1][case[3]] for both, case in some]), usual)
            first = np.mean([both[1].argmax() == case[3] for both, case in some])
            rows.append([kind, way, f"{area:.4f}", f"{first:.4f}"])
    return rows


def methods_of(run: RunClassifiers) -> tuple[Method, ...]:
    """Return the methods, on the signals of a run."""
    return Method(CLASSIFIERS, run.outputs), WINDOW_STATISTICS, ONE_CLASS, MOTION_STATISTICS


def features_alone(method: Method, windows: list[np.ndarray]) -> list[Features]:
    """Return features of individuals that have no fellows."""
    return [Features(each) for each in method.features(windows)]


Scored = Callable[..., np.ndarray]


def looked_at(
    run: RunClassifiers, genuine: list[RecordedMotion]
) -> Iterator[tuple[Method, np.ndarray, Scored]]:
    """Yield methods, scores of normal individuals, each by what was learned without it, and a scorer, as `judge_alike` has."""
    examples = _planted(genuine, run, 0, True)[0]
    for method in methods_of(run):
        method = replace(
            method,
            columns=slice(run.signals, None) if method is MOTION_STATISTICS else slice(run.signals),
        )
        yield (
            method,
            *scaled(
                method,
                NormalIndividuals.of([_windows(each, True) for each in genuine], np.inf),
                examples,
            ),
        )


def scaled(
    method: Method, normal: NormalIndividuals, examples: list[Case]
) -> tuple[np.ndarray, Scored]:
    """Return the scores of normal individuals in units of their scatter, and a scorer of others."""
    trained = TrainedMethod.learn(method, normal, (), examples, True)
    scores = trained.normal_scores()
    middle = np.median(scores)
    scatter = np.median(np.abs(scores - middle))

    def score(features: list[np.ndarray], without: str = "") -> np.ndarray:
        shares = trained.shares(beside_fellows(features, True), without)
        means = np.array([each.mean() if len(each) else -np.inf for each in shares])
        return np.arcsinh((means - middle) / scatter)

    return np.arcsinh((scores - middle) / scatter), score


def families(work: Path) -> Measured:
    """Individuals planted into simulated groups; the first four kinds were tuned on, and all of the first seed."""
    for seed, drawn in ((1, 10), (2, 30020)):
        for name, signals, model in (
            ("couzin", "all", "couzin"), ("couzin", "own", "burst-and-coast"), ("boids", "all", "boids"),
            ("burst-and-coast", "own", "burst-and-coast"), ("burst-and-coast", "all", "couzin"),
        ):  # fmt: skip
            for count in (1, 5):
                key = (f"{name} {signals} {model}", f"{seed} {count}")

                def measure(
                    name: str = name,
                    signals: str = signals,
                    model: str = model,
                    count: int = count,
                    seed: int = seed,
                    drawn: int = drawn,
                ):
                    normal, fresh = group(name, 5, drawn), group(name, 8, drawn + 1)
                    result = learned(
                        work, group(name, 1, seed)[0], model, signals, seed, name, TANK
                    )
                    rng, cases = np.random.default_rng((32, drawn)), []
                    for k, each in enumerate(fresh):
                        who = k % INDIVIDUALS
                        cases += [
                            (kind, each, plant(each, who, kind, rng), who) for kind in PLANTED_KINDS
                        ]
                    return planted(result, normal[:count], cases)

                yield key, measure


def recordings(work: Path) -> Measured:
    """Individuals planted into parts of recordings of animals; the other parts are the normal recordings."""
    for name, (file, fps, scale, parts) in RECORDED.items():
        whole = (
            tl.load_trajectories(DATA / file, fps=fps, pixels_per_cm=scale, y_axis="down")
            .bridged(15)
            .thinned(3)
        )
        ends = np.linspace(0, len(whole.positions), parts + 1).astype(int)
        pieces = [
            replace(
                whole,
                positions=whole.positions[a:b],
                present=whole.present[a:b],
                confidence=None,
                interpolated=None,
            )
            for a, b in pairwise(ends)
        ]
        for signals, model in (("own", "burst-and-coast"), ("all", "couzin")):
            for out in range(1, parts):

                def measure(pieces=pieces, name=name, signals=signals, model=model, out=out):
                    result = learned(work, pieces[0], model, signals, 1, name)
                    rng, each = np.random.default_rng((33, out)), pieces[out]
                    cases = [
                        (kind, each, plant(each, who, kind, rng), who)
                        for who in range(len(each.individuals))
                        for kind in PLANTED_KINDS
                    ]
                    return planted(
                        result, [piece for k, piece in enumerate(pieces) if k != out], cases
                    )

                yield (f"{name} {signals} {model}", f"part {out + 1}"), measure


def turned(path: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Return a path (F, 2) whose steps are turned by angles (F - 1,)."""
    steps = np.diff(path, axis=0)
    cos, sin = np.cos(angles), np.sin(angles)
    moved = np.stack(
        [cos * steps[:, 0] - sin * steps[:, 1], sin * steps[:, 0] + cos * steps[:, 1]], axis=1
    )
    return path[0] + np.concatenate([np.zeros((1, 2)), np.cumsum(moved, axis=0)])


def slow_noise(count: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Return normal noise (count,) with a memory of about a second."""
    width = max(1, int(2 * fps))
    return np.convolve(
        rng.standard_normal(count + width - 1), np.ones(width) / np.sqrt(width), "valid"
    )


def uneven(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Return the path of somebody whose speed wavers."""
    steps = (
        np.diff(paths[:, k], axis=0) * np.exp(0.6 * slow_noise(len(paths) - 1, fps, rng))[:, None]
    )
    return paths[0, k] + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def zigzag(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Return the path of somebody who goes 40 degrees to the left and to the right in turns, half a second each."""
    sides = np.where(np.arange(len(paths) - 1) // max(1, int(fps / 2)) % 2, 1, -1)
    return turned(paths[:, k], np.deg2rad(40) * sides)


def wavering(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Return the path of somebody whose direction wavers slowly."""
    return turned(paths[:, k], 0.8 * slow_noise(len(paths) - 1, fps, rng))


def smoothed(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Return a path averaged over a second."""
    width = int(fps) | 1
    padded = np.pad(paths[:, k], ((width // 2, width // 2), (0, 0)), mode="edge")
    return np.stack(
        [np.convolve(column, np.ones(width) / width, "valid") for column in padded.T], axis=1
    )


def central(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Return the path of somebody who stays halfway between where it would be and the middle of the group."""
    return 0.5 * (paths[:, k] + paths.mean(axis=1))


NEW = {
    "uneven pace": uneven, "zigzag": zigzag, "wavering": wavering, "smoothed": smoothed, "central": central,
    "backwards in time": lambda paths, k, fps, rng: paths[::-1, k].copy(),
}  # fmt: skip
"""Kinds that nothing was trained on; what is trained on planted ones was chosen while they were looked at in other parts."""


def mirrored(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Return the mirror image of somebody else's path, in time with it."""
    other = np.delete(paths, k, axis=1)[:, rng.integers(paths.shape[1] - 1)]
    return np.stack([paths[..., 0].min() + paths[..., 0].max() - other[:, 0], other[:, 1]], axis=1)


def walking(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Return a walk of even speed, the median of its own, whose turns have a memory."""
    speed = np.median(np.hypot(*np.diff(paths[:, k], axis=0).T))
    course = np.cumsum(slow_noise(len(paths) - 1, fps, rng)) / fps
    steps = speed * np.stack([np.cos(course), np.sin(course)], axis=1)
    return paths[0, k] + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def wiggling(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Return the path of somebody whose direction swings by 30 degrees twice a second."""
    return turned(paths[:, k], np.deg2rad(30) * np.sin(4 * np.pi * np.arange(len(paths) - 1) / fps))


def cornered(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Return the path of somebody who goes straight for a second, and then to where it would be."""
    frames = np.arange(len(paths))
    known = frames[:: max(1, int(fps))]
    return np.stack([np.interp(frames, known, paths[known, k, axis]) for axis in range(2)], axis=1)


def bolting(paths: np.ndarray, k: int, fps: float, rng: np.random.Generator) -> np.ndarray:
    """Return the path of somebody who is three times as fast in one second of ten."""
    length = max(1, int(fps))
    fast = np.repeat(rng.random(len(paths) // length + 1) < 0.1, length)[: len(paths) - 1]
    steps = np.where(fast[:, None], 3.0, 1.0) * np.diff(paths[:, k], axis=0)
    return paths[0, k] + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


FRESH = {
    "mirrored": mirrored,
    "walking": walking,
    "wiggling": wiggling,
    "cornered": cornered,
    "bolting": bolting,
}
"""Kinds that were written down last."""
GROUPS: dict[str, dict[str, Planting]] = {"fresh": FRESH, "blind": BLIND, "second blind": SECOND}


def held_out(work: Path) -> Measured:
    """All kinds, and new ones, in other parts, with other seeds, than those of the other tables."""
    _detect.PLANTED_KINDS = dict(
        PLANTED_KINDS
    )  # what `detect` plants itself has none of the new ones
    every = dict(PLANTED_KINDS) | NEW
    PLANTED_KINDS.update(NEW | FRESH | BLIND | SECOND)
    for name, (file, fps, scale, parts) in RECORDED.items():
        whole = (
            tl.load_trajectories(DATA / file, fps=fps, pixels_per_cm=scale, y_axis="down")
            .bridged(15)
            .thinned(3)
        )
        ends = np.linspace(0, len(whole.positions), parts).astype(int)
        bare = replace(whole, confidence=None, interpolated=None)
        pieces = [
            replace(bare, positions=bare.positions[a:b], present=bare.present[a:b])
            for a, b in pairwise(ends)
        ]
        for signals, model, kinds in (
            ("all", "couzin", ""),
            ("own", "burst-and-coast", ""),
            ("all", "couzin", "fresh"),
            ("all", "couzin", "blind"),
            ("all", "couzin", "second blind"),
        ):

            def recorded(pieces=pieces, name=name, signals=signals, model=model, kinds=kinds):
                result = learned(work, pieces[0], model, signals, 7, name)
                rows = []
                for out in range(1, len(pieces)):
                    rng, each = np.random.default_rng((43, out)), pieces[out]
                    cases = [
                        (kind, each, plant(each, who, kind, rng), who)
                        for who in range(len(each.individuals))
                        for kind in GROUPS.get(kinds, every)
                    ]
                    rows += planted(
                        result, [piece for k, piece in enumerate(pieces) if k != out], cases
                    )
                return rows

            yield (f"{name} {signals} {model}{f', {kinds} kinds' * bool(kinds)}", "7"), recorded
    for name, signals, model, kinds in (
        ("couzin", "all", "couzin", ""),
        ("couzin", "own", "burst-and-coast", ""),
        ("couzin", "all", "couzin", "blind"),
        ("couzin", "all", "couzin", "second blind"),
    ):

        def simulated(name=name, signals=signals, model=model, kinds=kinds):
            normal, fresh = group(name, 5, 70020), group(name, 8, 70021)
            result = learned(work, group(name, 1, 7)[0], model, signals, 7, name, TANK)
            rng, cases = np.random.default_rng((43, 70020)), []
            for k, each in enumerate(fresh):
                who = k % INDIVIDUALS
                cases += [
                    (kind, each, plant(each, who, kind, rng), who)
                    for kind in GROUPS.get(kinds, every)
                ]
            return planted(result, normal, cases)

        yield (f"{name} {signals} {model}{f', {kinds} kinds' * bool(kinds)}", "7"), simulated


def direct(work: Path) -> Measured:
    """What can be told at all: each kind by a classifier that was trained on that very kind, in the other parts."""
    PLANTED_KINDS.update(NEW)
    for name, (file, fps, scale, parts) in RECORDED.items():
        whole = (
            tl.load_trajectories(DATA / file, fps=fps, pixels_per_cm=scale, y_axis="down")
            .bridged(15)
            .thinned(3)
        )
        ends = np.linspace(0, len(whole.positions), parts).astype(int)
        bare = replace(whole, confidence=None, interpolated=None)
        pieces = [
            replace(bare, positions=bare.positions[a:b], present=bare.present[a:b])
            for a, b in pairwise(ends)
        ]

        def told(pieces=pieces, name=name):
            from sklearn.discriminant_analysis import LinearDiscriminantAnalysis

            run = run_classifiers(learned(work, pieces[0], "couzin", "all", 7, name))
            method = replace(MOTION_STATISTICS, columns=slice(run.signals, None))

            def seen(recording: tl.Trajectories) -> list[np.ndarray]:
                """Return windows relative to the median of all individuals."""
                found = method.features(_windows(recorded_motion(recording, run), True))
                middle = np.median([each.mean(axis=0) for each in found if len(each)], axis=0)
                return [each - middle for each in found]

            normal, rows = [seen(each) for each in pieces], []
            for kind in PLANTED_KINDS:
                moved = [
                    [
                        seen(plant(each, k, kind, np.random.default_rng((43, p, k))))
                        for k in range(len(each.individuals))
                    ]
                    for p, each in enumerate(pieces)
                ]
                usual, other, first = [], [], []
                for out in range(1, len(pieces)):
                    known = [p for p in range(len(pieces)) if p != out]
                    own = np.concatenate([each for p in known for each in normal[p]])
                    planted_ones = np.concatenate(
                        [group[k] for p in known for k, group in enumerate(moved[p])]
                    )
                    windows, labels = (
                        np.concatenate((own, planted_ones)),
                        np.repeat([0, 1], [len(own), len(planted_ones)]),
                    )
                    spread = windows.std(axis=0) + 1e-6
                    machine = LinearDiscriminantAnalysis(solver="lsqr", shrinkage=0.1).fit(
                        windows / spread, labels
                    )

                    def scores(
                        group: list[np.ndarray], machine=machine, spread=spread
                    ) -> np.ndarray:
                        return np.array(
                            [
                                machine.decision_function(each / spread).mean()
                                if len(each)
                                else -np.inf
                                for each in group
                            ]
                        )

                    usual.append(scores(normal[out]))
                    for k, group in enumerate(moved[out]):
                        found = scores(group)
                        other.append(found[k])
                        first.append(found.argmax() == k)
                area = area_under_curve(np.array(other), np.concatenate(usual))
                rows.append([kind, f"{area:.4f}", f"{np.mean(first):.4f}"])
            return rows

        yield (name, "7"), told


def alarms(work: Path) -> Measured:
    """False alarms on 200 normal recordings of each family, whose individuals differ lastingly."""
    for name, signals, model in (
        ("couzin", "all", "couzin"),
        ("burst-and-coast", "own", "burst-and-coast"),
        ("boids", "all", "boids"),
    ):
        for count in (1, 5, 20):

            def measure(name=name, signals=signals, model=model, count=count):
                result = learned(work, group(name, 1, 1)[0], model, signals, 1, name, TANK)
                run = run_classifiers(result)
                called: dict[tuple[str, float], list[float]] = {}
                for part in range(20):
                    genuine = [
                        recorded_motion(each, run) for each in group(name, count, 40000 + part)
                    ]
                    fresh = [recorded_motion(each, run) for each in group(name, 10, 50000 + part)]
                    said = detect(run, fresh[0], genuine=genuine).rankings
                    usual, new = {}, {}
                    for method, scores, score in looked_at(run, genuine):
                        usual[method.name] = scores
                        new[method.name] = np.stack(
                            [score(method.features(_windows(each, True))) for each in fresh]
                        )
                    usual["read first"], new["read first"] = usual[said[0].name], new[said[0].name]
                    for way, scores in usual.items():
                        chances = (1 + (scores >= new[way][..., None]).sum(axis=-1)) / (
                            len(scores) + 1
                        )
                        for share in (0.01, 0.05):
                            limit = max(share, 1 / (len(scores) + 1)) + 1e-9
                            called.setdefault((way, share), []).extend(
                                np.mean(chances <= limit, axis=1).tolist()
                            )
                return [
                    [
                        way,
                        share,
                        max(share, 1 / (count * INDIVIDUALS + 1)),
                        len(each),
                        f"{np.mean(each):.4f}",
                    ]
                    for (way, share), each in called.items()
                ]

            yield (f"{name} {signals} {model}", f"{count} recordings"), measure


SHORT_SHARES = (1.0, 0.9, 0.75, 0.6, 0.5, 0.25)  # of the windows of all others


def short(work: Path) -> Measured:
    """One short individual among eight normal ones by 40: how often it is called abnormal where 10 % are asked for."""
    for own in (0.1, 0.3, 1.0):
        for share in SHORT_SHARES:
            yield (
                (str(own), str(share)),
                lambda own=own, share=share: [[f"{false_alarms_of_short(own, share):.3f}"]],
            )


def false_alarms_of_short(own: float, share: float, repetitions: int = 60) -> float:
    """Return the share of repetitions in which an individual with a share of the windows is called abnormal."""
    rng = np.random.default_rng(77)

    def group() -> list[np.ndarray]:
        means = own * rng.standard_normal((8, 1, 1, 2))
        return list(means + rng.standard_normal((8, 24, 20, 2)))

    called = []
    for _ in range(repetitions):
        normal = [group() for _ in range(5)]
        motion = group()
        motion[0] = motion[0][: round(24 * share)]
        least = _alike.SHORTEST_SHARE
        # Whoever is short is judged here.
        _alike.SHORTEST_SHARE = 1e-6
        found = _alike.judge_alike(
            [MOTION_STATISTICS], motion, normal, names="abcdefgh", false_alarms=0.1
        )
        _alike.SHORTEST_SHARE = least
        called.append(bool(found.individuals[0].abnormal))
    return float(np.mean(called))


MEASURED: dict[str, tuple[list[str], Callable[[Path], Measured]]] = {
    "swarm": (["scenario", "seed", "way", "difference", "area"], swarm),
    "grid": (
        ["scenario", "seed", "way", "samples", "level", "accuracy", "sensitivity", "specificity"],
        grid,
    ),
    "families": (["case", "seed and recordings", "kind", "way", "area", "first"], families),
    "recordings": (["case", "part", "kind", "way", "area", "first"], recordings),
    "held-out": (["case", "seed", "kind", "way", "area", "first"], held_out),
    "direct": (["case", "seed", "kind", "area", "first"], direct),
    "short": (["individuals_differ_by", "share_of_windows", "false_alarms"], short),
    "alarms": (
        ["case", "calibration", "way", "asked", "promised", "recordings", "false_alarms"],
        alarms,
    ),
}
if __name__ == "__main__":
    main()
