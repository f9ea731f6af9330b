"""What `check` says at little effort of right models, wrong ones, and searches that fail; rows of verdicts.csv.

Run with ``python experiments/examination/verdicts.py FIRST LAST`` for some seeds; without arguments it prints
the shares. Right models have a parameter without effect. Wrong models lack one mechanism of the system, at
the same parameters. Failed searches have 20 trials. A row that is there is not made again.
"""

import csv
import sys
from pathlib import Path
from time import process_time

import numpy as np
import pandas as pd
import systems

import turing_learning as tl
from turing_learning.identifiability import Effort

TABLE = Path(__file__).with_name("verdicts.csv")
FIELDS = (
    "case",
    "system",
    "seed",
    "run_says",
    "verdict",
    "fits",
    "accuracy",
    "margin",
    "pinned_down",
    "inert_pinned_down",
    "check_s",
)
LITTLE = {"samples": 80, "references": 8}
TRIALS, FEWER = 300, 20
SAMPLES = 150


def check(case: str, name: str, seed: int) -> dict[str, object]:
    """Return the row of one check."""
    system = (systems.TUNED | systems.REPORTED)[name]
    ranges = dict(system.ranges)
    if case == "right":
        ranges["inert"] = (0.0, 1.0)
    source = system.system if case == "wrong" else system.right
    rng = np.random.default_rng([seed, 45])
    genuine = source(np.tile(system.truth, (SAMPLES, 1)), rng)
    trials = FEWER if case == "failed" else TRIALS
    settings = {"run.threads": 1}
    result = tl.infer(
        genuine=genuine,
        simulate=system.right,
        parameters=ranges,
        trials=trials,
        seed=seed,
        settings=settings,
    )
    said = result.verdict  # later it is that of the check
    effort = Effort(**LITTLE, points=6 if case == "right" else 0)
    began = process_time()
    found = result.check(effort=effort, seed=seed, recoveries=3 if case == "failed" else 0)
    took = process_time() - began
    own = {each.parameter: each.pinned_down for each in found.parameters}
    inert = own.pop("inert", None)
    margin = found.judgment.margin
    values = (
        case,
        name,
        seed,
        said,
        found.verdict,
        found.judgment.fits,
        f"{found.test.accuracy:.3f}",
        "" if margin is None else f"{margin:.3f}",
        f"{sum(own.values())} of {len(own)}" if case == "right" else "",
        inert,
        f"{took:.1f}",
    )
    return dict(zip(FIELDS, values, strict=True))


def main(first: int, last: int) -> None:
    """Make the rows of some seeds that the table lacks; systems take turns."""
    names = [*systems.REPORTED]
    for seed in range(first, last + 1):
        name = names[seed % len(names)]
        for case in ("wrong", "right", "failed"):
            rows = list(csv.DictReader(TABLE.open())) if TABLE.exists() else []
            if (case, str(seed)) in {(row["case"], row["seed"]) for row in rows}:
                continue
            row = check(case, name, seed)
            new = not TABLE.exists()
            with TABLE.open("a") as file:
                writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
                if new:
                    writer.writeheader()
                writer.writerow(row)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(*map(int, sys.argv[1:3]))
    else:
        table = pd.read_csv(TABLE, keep_default_na=False)
        for columns in (["case", "run_says", "fits", "verdict"], ["case", "inert_pinned_down"]):
            sys.stdout.write(f"{table.groupby(columns).size()}\n")
