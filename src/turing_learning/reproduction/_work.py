"""The pieces of work of an experiment: each is stored in a small file, and done once."""

import os
import time
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.store import Kind, Store
from turing_learning.workers import Workers, asked_to_stop

if TYPE_CHECKING:
    from turing_learning.studies import StudyProgress, StudyResult

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

    Its folder may be given as the store whose lock is held. In the fast form, studies run in this process, which costs less than
    to start others; else in so many `workers`, one for each processor if None. `seconds` is the computing time of all pieces, and
    runs of studies, that have been asked for so far.
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
