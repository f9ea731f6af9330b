"""What `check` says of runs of trials: ``python checks.py FIRST LAST``; a row for each check in checks.csv.

The model is an offset with white noise, and a parameter without effect. Right: so are the recordings; wrong: their noise has a
memory. Failed: four offsets, each of a quarter of the time, are sought in 20 trials. With little effort; right-default and
wrong-default: with the default effort, without profiles. A check that has its row is not repeated.
``python checks.py`` alone prints what was said.
"""

import csv
import sys
from dataclasses import replace
from pathlib import Path

import curves
import numpy as np
import pandas as pd

import turing_learning as tl
from turing_learning.identifiability import Effort

PATH = Path(__file__).with_name("checks.csv")
FIELDS = (
    "case",
    "seed",
    "fits",
    "fault",
    "search_succeeds",
    "accuracy",
    "offset_pinned_down",
    "inert_pinned_down",
)
EFFORT = Effort(samples=100, points=6)
RANGES = {"offset": (0.0, 20.0), "inert": (0.0, 20.0)}
TRIALS, RECORDINGS, STEPS = 300, 200, 12
OFFSETS, FEWER = (4.0, 7.0, 12.0, 15.0), 20


def simulate(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return samples (M, 12, 1) of models (M, 2), or (M, 4) with four offsets."""
    offsets = parameters if parameters.shape[1] == len(OFFSETS) else parameters[:, :1]
    return np.repeat(offsets, STEPS // offsets.shape[1], axis=1)[..., None] + rng.normal(
        0, 3, (len(offsets), STEPS, 1)
    )


def check(asked: str, seed: int) -> dict[str, object]:
    """Return the row of one check."""
    case, _, default = asked.partition("-")
    rng, failed = np.random.default_rng([seed, 7]), case == "failed"
    truth = OFFSETS if failed else (7.0, 7.0)
    genuine = simulate(np.tile(truth, (RECORDINGS, 1)), rng)
    if case == "wrong":
        noise = genuine[..., 0] - 7
        for step in range(1, STEPS):
            noise[:, step] = 0.8 * noise[:, step - 1] + 0.6 * noise[:, step]
        genuine = 7 + noise[..., None]
    result = tl.infer(
        genuine=genuine, simulate=simulate, trials=FEWER if failed else TRIALS, seed=seed, settings={"run.threads": 1},
        parameters=dict.fromkeys(("a", "b", "c", "d"), (0.0, 20.0)) if failed else RANGES,
    )  # fmt: skip
    effort = Effort(points=0) if default else replace(EFFORT, points=0) if failed else EFFORT
    found = result.check(effort=effort, seed=seed)
    pinned = (
        (None, None) if failed or default else tuple(each.pinned_down for each in found.parameters)
    )
    judgment = found.judgment
    said = judgment.fits, judgment.fault, judgment.search_succeeds, f"{found.test.accuracy:.4f}"
    return dict(zip(FIELDS, (asked, seed, *said, *pinned), strict=True))


def main(first: int, last: int) -> None:
    """Make the checks that the table lacks."""
    rows = list(csv.DictReader(PATH.open())) if PATH.exists() else []
    done = {(row["case"], int(row["seed"])) for row in rows}
    for seed in range(first, last + 1):
        for case in ("right", "wrong", "failed", "right-default", "wrong-default"):
            if (case, seed) not in done:
                curves.append(PATH, FIELDS, [check(case, seed)])


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(*map(int, sys.argv[1:3]))
    else:
        rows = pd.read_csv(PATH, keep_default_na=False)
        sys.stdout.write(f"{rows.groupby(['case', 'fits', 'fault', 'search_succeeds']).size()}\n")
