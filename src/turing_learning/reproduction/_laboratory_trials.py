"""Robots in the emulated laboratory: runs, the same in simulation, swarms before the camera, random models."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning import robots, runs
from turing_learning.analysis import dispersion, largest_cluster
from turing_learning.purposes import (
    ACCURACY_MODELS,
    VALIDATION_CAMERA,
    VALIDATION_NOISE,
    VALIDATION_STARTS,
)

from ._experiment import Sizes, Stop, Work, seeds_of

REPLICAS = {"replica-1": "orange", "replica-2": "purple"}
"""Names and markers; as in the paper, agents wear blue."""
AGENTS = 8
SWARM_KINDS = ("agents", "model")
MARKER = "red"


@dataclass(frozen=True, eq=False)
class LaboratoryRuns:
    """What R runs of G generations have been through."""

    models: np.ndarray  # (R, G, M, P), wheel speeds as fractions of the maximum
    fitness: np.ndarray  # (R, G, M), subjective
    # (R, repeats, M), of the last models, observed again and judged by the last classifiers
    again: np.ndarray
    classifiers: np.ndarray  # (R, K, N, Q), of K generations
    classifier_fitness: np.ndarray  # (R, K, N), subjective

    @classmethod
    def stacked(cls, pieces: Mapping[str, Mapping[str, np.ndarray]]) -> "LaboratoryRuns":
        """Return what pieces of work hold of one run each."""
        arrays = {}
        for name in cls.__dataclass_fields__:
            arrays[name] = np.stack([piece[name] for piece in pieces.values()])
        return cls(**arrays)

    @property
    def best(self) -> np.ndarray:
        """The models (R, P) of the last generation with the highest mean fitness in the post-evaluation."""
        chosen = self.again.mean(axis=1).argmax(axis=1)
        return self.models[np.arange(len(chosen)), -1, chosen]

    @property
    def fittest(self) -> np.ndarray:
        """The subjectively best model (R, G, P) of each generation."""
        chosen = self.fitness.argmax(axis=2)[..., None, None]
        return np.take_along_axis(self.models, chosen, axis=2)[:, :, 0]


def laboratory_file(work: Work, preset: str) -> Path:
    """Write the laboratory's file and the calibration of its camera; return the file's path."""
    folder = work.store.path / f"laboratory-{preset}"
    folder.mkdir(parents=True, exist_ok=True)
    robots.overhead_camera().save(folder / "camera.json", force=True)
    members = []
    for k in range(1, AGENTS + 1):
        members.append(f'name = "agent-{k}"\nrole = "agent"\nmarker = "blue"\n')
    for name, marker in REPLICAS.items():
        members.append(
            f'name = "{name}"\nrole = "replica"\nmarker = "{marker}"\naddress = "{name}"\n'
        )
    text = f'preset = "{preset}"\n\n[camera]\ncalibration = "camera.json"\n\n'
    text += "\n".join(f"[[robots]]\n{robot}" for robot in members)
    path = folder / "lab.toml"
    path.write_text(
        f"{text}\n[evaluation]\nrepeats = {work.sizes['runs']['repeats']}\n", encoding="utf-8"
    )
    return path


def emulated_runs(work: Work) -> LaboratoryRuns:
    """Conduct the runs in the emulated laboratory, a piece of work for each that can be resumed."""
    path = laboratory_file(work, "default")
    sizes = work.sizes["runs"]
    arguments = {}
    for seed in seeds_of(sizes):
        folder = work.store.path / f"emulated-run-seed{seed}"
        arguments[f"emulated-seed{seed}"] = (path, folder, _settings(sizes, seed), sizes["kept"])
    return LaboratoryRuns.stacked(work.all_arrays(_emulated, arguments))


def simulated_runs(work: Work, preset: str) -> LaboratoryRuns:
    """Conduct the same runs in plain simulation."""
    path = laboratory_file(work, preset)
    sizes = work.sizes["runs"]
    arguments = {}
    for seed in seeds_of(sizes):
        values = (path, _settings(sizes, seed), sizes["kept"], sizes["repeats"])
        arguments[f"simulated-{preset}-seed{seed}"] = values
    return LaboratoryRuns.stacked(work.all_arrays(_simulated, arguments))


def _settings(sizes: Sizes, seed: int) -> dict[str, Any]:
    return {
        **sizes["settings"],
        "run.generations": sizes["generations"],
        "run.seed": seed,
        "run.threads": 1,
    }


def _emulated(
    should_stop: Stop, path: Path, out: Path, overrides: dict[str, Any], generations: list[int]
) -> dict[str, np.ndarray] | None:
    """Begin a run, or resume it. A laboratory that is opened again meets other noise than the first time."""
    laboratory = robots.load_laboratory(path, overrides)
    if runs.is_laboratory_run(out):
        begun = runs.stored_generations(runs.RunFolder(out).checkpoints_path)
        # A laboratory that is opened again must not repeat its noise.
        entropy = (laboratory.configuration.run.seed, 1 + begun)
        seed = int(np.random.SeedSequence(entropy).generate_state(1)[0])
        equipment = robots.rehearse(laboratory, seed)
        result = runs.resume_laboratory(out, equipment=equipment, should_stop=should_stop)
    else:
        equipment = robots.rehearse(laboratory)
        result = runs.start_laboratory(
            laboratory, out, equipment=equipment, force=True, should_stop=should_stop
        )
    evaluation = runs.read_post_evaluation(out)
    if evaluation is None or not evaluation.complete:
        return None
    return _arrays(result, evaluation.fitness, generations)


def _simulated(
    should_stop: Stop, path: Path, overrides: dict[str, Any], generations: list[int], repeats: int
) -> dict[str, np.ndarray] | None:
    configuration = robots.load_laboratory(path, {**overrides, "run.history": "full"}).configuration
    run = runs.simulate_laboratory(configuration, repeats, should_stop=should_stop)
    if run is None:
        return None
    return _arrays(run.result, run.fitness, generations)


def _arrays(
    result: runs.Result, again: np.ndarray, generations: list[int]
) -> dict[str, np.ndarray]:
    """Return what a run has been through, by the names of `LaboratoryRuns`."""
    history = result.history
    judging = history.isel(generation=generations)
    return {
        "models": history["model"].to_numpy(),
        "fitness": history["model_fitness"].to_numpy(),
        "again": again,
        "classifiers": judging["classifier"].to_numpy(),
        "classifier_fitness": judging["classifier_fitness"].to_numpy(),
    }


@dataclass(frozen=True, eq=False)
class Gathering:
    """What R trials of A robots look like at K moments."""

    # (R, K, A, 2), positions (cm) by the camera; those before if it missed a robot
    seen: np.ndarray
    complete: np.ndarray  # (R, K), whether all robots were seen
    poses: np.ndarray  # (R, K, A, 3), where they were
    radius_cm: float  # of a robot

    @cached_property
    def proportion(self) -> np.ndarray:
        """Share of the robots in the largest cluster (R, K)."""
        return largest_cluster(self.seen, self.radius_cm) / self.seen.shape[2]

    @cached_property
    def dispersion(self) -> np.ndarray:
        """Dispersion of the robots (R, K)."""
        return dispersion(self.seen, self.radius_cm)


def gatherings(work: Work, model: np.ndarray) -> tuple[Gathering, Gathering]:
    """Let swarms of agents and of replicas of a model (P,) go, a piece of work for each trial."""
    sizes = work.sizes["validation"]
    controllers = (np.array(robots.LABORATORY.controller), model)
    arguments = {}
    for number, (role, controller) in enumerate(zip(SWARM_KINDS, controllers, strict=True)):
        for trial in range(1, sizes["trials"] + 1):
            arguments[f"validation-{role}-trial{trial:02d}"] = (sizes, controller, trial, number)
    pieces = list(work.all_arrays(_filmed, arguments).values())
    trials = sizes["trials"]
    return _gathering(pieces[:trials]), _gathering(pieces[trials:])


def _gathering(pieces: Sequence[Mapping[str, np.ndarray]]) -> Gathering:
    arrays = {}
    for name in ("seen", "complete", "poses"):
        arrays[name] = np.stack([piece[name] for piece in pieces])
    return Gathering(**arrays, radius_cm=robots.LABORATORY.robot.radius_cm)


def times_of(sizes: Sizes) -> np.ndarray:
    """Return when the camera takes an image (K,), in s."""
    return np.arange(round(sizes["duration_s"] / sizes["every_s"]) + 1) * sizes["every_s"]


def places_apart(
    robots: int, sides_cm: tuple[float, float], radius_cm: float, rng: np.random.Generator
) -> np.ndarray:
    """Return poses (A, 3) drawn uniformly in an arena; a place that is taken is drawn again."""
    high = np.array(sides_cm) - radius_cm
    positions = np.empty((0, 2))
    while len(positions) < robots:
        position = rng.uniform(radius_cm, high)
        if (np.linalg.norm(positions - position, axis=1) > 2 * radius_cm).all():
            positions = np.vstack([positions, position])
    return np.column_stack([positions, rng.uniform(-np.pi, np.pi, robots)])


def _filmed(
    should_stop: Stop, sizes: Sizes, controller: np.ndarray, trial: int, role: int
) -> dict[str, np.ndarray] | None:
    """Run a trial before the emulated camera; find the robots' round markers in its images."""
    from turing_learning.robots.emulation import move_alone

    def drawn(purpose: int) -> int:
        return int(
            np.random.SeedSequence((purpose, sizes["seed"], trial, role)).generate_state(1)[0]
        )

    scenario = robots.LABORATORY
    count = sizes["robots"]
    sides = (float(scenario.arena.width_cm or 0), float(scenario.arena.height_cm or 0))
    rng = np.random.default_rng((VALIDATION_STARTS, sizes["seed"], trial))
    start = places_apart(count, sides, scenario.robot.radius_cm, rng)
    calibration = robots.overhead_camera(*sides)
    markers = robots.RoundMarkers()
    labels = (MARKER,) * count
    camera_seed = drawn(VALIDATION_CAMERA)
    camera = robots.EmulatedCamera(calibration, markers, labels, arena_cm=sides, seed=camera_seed)
    tracker = robots.Tracker(markers, calibration, labels)
    every = round(sizes["every_s"] / scenario.trial.control_interval_s)
    cycles = every * (len(times_of(sizes)) - 1)
    tracked: list[np.ndarray] = []
    poses = []
    complete = []
    motion = move_alone(scenario, controller, start, cycles=cycles, seed=drawn(VALIDATION_NOISE))
    for cycle, now in enumerate(motion):
        if cycle % every:
            continue
        if should_stop():
            return None
        positions = tracker.detect(camera.render(now)).positions
        complete.append(len(positions) == count)
        if not complete[-1]:
            # A robot was missed: all positions of the image before, at first the true ones.
            positions = tracked[-1] if tracked else now[:, :2]
        tracked.append(positions)
        poses.append(now)
    return {"seen": np.array(tracked), "complete": np.array(complete), "poses": np.array(poses)}


def random_models(path: Path, sizes: Sizes) -> dict[str, Any]:
    """Observe each random model once, with all of the chain: links, robots, camera, tracker."""
    laboratory = robots.load_laboratory(path)
    configuration = laboratory.configuration
    rng = np.random.default_rng((ACCURACY_MODELS, sizes["seed"]))
    models = rng.uniform(-1, 1, (sizes["models"], len(configuration.parameter_names)))
    equipment = robots.rehearse(laboratory, sizes["seed"])
    with robots.LaboratorySource(laboratory.setup, configuration.swarm, equipment) as source:
        samples = source.observe(models, "random-models")
    return {"models": models, "agents": samples.genuine, "replicas": samples.counterfeit[:, 0]}
