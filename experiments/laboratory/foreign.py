"""What runs of 200 trials say of a foreign swarm, whose robots have phases of their own, and whether mistakes are found in it.

    python experiments/laboratory/foreign.py runs fixed grid 1 4   # phases, tracker, first seed, seeds; rows of foreign.csv
    python experiments/laboratory/foreign.py faults 10             # laboratories of each kind; writes foreign-faults.csv
    python experiments/laboratory/foreign.py                       # prints how many intervals hold

Phases and trackers: see foreign_swarm.py. The test of phases was tuned on seeds 1 to 4; seeds from 11 on have other controllers.
A run takes about 10 s of one core.
"""

import csv
import math
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd
from foreign_swarm import AXLE_CM, RADIUS_CM, TOP_CM_S, Swarm, SwarmPoses

from turing_learning.robots import Equipment, Laboratory, LaboratoryError, load_laboratory
from turing_learning.runs import start_laboratory

TABLE = Path(__file__).with_name("foreign.csv")
FAULTS = Path(__file__).with_name("foreign-faults.csv")
NAMES = ("vl0", "vr0", "vl1", "vr1")
AGENTS, REPLICAS, TRIALS = 8, 2, 200
TUNED = ((0.85, 0.45, -0.4, 0.6), (-0.7, -1.0, 1.0, -1.0), (0.3, 0.9, 0.9, -0.2))
FRESH = ((0.5, -0.3, 0.2, 0.9), (-0.2, 0.8, 0.6, 0.1), (1.0, 0.7, -0.8, 0.4))
FIRST_FRESH = 11  # seed
MOST_TRIALS = 10  # in which a mistake is to be found


def laboratory_of(truth: tuple[float, ...], seed: int, trials: int) -> Laboratory:
    """Return the laboratory of the swarm's file, with an address for each robot."""
    robot = '\n[[robots]]\nname = "{0}"\nrole = "{1}"\nmarker = "{0}"\naddress = "{0}"\n'
    text = 'tracker = "none"\n'
    for number in range(AGENTS):
        text += robot.format(f"a{number}", "agent")
    for number in range(REPLICAS):
        text += robot.format(f"r{number}", "replica")
    text += "\n[interventions]\nbatteries_every = 0\n\n[scenario.robot]\n"
    text += f"maximum_speed_cm_s = {TOP_CM_S}\nwheel_distance_cm = {AXLE_CM}\n"
    text += f"radius_cm = {RADIUS_CM}\n"
    settings = {"scenario.controller": list(truth), "run.trials": trials, "run.seed": seed}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "lab.toml"
        file.write_text(text)
        return load_laboratory(file, settings | {"run.threads": 1})


def row_of(phases: str, tracker: str, truth: tuple[float, ...], seed: int) -> dict[str, object]:
    """Return the row of one run: its verdict, how many intervals it states and how many of these hold.

    And how many of those would that are read off its draws, stated or not.
    """
    laboratory = laboratory_of(truth, seed, TRIALS)
    swarm = Swarm(truth, AGENTS, REPLICAS, seed, phases)
    poses = SwarmPoses(swarm, laboratory.setup.labels, tracker, seed=seed)
    equipment = swarm.equipment([str(robot.address) for robot in laboratory.setup.linked], poses)
    with tempfile.TemporaryDirectory() as folder:
        result = start_laboratory(laboratory, Path(folder) / "run", equipment=equipment)
        draws = result.record.draws()
    low, high = np.array(list(result.interval.values())).T
    row: dict[str, object] = {"phases": phases, "tracker": tracker}
    row |= dict(zip(NAMES, truth, strict=True))
    row |= {"seed": seed, "verdict": result.verdict, "stated": int((~np.isnan(low)).sum())}
    row["holding"] = int(((low <= truth) & (truth <= high)).sum())
    row["drawn"] = row["holding of drawn"] = 0
    if draws is not None:
        low, high = np.quantile(draws, (0.05, 0.95), axis=0)
        row["drawn"] = len(low)
        row["holding of drawn"] = int(((low <= truth) & (truth <= high)).sum())
        for name, width in zip(NAMES, (high - low).round(4), strict=True):
            row[f"width of {name}"] = width
    estimate = np.array(list(result.estimate.values()))
    row["mean error"] = round(float(np.abs(estimate - truth).mean()), 4)
    return row


def runs(phases: str, tracker: str, first: int, count: int) -> None:
    """Conduct the runs that the table lacks."""
    columns = ["phases", "tracker", *NAMES, "seed", "verdict", "stated", "holding", "drawn"]
    columns += ["holding of drawn", *(f"width of {name}" for name in NAMES), "mean error"]
    done = set()
    if TABLE.exists():
        known = pd.read_csv(TABLE)[["phases", "tracker", "vl0", "seed"]]
        done = set(known.itertuples(index=False, name=None))
    for seed in range(first, first + count):
        for truth in FRESH if seed >= FIRST_FRESH else TUNED:
            if (phases, tracker, truth[0], seed) in done:
                continue
            row = row_of(phases, tracker, truth, seed)
            with TABLE.open("a", newline="") as file:
                writer = csv.DictWriter(file, columns)
                if file.tell() == 0:
                    writer.writeheader()
                writer.writerow(row)


