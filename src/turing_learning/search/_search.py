"""The search: all controllers of a grid in few trials, the better ones in more, the best in many."""

import json
import math
import time
from collections.abc import Callable
from dataclasses import MISSING, asdict, dataclass, fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.analysis import dispersion
from turing_learning.analysis._disks import gathered
from turing_learning.config import ConfigurationError, dotted, require_whole_cycles
from turing_learning.config._sections import PROSE, check
from turing_learning.errors import integer, number, require
from turing_learning.purposes import SEARCH_NOISE, SEARCH_STARTS
from turing_learning.store import Kind, RunFolderError, Store, storage, writable
from turing_learning.swarm import Scenario, initial_poses, simulate

SAMPLING_S = 1.0  # between two looks at the dispersion: a robot moves less than two diameters
BLOCK = 500  # controllers whose costs are stored in one file
BATCH = 128  # trials that are simulated, and kept in memory, at a time
MOST_CONTROLLERS = 1_000_000  # on the whole grid; their costs are kept in memory
LONGEST_S = 3600.0
LARGEST_TRIALS = 100_000
SEMIFINALISTS = 20  # controllers of the second round, for each of the last one
SEARCH = Kind("search", "search.json", identity=("scenario", "settings"))


def mirrored(controllers: np.ndarray) -> np.ndarray:
    """Return controllers (..., 2 n) with left and right exchanged: their swarms do the same, seen in a mirror."""
    return controllers.reshape(*controllers.shape[:-1], -1, 2)[..., ::-1].reshape(controllers.shape)


def grid_controllers(states: int, steps: int) -> np.ndarray:
    """Return every controller (N, 2 n) whose wheel speeds are on a grid of so many steps from -1 to 1, one of each mirror pair.

    It is the one that is larger at the first speed in which they differ; the last speed changes fastest.
    Source: section 4.6.1.
    """
    places = np.indices((steps,) * (2 * states)).reshape(2 * states, -1).T
    number = steps ** np.arange(2 * states)[::-1]
    kept = places[places @ number >= mirrored(places) @ number]
    return np.linspace(-1, 1, steps).round(12)[kept]


def gathering_costs(
    scenario: Scenario,
    controllers: np.ndarray,
    starts: np.ndarray,
    *,
    duration_s: float,
    seed: int,
    threads: int | None = None,
) -> np.ndarray:
    """Return costs of controllers (M, 2 n), and dispersion at the end, of trials that start at poses (R, A + O, 3): (M, R, 2).

    The cost is sum t u(t) / sum t over the seconds t = 1, 2, ... of a trial, where u is the dispersion of the
    objects, or of the robots where there are none. Source: Gauci et al. 2014, Int. J. Robotics Research 33;
    docs/decisions/0016 says what is assumed.
    """
    models, trials, robots = len(controllers), len(starts), scenario.individuals
    many = np.tile(starts, (models, 1, 1))
    executed = np.repeat(controllers, trials, axis=0)[:, None].repeat(robots, axis=1)
    cycles = scenario.trial.steps_of(duration_s, "duration_s")
    stride = max(1, round(SAMPLING_S / scenario.trial.control_interval_s))
    poses = simulate(scenario, executed, many, control_steps=cycles, seed=seed, threads=threads).poses
    spread = dispersion(*gathered(scenario, poses[:, stride::stride], robots))
    weights = np.arange(1, spread.shape[1] + 1)
    costs = spread @ weights / weights.sum()
    return np.stack((costs, spread[:, -1]), axis=-1).reshape(models, trials, 2)


@dataclass(frozen=True)
class SearchSettings:
    """How large a search is.

    Parameters
    ----------
    steps
        Settings of each wheel speed, from -1 to 1; >= 2.
    trials
        Of each controller on the grid in the first round, the screening; >= 1.
    finalists
        Controllers of the last round; >= 1.
    final_trials
        Of each of them; >= `trials`.
    duration_s
        Of a trial (s); at most 3600, and an integer multiple of the control interval.
    seed
        Of initial poses and wheel noise; >= 0.

    Source
    ------
    Steps and duration: Gauci et al. 2014, Int. J. Robotics Research 33, as far as is known; docs/decisions/0016.
    """

    steps: int = 21
    trials: int = 1
    finalists: int = 50
    final_trials: int = 100
    duration_s: float = 180.0
    seed: int = 1

    def __post_init__(self) -> None:
        bounds = {"steps": (2, MOST_CONTROLLERS), "trials": (1, LARGEST_TRIALS), "finalists": (1, MOST_CONTROLLERS)}
        bounds |= {"final_trials": (self.trials, LARGEST_TRIALS), "seed": (0, 2**63 - 1)}
        for name, (least, most) in bounds.items():
            integer(name, getattr(self, name), least, most, error=ConfigurationError)
        number("duration", self.duration_s, above=0, most=LONGEST_S, error=ConfigurationError)

    def check(self, scenario: Scenario) -> None:
        """Reject a grid that is too large for a scenario, or trials that do not fit its control cycles."""
        speeds = len(scenario.controller)
        shortest = max(1.0, scenario.trial.control_interval_s)
        got = f"{self.steps}, which gives {self.steps}^{speeds} in scenario {scenario.name!r}"
        rule, few = f"give at most {MOST_CONTROLLERS} controllers", self.steps**speeds <= MOST_CONTROLLERS
        check(few, "steps", rule, got, "Choose fewer steps.")
        check(self.duration_s >= shortest, "duration", f"be at least {shortest:g} s", self.duration_s)
        require_whole_cycles(scenario, self.duration_s)

    def rounds(self, controllers: int) -> tuple[tuple[int, int], ...]:
        """Return the rounds of a search among that many controllers: all of them, the better ones in more trials, the finalists.

        Each is a number of controllers and of trials.
        """
        sizes = (controllers, min(controllers, SEMIFINALISTS * self.finalists), min(controllers, self.finalists))
        trials = (self.trials, math.isqrt(self.trials * self.final_trials), self.final_trials)
        return tuple(zip(sizes, trials, strict=True))


