"""Runs in the emulated laboratory, and the same runs in plain simulation: what the figures of section 5 need of them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.reproduction._work import Work

if TYPE_CHECKING:
    from turing_learning.robots import Laboratory
    from turing_learning.runs import Progress, Result

REPLICAS = {"replica-1": "orange", "replica-2": "purple"}
"""Name and marker; as in the paper, agents wear blue."""
AGENTS = 8
Stop = Callable[[], bool]


@dataclass(frozen=True)
class LaboratoryRunSizes:
    """How many runs, how long, which generations' classifiers are kept, and how often the last models are observed again."""

    runs: int = 10
    generations: int = 100
    first_seed: int = 5001
    repeats: int = 5
    kept: tuple[int, ...] = (0, 1, 2, 3, 4, 5, 10, 20, 50, 99)
    settings: Mapping[str, Any] = field(default_factory=dict)

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seeds of the runs."""
        return tuple(range(self.first_seed, self.first_seed + self.runs))

    def overrides(self, seed: int) -> dict[str, Any]:
        """Return the settings of a run."""
        own = {"run.generations": self.generations, "run.seed": seed, "run.threads": 1}
        return {**self.settings, **own}


@dataclass(frozen=True, eq=False)
class LaboratoryRuns:
    """What R runs of G generations have been through.

    Attributes
    ----------
    models : (R, G, M, P)
        In wheel speeds, fractions of the maximum.
    fitness : (R, G, M)
        Subjective fitness of the models.
    again : (R, repeats, M)
        Fitness of the models of the last generation, observed again and judged by all its classifiers.
    classifiers : (R, K, N, Q)
        Of the K generations that are kept.
    classifier_fitness : (R, K, N)
        Their subjective fitness.
    """

    models: np.ndarray
    fitness: np.ndarray
    again: np.ndarray
    classifiers: np.ndarray
    classifier_fitness: np.ndarray

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
    """Write the laboratory's file and the calibration of its camera, if they are not there; return the file's path."""
    from turing_learning.robots import overhead_camera

    folder = work.folder(f"laboratory-{preset}")
    folder.mkdir(parents=True, exist_ok=True)
    overhead_camera().save(folder / "camera.json", force=True)
    path, sizes = folder / "lab.toml", work.sizes.runs
    lines = [f'preset = "{preset}"', "", "[camera]", 'calibration = "camera.json"', ""]
    lines += [*_robots(), "[evaluation]", f"repeats = {sizes.repeats}", ""]
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def _robots() -> list[str]:
    agents = [
        line
        for k in range(1, AGENTS + 1)
        for line in ("[[robots]]", f'name = "agent-{k}"', 'role = "agent"', 'marker = "blue"', "")
    ]
    replicas = [
        line
        for name, marker in REPLICAS.items()
        for line in (
            "[[robots]]", f'name = "{name}"', 'role = "replica"', f'marker = "{marker}"', f'address = "{name}"', "",
        )
    ]  # fmt: skip
    return [*agents, *replicas]


def emulated_runs(work: Work) -> LaboratoryRuns:
    """Conduct the runs in the emulated laboratory, a piece of work for each that can be gone on with."""
    sizes: LaboratoryRunSizes = work.sizes.runs
    path = laboratory_file(work, "default")
    given = {
        f"emulated-seed{seed}": (path, work.folder(f"emulated-run-seed{seed}"), sizes.overrides(seed), sizes.kept)
        for seed in sizes.seeds
    }
    return _stacked(work.all_arrays(_emulated, given))


def simulated_runs(work: Work, preset: str) -> LaboratoryRuns:
    """Conduct the same runs in plain simulation."""
    sizes: LaboratoryRunSizes = work.sizes.runs
    path = laboratory_file(work, preset)
    given = {
        f"simulated-{preset}-seed{seed}": (path, sizes.overrides(seed), sizes.kept, sizes.repeats)
        for seed in sizes.seeds
    }
    return _stacked(work.all_arrays(_simulated, given))


def _stacked(pieces: Mapping[str, Mapping[str, np.ndarray]]) -> LaboratoryRuns:
    names = LaboratoryRuns.__dataclass_fields__
    return LaboratoryRuns(**{name: np.stack([piece[name] for piece in pieces.values()]) for name in names})


def _emulated(
    should_stop: Stop, path: Path, out: Path, overrides: dict[str, Any], kept: tuple[int, ...]
) -> dict[str, np.ndarray] | None:
    from turing_learning.robots import load_laboratory
    from turing_learning.runs import read_post_evaluation

    result = _conducted(load_laboratory(path, overrides), out, should_stop)
    evaluation = read_post_evaluation(out)
    if evaluation is None or not evaluation.complete:
        return None
    history, chosen = result.history, list(kept)
    return {
        "models": history["model"].to_numpy(),
        "fitness": history["model_fitness"].to_numpy(),
        "again": evaluation.fitness,
        "classifiers": history["classifier"].isel(generation=chosen).to_numpy(),
        "classifier_fitness": history["classifier_fitness"].isel(generation=chosen).to_numpy(),
    }


def _conducted(laboratory: "Laboratory", out: Path, should_stop: Stop) -> "Result":
    """Begin a run, or go on with it. A laboratory that is opened again meets other noise than the first time."""
    from turing_learning.robots import rehearse
    from turing_learning.runs import (
        RunFolder,
        is_laboratory_run,
        resume_laboratory,
        start_laboratory,
        stored_generations,
    )

    if not is_laboratory_run(out):
        return start_laboratory(laboratory, out, equipment=rehearse(laboratory), force=True, should_stop=should_stop)
    entropy = (laboratory.configuration.run.seed, 1 + stored_generations(RunFolder(out).checkpoints_path))
    seed = int(np.random.SeedSequence(entropy).generate_state(1)[0])
    return resume_laboratory(out, equipment=rehearse(laboratory, seed), should_stop=should_stop)


def _simulated(
    should_stop: Stop, path: Path, overrides: dict[str, Any], kept: tuple[int, ...], repeats: int
) -> dict[str, np.ndarray] | None:
    from turing_learning.robots import load_laboratory
    from turing_learning.runs import simulate_laboratory

    found: dict[str, list[np.ndarray]] = {
        name: [] for name in ("models", "fitness", "classifiers", "classifier_fitness")
    }

    def keep(progress: "Progress") -> None:
        generation = progress.generation
        found["models"].append(generation.models)
        found["fitness"].append(generation.model_fitness)
        if generation.number in kept:
            found["classifiers"].append(generation.classifiers.astype(np.float32))
            found["classifier_fitness"].append(generation.classifier_fitness)

    laboratory = load_laboratory(path, {**overrides, "run.history": "full"})
    run = simulate_laboratory(laboratory.configuration, repeats, observer=keep, should_stop=should_stop)
    if run is None:
        return None
    return {name: np.stack(arrays) for name, arrays in found.items()} | {"again": run.fitness}
