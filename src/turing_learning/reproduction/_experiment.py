"""What an experiment is: pieces of work, each done once and stored, what it leaves, and what several share."""

import os
import time
from bisect import insort
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from functools import partial
from importlib.util import find_spec
from operator import itemgetter
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from turing_learning import studies, swarm
from turing_learning.analysis import Comparison, compare
from turing_learning.store import FolderKind, Store
from turing_learning.swarm import Scenario
from turing_learning.workers import Workers, asked_to_stop

from ._verdicts import ClaimVerdict, Spreads, prose

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Say = Callable[[str], None]
Stop = Callable[[], bool]
Finding = Mapping[str, Any]
"""What a piece of work has found, by name."""
Sizes = dict[str, Any]
"""How many runs, trials, robots: plain values, by the names that experiments.toml gives them."""
Compute = Callable[..., Finding | None]
"""A function of a module: `should_stop`, then what it is given -> arrays by name, None if it was stopped."""
PIECES = FolderKind("experiment", "store.json", identity=("experiment", "form", "sizes"))
PRESETS = ("default", "paper")
"""Presets of an experiment that names none; the first one decides, the other stands beside it."""
MODEL_KINDS = {"best_model": "absolute_error", "estimate": "estimate_absolute_error"}
"""What a run infers, and its errors in the result of the run; the first is the paper's rule, and decides."""
_ARRAY_PREFIX = "found/"
_POLL_S = 0.5


class Stopped(Exception):
    """An experiment was stopped between two pieces of work, and can be resumed."""


