"""How often agents have each sensor reading, over gravity, lag and the length of a trial: ``python shares.py [BLOCKS]``.

The paper prints these shares as means over 100 trials (section 4.3). Each world gets BLOCKS blocks of 100 trials, 10 by default.
A block is appended to shares-blocks.csv as soon as it is done, and not repeated; the same command goes on where it was stopped.
Then shares.csv is written: means over all trials, standard errors, and the largest distance from the printed shares.
"""

import csv
import sys
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np

from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Scenario, initial_poses, simulate

HERE = Path(__file__).parent
BLOCKS = HERE / "shares-blocks.csv"
PRINTED = {"aggregation": (0.912, 0.088, 0.0), "object-clustering": (0.532, 0.342, 0.126)}
DURATIONS_S = (*range(10, 100, 10), *range(100, 501, 20))
TRIALS = 100
GRAVITIES = (981.0, 9.81, 98.1, 9810.0)  # cm/s^2; aggregation has no objects
LAGS = (0, 1, 2, 3)  # control cycles
CASES = [(AGGREGATION, 9.81, lag) for lag in LAGS]
CASES += [(OBJECT_CLUSTERING, gravity, lag) for gravity in GRAVITIES for lag in LAGS[:3]]
WORLD = ("scenario", "gravity_cm_s2", "lag_cycles")
FIELDS = (
    *WORLD,
    "duration_s",
    "trials",
    "share_0",
    "share_1",
    "share_2",
    "variance_0",
    "variance_1",
    "variance_2",
)


def changed(scenario: Scenario, gravity: float, lag: int) -> Scenario:
    """Return a scenario with another gravity and lag."""
    objects = replace(scenario.objects, gravity_cm_s2=gravity)
    return replace(
        scenario, objects=objects, robot=replace(scenario.robot, actuation_lag_cycles=lag)
    )


def shares_of(scenario: Scenario, seed: int) -> np.ndarray:
    """Return the share of each of three readings (trials, durations, 3) up to each duration; all robots are agents."""
    steps = [round(duration / scenario.trial.control_interval_s) for duration in DURATIONS_S]
    poses = initial_poses(scenario, TRIALS, np.random.default_rng(seed))
    controllers = np.broadcast_to(
        scenario.controller, (TRIALS, scenario.individuals, len(scenario.controller))
    )
    moved = simulate(scenario, controllers, poses, control_steps=max(steps), seed=seed, threads=1)
    happened = (moved.sensors[:, :-1, :, None] == np.arange(3)).mean(axis=2)
    mean = np.cumsum(happened, axis=1) / np.arange(1, max(steps) + 1)[:, None]
    return mean[:, [step - 1 for step in steps]]


def measure(blocks: int) -> None:
    """Append what is missing, all worlds block by block."""
    done = defaultdict(int)
    if BLOCKS.exists():
        with BLOCKS.open(newline="") as file:
            for row in csv.DictReader(file):
                done[tuple(row[name] for name in WORLD)] += 1
    for block in range(blocks):
        for scenario, gravity, lag in CASES:
            world = (scenario.name, str(gravity), str(lag))
            if done[world] > block * len(DURATIONS_S):
                continue
            shares = shares_of(changed(scenario, gravity, lag), seed=1 + block)
            rows = [
                [
                    *world,
                    duration,
                    TRIALS,
                    *shares[:, k].mean(axis=0),
                    *shares[:, k].var(axis=0, ddof=1),
                ]
                for k, duration in enumerate(DURATIONS_S)
            ]
            with BLOCKS.open("a", newline="") as file:
                writer = csv.writer(file, lineterminator="\n")
                if file.tell() == 0:
                    writer.writerow(FIELDS)
                writer.writerows(
                    [f"{value:.6g}" if isinstance(value, float) else value for value in row]
                    for row in rows
                )


def write_table() -> None:
    """Write the shares of each world and duration over all of its blocks."""
    blocks = defaultdict(list)
    with BLOCKS.open(newline="") as file:
        for row in csv.DictReader(file):
            key = (
                row["scenario"],
                float(row["gravity_cm_s2"]),
                int(row["lag_cycles"]),
                int(row["duration_s"]),
            )
            blocks[key].append([float(row[name]) for name in FIELDS[4:]])
    with (HERE / "shares.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        errors = [f"standard_error_{state}" for state in range(3)]
        writer.writerow([*FIELDS[:8], *errors, "largest_distance_from_printed"])
        for key, found in sorted(blocks.items()):
            numbers = np.array(found)
            trials = numbers[:, 0].sum()
            mean, error = (
                numbers[:, 1:4].mean(axis=0),
                np.sqrt(numbers[:, 4:7].mean(axis=0) / trials),
            )
            distance = np.abs(mean - PRINTED[key[0]]).max()
            writer.writerow(
                [*key, int(trials), *(f"{value:.4f}" for value in (*mean, *error, distance))]
            )


if __name__ == "__main__":
    measure(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
    write_table()
