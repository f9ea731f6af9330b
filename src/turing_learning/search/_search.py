"""The search: all controllers of a grid in few trials, the better ones in more, the best in many."""

import csv
import io
import json
import time
from collections.abc import Callable
from dataclasses import MISSING, asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning._files import in_home
from turing_learning.config import PROSE, dotted
from turing_learning.purposes import SEARCH_NOISE, SEARCH_STARTS
from turing_learning.runs import RunFolderError, storage, writable, write_atomically, write_json
from turing_learning.swarm import Scenario, initial_poses

from ._cost import gathering_costs
from ._grid import grid_controllers
from ._settings import Round, SearchSettings

BLOCK = 500
"""Controllers whose costs are stored in one file."""
BATCH = 128
"""Trials that are simulated, and kept in memory, at a time."""
FORMAT_VERSION = 1


@dataclass(frozen=True)
class SearchProgress:
    """How far a search is.

    Attributes
    ----------
    round, rounds
        Which of how many.
    done, total
        Controllers of the round.
    seconds_left
        In the round, at the rate of this call.
    """

    round: int
    rounds: int
    done: int
    total: int
    seconds_left: float


@dataclass(frozen=True)
class SearchResult:
    """The best controllers, best first.

    Attributes
    ----------
    scenario, settings
        What was searched.
    controllers : (F, 2 n)
        The finalists.
    costs : (F, R)
        Of each in the trials of the last round, which had no part in the choice of the finalists.
    ends : (F, R)
        Dispersion at the end of each trial.
    path
        The folder.
    """

    scenario: Scenario
    settings: SearchSettings
    controllers: np.ndarray
    costs: np.ndarray
    ends: np.ndarray
    path: Path

    @property
    def best(self) -> tuple[float, ...]:
        """The best controller (2 n,)."""
        return tuple(self.controllers[0].tolist())

    @property
    def standard_errors(self) -> np.ndarray:
        """Standard errors of the mean costs (F,); 0 for a single trial."""
        trials = self.costs.shape[1]
        return self.costs.std(axis=1, ddof=1) / np.sqrt(trials) if trials > 1 else np.zeros(len(self.costs))


def search_controller(
    scenario: Scenario,
    settings: SearchSettings | None = None,
    *,
    out: str | Path,
    threads: int | None = None,
    should_stop: Callable[[], bool] | None = None,
    observer: Callable[[SearchProgress], None] | None = None,
) -> SearchResult | None:
    """Search the reactive controller with which a swarm gathers best, on a grid over all wheel speeds.

    What has been simulated before is not simulated again: a call that was stopped or killed is gone on with.

    Parameters
    ----------
    scenario
        Robots, sensor, objects and numbers of them; what it says of the agents' controller does not matter.
    settings
        How large the search is.
    out
        A folder; a new one, or that of the same search.
    threads
        Number of threads; None takes every processor. The result does not depend on it.
    should_stop
        Asked every second or so.
    observer
        Told how far the search is.

    Returns
    -------
    SearchResult or None
        None if it was stopped.

    Raises
    ------
    ConfigurationError
        If the settings do not fit the scenario.
    RunFolderError
        If the folder cannot be written, or holds something else.
    RunStorageError
        If the results cannot be written; the call can be repeated.

    Source
    ------
    Paper, section 4.6.1; docs/decisions/0016.
    """
    settings = settings or SearchSettings()
    settings.check(scenario)
    folder = in_home(out)
    _begin(folder, scenario, settings)
    search = _Search(scenario, settings, folder, threads, should_stop or (lambda: False), observer or (lambda _: None))
    with storage(folder, "give the same command again: it goes on."):
        return search.conduct()


def _begin(folder: Path, scenario: Scenario, settings: SearchSettings) -> None:
    """Make this the folder of a search, or leave it if it is."""
    path = folder / "search.json"
    content = {"format_version": FORMAT_VERSION, "scenario": asdict(scenario), "settings": asdict(settings)}
    content = json.loads(json.dumps(content))
    with writable("out", folder):
        if not folder.exists() or not any(folder.iterdir()):
            folder.mkdir(parents=True, exist_ok=True)
            write_json(path, content)
            return
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise RunFolderError(
            f"`out` must be a new folder, or that of a search; got {folder}, without a readable {path.name}. Choose another folder."
        ) from error
    if isinstance(held, dict) and isinstance(held.get("scenario"), dict):
        held["scenario"] = _later_defaults() | held["scenario"]
    if _without_prose(held) != _without_prose(content):
        raise RunFolderError(
            f"`out` must be the folder of the same search; got one of other settings [{path}]. Choose another folder."
        )


