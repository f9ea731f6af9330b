"""Error over trials of ``infer(..., trials=N)``: ``python curves.py CASE TRIALS FIRST LAST``; one row per run in a table.

A run that has its row is not repeated. Cases: aggregation, object-clustering; two-state-N and three-state-N: the agents of
either scenario with random controller number N, wheel speeds uniform in [-1, 1]; four-state-N: the same of four robots that
also see a light and posts (docs/scenarios.md). ``python curves.py`` alone prints the tables.
"""

import csv
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

import turing_learning as tl
from turing_learning.swarm import SCENARIOS, Item, Sensor

HERE = Path(__file__).parent
HEADER = (
    "trials",
    "seed",
    "mae",
    "largest_ae",
    "verdict",
    "held_90",
    "cpu_s",
    "estimate",
    "low",
    "high",
    "truth",
)


def system(case: str):
    """Return the scenario of a case."""
    kind, _, number = case.rpartition("-")
    if kind not in ("two-state", "three-state", "four-state"):
        return SCENARIOS[case]
    states = {"two-state": 2, "three-state": 3, "four-state": 4}[kind]
    rng = np.random.default_rng(int(number))
    controller = tuple(rng.uniform(-1, 1, 2 * states).tolist())
    if states < 4:
        base = SCENARIOS["aggregation" if states == 2 else "object-clustering"]
        return replace(base, controller=controller)
    aggregation = SCENARIOS["aggregation"]
    return replace(
        aggregation,
        controller=controller,
        agents=4,
        items={
            "light": Item(mobility="seen", radius_cm=8, centers_cm=((50.0, 50.0),)),
            "post": Item(count=4, radius_cm=6),
        },
        sensor=Sensor(("background", "robot", "light", "post")),
        arena=replace(aggregation.arena, width_cm=100, height_cm=100),
    )


def append(path: Path, header: tuple[str, ...], rows: list[dict]) -> None:
    """Append rows to a table; a new one begins with its header."""
    with path.open("a", newline="") as file:
        writer = csv.DictWriter(file, header)
        if file.tell() == 0:
            writer.writeheader()
        writer.writerows(rows)


def run(case: str, trials: int, seed: int) -> dict:
    """Return the row of one run; `held_90` is the share of the intervals that hold the truth, NaN without any."""
    agents, begun = system(case), time.process_time()
    result = tl.infer(agents, trials=trials, seed=seed, settings={"run.threads": 1})
    truth, estimate = np.array(agents.controller), np.array(list(result.estimate.values()))
    low, high = np.array(list(result.interval.values())).T
    error = np.abs(estimate - truth)
    return {
        "trials": trials,
        "seed": seed,
        "mae": f"{error.mean():.5f}",
        "largest_ae": f"{error.max():.4f}",
        "verdict": result.verdict,
        "held_90": "nan"
        if np.isnan(low).any()
        else f"{((low <= truth) & (truth <= high)).mean():.3f}",
        "cpu_s": f"{time.process_time() - begun:.1f}",
        **{
            name: " ".join(f"{value:.4f}" for value in values)
            for name, values in (
                ("estimate", estimate),
                ("low", low),
                ("high", high),
                ("truth", truth),
            )
        },
    }


def summary() -> None:
    """Print, for each table and number of trials, errors, how many runs give intervals, and how many of these hold the truth."""
    for name in ("aggregation", "object-clustering", "two-state", "three-state", "four-state"):
        path = HERE / f"{name}.csv"
        if path.exists():
            rows = pd.read_csv(path).assign(
                given=lambda one: one.held_90.notna(), below=lambda one: one.mae < 0.05
            )
            good = rows[rows.mae < 2 * rows.groupby("trials").mae.transform("median")]
            table = rows.groupby("trials").agg(
                runs=("mae", "size"), median=("mae", "median"), worst=("mae", "max"), below_005=("below", "mean"),
                given=("given", "mean"), held=("held_90", "mean"), cpu_s=("cpu_s", "median"),
            )  # fmt: skip
            table["good_called_converged"] = (
                (good.verdict == "converged").groupby(good.trials).mean()
            )
            sys.stdout.write(f"{name}\n{table.to_string(float_format='{:.4f}'.format)}\n")


def main(case: str, trials: int, first: int, last: int) -> None:
    """Compute the rows that are missing."""
    path = HERE / f"{case.rstrip('-0123456789')}.csv"
    rows = list(csv.DictReader(path.open())) if path.exists() else []
    done = {(row["trials"], row["seed"], row["truth"]) for row in rows}
    truth = " ".join(f"{value:.4f}" for value in system(case).controller)
    for seed in range(first, last + 1):
        if (str(trials), str(seed), truth) in done:
            continue
        row = run(case, trials, seed)
        append(path, HEADER, [row])
        sys.stdout.write(f"{case} {trials} {seed} {row['mae']} {row['cpu_s']}\n")


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(sys.argv[1], *(int(word) for word in sys.argv[2:5]))
    else:
        summary()
