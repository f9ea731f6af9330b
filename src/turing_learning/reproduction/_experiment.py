"""What an experiment is: pieces of work, each stored in a small file and done once, what it leaves, and what several share."""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from turing_learning.analysis import Comparison, compare
from turing_learning.figures import Picture
from turing_learning.store import Kind, Store
from turing_learning.swarm import Scenario
from turing_learning.workers import Workers, asked_to_stop

from ._verdicts import ClaimVerdict, Spread, printed_spreads, prose, spreads_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from turing_learning.studies import StudyProgress, StudyResult
    from turing_learning.swarm import Simulation

Say = Callable[[str], None]
Found = Mapping[str, Any]
Compute = Callable[..., Found | None]
"""A function of a module: `should_stop`, then what it is given -> arrays by name, None if it was stopped."""
PIECES = Kind("experiment", "store.json", identity=("experiment", "form", "sizes"), pieces=("*.json", "*.npz"))
_FOUND = "found/"
_POLL_S = 0.5


@dataclass(frozen=True)
class RunSizes:
    """How many runs of how many generations."""

    runs: int = 30
    generations: int = 1000
    first_seed: int = 2001

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seeds of the runs."""
        return tuple(range(self.first_seed, self.first_seed + self.runs))


class Stopped(Exception):
    """An experiment was stopped between two pieces of work, and can be resumed."""


class Work:
    """Does pieces of work, or takes them from the files that an earlier call has left.

    Its folder may be given as the store whose lock is held. In the fast form, studies run in this process,
    which costs less than to start others; else in so many `workers`, one for each processor if None. `seconds`
    is the computing time of all pieces, and runs of studies, that have been asked for so far.
    """

    def __init__(
        self, folder: Path | Store, sizes: Any, *, fast: bool = False, workers: int | None = None,
        should_stop: Callable[[], bool] | None = None, say: Say | None = None,
    ) -> None:  # fmt: skip
        self.store = folder if isinstance(folder, Store) else Store(folder, PIECES)
        self.sizes, self.should_stop = sizes, should_stop or (lambda: False)
        self._fast, self._workers, self._say = fast, workers, say or (lambda text: None)
        self._seconds: dict[str, float] = {}

    @property
    def seconds(self) -> float:
        """Computing time (s); a piece that is asked for again counts once."""
        return sum(self._seconds.values())

    def piece(self, name: str, compute: Callable[[], Found | None]) -> dict[str, Any]:
        """Return what a piece of work of that name has found, from its file if it is there.

        `compute` returns an object that JSON can hold, or None if it was stopped.
        """
        return self._once(name, f"{name}.json", compute)

    def arrays(self, name: str, compute: Callable[[], Found | None]) -> dict[str, np.ndarray]:
        """Return what a piece of work has found, as `piece`, where that is arrays by name."""
        return self._once(name, f"{name}.npz", compute)

    def folder(self, name: str) -> Path:
        """Return where a piece of work may store what it can be resumed from; nothing is made yet."""
        return self.store.path / name

    def all_arrays(self, compute: Compute, given: Mapping[str, tuple[Any, ...]]) -> dict[str, dict[str, np.ndarray]]:
        """Return what many pieces of work have found, as `arrays`; what is missing is done side by side in worker processes.

        `given` holds the arguments of each piece.
        """
        missing = {name: each for name, each in given.items() if self._find(f"{name}.npz") is None}
        count = min(self._workers or os.cpu_count() or 1, len(missing))
        if count > 1 and not self._fast and not self.should_stop():
            workers = Workers(partial(_in_worker, compute), count)
            try:
                names = {workers.submit(*arguments): name for name, arguments in missing.items()}
                left = set(names)
                while left:
                    done, left = wait(left, _POLL_S, FIRST_COMPLETED)
                    for future in done:
                        if (stored := future.result()) is not None:
                            self._write(names[future], f"{names[future]}.npz", stored)
                    if self.should_stop():
                        workers.stop()
            except BaseException:
                workers.kill()
                raise
            finally:
                workers.close()
        return {name: self.arrays(name, partial(compute, self.should_stop, *each)) for name, each in given.items()}

    def _once(self, name: str, file: str, compute: Callable[[], Found | None]) -> dict[str, Any]:
        stored = self._find(file)
        if stored is None:
            stored = None if self.should_stop() else _timed(compute)
            if stored is None:
                raise Stopped(name)
            self._write(name, file, stored)
        self._seconds[name] = stored["seconds"]
        return stored["found"]

    def _find(self, file: str) -> dict[str, Any] | None:
        """Return seconds and what was found of a piece of work that is done."""
        if file.endswith(".json"):
            return self.store.find(
                file, fits=lambda held: isinstance(held, dict) and {"seconds", "found"} <= held.keys()
            )
        held = self.store.find(file, fits=lambda held: "seconds" in held)
        return held and {
            "seconds": float(held["seconds"]),
            "found": {name.removeprefix(_FOUND): held[name] for name in held if name.startswith(_FOUND)},
        }

    def _write(self, name: str, file: str, stored: dict[str, Any]) -> None:
        content = stored
        if file.endswith(".npz"):
            arrays = {f"{_FOUND}{key}": array for key, array in stored["found"].items()}
            content = {"seconds": np.array(stored["seconds"])} | arrays
        self.store.write(file, content)
        self._say(f"{name}: {stored['seconds']:.1f} s")

    def study(self, name: str, scenario: str, **arguments: Any) -> "StudyResult":
        """Return a study of many runs, executed or resumed as far as it is not complete; see `turing_learning.study`."""
        from turing_learning.studies import ExecutorError, is_study, load_study, study

        def observe(progress: "StudyProgress") -> None:
            if progress.finished:
                self._say(f"{name}: {progress.done} of {progress.total} runs")

        path = self.folder(name)
        written = is_study(path) and (path / "report.html").exists()  # the report comes last
        result = load_study(path) if written else None
        if result is None or not result.complete:
            arguments |= {"observer": observe, "should_stop": self.should_stop, "out": path}
            with ThreadPoolExecutor(1) as executor:
                hands: dict[str, Any] = {"executor": executor} if self._fast else {"workers": self._workers}
                result = study(scenario, **arguments, **hands)
        if result.unfinished:
            raise Stopped(name)
        if result.failed:
            got = f"{len(result.failed)}, the first for: {result.failed[0].reason} [{path}]"
            raise ExecutorError(
                f"`{name}` must have no runs that fail; got {got}. Give the same command again to try again."
            )
        self._seconds[name] = sum(run.seconds or 0.0 for run in result.runs)
        return result

    def runs(
        self, name: str, scenario: str, preset: str, *, runs: int | None = None,
        settings: Mapping[str, Any] = MappingProxyType({}),
    ) -> "StudyResult":  # fmt: skip
        """Return the study of as many runs (or `runs`) and generations as the sizes say, with further settings; see `study`."""
        sizes = self.sizes
        how = {"generations": sizes.generations, "preset": preset, "settings": {**sizes.settings, **settings}}
        return self.study(name, scenario, runs=runs or sizes.runs, first_seed=sizes.first_seed, **how)


def _timed(compute: Callable[[], Found | None]) -> dict[str, Any] | None:
    begun = time.perf_counter()
    found = compute()
    return None if found is None else {"seconds": round(time.perf_counter() - begun, 3), "found": dict(found)}


def _in_worker(compute: Compute, *arguments: Any) -> dict[str, Any] | None:
    return None if asked_to_stop() else _timed(partial(compute, asked_to_stop, *arguments))


@dataclass(frozen=True)
class Table:
    """A small table."""

    name: str  # of its file, without suffix
    caption: str  # what it holds
    frame: pd.DataFrame  # the index is left out
    inline: bool = False  # whether the page of the experiment shows it

    def csv(self) -> bytes:
        """Return the table as a CSV file; six digits are more than any of the quantities has."""
        return self.frame.to_csv(index=False, float_format="%.6g", lineterminator="\n").encode()


def stacked(frames: Mapping[Any, pd.DataFrame], *columns: str) -> pd.DataFrame:
    """Return frames one below the other, after columns with what their keys say."""
    frame = pd.concat(dict(frames), names=columns)
    return frame.reset_index(level=list(range(len(columns)))).reset_index(drop=True)


@dataclass(frozen=True)
class Captions:
    """Makes the tables and pictures of an experiment: experiments.toml has their captions under patterns of their names."""

    experiment: str  # its id

    def table(self, pattern: str, frame: pd.DataFrame, inline: bool = False, /, **words: Any) -> Table:
        """Return a table; name and caption are filled in with the words."""
        return Table(pattern.format(**words), self._caption("tables", pattern, words), frame, inline)

    def picture(self, pattern: str, claim: str, figure: "Figure", /, **words: Any) -> Picture:
        """Return a picture that belongs to a claim."""
        return Picture(pattern.format(**words), claim, self._caption("pictures", pattern, words), figure)

    def _caption(self, kind: str, pattern: str, words: Mapping[str, Any]) -> str:
        return str(prose()[kind][self.experiment][pattern]).format(**words)


@dataclass(frozen=True)
class Findings:
    """What an experiment has found; the title of a picture is the id of its claim, remarks are sentences in Markdown."""

    verdicts: Sequence[ClaimVerdict]
    tables: Sequence[Table]
    pictures: Sequence[Picture]
    remarks: Sequence[str] = ()


@dataclass(frozen=True)
class Experiment:
    """One section of the paper, repeated."""

    id: str  # the section
    title: str
    cost: str  # how long it takes at full size
    claims: tuple[str, ...]  # ids of the claims that it is held against
    deviations: tuple[str, ...]  # what is done differently, or is not known from the paper, and why
    full: Any  # sizes: frozen dataclasses of plain values
    fast: Any
    conduct: Callable[[Work], Findings]  # does the work: pieces that are there already are not done again
    conditions: tuple[str, ...] = ()  # what is compared, where the paper has nothing to be held against
    packages: tuple[str, ...] = ()  # beyond those of the installation
    extra: str = ""  # that brings them

    @classmethod
    def of(cls, id: str, conduct: Callable[[Work], Findings], *, full: Any, fast: Any) -> "Experiment":
        """Return an experiment about which experiments.toml says the rest."""
        entries: dict[str, Any] = prose()["experiments"][id]
        about: dict[str, Any] = {key: tuple(x) if isinstance(x, list) else x for key, x in entries.items()}
        return cls(id=id, conduct=conduct, full=full, fast=fast, **about)

    @property
    def missing(self) -> tuple[str, ...]:
        """Packages that are not installed."""
        return tuple(package for package in self.packages if find_spec(package) is None)


PRESETS = ("default", "paper")  # the first one decides; the other stands beside it
KINDS = {"best_model": "absolute_error", "estimate": "estimate_absolute_error"}
"""What a run infers, and its errors in the result of the run; the first is the paper's rule, and decides."""