@dataclass(frozen=True)
class SearchProgress:
    """How far a search is: round of how many, controllers of the round, and the time that is left for it at this rate (s)."""

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

    A search that was stopped or killed is resumed by the same call.

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
        Called with a `SearchProgress` after every 500 controllers.

    Returns
    -------
    SearchResult or None
        None if it was stopped.

    Raises
    ------
    ConfigurationError
        If the settings do not fit the scenario.
    RunFolderError
        If the folder cannot be written, is in use, or holds something else.
    RunStorageError
        If the results cannot be written; the call can be repeated.

    Source
    ------
    Paper, section 4.6.1; docs/decisions/0016.
    """
    settings = settings or SearchSettings()
    settings.check(scenario)
    store = Store(out, SEARCH)
    _begin(store, scenario, settings)

    def costs_of(controllers: np.ndarray, starts: np.ndarray, number: int, first: int) -> np.ndarray | None:
        """Return costs batch by batch, each with noise of its own place in the round; None if the search was stopped."""
        batches, size = [], max(1, BATCH // len(starts))
        for k in range(0, len(controllers), size):
            if should_stop is not None and should_stop():
                return None
            entropy = np.random.SeedSequence((SEARCH_NOISE, settings.seed, number, first + k))
            noise = int(entropy.generate_state(1, np.uint64)[0])
            how: dict[str, Any] = {"duration_s": settings.duration_s, "seed": noise, "threads": threads}
            batches.append(gathering_costs(scenario, controllers[k : k + size], starts, **how))
        return np.concatenate(batches)

    with storage(store.path, "give the same command again: it goes on."), store.locked():
        controllers = grid_controllers(scenario.sensor.states, settings.steps)
        costs, rounds = np.zeros((len(controllers), 1, 2)), settings.rounds(len(controllers))
        for number, (count, trials) in enumerate(rounds, start=1):
            controllers = controllers[_best(costs)[:count]]
            starts = initial_poses(scenario, trials, np.random.default_rng((SEARCH_STARTS, settings.seed, number)))
            blocks, begun, fresh = [], time.monotonic(), 0
            for first in range(0, len(controllers), BLOCK):
                own = controllers[first : first + BLOCK]
                name = f"round{number}/{first:07d}.npy"
                fresh += 0 if (store.path / name).exists() else len(own)
                compute = partial(costs_of, own, starts, number, first)
                block = store.once(name, compute)
                if block is None:
                    return None
                blocks.append(block)
                done = first + len(own)
                left = (time.monotonic() - begun) / max(fresh, 1) * (len(controllers) - done)
                if observer is not None:
                    observer(SearchProgress(number, len(rounds), done, len(controllers), left))
            costs = np.concatenate(blocks)
        order = _best(costs)
        best, ends = costs[order, :, 0], costs[order, :, 1]
        found = SearchResult(scenario, settings, controllers[order], best, ends, store.path)
        store.write("controllers.csv", _table(found))
        return found


def _begin(store: Store, scenario: Scenario, settings: SearchSettings) -> None:
    """Make this the folder of a search, or leave it if it is."""
    content = json.loads(json.dumps({"scenario": asdict(scenario), "settings": asdict(settings)}))
    with writable("out", store.path):
        if not store.foreign_names():
            store.create(content)
            return
    check, remedy = partial(require, name="out", error=RunFolderError), "Choose another folder."
    rule, got = "be a new folder, or that of a search", f"{store.path}, without a readable {SEARCH.head}"
    check(store.exists(), rule=rule, got=got, remedy=remedy)
    held = store.head()
    # folders of before a setting came do not name it
    later = {each.name: each.default for each in fields(Scenario) if each.default is not MISSING}
    held["scenario"] = later | held["scenario"]
    both = [dotted({key: each[key] for key in SEARCH.identity}) for each in (held, content)]
    stored, given = ({key: value for key, value in each.items() if key not in PROSE} for each in both)
    rule, place = "be the folder of the same search", str(store.head_path)
    check(stored == given, rule=rule, got="one of other settings", place=place, remedy=remedy)


def _best(costs: np.ndarray) -> np.ndarray:
    """Return the indices of controllers by mean cost, best first; of equals the first come first."""
    return np.argsort(costs[..., 0].mean(axis=1), kind="stable")


def _table(result: SearchResult) -> bytes:
    """Return the finalists as CSV."""
    import pandas

    speeds = [f"v{side}{state}" for state in range(result.scenario.sensor.states) for side in "lr"]
    columns = dict(zip(speeds, result.controllers.T, strict=True)) | {
        "trials": [result.costs.shape[1]] * len(result.costs),
        "cost": result.costs.mean(axis=1),
        "standard_error": result.standard_errors,
        "median_cost": np.median(result.costs, axis=1),
        "median_dispersion_at_the_end": np.median(result.ends, axis=1),
    }
    table = pandas.DataFrame(columns, index=pandas.RangeIndex(1, len(result.costs) + 1, name="rank"))
    return table.to_csv(float_format="%.6g", lineterminator="\n").encode()