class Frozen:
    """Headings that stay what they were in the first image."""

    def __init__(self) -> None:
        self._headings: np.ndarray | None = None

    def __call__(self, poses: np.ndarray) -> np.ndarray:
        """Return poses with these headings."""
        if self._headings is None:
            self._headings = poses[:, 2].copy()
        poses[:, 2] = self._headings
        return poses


def mirrored(poses: np.ndarray) -> np.ndarray:
    """Return headings that are clockwise."""
    return poses * [1, 1, -1]


def turned(poses: np.ndarray) -> np.ndarray:
    """Return headings of markers that are glued on across."""
    return poses + np.array([0, 0, math.pi / 2])


def in_metres(poses: np.ndarray) -> np.ndarray:
    """Return positions in metres."""
    return poses / [100, 100, 1]


def exchanged(poses: np.ndarray) -> np.ndarray:
    """Exchange the third agent and the first replica."""
    order = np.arange(len(poses))
    order[[2, AGENTS]] = AGENTS, 2
    return poses[order]


SPOILT = {
    "headings frozen": "headings look frozen",
    "headings mirrored": "headings look mirrored",
    "headings off by 90 degrees": "headings are off by about",
    "positions in metres": "positions look like metres",
    "agent and replica exchanged": "an agent executes what replica",
    "addresses of replicas exchanged": "executes what replica",
    "1 % of images lost": "",
    "right": "",
}
"""Kinds of laboratories, and what is to be said of them."""
SPOILERS = dict(zip(SPOILT, (Frozen, mirrored, turned, in_metres, exchanged), strict=False))


def outcome(kind: str, seed: int) -> tuple[int, str, int]:
    """Return at which trial a run ends with a fault, 0 for none, what it says, and how often the operator was asked."""
    truth = tuple(np.random.default_rng([seed, 9]).uniform(-1, 1, 4).round(3).tolist())
    laboratory = laboratory_of(truth, seed, 2 * MOST_TRIALS)
    swarm = Swarm(truth, AGENTS, REPLICAS, seed, "fixed")
    spoil = SPOILERS.get(kind)
    if spoil is Frozen:
        spoil = Frozen()
    lost = 0.01 if kind == "1 % of images lost" else 0.0
    poses = SwarmPoses(swarm, laboratory.setup.labels, "grid", seed=seed, lost=lost, spoil=spoil)
    addresses = [str(robot.address) for robot in laboratory.setup.linked]
    if kind == "addresses of replicas exchanged":
        addresses[-2:] = reversed(addresses[-2:])
    equipment: Equipment = swarm.equipment(addresses, poses)
    seen = []
    with tempfile.TemporaryDirectory() as folder:
        try:
            start_laboratory(
                laboratory,
                Path(folder) / "run",
                equipment=equipment,
                on_event=lambda event: seen.append(event.kind == "trial"),
                should_stop=lambda: sum(seen) >= MOST_TRIALS,
            )
        except LaboratoryError as error:
            return sum(seen) + 1, str(error), len(equipment.operator.asked)
    return 0, "", len(equipment.operator.asked)


def fault_rows(laboratories: int) -> Iterator[list[object]]:
    """Yield a row for each kind of laboratory."""
    for kind, said in SPOILT.items():
        outcomes = [outcome(kind, seed) for seed in range(1, laboratories + 1)]
        found = [number for number, _, _ in outcomes if number]
        named = 0
        for number, fault, _ in outcomes:
            if number and said and said in fault:
                named += 1
        asked = sum(asked for _, _, asked in outcomes)
        yield [kind, laboratories, len(found), named, max(found, default=""), asked]


def faults(laboratories: int) -> None:
    """Look at laboratories of each kind, and write the table."""
    with FAULTS.open("w", newline="") as file:
        writer = csv.writer(file)
        head = ["laboratory", "laboratories", "run ended", "named rightly", "latest at trial"]
        writer.writerow([*head, "operator asked"])
        for row in fault_rows(laboratories):
            writer.writerow(row)
            file.flush()


def summary() -> None:
    """Print how many intervals hold, of those that are stated and of those that are not."""
    table = pd.read_csv(TABLE)
    table["fresh"] = table["seed"] >= FIRST_FRESH
    table["runs"] = 1
    table["converged"] = table["verdict"] == "converged"
    sums = ["runs", "converged", "stated", "holding", "drawn", "holding of drawn"]
    grouped = table.groupby(["phases", "tracker", "fresh"])
    result = grouped[sums].sum().join(grouped["mean error"].median())
    sys.stdout.write(result.to_string() + "\n")


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["runs", phases, tracker, first, count]:
            runs(phases, tracker, int(first), int(count))
        case ["faults", laboratories]:
            faults(int(laboratories))
        case _:
            summary()
