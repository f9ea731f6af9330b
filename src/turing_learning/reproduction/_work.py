"""The pieces of work of an experiment: each is stored in a small file of its own, and done once."""

import os
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from functools import cache, partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.runs import RunFolder, new_manifest
from turing_learning.store import Kind, Store
from turing_learning.workers import Workers, asked_to_stop

if TYPE_CHECKING:
    from turing_learning.studies import StudyProgress, StudyResult

Say = Callable[[str], None]
Compute = Callable[..., Mapping[str, np.ndarray] | None]
"""A function of a module: `should_stop`, then what it is given -> arrays by name, None if it was stopped."""
PIECES = Kind("experiment", "store.json", identity=("experiment", "form", "sizes"), pieces=("*.json", "*.npz"))
_FOUND = "found/"
_POLL_S = 0.5


class Stopped(Exception):
    """An experiment was stopped between two pieces of work, and can be resumed."""


class Work:
    """Do pieces of work, or take them from the files that an earlier call has left.

    Attributes
    ----------
    sizes
        Sizes of the experiment's form.
    seconds
        Computing time of all pieces, and runs of studies, that have been asked for so far (s).
    commits
        How many of them are of which commit of the package; "" counts those that do not say it.

    Parameters
    ----------
    folder
        Where the pieces are; or their store, if its lock is held.
    fast
        Whether this is the fast form: its studies run in this process, which costs less than to start others.
    workers
        Number of worker processes of studies; None takes one for each processor.
    should_stop
        Asked before every piece, and by whatever takes long: `Stopped` is raised then.
    say
        Gets a line when a piece has been done.
    """

    def __init__(
        self,
        folder: Path | Store,
        sizes: Any,
        *,
        fast: bool = False,
        workers: int | None = None,
        should_stop: Callable[[], bool] | None = None,
        say: Say | None = None,
    ) -> None:
        self.sizes = sizes
        self.seconds = 0.0
        self.commits: Counter[str] = Counter()
        self._names: set[str] = set()
        self.store = folder if isinstance(folder, Store) else Store(folder, PIECES)
        self._folder = self.store.path
        self._fast = fast
        self._workers = workers
        self._should_stop = should_stop or (lambda: False)
        self._say = say or (lambda text: None)

    def should_stop(self) -> bool:
        """Return whether somebody has asked for a stop."""
        return self._should_stop()

    def piece(self, name: str, compute: Callable[[], Mapping[str, Any] | None]) -> dict[str, Any]:
        """Return what a piece of work of that name has found, from its file if it is there.

        `compute` returns an object that JSON can hold, or None if it was stopped.
        """
        return self._once(name, f"{name}.json", compute)

    def arrays(self, name: str, compute: Callable[[], Mapping[str, np.ndarray] | None]) -> dict[str, np.ndarray]:
        """Return what a piece of work has found, as `piece`, where that is arrays by name."""
        return self._once(name, f"{name}.npz", compute)

    def folder(self, name: str) -> Path:
        """Return where a piece of work may keep what it can be resumed from; nothing is made yet."""
        return self._folder / name

    def all_arrays(self, compute: Compute, given: Mapping[str, tuple[Any, ...]]) -> dict[str, dict[str, np.ndarray]]:
        """Return what many pieces of work have found, as `arrays`; what is missing is done side by side in worker processes.

        `given` holds the arguments of each piece.
        """
        missing = {name: each for name, each in given.items() if self._find(f"{name}.npz") is None}
        workers = min(self._workers or os.cpu_count() or 1, len(missing))
        if workers > 1 and not self._fast and not self.should_stop():
            self._side_by_side(partial(_in_worker, compute), missing, workers)
        return {name: self.arrays(name, partial(compute, self._should_stop, *each)) for name, each in given.items()}

    def _side_by_side(self, compute: Compute, missing: Mapping[str, tuple[Any, ...]], count: int) -> None:
        workers = Workers(compute, count)
        try:
            names = {workers.submit(*arguments): name for name, arguments in missing.items()}
            left = set(names)
            while left:
                done, left = wait(left, _POLL_S, FIRST_COMPLETED)
                for future in done:
                    if (stored := future.result()) is not None:
                        self._keep(names[future], f"{names[future]}.npz", stored)
                if self.should_stop():
                    workers.stop()
        except BaseException:
            workers.kill()
            raise
        finally:
            workers.close()

    def _once(self, name: str, file: str, compute: Callable[[], Mapping[str, Any] | None]) -> dict[str, Any]:
        stored = self._find(file)
        if stored is None:
            stored = None if self.should_stop() else _timed(compute)
            if stored is None:
                raise Stopped(name)
            self._keep(name, file, stored)
        self._count(name, stored["seconds"], [stored.get("commit")])
        return stored["found"]

    def _find(self, file: str) -> dict[str, Any] | None:
        """Return seconds, commit and what was found of a piece of work that is done."""
        if file.endswith(".json"):
            return self.store.find(
                file, fits=lambda held: isinstance(held, dict) and {"seconds", "found"} <= held.keys()
            )
        held = self.store.find(file, fits=lambda held: "seconds" in held)
        return held and {
            "seconds": float(held["seconds"]),
            "commit": str(held.get("commit", "")),
            "found": {name.removeprefix(_FOUND): held[name] for name in held if name.startswith(_FOUND)},
        }

    def _keep(self, name: str, file: str, stored: dict[str, Any]) -> None:
        stored["commit"] = _present_commit()
        if file.endswith(".json"):
            self.store.write(file, stored)
        else:
            found = {f"{_FOUND}{name}": array for name, array in stored["found"].items()}
            about = {key: np.array(stored[key]) for key in ("seconds", "commit")}
            self.store.write(file, about | found)
        self._say(f"{name}: {stored['seconds']:.1f} s")

    def _count(self, name: str, seconds: float, commits: Sequence[str | None]) -> None:
        """Count a piece of work, or a study; one that is asked for again counts once."""
        if name not in self._names:
            self._names.add(name)
            self.seconds += seconds
            self.commits.update(commit or "" for commit in commits)

    def study(self, name: str, scenario: str, **arguments: Any) -> "StudyResult":
        """Return a study of many runs, executed or resumed as far as it is not complete; see `turing_learning.study`."""
        from turing_learning.studies import ExecutorError, StudyFolder, is_study, load_study, study

        def observe(progress: "StudyProgress") -> None:
            if progress.finished:
                self._say(f"{name}: {progress.done} of {progress.total} runs")

        path = self._folder / name
        written = is_study(path) and (path / "report.html").exists()  # the report comes last
        result = load_study(path) if written else None
        if result is None or not result.complete:
            watch: dict[str, Any] = {"observer": observe, "should_stop": self._should_stop, "out": path}
            with ThreadPoolExecutor(1) as executor:
                hands: dict[str, Any] = {"executor": executor} if self._fast else {"workers": self._workers}
                result = study(scenario, **arguments, **hands, **watch)
        if result.unfinished:
            raise Stopped(name)
        if result.failed:
            raise ExecutorError(
                f"`{name}` must have no runs that fail; got {len(result.failed)}, the first for: "
                f"{result.failed[0].reason} [{path}]. Give the same command again to try again."
            )
        folder = StudyFolder(result.path)
        commits = [RunFolder(folder.run_path(run.number)).manifest().get("commit") for run in result.runs]
        self._count(name, sum(run.seconds or 0.0 for run in result.runs), commits)
        return result

    def runs(
        self, name: str, scenario: str, preset: str, *, runs: int | None = None,
        settings: Mapping[str, Any] = MappingProxyType({}),
    ) -> "StudyResult":  # fmt: skip
        """Return the study of as many runs (or `runs`) and generations as the sizes say, with further settings; see `study`."""
        sizes = self.sizes
        return self.study(
            name,
            scenario,
            runs=sizes.runs if runs is None else runs,
            first_seed=sizes.first_seed,
            generations=sizes.generations,
            preset=preset,
            settings={**sizes.settings, **settings},
        )


@cache
def _present_commit() -> str:
    """Return the commit of the package, "" where it is not known."""
    return new_manifest("", 0)["commit"] or ""


def _timed(compute: Callable[[], Mapping[str, Any] | None]) -> dict[str, Any] | None:
    begun = time.perf_counter()
    found = compute()
    return None if found is None else {"seconds": round(time.perf_counter() - begun, 3), "found": dict(found)}


def _in_worker(compute: Compute, *arguments: Any) -> dict[str, Any] | None:
    return None if asked_to_stop() else _timed(partial(compute, asked_to_stop, *arguments))