def variant_of(preset: str, kind: str = "best_model") -> str:
    """Return what a verdict is about; nothing for the one that counts."""
    parts = [] if preset == PRESETS[0] else [f"preset {preset}"]
    return ", ".join([*parts, *([] if kind == "best_model" else [kind])])


def small(population: int, every: int) -> dict[str, Any]:
    """Return settings of a fast form: few models and classifiers, checkpoints every so many generations."""
    return {"models.population": population, "classifiers.population": population, "run.checkpoint_every": every}


@dataclass(frozen=True, eq=False)
class Runs:
    """What R runs of a study with one preset have inferred."""

    preset: str
    names: tuple[str, ...]
    seeds: tuple[int, ...]
    models: dict[str, np.ndarray]  # kind -> (R, P), by the kinds of `KINDS`
    errors: dict[str, np.ndarray]  # kind -> (R, P), their absolute errors

    @classmethod
    def of(cls, result: "StudyResult", preset: str, names: tuple[str, ...]) -> "Runs":
        """Return what the runs of a study have inferred."""
        models = {kind: values_of(result, kind) for kind in KINDS}
        errors = {kind: values_of(result, key) for kind, key in KINDS.items()}
        return cls(preset, names, tuple(run.seed for run in result.runs), models, errors)

    def __len__(self) -> int:
        return len(self.seeds)

    def maes(self, kind: str) -> np.ndarray:
        """Return the mean absolute error of each run (R,)."""
        return self.errors[kind].mean(axis=1)

    def models_frame(self) -> pd.DataFrame:
        """Return what every run has inferred: model, seed, parameters."""
        return stacked({kind: seeded(self.seeds, self.models[kind], self.names) for kind in KINDS}, "model")

    def errors_frame(self, claim: str = "") -> pd.DataFrame:
        """Return statistics of the errors: model, parameter, runs, mean, standard deviation, median; beside what a claim prints."""
        frame = stacked({kind: errors_frame(self.errors[kind], self.names) for kind in KINDS}, "model")
        return beside_the_paper(frame, claim) if claim else frame