def _later_defaults() -> dict[str, Any]:
    """Return the simple settings of a scenario that have a default: folders of before they came do not name them."""
    return {each.name: each.default for each in fields(Scenario) if each.default is not MISSING}


def _without_prose(content: Any) -> Any:
    return (
        {key: value for key, value in dotted(content).items() if key not in PROSE}
        if isinstance(content, dict)
        else content
    )


class _Search:
    def __init__(
        self,
        scenario: Scenario,
        settings: SearchSettings,
        folder: Path,
        threads: int | None,
        should_stop: Callable[[], bool],
        observer: Callable[[SearchProgress], None],
    ) -> None:
        self._scenario, self._settings, self._folder = scenario, settings, folder
        self._threads, self._should_stop, self._observer = threads, should_stop, observer

    def conduct(self) -> SearchResult | None:
        controllers = grid_controllers(self._scenario.sensor.states, self._settings.steps)
        rounds = self._settings.rounds(len(controllers))
        costs = np.zeros((len(controllers), 1, 2))
        for number, one in enumerate(rounds, start=1):
            controllers = controllers[_best(costs, one.controllers)] if number > 1 else controllers
            found = self._round(number, len(rounds), one, controllers)
            if found is None:
                return None
            costs = found
        order = _best(costs, len(costs))
        result = SearchResult(
            self._scenario,
            self._settings,
            controllers[order],
            costs[order, :, 0],
            costs[order, :, 1],
            self._folder,
        )
        write_atomically(self._folder / "controllers.csv", _table(result))
        return result

    def _round(self, number: int, rounds: int, one: Round, controllers: np.ndarray) -> np.ndarray | None:
        """Return costs and final dispersions (M, R, 2) of a round; None if it was stopped."""
        rng = np.random.default_rng((SEARCH_STARTS, self._settings.seed, number))
        starts = initial_poses(self._scenario, one.trials, rng)
        folder = self._folder / f"round{number}"
        folder.mkdir(exist_ok=True)
        blocks, begun, fresh = [], time.monotonic(), 0
        for start in range(0, len(controllers), BLOCK):
            own = controllers[start : start + BLOCK]
            path = folder / f"{start:07d}.npy"
            block = _stored(path, (len(own), one.trials, 2))
            if block is None:
                block = self._block(number, start, own, starts)
                if block is None:
                    return None
                write_atomically(path, _bytes(block))
                fresh += len(own)
            blocks.append(block)
            done = start + len(own)
            left = (time.monotonic() - begun) / max(fresh, 1) * (len(controllers) - done)
            self._observer(SearchProgress(number, rounds, done, len(controllers), left))
        return np.concatenate(blocks)

    def _block(self, number: int, start: int, controllers: np.ndarray, starts: np.ndarray) -> np.ndarray | None:
        size = max(1, BATCH // len(starts))
        batches = []
        for k in range(0, len(controllers), size):
            if self._should_stop():
                return None
            entropy = (SEARCH_NOISE, self._settings.seed, number, start + k)
            batches.append(
                gathering_costs(
                    self._scenario,
                    controllers[k : k + size],
                    starts,
                    duration_s=self._settings.duration_s,
                    seed=int(np.random.SeedSequence(entropy).generate_state(1, np.uint64)[0]),
                    threads=self._threads,
                )
            )
        return np.concatenate(batches)


def _best(costs: np.ndarray, count: int) -> np.ndarray:
    """Return the indices of the controllers with the smallest mean cost, best first; of equals the first come first."""
    return np.argsort(costs[..., 0].mean(axis=1), kind="stable")[:count]


def _stored(path: Path, shape: tuple[int, ...]) -> np.ndarray | None:
    try:
        block = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    return block if block.shape == shape else None


def _bytes(array: np.ndarray) -> bytes:
    content = io.BytesIO()
    np.save(content, array, allow_pickle=False)
    return content.getvalue()


def _table(result: SearchResult) -> bytes:
    """Return the finalists as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    names = tuple(f"v{side}{state}" for state in range(result.scenario.sensor.states) for side in "lr")
    writer.writerow(("rank", *names, "trials", "cost", "standard_error", "median_cost", "median_dispersion_at_the_end"))
    for rank, (controller, costs, ends, error) in enumerate(
        zip(result.controllers, result.costs, result.ends, result.standard_errors, strict=True), start=1
    ):
        numbers: tuple[Any, ...] = (costs.mean(), error, np.median(costs), np.median(ends))
        row = (*controller, len(costs), *numbers)
        writer.writerow((rank, *(f"{float(value):.6g}" for value in row)))
    return text.getvalue().encode()
