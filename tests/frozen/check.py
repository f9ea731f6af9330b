# ruff: noqa: T201
"""The behavior of version 0.2.0, frozen: small runs of every kind, compared bit by bit with a stored reference.

    python tests/frozen/check.py            # all cases, a minute; --quick: those of a few seconds; --only NAME
    python tests/frozen/check.py --list
    python tests/frozen/check.py --write    # a new reference: only where the numbers are meant to change

Every setting of 0.2.0 is written out below, so that later defaults do not matter. A change of the code that is not meant to
change numbers leaves the reference alone. Times, dates, versions and paths are left out. What is called is public: if a name
changes, change the doors below and nothing else. Runs by trials are not among the cases: their method still changes.

Another kind of processor, other kernels of BLAS, or another version of numpy round differently (decisions 0005 and 0006):
there numbers are compared but for their last digits, of arrays the means, and the last line says so. Runs are chaotic, and
these are so short that no rounding has yet become a decision.
"""

import argparse
import hashlib
import io
import json
import math
import os
import re
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import asdict, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
REFERENCE = HERE / "reference.json"
TIMES = ("seconds_total", "seconds_per_generation")

# --- every setting of 0.2.0 -------------------------------------------------------------------------------------------------

POPULATION = {
    "parents": 50,
    "offspring": 50,
    "initial_low": -1.0,
    "initial_high": 1.0,
    "initial_step_size": 1.0,
    "minimum_step_size": 0.01,
    "adaptation": 0.5,
}
METHOD: dict[str, Any] = {
    **{
        f"{of}.{key}": value
        for of in ("models", "classifiers")
        for key, value in POPULATION.items()
    },
    "models.hidden": 0,
    "models.recombination": 0.5,
    "models.redraw": 0.2,
    "models.exchange": 0.1,
    "models.intermediate": True,
    "models.memory": 0.9,
    "classifiers.hidden": 5,
    "classifiers.renewal": 100,
    "coevolution.archive": 100,
    "run.generations": 1000,
    "run.seed": 1,
    "run.threads": 2,
    "run.checkpoint_every": 50,
    "run.estimate_window": 300,
    "run.history": "full",
}
PAPER = {
    "models.minimum_step_size": 0.0,
    "models.recombination": 1.0,
    "models.redraw": 0.0,
    "models.exchange": 0.0,
    "models.intermediate": False,
    "models.memory": 0.0,
    "classifiers.minimum_step_size": 0.0,
    "classifiers.renewal": 0,
    "coevolution.archive": 0,
}
AGGREGATION: dict[str, Any] = {
    "scenario.controller": [-0.7, -1.0, 1.0, -1.0],
    "scenario.agents": 10,
    "scenario.replicas": 1,
    "scenario.grouping": "mixed",
    "scenario.robot.radius_cm": 3.5,
    "scenario.robot.mass_g": 150.0,
    "scenario.robot.wheel_distance_cm": 5.1,
    "scenario.robot.maximum_speed_cm_s": 12.8,
    "scenario.robot.wheel_noise": 0.05,
    "scenario.robot.clamp_wheel_speeds": False,
    "scenario.objects.count": 0,
    "scenario.objects.radius_cm": 5.0,
    "scenario.objects.mass_g": 35.0,
    "scenario.objects.friction": 0.58,
    "scenario.arena.width_cm": "unbounded",
    "scenario.arena.height_cm": "unbounded",
    "scenario.sensor.readings": ["background", "robot"],
    "scenario.sensor.field_of_view": 0.0,
    "scenario.trial.duration_s": 10.0,
    "scenario.trial.control_interval_s": 0.1,
    "scenario.trial.physics_steps": 10,
    "scenario.trial.start_side_cm": 331.66,
    "scenario.representation": "reactive",
    "scenario.known": True,
    "classifiers.input_scale": "robot",
}
CLUSTERING = AGGREGATION | {
    "scenario.controller": [0.5, 1.0, 1.0, 0.5, 0.1, 0.5],
    "scenario.agents": 4,
    "scenario.objects.count": 10,
    "scenario.sensor.readings": ["background", "object", "robot"],
    "scenario.trial.start_side_cm": 100.0,
}
FIELD_OF_VIEW = AGGREGATION | {
    "scenario.controller": [-0.7, -1.0, 1.0, 0.0],
    "scenario.sensor.field_of_view": 1.0471975511965976,
    "scenario.trial.duration_s": 100.0,
    "scenario.representation": "morphology",
}
SMALL = {
    "models.parents": 8,
    "models.offspring": 8,
    "classifiers.parents": 8,
    "classifiers.offspring": 8,
    "classifiers.renewal": 6,
    "coevolution.archive": 7,
    "run.generations": 24,
    "run.checkpoint_every": 5,
    "run.seed": 3,
}
OWN: dict[str, Any] = {
    "name": "own-system",
    "title": "own-system",
    "length": None,
    "held_out": 0.2,
    "samples_per_generation": 16,
    "vectorized": True,
    "batches": 1,
    "workers": None,
    "timeout_s": None,
}
LEFT_OUT = object()
SPLIT = {key: value for key, value in OWN.items() if key != "held_out"}
EFFORT = {"samples": 24, "points": 6}
FAMILY: dict[str, Any] = {
    "observed": 1,
    "settling_steps": 0,
    "start_side_cm": 20.0,
    "tank_cm": None,
}
WINDOWS: dict[str, Any] = {
    "stride": None,
    "signals": ("speed", "turn"),
    "individuals": None,
    "hold_out": 0.2,
    "hold_out_individuals": (),
    "gap": 0,
    "smooth_frames": 1,
    "jump_factor": 20.0,
}
BURST_AND_COAST = {
    "speed": (0.0, 40.0),
    "kick_interval": (0.1, 2.0),
    "glide_time": (0.1, 2.0),
    "turn": (0.0, 1.5),
}
COUZIN = {
    "speed": (0.0, 20.0),
    "turning_rate": (0.0, 6.0),
    "repulsion_radius": (0.0, 5.0),
    "orientation_width": (0.0, 15.0),
    "attraction_width": (0.0, 15.0),
    "noise": (0.0, 0.5),
}
OF_FAMILIES: dict[str, dict[str, Any]] = {
    "boids": {"radius_cm": 10.0, "acceleration_per_s": 2.0, "slowest": 0.5},
    "burst-and-coast": {"variation": 0.5},
    "couzin": {"field_of_view_rad": 4.71238898038469},
    "robots": {},
    "vicsek": {"period_cm": 20.0},
}
OF_STUDY = ("run.seed", "run.threads", "classifiers.hidden")
LABORATORY = {
    "models.parents": 2,
    "models.offspring": 2,
    "models.redraw": 0.0,
    "models.exchange": 0.0,
    "classifiers.parents": 4,
    "classifiers.offspring": 4,
    "run.checkpoint_every": 1,
    "scenario.robot.clamp_wheel_speeds": True,
    "scenario.arena.width_cm": 90.0,
    "scenario.arena.height_cm": 100.0,
    "scenario.trial.duration_s": 1.0,
}