class Work:
    """Does pieces of work, or takes them from the files that an earlier call has left.

    Its folder may be given as the store whose lock is held. In the fast form, studies run in this
    process, which costs less than to start others; else in so many `workers`, one for each
    processor if None.
    """

    def __init__(
        self, folder: Path | Store, sizes: Sizes | None = None, *, fast: bool = False, workers: int | None = None,
        should_stop: Stop | None = None, say: Say | None = None,
    ) -> None:  # fmt: skip
        self.store = folder if isinstance(folder, Store) else Store(folder, PIECES)
        self.sizes = sizes or {}
        self.should_stop = should_stop or (lambda: False)
        self._fast = fast
        self._workers = workers
        self._say = say or (lambda text: None)
        self._seconds: dict[str, float] = {}

    @property
    def presets(self) -> tuple[str, ...]:
        """Presets of the runs; the first one decides, any other stands beside it."""
        return tuple(self.sizes.get("presets", PRESETS))

    def in_world(self, scenario: Scenario) -> Scenario:
        """Return a scenario in the world of the experiment: its own, unless the sizes name another."""
        world = self.sizes.get("world")
        if world is None:
            return scenario
        return scenario.in_world(world)

    @property
    def settings(self) -> dict[str, Any]:
        """Settings of a run that puts its scenario into the world of the experiment."""
        world = self.sizes.get("world")
        if world is None:
            return {}
        return {"scenario.world": world}

    def variant_of(self, preset: str) -> str:
        """Return what a verdict with a preset is about; nothing for the one that counts."""
        if preset == self.presets[0]:
            return ""
        return f"preset {preset}"

    @property
    def seconds(self) -> float:
        """Computing time (s) of the pieces, and runs of studies, that were asked for; each counts once."""
        return sum(self._seconds.values())

    def piece(
        self, name: str, compute: Callable[[], Finding | None], suffix: str = "json"
    ) -> dict[str, Any]:
        """Return what a piece of work of that name has found, from its file if it is there.

        `compute` returns what JSON can hold, or with the suffix npz arrays by name; None if it was
        stopped.
        """
        file = f"{name}.{suffix}"
        stored = self._find(file)
        # A piece that was stopped has left nothing: it is done again from its beginning.
        if stored is None and not self.should_stop():
            stored = _timed(compute)
            if stored is not None:
                self._write(file, stored)
        if stored is None:
            raise Stopped(name)
        self._seconds[name] = stored["seconds"]
        return stored["found"]

    def all_arrays(
        self, compute: Compute, arguments: Mapping[str, tuple[Any, ...]]
    ) -> dict[str, dict[str, np.ndarray]]:
        """Return what pieces have found, by the arguments of each; done side by side in worker processes."""
        missing = {
            name: values for name, values in arguments.items() if self._find(f"{name}.npz") is None
        }
        count = min(self._workers or os.cpu_count() or 1, len(missing))
        if count > 1 and not self._fast and not self.should_stop():
            self._compute_in_workers(compute, missing, count)
        pieces = {}
        for name, values in arguments.items():
            pieces[name] = self.piece(name, partial(compute, self.should_stop, *values), "npz")
        return pieces

    def _compute_in_workers(
        self, compute: Compute, arguments: Mapping[str, tuple[Any, ...]], count: int
    ) -> None:
        """Do pieces of work in so many processes; those that a stop has reached are left undone."""
        workers = Workers(partial(_in_worker, compute), count)
        try:
            names = {workers.submit(*values): name for name, values in arguments.items()}
            pending = set(names)
            while pending:
                done, pending = wait(pending, _POLL_S, FIRST_COMPLETED)
                for future in done:
                    # Written at once: a call that is killed loses only the pieces under way.
                    stored = future.result()
                    if stored is not None:
                        self._write(f"{names[future]}.npz", stored)
                if self.should_stop():
                    workers.stop()
        except BaseException:
            workers.kill()
            raise
        finally:
            workers.close()

    def _find(self, file: str) -> dict[str, Any] | None:
        """Return seconds and what was found of a piece of work that is done."""
        content = self.store.find(file)
        if content is None:
            return None
        arrays = {}
        for name in content:
            if name.startswith(_ARRAY_PREFIX):
                arrays[name.removeprefix(_ARRAY_PREFIX)] = content[name]
        return {"seconds": float(content["seconds"]), "found": content.get("found", arrays)}

    def _write(self, file: str, stored: dict[str, Any]) -> None:
        if file.endswith(".npz"):
            arrays = {f"{_ARRAY_PREFIX}{name}": array for name, array in stored["found"].items()}
            self.store.write(file, {"seconds": np.array(stored["seconds"])} | arrays)
        else:
            self.store.write(file, stored)
        self._say(f"{Path(file).stem}: {stored['seconds']:.1f} s")

    def study(self, name: str, scenario: str, **arguments: Any) -> "studies.StudyResult":
        """Return a study of many runs, executed or resumed if not complete; see `turing_learning.study`."""

        def observe(progress: "studies.StudyProgress") -> None:
            if progress.finished:
                self._say(f"{name}: {progress.done} of {progress.total} runs")

        path = self.store.path / name
        result = None
        # The report is written last.
        if studies.is_study(path) and (path / "report.html").exists():
            result = studies.load_study(path)
        if result is None or not result.complete:
            arguments |= {"observer": observe, "should_stop": self.should_stop, "out": path}
            with ThreadPoolExecutor(1) as executor:
                if self._fast:
                    hands: dict[str, Any] = {"executor": executor}
                else:
                    hands = {"workers": self._workers}
                result = studies.study(scenario, **arguments, **hands)
        if result.unfinished:
            raise Stopped(name)
        if result.failed:
            got = f"{len(result.failed)}, the first for: {result.failed[0].reason} [{path}]"
            raise studies.ExecutorError(
                f"`{name}` must have no runs that fail; got {got}. Give the same command again to try again."
            )
        self._seconds[name] = sum(run.seconds or 0.0 for run in result.runs)
        return result

    def runs(
        self, name: str, scenario: str, preset: str, names: tuple[str, ...], *, runs: int | None = None,
        generations: int | None = None, settings: Mapping[str, Any] = MappingProxyType({}),
    ) -> "Runs":  # fmt: skip
        """Return what runs infer of parameters with these names; what is not given is as the sizes say."""
        sizes = self.sizes
        result = self.study(
            name,
            scenario,
            runs=runs or sizes["runs"],
            generations=generations or sizes["generations"],
            first_seed=sizes["first_seed"],
            settings={**sizes["settings"], **self.settings, **settings},
            preset=preset,
        )
        results = [run.result for run in result.runs if run.result is not None]
        models = {}
        errors = {}
        for readout, error in MODEL_KINDS.items():
            models[readout] = np.array([list(inferred[readout].values()) for inferred in results])
            errors[readout] = np.array([list(inferred[error].values()) for inferred in results])
        seeds = tuple(run.seed for run in result.runs)
        beside = self.variant_of(preset)
        return Runs(preset, names, seeds, models, errors, result, beside)


