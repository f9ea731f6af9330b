"""Networks that are off in the last generation (section 4.6.2): were they right before, and does anybody see that they
are off?

    turing-learning reproduce 4.6.2 --as-printed --out FOLDER    # 30 runs each with 1, 3 and 5 hidden neurons, half an hour
    python outliers.py FOLDER/4.6.2                             # a row of outliers.csv for each run that the table lacks
    python outliers.py 2001 2015                                # runs of these seeds with 5 hidden neurons and other rates
    python outliers.py                                          # counts

A network is right if all its steady outputs, those in the 20th step of a constant reading, are within 0.2 of the
agents' parameters, as the claim of the paper is judged. A row is a run: in which generation the subjectively best
network is right for the first time, in what share of the generations 401 to 1000 it is, and the typical one; the
largest error of the last generation's best network in the 20th step of a constant reading; and its largest mean
error, over the two wheels and readings, along the readings that agents have in 100 trials of 10 s. There the network
begins as in a trial, and I = 1 lasts at most a few steps.
"""

import sys
import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

import turing_learning as tl
from turing_learning.config import load_configuration
from turing_learning.models import ElmanModel
from turing_learning.runs import Result, load_run
from turing_learning.swarm import AGGREGATION, alone, initial_poses, simulate

TABLE = Path(__file__).parent / "outliers.csv"
TRUTH = np.array(AGGREGATION.controller)
HIDDEN = (1, 3, 5)
RIGHT = 0.2
SETTLED = 400
TRIALS = 100
SEED = 1


def readings() -> np.ndarray:
    """Return the readings (K, T) of agents in trials of agents alone."""
    settings = {"scenario.world": "paper"}
    scenario = load_configuration(None, "paper", settings, scenario=AGGREGATION.name).swarm
    shape = (*alone(scenario, TRIALS).shape, len(TRUTH))
    poses = initial_poses(scenario, TRIALS, np.random.default_rng(SEED))
    steps = scenario.control_steps
    controllers = np.broadcast_to(TRUTH, shape)
    motion = simulate(scenario, controllers, poses, control_steps=steps, seed=SEED)
    return motion.sensors[:, :-1].swapaxes(1, 2).reshape(-1, steps)


def error_as_seen(model: ElmanModel, network: np.ndarray, seen: np.ndarray) -> float:
    """Return the largest mean error of the outputs of a network (Q,) along readings (K, T), over wheels and readings."""
    outputs = np.stack([model.respond(network, series) for series in seen])
    errors = np.abs(outputs - TRUTH.reshape(-1, 2)[seen])
    return max(float(errors[seen == state].mean(axis=0).max()) for state in range(model.states))


def row(rates: str, run: Result, seen: np.ndarray) -> dict[str, object]:
    """Return the row of a run."""
    hidden = run.configuration.models.hidden
    model = ElmanModel(hidden=hidden)
    best, typical = (run.history[name].to_numpy() for name in ("best_model", "typical_model"))
    errors = np.abs(model.described(best) - TRUTH).max(axis=1)
    right = errors <= RIGHT
    typical_right = np.abs(model.described(typical) - TRUTH).max(axis=1) <= RIGHT
    found: dict[str, object] = {"rates": rates, "hidden": hidden}
    found["seed"] = run.configuration.run.seed
    found["first"] = int(right.argmax()) + 1 if right.any() else ""
    found["share_best"] = round(float(right[SETTLED:].mean()), 3)
    found["share_typical"] = round(float(typical_right[SETTLED:].mean()), 3)
    found["last_steady"] = round(float(errors[-1]), 4)
    found["last_as_seen"] = round(error_as_seen(model, best[-1], seen), 4)
    return found


def summary() -> None:
    """Print counts for each number of hidden neurons."""
    seen = readings()
    lengths = []
    for series in seen:
        bounds = np.flatnonzero(np.diff(np.concatenate([[0], series, [0]])))
        lengths += np.diff(bounds)[::2].tolist()
    sys.stdout.write(
        f"I = 1 lasts at most {max(lengths)} steps, {np.mean(lengths):.2f} on average\n"
    )
    for (rates, hidden), runs in pd.read_csv(TABLE).groupby(["rates", "hidden"]):
        off = runs[runs["last_steady"] > RIGHT]
        right = runs[runs["last_steady"] <= RIGHT]
        line = f"{rates}, {hidden} hidden: {len(off)} of {len(runs)} off, {off['first'].notna().sum()} of these were right before, "
        line += f"first in generation {runs['first'].min():.0f} to {runs['first'].max():.0f}; "
        line += (
            f"right in {runs['share_best'].mean():.2f} of the generations from {SETTLED + 1} on, "
        )
        line += (
            f"between {runs['share_best'].min():.2f} and {runs['share_best'].max():.2f} by run, "
        )
        line += f"typical network {runs['share_typical'].mean():.2f}; "
        line += (
            f"off, but right along the agents' readings: {(off['last_as_seen'] <= RIGHT).sum()}; "
        )
        line += f"the other way round: {(right['last_as_seen'] > RIGHT).sum()}"
        sys.stdout.write(line + "\n")


def add(rates: str, hidden: int, seed: int, execute: Callable[[], Result]) -> None:
    """Add the row of a run that the table lacks."""
    if TABLE.exists():
        done = pd.read_csv(TABLE)[["rates", "hidden", "seed"]].itertuples(index=False, name=None)
        if (rates, hidden, seed) in set(done):
            return
    line = pd.DataFrame([row(rates, execute(), readings())])
    line.to_csv(TABLE, mode="a", header=not TABLE.exists(), index=False)


def add_stored(folder: Path) -> None:
    """Add the rows of the runs of an experiment's folder."""
    for hidden in HIDDEN:
        runs = folder / "pieces" / f"study-{hidden}-hidden-paper" / "runs"
        for path in sorted(runs.iterdir()):
            seed = int(tomllib.loads((path / "config.toml").read_text())["run"]["seed"])
            add("group", hidden, seed, partial(load_run, path))


def execute_with_other_rates(first: int, last: int) -> None:
    """Execute runs of the largest networks whose step sizes adapt twice as fast."""
    settings = {"scenario.world": "paper", "models.hidden": HIDDEN[-1], "run.threads": 1}
    for population in ("models", "classifiers"):
        settings[f"{population}.adaptation"] = 1.0
    for seed in range(first, last + 1):
        how = {"preset": "paper", "generations": 1000, "seed": seed, "settings": settings}
        execute = partial(tl.infer, AGGREGATION.name, progress=False, **how)
        add("textbook", HIDDEN[-1], seed, execute)


if __name__ == "__main__":
    if len(sys.argv) == 3:
        execute_with_other_rates(int(sys.argv[1]), int(sys.argv[2]))
    elif len(sys.argv) == 2:
        add_stored(Path(sys.argv[1]))
    else:
        summary()