# --- the doors --------------------------------------------------------------------------------------------------------------


def infer(
    scenario: str | None = None, settings: dict[str, Any] | None = None, **options: Any
) -> Any:
    """Execute a run."""
    import turing_learning as tl

    return tl.infer(scenario, settings=METHOD | (settings or {}), **options)


def command(*arguments: object) -> str:
    """Call the command line in this process, which has imported it, and return what it prints."""
    from turing_learning.cli import main

    words = [str(argument) for argument in arguments]
    code = None
    out = io.StringIO()
    err = io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        try:
            main(words)
        except SystemExit as ended:
            code = ended.code
    if code:
        raise SystemExit(f"turing-learning {' '.join(words)}\n{out.getvalue()}\n{err.getvalue()}")
    return out.getvalue()


def toml(settings: dict[str, Any], path: Path) -> Path:
    """Write settings by dotted keys as a file."""
    path.write_text("".join(f"{key} = {json.dumps(value)}\n" for key, value in settings.items()))
    return path


def outcome(result: Any) -> dict[str, Any]:
    """Return all numbers of a run: those of result.json, and its history."""
    content = {key: value for key, value in result.to_json().items() if key not in TIMES}
    history = result.history
    arrays = {
        str(name): history[name].to_numpy()
        for name in sorted([*history.data_vars, *history.coords], key=str)
    }
    return {"result": content, "history": {name: digest(array) for name, array in arrays.items()}}