def values_of(result: "StudyResult", name: str) -> np.ndarray:
    """Return what each run of a study has under a name, parameter by parameter (R, P)."""
    return np.array([list(run.result[name].values()) for run in result.runs if run.result is not None])


def seeded(seeds: Sequence[int], models: np.ndarray, names: Sequence[str]) -> pd.DataFrame:
    """Return models (R, P) with the seeds of their runs."""
    return pd.DataFrame({"seed": seeds}).join(pd.DataFrame(models, columns=list(names)))


def errors_frame(errors: np.ndarray, names: Sequence[str]) -> pd.DataFrame:
    """Return statistics of absolute errors (R, P): parameter, runs, mean, standard deviation, median."""
    frame = pd.DataFrame({"parameter": names, "runs": len(errors)})
    return frame.join(spreads_frame(spreads_of(errors))).assign(median=np.median(errors, axis=0))


def beside_the_paper(frame: pd.DataFrame, claim: str) -> pd.DataFrame:
    """Return statistics of errors with what a claim prints of the best model of a run; it comes first."""
    return frame.join(spreads_frame(printed_spreads(claim), "paper_mean", "paper_standard_deviation"))


def spreads_frame(spreads: Sequence[Spread], mean: str = "mean", deviation: str = "standard_deviation") -> pd.DataFrame:
    """Return means and standard deviations as columns of these names."""
    return pd.DataFrame([(one.mean, one.standard_deviation) for one in spreads], columns=[mean, deviation])


