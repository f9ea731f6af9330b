"""The zebrafish of examples/zebrafish.py against both families of models at their estimates. Rows of zebrafish.csv.

Run with ``python experiments/examination/zebrafish.py``.
"""

import csv
import sys
import time
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np

import turing_learning as tl
from turing_learning.trajectories import Trajectories

ROOT = Path(__file__).parents[2]
TABLE = Path(__file__).parent / "zebrafish.csv"
ESTIMATES = ROOT / "docs" / "results" / "zebrafish.csv"
STEPS = 3000
"""Of the simulated recording, at 10 frames per second."""

sys.path.insert(0, str(ROOT / "examples"))
import zebrafish as example  # noqa: E402 - found by the line above


def main() -> None:
    """Test both families and write a row for each."""
    fish = example.recording()
    windows = fish.windows(length_s=example.WINDOW_S, signals=example.SIGNALS)
    estimates: dict[str, list[float]] = defaultdict(list)
    for row in csv.DictReader(ESTIMATES.open()):
        estimates[row["family"]].append(float(row["estimate"]))
    with TABLE.open("w") as file:
        writer = csv.writer(file, lineterminator="\n")
        names = [
            "accuracy",
            "low",
            "high",
            "p_value",
            "power_accuracy",
            "control",
            "processor_s",
            "told_by",
        ]
        writer.writerow(["family", *names])
        for name, family in example.families(fish, windows).items():
            longer = replace(family, steps=STEPS)
            positions = longer.simulate(np.array([estimates[name]]), np.random.default_rng(45))[0]
            present = np.ones(positions.shape[:2], dtype=bool)
            simulated = Trajectories(positions, present, longer.fps, fish.individuals)
            begin = time.process_time()
            found = tl.test(fish, simulated, names=example.SIGNALS, control=True)
            seconds = time.process_time() - begin
            control = found.control.accuracy if found.control else float("nan")
            numbers = [
                found.accuracy,
                *found.examined.interval,
                found.p_value,
                found.examined.power_accuracy,
                control,
            ]
            told_by = "; ".join(f"{each.what} ({each.words})" for each in found.telling[:3])
            writer.writerow(
                [
                    name,
                    *(f"{number or np.nan:.3f}" for number in numbers),
                    f"{seconds:.0f}",
                    told_by,
                ]
            )
            file.flush()


if __name__ == "__main__":
    main()