def digest(array: Any) -> str:
    """Return what is compared of an array: type, shape, mean, and a digest of every bit."""
    array = np.asarray(array)
    if array.dtype.kind in "OUT":
        return ",".join(map(str, array.ravel()))
    data = np.ascontiguousarray(array).tobytes()
    mean = float(np.mean(array, dtype=float))
    return f"{array.dtype} {array.shape} mean {mean!r} bits {hashlib.sha256(data).hexdigest()[:20]}"


def numbers(text: str) -> str:
    """Return what is compared of a text: the digest of all numbers in it."""
    return digest([float(each) for each in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", text)])


def plain(value: Any) -> Any:
    """Return what JSON can hold; numbers survive it to the last bit."""
    if isinstance(value, dict):
        return {str(key): plain(each) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    if isinstance(value, np.ndarray):
        return digest(value)
    if isinstance(value, np.generic):
        return plain(value.item())
    if is_dataclass(value) and not isinstance(value, type):
        return plain(asdict(value))
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


# --- what is run ------------------------------------------------------------------------------------------------------------

CASES: dict[str, tuple[Callable[[Path], Any], bool]] = {}


def case(function: Callable[[Path], Any] | None = None, *, quick: bool = False) -> Any:
    """Register a case."""

    def register(function: Callable[[Path], Any]) -> Callable[[Path], Any]:
        CASES[function.__name__.replace("_", "-")] = (function, quick)
        return function

    return register(function) if function else register


@case(quick=True)
def aggregation(folder: Path) -> Any:
    """The first case study, small, with renewals and a full archive."""
    return outcome(infer("aggregation", AGGREGATION | SMALL))


@case(quick=True)
def clustering(folder: Path) -> Any:
    """The second case study, small, in a folder."""
    return outcome(infer("object-clustering", CLUSTERING | SMALL, out=folder / "run"))


@case
def aggregation_at_full_size(folder: Path) -> Any:
    """The paper's size."""
    return outcome(infer("aggregation", AGGREGATION | {"run.generations": 40}))


@case
def clustering_at_full_size(folder: Path) -> Any:
    """The paper's size."""
    return outcome(infer("object-clustering", CLUSTERING | {"run.generations": 40}))


@case(quick=True)
def paper(folder: Path) -> Any:
    """The preset that keeps to the text of the paper."""
    return outcome(infer("aggregation", AGGREGATION | SMALL | PAPER, preset="paper"))


@case(quick=True)
def field_of_view(folder: Path) -> Any:
    """The field of view is inferred, too."""
    short = {"scenario.trial.duration_s": 10.0}
    return outcome(infer("aggregation-field-of-view-60", FIELD_OF_VIEW | SMALL | short))


@case
def narrow_view(folder: Path) -> Any:
    """As above, with agents whose sensor is a line, and longer trials."""
    line = {"scenario.controller": [-0.7, -1.0, 1.0, -1.0], "scenario.sensor.field_of_view": 0.0}
    short = {"run.generations": 6, "scenario.trial.duration_s": 30.0}
    return outcome(infer("aggregation-field-of-view-0", FIELD_OF_VIEW | line | SMALL | short))


@case(quick=True)
def separated(folder: Path) -> Any:
    """Replicas never meet agents."""
    return outcome(infer("aggregation", AGGREGATION | SMALL | {"scenario.grouping": "separated"}))


@case(quick=True)
def networks(folder: Path) -> Any:
    """Models are networks that assume no control system."""
    hidden = {"models.hidden": 3, "models.initial_step_size": 0.3}
    return outcome(infer("aggregation", AGGREGATION | SMALL | hidden))


@case
def walls(folder: Path) -> Any:
    """Fewer robots, two replicas, walls, cut wheel speeds, another network and a scale of its own."""
    changes = {
        "scenario.agents": 5,
        "scenario.replicas": 2,
        "scenario.arena.width_cm": 120.0,
        "scenario.arena.height_cm": 90.0,
        "scenario.robot.clamp_wheel_speeds": True,
        "scenario.trial.duration_s": 5.0,
        "classifiers.hidden": 3,
        "classifiers.input_scale": [10.0, 4.0],
        "run.threads": 1,
    }
    return outcome(infer("object-clustering", CLUSTERING | SMALL | changes))


@case(quick=True)
def stopped_and_resumed(folder: Path) -> Any:
    """A run that is stopped, between two checkpoints and at one, has the numbers of one that is not."""
    import turing_learning as tl

    for generations in (7, 3):
        asked = iter([False] * (generations - 1))
        options = {"should_stop": lambda asked=asked: next(asked, True)}
        if not (folder / "run").exists():
            infer("aggregation", AGGREGATION | SMALL, out=folder / "run", **options)
        else:
            tl.resume(folder / "run", **options)
    stopped = outcome(tl.load_run(folder / "run"))
    finished = outcome(tl.resume(folder / "run", threads=1))
    if finished != (uninterrupted := CASES["aggregation"][0](folder)):
        raise SystemExit(f"a resumed run differs: {finished} is not {uninterrupted}")
    return {"stopped": stopped, "finished": finished}


@case
def thin(folder: Path) -> Any:
    """A thin history, from the command line, with a file of settings."""
    import turing_learning as tl

    settings = METHOD | AGGREGATION | SMALL | {"run.history": "thin"}
    command(
        "infer",
        "aggregation",
        "--config",
        toml(settings, folder / "a.toml"),
        "--out",
        folder / "run",
    )
    return outcome(tl.load_run(folder / "run"))


def walk(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Speed and turn of walkers in 30 steps."""
    speed, noise = parameters.T[:, :, None]
    shape = (len(parameters), 30)
    return np.stack(
        [speed + rng.standard_normal(shape), noise * rng.standard_normal(shape)], axis=-1
    )


def falling_walk(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The same, of which the fastest are lost."""
    samples = walk(parameters, rng)
    samples[parameters[:, 0] > 17, 3, 0] = np.nan
    return samples


def one_walk(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The walk of one model, twice."""
    return np.stack([walk(parameters[None], rng)[0], walk(parameters[None], rng)[0]])


def walks(count: int = 40, speed: float = 6.0) -> np.ndarray:
    """Recorded walks."""
    return walk(np.tile([speed, 0.6], (count, 1)), np.random.default_rng(1))


def walk_ranges() -> dict[str, Any]:
    """The ranges of the walk: a plain one, and one on a logarithmic scale."""
    import turing_learning as tl

    return {
        "speed": tl.Parameter(0.0, 20.0, scale="linear", unit="cm/s", initial=(0.0, 20.0)),
        "turn_noise": tl.Parameter(0.01, 3.0, scale="log", unit="rad", initial=(0.1, 2.0)),
    }


def infer_walk(
    simulate: Any = walk,
    settings: dict[str, Any] | None = None,
    genuine: Any = None,
    **options: Any,
) -> Any:
    """Execute a run with the walk."""
    return infer(
        genuine=walks() if genuine is None else genuine,
        simulate=simulate,
        parameters=walk_ranges(),
        settings=SMALL | (settings or {}),
        signals=("speed", "turn"),
        **{key: value for key, value in (OWN | options).items() if value is not LEFT_OUT},
    )


@case(quick=True)
def custom(folder: Path) -> Any:
    """A system given by samples and a simulator; some of its simulations fail."""
    return outcome(infer_walk(falling_walk, out=folder / "run"))


@case
def custom_on_workers(folder: Path) -> Any:
    """A simulator of one model at a time in two processes; recorded samples of different lengths; another scale."""
    samples = [each[: 25 + k % 6] for k, each in enumerate(walks())]
    scales = {"classifiers.input_scale": [3.0, 1.5]}
    options = {
        "vectorized": False,
        "batches": LEFT_OUT,
        "workers": 2,
        "length": "shortest",
        "held_out": [1, 5, 9],
    }
    return outcome(infer_walk(one_walk_of_25, scales, samples, **options))


def one_walk_of_25(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The walk of one model, as long as the shortest sample."""
    return one_walk(parameters, rng)[:, :25]


@case
def custom_observed_anew(folder: Path) -> Any:
    """A system that is observed in every generation; three calls of the simulator in each."""
    return outcome(infer_walk(walk, genuine=observe_walks, batches=3, held_out=LEFT_OUT))


def observe_walks(rng: np.random.Generator) -> np.ndarray:
    """Walks that nobody has seen before."""
    return walk(np.tile([6.0, 0.6], (20, 1)), rng)


@case
def scenario_as_system(folder: Path) -> Any:
    """The agents of a scenario, observed, and a family of models of robots."""
    from turing_learning.families import Robots

    robots = Robots(individuals=5, steps=100, interval_s=0.1)
    result = infer(
        genuine="aggregation",
        simulate=robots,
        parameters=robots.parameters,
        settings=SMALL | {"run.generations": 8},
        signals=("speed", "turn"),
        **SPLIT,
    )
    return outcome(result)


def fish(individuals: int, frames: int, seed: int, turn: float = 0.3) -> Any:
    """A recording of simulated fish."""
    import turing_learning as tl
    from turing_learning.families import BurstAndCoast

    tank = BurstAndCoast(
        individuals=individuals,
        steps=frames - 2,
        interval_s=0.1,
        signals=("speed", "turn"),
        variation=0.5,
        **FAMILY | {"tank_cm": (60.0, 40.0)},
    )
    positions = tank.simulate(np.array([[12.0, 0.5, 0.8, turn]]), np.random.default_rng(seed))[0]
    names = tuple(f"fish {k + 1}" for k in range(individuals))
    return tl.Trajectories(
        positions, np.ones(positions.shape[:2], dtype=bool), fps=10.0, individuals=names
    )


@case
def recording(folder: Path) -> Any:
    """Windows of a recording, and burst and coast; then its check, and detection in another recording."""
    from turing_learning.detection import Detector, recorded_motion, run_classifiers
    from turing_learning.families import BurstAndCoast

    windows = fish(4, 900, seed=1).windows(steps=30, **WINDOWS)
    swim = BurstAndCoast(
        individuals=1, steps=30, interval_s=0.1, signals=("speed", "turn"), variation=0.5, **FAMILY
    )
    result = infer(
        genuine=windows,
        simulate=swim,
        parameters=BURST_AND_COAST,
        settings=SMALL,
        signals=("speed", "turn"),
        out=folder / "run",
        **SPLIT,
    )
    found = {
        "windows": digest(windows.learning),
        "held out": digest(windows.held_out),
        "run": outcome(result),
    }
    motion = recorded_motion(fish(3, 600, seed=2, turn=0.9), run_classifiers(result))
    detector = Detector.from_run(result, rule="discriminant", false_alarms=0.05, seed=0, threads=1)
    return found | {"timeline": [plain(each) for each in detector.timeline(motion)]}


@case
def couzin(folder: Path) -> Any:
    """What a tracker wrote, and Couzin's model, with signals of neighbors."""
    import turing_learning as tl
    from turing_learning.families import Couzin

    path = HERE.parent / "reference" / "data" / "tracktor" / "zebrafish_video_idtracked.txt"
    tracked = tl.load_trajectories(path, fps=30.0, pixels_per_cm=20.0, y_axis="down")
    signals = ("speed", "turn", "neighbor_distance")
    windows = tracked.windows(
        steps=40, **WINDOWS | {"signals": signals, "smooth_frames": 3, "gap": 5}
    )
    swim = Couzin(
        individuals=5,
        steps=40,
        interval_s=windows.interval_s,
        signals=signals,
        field_of_view_rad=4.71238898038469,
        **FAMILY | {"settling_steps": 10},
    )
    settings = SMALL | {"run.generations": 10}
    result = infer(
        genuine=windows,
        simulate=swim,
        parameters=COUZIN,
        settings=settings,
        **SPLIT | {"title": "Zebrafish"},
    )
    return {"windows": digest(windows.learning), "run": outcome(result)}


@case
def recording_by_command(folder: Path) -> Any:
    """What a tracker wrote, by command."""
    import turing_learning as tl

    path = HERE.parent / "reference" / "data" / "tracktor" / "termite_video_idtracked.txt"
    settings = toml(METHOD | SMALL | {"run.generations": 6}, folder / "settings.toml")
    options = (
        "--fps",
        25,
        "--scale",
        30,
        "--y-axis",
        "down",
        "--window",
        2,
        "--every",
        2,
        "--model",
        "vicsek",
        # those of 0.2.0; by default ranges follow from the recording now
        "--range",
        "speed=0:20",
        "--range",
        f"noise=0:{2 * math.pi}",
        "--range",
        "radius=0:10",
    )
    signals = ("--signals", "speed,turn")
    command(
        "infer",
        "--trajectories",
        path,
        *options,
        *signals,
        "--config",
        settings,
        "--out",
        folder / "run",
    )
    return outcome(tl.load_run(folder / "run"))


@case
def families(folder: Path) -> Any:
    """Motion of all families."""
    from turing_learning.families import FAMILIES

    found = {}
    for name, family in sorted(FAMILIES.items()):
        plane = {} if name == "robots" else FAMILY
        group = family(individuals=4, steps=25, interval_s=0.1, **plane, **OF_FAMILIES[name])
        middle = [0.5 * (each.initial[0] + each.initial[1]) for each in group.parameters.values()]
        found[name] = digest(group(np.array([middle, middle]), np.random.default_rng(5)))
    return found


@case(quick=True)
def motion(folder: Path) -> Any:
    """Trials of swarms, with objects and many robots."""
    import turing_learning as tl

    found = {}
    for name, agents in (
        ("aggregation", 60),
        ("object-clustering", 12),
        ("aggregation-field-of-view-60", 30),
    ):
        scenario = replace(tl.swarm.SCENARIOS[name], agents=agents)
        poses = tl.swarm.initial_poses(
            scenario, trials=2, rng=np.random.default_rng(4), side_cm=60.0
        )
        controllers = np.broadcast_to(
            scenario.controller, (*poses.shape[:2], len(scenario.controller))
        )
        moved = tl.swarm.simulate(scenario, controllers, poses, control_steps=50, seed=9, threads=2)
        found[name] = digest(moved.speeds)
    return found


@case
def study_on_two_workers(folder: Path) -> Any:
    """Four runs of two configurations in two processes; then they are pooled."""
    import turing_learning as tl

    found = tl.study(
        "aggregation",
        runs=2,
        first_seed=5,
        settings={
            key: value
            for key, value in (METHOD | AGGREGATION | SMALL).items()
            if key not in OF_STUDY
        }
        | {"run.history": "thin"},
        grid={"classifiers.hidden": [3, 5]},
        workers=2,
        out=folder / "study",
    )
    assert found.complete
    runs = [tl.load_run(path) for path in sorted((folder / "study" / "runs").iterdir())]
    summary = (folder / "study" / "summary.csv").read_text()
    pooled = tl.pool(runs[:2])
    return {
        "runs": [outcome(run) for run in runs],
        "summary": numbers(summary),
        "convergence": numbers((folder / "study" / "convergence.csv").read_text()),
        "pooled": [pooled.estimate, pooled.interval],
    }


@case
def check(folder: Path) -> Any:
    """The checks of a swarm's run and of a custom system's."""
    from turing_learning.identifiability import Effort

    effort = Effort(**EFFORT)
    swarm = infer("aggregation", AGGREGATION | SMALL, out=folder / "swarm")
    options = {"effort": effort, "recoveries": 1, "recovery_generations": 8, "seed": 2}
    checks = [swarm.check(**options), infer_walk(out=folder / "own").check(**options, groups=None)]
    return [
        {
            "test": plain(each.test),
            "profiles": plain(each.profiles),
            "recoveries": plain(each.recoveries),
            "quantities": numbers(json.dumps(plain(each.quantities), sort_keys=True)),
        }
        for each in checks
    ]


@case
def detection(folder: Path) -> Any:
    """Who of a swarm behaves abnormally, from the command line and by three rules."""
    import turing_learning as tl
    from turing_learning.detection import Detector, plant_abnormal, run_classifiers

    run = infer(
        "aggregation", AGGREGATION | SMALL | {"scenario.trial.duration_s": 3.0}, out=folder / "run"
    )
    told = command(
        "detect",
        folder / "run",
        "--simulate",
        2,
        "--samples",
        3,
        "--seed",
        4,
        "--rule",
        "discriminant",
        "--json",
    )
    stored = tl.load_run(folder / "run")
    motion = plant_abnormal(
        run_classifiers(stored).simulated_scenario(), 3, samples=2, seed=6, threads=1
    )
    found = {"command": json.loads(told), "motion": digest(motion.samples)}
    for rule in ("fittest", "unanimous", "discriminant"):
        detector = Detector.from_run(
            run, rule=rule, false_alarms=0.05, behaviors=20, trials=4, seed=1, threads=1
        )
        found[rule] = [plain(each) for each in detector.verdicts(motion)]
    return found


def laboratory_file(folder: Path, *, repeats: int, generations: int) -> Path:
    """Write the file of a small laboratory."""
    replica = 'name = "{0}"\nrole = "replica"\nmarker = "{0}"\naddress = "{0}"\n'
    robots = [f'name = "a{k}"\nrole = "agent"\nmarker = "blue"\n' for k in range(3)]
    robots += [replica.format(color) for color in ("orange", "purple")]
    head = (
        'camera = { source = 0, fps = 10.0, calibration = "camera.json", markers = "triangles", marker_height_cm = 6.0 }\n'
        "timing = { wait_s = 1.0, disperse_s = 8.0, execute_s = 7.0, tolerance_s = 1.0 }\n"
        "interventions = { batteries_every = 2, stuck_cm = 0.2 }\n"
        f"evaluation = {{ repeats = {repeats} }}\n"
    )
    drawn_from_robots = (
        "scenario.agents",
        "scenario.replicas",
        "scenario.trial.control_interval_s",
    )
    settings = METHOD | AGGREGATION | LABORATORY | {"run.generations": generations}
    file = toml(
        {key: value for key, value in settings.items() if key not in drawn_from_robots},
        folder / "lab.toml",
    )
    file.write_text(head + file.read_text() + "".join(f"[[robots]]\n{robot}" for robot in robots))
    return file


@case
def rehearsal(folder: Path) -> Any:
    """A run in an emulated laboratory, with a post-evaluation and what detectors are calibrated with.

    Its numbers are those after 0.2.0, since the clocks of emulated robots are out of step.
    """
    from turing_learning.runs import load_run, read_post_evaluation

    file = laboratory_file(folder, repeats=1, generations=3)
    command("robots", "run", "--config", file, "--emulated", "--out", folder / "run")
    post = read_post_evaluation(folder / "run")
    assert post is not None
    with np.load(folder / "run" / "calibration.npz") as kept:
        calibration = {name: digest(kept[name]) for name in kept.files}
    events = [
        json.loads(line) for line in (folder / "run" / "events.jsonl").read_text().splitlines()
    ]
    return {
        "run": outcome(load_run(folder / "run")),
        "post-evaluation": [digest(post.fitness), plain(post.best_model)],
        "calibration": calibration,
        "events": [[event["kind"], event["stage"]] for event in events],
    }


# --- comparison -------------------------------------------------------------------------------------------------------------


def machine() -> dict[str, str]:
    """Return what the last bits depend on: the kind of processor, the kernels of BLAS, and the versions of what computes."""
    import llvmlite.binding
    import numba
    import scipy.linalg
    from threadpoolctl import threadpool_info

    features = llvmlite.binding.get_host_cpu_features()
    kind = "avx512" if features.get("avx512f") else "avx2" if features.get("avx2") else "plain"
    versions = {module.__name__: module.__version__ for module in (np, numba, scipy)}
    blas = sorted(
        {each.get("architecture", "") for each in threadpool_info() if each["user_api"] == "blas"}
    )
    return {"processor": os.environ.get("NUMBA_CPU_NAME", kind), "blas": " ".join(blas), **versions}


def differences(
    found: Any, expected: Any, same: Callable[[Any, Any], bool], place: str = ""
) -> list[str]:
    """Return the places at which two outcomes differ."""
    if (
        isinstance(found, dict) and isinstance(expected, dict) and found.keys() >= expected.keys()
    ):  # later versions may say more
        pairs: Any = ((key, found[key], expected[key]) for key in expected)
    elif isinstance(found, list) and isinstance(expected, list) and len(found) == len(expected):
        pairs = zip(range(len(found)), found, expected, strict=True)
    else:
        return (
            []
            if same(found, expected)
            else [f"{place}: {str(found)[:160]} is not {str(expected)[:160]}"]
        )
    return [line for key, *pair in pairs for line in differences(*pair, same, f"{place}/{key}")]


def same_bits(found: Any, expected: Any) -> bool:
    """Return whether two values are the same."""
    return type(found) is type(expected) and found == expected


def nearly_same(found: Any, expected: Any) -> bool:
    """Return whether two values are the same but for the last digits of numbers; of an array, its mean."""
    if isinstance(found, str) and isinstance(expected, str):
        (here, value, _), (there, other, _) = (parts(each) for each in (found, expected))
        return here == there and nearly_same(value, other)
    if isinstance(found, float) and isinstance(expected, float):
        return found == expected or math.isclose(found, expected, rel_tol=1e-8, abs_tol=1e-10)
    return same_bits(found, expected)


def parts(text: str) -> tuple[str, float, str]:
    """Return what an array is, its mean and its digest; any other text is what it is."""
    found = re.fullmatch(r"(.*) mean (\S+) bits (\S+)", text)
    return (
        (found[1], 0.0 if found[2] == "nan" else float(found[2]), found[3])
        if found
        else (text, 0.0, "")
    )


def execute(names: list[str], report: Callable[[str], None]) -> dict[str, Any]:
    """Return what the cases come to."""
    found = {}
    for name in names:
        began = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            found[name] = json.loads(json.dumps(plain(CASES[name][0](Path(folder)))))
        report(f"{name}: {time.perf_counter() - began:.1f} s")
    return found


def main() -> int:
    """Compare, or write the reference."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="only the cases of a few seconds")
    parser.add_argument(
        "--only", action="append", choices=sorted(CASES), help="this case alone; repeatable"
    )
    parser.add_argument("--list", action="store_true", help="name the cases, and execute none")
    parser.add_argument("--write", action="store_true", help="write the reference instead")
    parser.add_argument("--strict", action="store_true", help="bit by bit on any machine")
    options = parser.parse_args()
    if options.list:
        for name, (function, quick) in CASES.items():
            print(f"{name}{' (quick)' if quick else ''}: {function.__doc__}")
        return 0
    names = options.only or [
        name for name, (_, quick) in CASES.items() if quick or not options.quick
    ]
    found = execute(names, lambda line: print(line, flush=True))
    if options.write:
        kept = (
            json.loads(REFERENCE.read_text())["cases"]
            if options.only and REFERENCE.exists()
            else {}
        )
        document = {"machine": machine(), "cases": kept | found}
        REFERENCE.write_text(json.dumps(document, indent=1, sort_keys=True) + "\n")
        return 0
    reference = json.loads(REFERENCE.read_text())
    here, there = machine(), reference["machine"]
    exact = options.strict or here == there
    same = same_bits if exact else nearly_same
    wrong = [
        line
        for name in names
        for line in differences(found[name], reference["cases"][name], same, name)
    ]
    print(*wrong[:200], sep="\n")
    print(f"frozen: {len(names)} cases, {len(wrong)} differences")
    if not exact:
        print(
            f"but for the last digits of numbers: the reference is of {there}, and this is {here}"
        )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
