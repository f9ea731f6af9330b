"""Errors of the paper's algorithm as it is, in today's world and in the paper's: ``python runs.py [FIRST LAST]``.

Preset `paper` keeps to the text: no archive, no renewal, no jumps, no memory. Preset `authors` adds the published settings of
TL_source (repository wawachen/Turing_learning): step sizes of at least 0.01, a start at zero. Runs of 1000 generations with
seeds FIRST to LAST, 2001 to 2030 by default, as in experiments/4.3, which has the preset `paper` in the world "enki" already.

A run is kept in build/worlds until it is done, and resumed from there; its errors are appended to runs.csv, and it is not
repeated. A run takes a minute of a processor. After each one runs-summary.csv is written: mean and standard
deviation of each parameter's error, beside what is printed.
"""

import csv
import sys
from collections import defaultdict
from pathlib import Path
from shutil import rmtree

import numpy as np

import turing_learning as tl

HERE = Path(__file__).parent
RUNS = HERE / "runs.csv"
WORK = HERE.parents[1] / "build" / "worlds"
GENERATIONS = 1000
NAMES = ("vl0", "vr0", "vl1", "vr1", "vl2", "vr2")
CELLS = (
    (
        ("object-clustering", "authors", "paper"),
        ("aggregation", "authors", "paper"),
        ("object-clustering", "paper", "paper"),
        ("aggregation", "paper", "paper"),
    ),
    (("object-clustering", "authors", "enki"), ("aggregation", "authors", "enki")),
)  # scenario, preset, world: each with runs of all seeds, group by group, seed by seed
KEYS = ("scenario", "preset", "world", "seed")
PRINTED = {
    "aggregation": ((0.01, 0.01, 0.07, 0.06), (0.01, 0.01, 0.07, 0.04)),
    "object-clustering": (
        (0.03, 0.04, 0.02, 0.03, 0.08, 0.08),
        (0.03, 0.03, 0.02, 0.03, 0.13, 0.09),
    ),
}  # mean and standard deviation of the absolute errors, paper, section 4.3


def finished() -> list[dict[str, str]]:
    """Return the rows of all runs that are done."""
    if not RUNS.exists():
        return []
    with RUNS.open(newline="") as file:
        return list(csv.DictReader(file))


def execute(scenario: str, preset: str, world: str, seed: int) -> None:
    """Execute or resume a run, and append its errors."""
    out = WORK / f"{scenario}-{preset}-{world}-{seed}"
    if out.exists():
        result = tl.resume(out, progress=False)
    else:
        settings = {"scenario.world": world, "run.threads": 1, "run.history": "thin"}
        given = {"preset": preset, "generations": GENERATIONS, "seed": seed, "settings": settings}
        result = tl.infer(scenario, out=out, progress=False, **given)
    errors = result.to_json()["absolute_error"]
    with RUNS.open("a", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        if file.tell() == 0:
            writer.writerow([*KEYS, *NAMES])
        row = [f"{errors[name]:.6g}" if name in errors else "" for name in NAMES]
        writer.writerow([scenario, preset, world, seed, *row])
    rmtree(out)


def write_summary() -> None:
    """Write mean and standard deviation of the errors of each kind of run."""
    kinds = defaultdict(list)
    for row in finished():
        kinds[row["scenario"], row["preset"], row["world"]].append(
            [float(row[name]) for name in NAMES if row[name]]
        )
    with (HERE / "runs-summary.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        names = [
            "parameter",
            "runs",
            "mean",
            "standard_deviation",
            "median",
            "paper_mean",
            "paper_standard_deviation",
        ]
        writer.writerow([*KEYS[:3], *names, "mae_below_0.1"])
        for kind, found in sorted(kinds.items()):
            errors = np.array(found)
            good = int((errors.mean(axis=1) < 0.1).sum())
            for k, name in enumerate(NAMES[: errors.shape[1]]):
                values = errors[:, k]
                numbers = values.mean(), values.std(ddof=min(1, len(values) - 1)), np.median(values)
                printed = [of[k] for of in PRINTED[kind[0]]]
                writer.writerow(
                    [
                        *kind,
                        name,
                        len(values),
                        *(f"{number:.4f}" for number in numbers),
                        *printed,
                        good,
                    ]
                )


if __name__ == "__main__":
    first, last = map(int, sys.argv[1:3]) if len(sys.argv) > 2 else (2001, 2030)
    done = {tuple(row[name] for name in KEYS) for row in finished()}
    for cells in CELLS:
        for number in range(first, last + 1):
            for cell in cells:
                if (*cell, str(number)) not in done:
                    execute(*cell, number)
                    write_summary()
    write_summary()
