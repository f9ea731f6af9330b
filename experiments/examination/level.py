"""How often does the panel tell real motion from real motion? Rows of level-trials.csv, and level.csv of all of them.

Run with ``python experiments/examination/level.py``; a number says how many splits of each system are made. What is there
already is not done again.
"""

import csv
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

import turing_learning as tl
from turing_learning.examination import QUICK, Examined, examine
from turing_learning.families import Couzin
from turing_learning.trajectories import Trajectories

HERE = Path(__file__).parent
TRIALS, TABLE = HERE / "level-trials.csv", HERE / "level.csv"
DATA = HERE.parents[1] / "tests" / "reference" / "data" / "tracktor"
SPLITS = 400
SIGNALS = ("speed", "turn", "neighbor_distance")
BLOCK_S = {"zebrafish": 25.0, "termites": 11.0}
LASTING = 0.2
"""Standard deviation of the logarithm of how much farther an individual moves in each step than others."""


def recording(name: str) -> Trajectories:
    """Return five zebrafish (frame rate and scale are assumed) or eight termites (the scale is not known)."""
    if name == "zebrafish":
        path = DATA / "zebrafish_video_idtracked.txt"
        return tl.load_trajectories(path, fps=30, pixels_per_cm=20).bridged(max_gap=5).thinned(3)
    path = DATA / "termite_video_idtracked.txt"
    return tl.load_trajectories(path, fps=25, pixels_per_cm="unknown").bridged(max_gap=5)


@cache
def windows_of(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return windows of a recording (K, T, 3), and in which block of time each is."""
    own = recording(name)
    windows = own.windows(length_s=5.0, signals=SIGNALS, hold_out=0.0)
    return windows.learning, (windows.learning_index[:, 1] / own.fps // BLOCK_S[name]).astype(int)


def halves(name: str, rng: np.random.Generator) -> Examined:
    """Examine one half of the blocks of time of a recording, drawn at random, against the other."""
    windows, blocks = windows_of(name)
    labels = rng.permutation(np.unique(blocks))
    first = np.isin(blocks, labels[: len(labels) // 2])
    sides = windows[first], windows[~first]
    owners = blocks[first], blocks[~first]
    return examine(
        *sides, groups=owners, names=SIGNALS, examiners=QUICK, seed=int(rng.integers(2**31))
    )


def shoal(individuals: int, frames: int, rng: np.random.Generator) -> Trajectories:
    """Return a Couzin group whose individuals differ lastingly in how far they move."""
    family = Couzin(individuals=individuals, steps=frames - 2, interval_s=0.1, settling_steps=100)
    positions = family.simulate(np.array([[5.0, 3.0, 1.0, 4.0, 8.0, 0.15]]), rng)[0]
    farther = np.exp(LASTING * rng.standard_normal(individuals))[:, None]
    positions = positions[:1] + farther * (positions - positions[:1])
    names = tuple(f"fish {k}" for k in range(individuals))
    return Trajectories(positions, np.ones(positions.shape[:2], dtype=bool), 10.0, names)


def shoals(recordings: int, individuals: int) -> Callable[[np.random.Generator], Examined]:
    """Return what examines so many new groups against as many others."""

    def made(rng: np.random.Generator) -> Examined:
        sides = [[shoal(individuals, 300, rng) for _ in range(recordings)] for _ in range(2)]
        return tl.test(*sides, examiners=QUICK, seed=int(rng.integers(2**31))).examined

    return made


def walkers(individuals: int, each: int) -> Callable[[np.random.Generator], Examined]:
    """Return what examines walkers that differ lastingly in their mean speed, with some samples of each."""

    def made(rng: np.random.Generator) -> Examined:
        sides = []
        for _ in range(2):
            level = np.repeat(0.5 * rng.standard_normal(individuals), each)
            samples = rng.standard_normal((len(level), 50, 2))
            samples[..., 0] += level[:, None]
            sides.append(samples)
        owners = np.repeat(np.arange(individuals), each)
        return examine(
            *sides, groups=(owners, owners), examiners=QUICK, seed=int(rng.integers(2**31))
        )

    return made


SYSTEMS: dict[str, Callable[[np.random.Generator], Examined]] = {
    "zebrafish, halves of the blocks of time": lambda rng: halves("zebrafish", rng),
    "termites, halves of the blocks of time": lambda rng: halves("termites", rng),
    "6 Couzin groups of 5 against 6": shoals(6, 5),
    "1 Couzin group of 10 against 1": shoals(1, 10),
    "60 walkers against 60, one sample each": walkers(60, 1),
    "8 walkers against 8, 10 samples each": walkers(8, 10),
    "3 Couzin groups of 5 against 3": shoals(3, 5),
}


def main() -> None:
    """Do what is missing, and write the table."""
    splits = int(sys.argv[1]) if len(sys.argv) > 1 else SPLITS
    rows = list(csv.reader(TRIALS.open())) if TRIALS.exists() else []
    done = {(row[0], int(row[1])) for row in rows}
    for split in range(splits):
        for place, (name, system) in enumerate(SYSTEMS.items()):
            if (name, split) in done:
                continue
            found = system(np.random.default_rng((45, place, split)))
            power = "" if found.power_accuracy is None else f"{found.power_accuracy:.3f}"
            row = [
                name,
                split,
                f"{found.accuracy:.4f}",
                f"{found.p_value:.4f}",
                power,
                found.grouping,
            ]
            with TRIALS.open("a") as file:
                csv.writer(file, lineterminator="\n").writerow(row)
    write_table(list(csv.reader(TRIALS.open())))


def write_table(rows: list[list[str]]) -> None:
    """Write how often the panel rejects, by system."""
    with TABLE.open("w") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            [
                "system",
                "splits",
                "mean_accuracy",
                "rejected_at_0.05",
                "rejected_at_0.01",
                "power_accuracy",
            ]
        )
        for name in SYSTEMS:
            own = [row for row in rows if row[0] == name]
            p_values = np.array([float(row[3]) for row in own])
            accuracy = np.mean([float(row[2]) for row in own])
            power = np.median([float(row[4] or np.nan) for row in own])
            shares = [f"{(p_values <= level).mean():.3f}" for level in (0.05, 0.01)]
            writer.writerow([name, len(own), f"{accuracy:.3f}", *shares, f"{power:.3f}"])


if __name__ == "__main__":
    main()