def _timed(compute: Callable[[], Finding | None]) -> dict[str, Any] | None:
    begin = time.perf_counter()
    finding = compute()
    if finding is None:
        return None
    return {"seconds": round(time.perf_counter() - begin, 3), "found": dict(finding)}


def _in_worker(compute: Compute, *arguments: Any) -> dict[str, Any] | None:
    if asked_to_stop():
        return None
    return _timed(partial(compute, asked_to_stop, *arguments))


@dataclass(frozen=True)
class Shown:
    """A table or figure that an experiment has left."""

    name: str  # of its files, without suffix
    caption: str  # what it shows
    claim: str = ""  # that a figure belongs to
    inline: bool = False  # whether the page of the experiment shows the table


@dataclass
class Findings:
    """What an experiment finds. experiments.toml has captions by patterns of names, in the order of the tables."""

    experiment: str  # its id
    verdicts: list[ClaimVerdict] = field(default_factory=list)
    tables: list[tuple[int, Shown, pd.DataFrame]] = field(default_factory=list)
    pictures: list[tuple[Shown, "Figure"]] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)  # sentences in Markdown

    def table(
        self, pattern: str, frame: pd.DataFrame, inline: bool = False, /, **words: Any
    ) -> None:
        """Add a table, without its index; name and caption are filled in with the words."""
        captions = prose()["tables"][self.experiment]
        table = Shown(pattern.format(**words), captions[pattern].format(**words), inline=inline)
        insort(self.tables, (list(captions).index(pattern), table, frame), key=itemgetter(0))

    def picture(self, pattern: str, claim: str, figure: "Figure", /, **words: Any) -> None:
        """Add a picture that belongs to a claim, to none if it is empty."""
        caption = prose()["pictures"][self.experiment][pattern].format(**words)
        self.pictures.append((Shown(pattern.format(**words), caption, claim), figure))


@dataclass(frozen=True)
class Experiment:
    """One section of the paper, repeated."""

    id: str  # the section
    title: str
    cost: str  # how long it takes at full size
    claims: Sequence[str]  # ids of the claims that it is held against
    # What is done differently, or is not known from the paper, and why
    deviations: Sequence[str]
    full: Sizes
    fast: Sizes
    # Does the work: pieces that are there already are not done again
    conduct: Callable[[Work, Findings], None]
    # What is compared, where the paper has nothing to be held against
    conditions: Sequence[str] = ()
    # Whether it has the paper's algorithm as it is, in the paper's world
    as_printed: bool = False
    packages: Sequence[str] = ()  # beyond those of the installation
    extra: str = ""  # that brings them

    @property
    def missing(self) -> tuple[str, ...]:
        """Packages that are not installed."""
        return tuple(package for package in self.packages if find_spec(package) is None)