def compare_columns(genuine: np.ndarray, others: np.ndarray) -> Comparison:
    """Test each of P columns of values (R, P) against the same column of others (R, P)."""
    tests = [compare(genuine[:, k], [others[:, k]]) for k in range(genuine.shape[1])]
    return Comparison(np.concatenate([test.p_values for test in tests]), tests[0].level)


@dataclass(frozen=True)
class ShareSizes:
    """How many trials, of the scenario's own duration."""

    trials: int = 100
    seed: int = 1


def sensor_shares(scenario: Scenario, sizes: ShareSizes) -> np.ndarray:
    """Return the share of the agents in each sensor state (R, T, n), trial by trial and step by step (paper, section 4.3)."""
    robots, steps, seed = scenario.individuals, scenario.control_steps, sizes.seed
    sensors = moved(scenario, scenario.controller, sizes.trials, robots, steps, starts=seed, noise=seed).sensors
    return (sensors[:, :-1, :, None] == np.arange(scenario.sensor.states)).mean(axis=2)


def moved(
    scenario: Scenario,
    controller: np.typing.ArrayLike,
    trials: int,
    robots: int,
    steps: int,
    *,
    starts: Any,
    noise: int,
) -> "Simulation":
    """Simulate trials in which all robots execute one controller; `starts` seeds initial configurations."""
    from turing_learning.swarm import initial_poses, simulate

    start = initial_poses(scenario, trials, np.random.default_rng(starts), robots=robots)
    controllers = np.broadcast_to(controller, (trials, robots, len(scenario.controller)))
    return simulate(scenario, controllers, start, control_steps=steps, seed=noise)


def gathered(scenario: Scenario, poses: np.ndarray, robots: int) -> tuple[np.ndarray, float]:
    """Return positions (..., S, 2) and radius (cm) of those that are to gather: the objects, or robots if there are none."""
    if scenario.objects.count:
        return poses[..., robots:, :2], scenario.objects.radius_cm
    return poses[..., :robots, :2], scenario.robot.radius_cm
