"""The emulated laboratory with a budget in trials: ``python laboratory.py TRIALS FIRST LAST``; a row per run in laboratory.csv.

Robots, camera and arena are those of ``turing-learning reproduce 5``: 8 agents, 2 replicas, 5 s observed of each trial. A run
that has its row is not repeated; one that was interrupted begins anew. ``python laboratory.py`` alone prints the errors.
"""

import sys
import tempfile
import time
from pathlib import Path

import curves
import numpy as np
import pandas as pd

from turing_learning.robots import load_laboratory, overhead_camera, rehearse
from turing_learning.runs import start_laboratory

PATH = Path(__file__).with_name("laboratory.csv")
FIELDS = (
    "trials",
    "seed",
    "parameter",
    "truth",
    "estimate",
    "low",
    "high",
    "error",
    "verdict",
    "cpu_s",
)
ROBOTS = [
    f'[[robots]]\nname = "agent-{k}"\nrole = "agent"\nmarker = "blue"\n' for k in range(1, 9)
] + [
    f'[[robots]]\nname = "replica-{k}"\nrole = "replica"\nmarker = "{marker}"\naddress = "replica-{k}"\n'
    for k, marker in ((1, "orange"), (2, "purple"))
]


def run(trials: int, seed: int) -> list[dict[str, object]]:
    """Return the rows of one run."""
    begun = time.process_time()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        overhead_camera().save(folder / "camera.json")
        file = '[camera]\ncalibration = "camera.json"\n\n[evaluation]\nrepeats = 0\n\n' + "\n".join(
            ROBOTS
        )
        (folder / "lab.toml").write_text(file, encoding="utf-8")
        settings = {"run.trials": trials, "run.seed": seed, "run.threads": 1}
        laboratory = load_laboratory(folder / "lab.toml", settings)
        result = start_laboratory(laboratory, folder / "run", equipment=rehearse(laboratory))
    truth = dict(
        zip(result.estimate, (-0.7, -1.0, 1.0, -1.0), strict=True)
    )  # of the emulated agents
    rows = []
    for parameter, value in truth.items():
        low, high = result.interval[parameter]
        error = abs(result.estimate[parameter] - value)
        numbers = {
            "truth": value,
            "estimate": result.estimate[parameter],
            "low": low,
            "high": high,
            "error": error,
        }
        numbers["cpu_s"] = time.process_time() - begun
        words = {"trials": trials, "seed": seed, "parameter": parameter, "verdict": result.verdict}
        rows.append(words | {key: f"{number:.5g}" for key, number in numbers.items()})
    return rows


def summary() -> None:
    """Print mean absolute errors with their standard errors, and how many intervals hold the truth."""
    rows = pd.read_csv(PATH)
    rows["given"], rows["held"] = (
        rows.low.notna(),
        (rows.low <= rows.truth) & (rows.truth <= rows.high),
    )
    table = rows.groupby(["trials", "parameter"], sort=False).agg(
        runs=("error", "size"), mean=("error", "mean"), standard_error=("error", "sem"), worst=("error", "max"),
        given=("given", "sum"), held=("held", "sum"),
    )  # fmt: skip
    sys.stdout.write(table.to_string(float_format="{:.4f}".format) + "\n")


def main(trials: int, first: int, last: int) -> None:
    """Run what the table lacks."""
    done = (
        pd.read_csv(PATH)[["trials", "seed"]].drop_duplicates().to_numpy().tolist()
        if PATH.exists()
        else []
    )
    for seed in np.arange(first, last + 1).tolist():
        if [trials, seed] not in done:
            curves.append(PATH, FIELDS, run(trials, seed))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(*(int(word) for word in sys.argv[1:4]))
    else:
        summary()