@dataclass(frozen=True, eq=False)
class Runs:
    """What R runs of a study with one preset have inferred."""

    preset: str
    names: tuple[str, ...]
    seeds: tuple[int, ...]
    models: dict[str, np.ndarray]  # kind -> (R, P), by the kinds of `MODEL_KINDS`
    errors: dict[str, np.ndarray]  # kind -> (R, P), their absolute errors
    result: Any = None  # of the study
    # What verdicts on these runs are about; nothing for those that count
    beside: str = ""

    def __len__(self) -> int:
        return len(self.seeds)

    def variant(self, readout: str = "best_model") -> str:
        """Return what a verdict on models of a kind is about; nothing for the one that counts."""
        subset = "" if readout == "best_model" else readout
        return ", ".join(filter(None, (self.beside, subset)))

    def maes(self, readout: str) -> np.ndarray:
        """Return the mean absolute error of each run (R,)."""
        return self.errors[readout].mean(axis=1)

    def models_frame(self) -> pd.DataFrame:
        """Return what every run has inferred: model, seed, parameters."""
        frames = {}
        for readout in MODEL_KINDS:
            frames[readout] = seeded(self.seeds, self.models[readout], self.names)
        return stacked(frames, "model")

    def errors_frame(self, claim: str = "") -> pd.DataFrame:
        """Return statistics of the errors of each model; a claim prints those of the best model."""
        frames = {
            "best_model": errors_frame(self.errors["best_model"], self.names, claim),
            "estimate": errors_frame(self.errors["estimate"], self.names),
        }
        return stacked(frames, "model")


def seeds_of(sizes: Sizes) -> range:
    return range(sizes["first_seed"], sizes["first_seed"] + sizes["runs"])


def stacked(frames: Mapping[Any, pd.DataFrame], *columns: str) -> pd.DataFrame:
    """Return frames one below the other, after columns with what their keys say."""
    return (
        pd.concat(dict(frames), names=columns)
        .reset_index(level=list(columns))
        .reset_index(drop=True)
    )


def seeded(seeds: Sequence[int], models: np.ndarray, names: Sequence[str]) -> pd.DataFrame:
    """Return models (R, P) with the seeds of their runs."""
    return pd.DataFrame({"seed": seeds}).join(pd.DataFrame(models, columns=list(names)))


def errors_frame(errors: np.ndarray, names: Sequence[str], claim: str = "") -> pd.DataFrame:
    """Return statistics of absolute errors (R, P), parameter by parameter, and what a claim prints of them."""
    frame = pd.DataFrame({"parameter": names, "runs": len(errors)})
    frame = frame.join(Spreads.of(errors).frame()).assign(median=np.median(errors, axis=0))
    if claim:
        frame = frame.join(Spreads.printed(claim).frame("paper_mean", "paper_standard_deviation"))
    return frame


def compare_columns(genuine: np.ndarray, compared: np.ndarray) -> Comparison:
    """Test each of P columns of values (R, P) against the same column of others (R, P)."""
    # Each column is a question of its own, and so a comparison of its own.
    tests = [compare(genuine[:, k], [compared[:, k]]) for k in range(genuine.shape[1])]
    return Comparison(np.concatenate([test.p_values for test in tests]), tests[0].level)


def sensor_shares(scenario: Scenario, trials: int, seed: int) -> np.ndarray:
    """Return the share of the agents in each sensor state (R, T, n), in each trial and step (section 4.3)."""
    robots = scenario.individuals
    steps = scenario.control_steps
    motion = moved(scenario, scenario.controller, trials, robots, steps, starts=seed, noise=seed)
    sensors = motion.sensors
    return (sensors[:, :-1, :, None] == np.arange(scenario.sensor.states)).mean(axis=2)


def moved(
    scenario: Scenario, controller: np.typing.ArrayLike, trials: int, robots: int, steps: int, *, starts: Any, noise: int
) -> "swarm.Simulation":  # fmt: skip
    """Simulate trials in which all robots execute one controller; `starts` seeds initial configurations."""
    start = swarm.initial_poses(scenario, trials, np.random.default_rng(starts), robots=robots)
    controllers = np.broadcast_to(controller, (trials, robots, len(scenario.controller)))
    return swarm.simulate(scenario, controllers, start, control_steps=steps, seed=noise)


def index_of_median(errors: np.ndarray) -> int:
    """Return the index of the median among errors (R,), of two middle ones that of the smaller."""
    # A stable order, so that equal errors do not depend on the machine.
    return int(np.argsort(errors, kind="stable")[(len(errors) - 1) // 2])
