"""What `check` says of runs of trials: ``python checks.py FIRST LAST``; a row for each check in checks.csv.

The model is an offset with white noise, and a parameter without effect. Right: so are the recordings; wrong: their noise has a
memory. A check that has its row is not repeated.
"""

import csv
import sys
from pathlib import Path

import curves
import numpy as np

import turing_learning as tl
from turing_learning.identifiability import Effort

PATH = Path(__file__).with_name("checks.csv")
FIELDS = ("case", "seed", "fault", "accuracy", "offset_pinned_down", "inert_pinned_down")
EFFORT = Effort(samples=100, generations=60, population=20, points=6, profile_generations=40, profile_population=20)
RANGES = {"offset": (0.0, 20.0), "inert": (0.0, 20.0)}
TRIALS, RECORDINGS, STEPS = 300, 200, 12


def simulate(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return samples (M, 12, 1) of models (M, 2)."""
    return parameters[:, :1, None] + rng.normal(0, 3, (len(parameters), STEPS, 1))


def check(case: str, seed: int) -> dict[str, object]:
    """Return the row of one check."""
    rng = np.random.default_rng([seed, 7])
    genuine = simulate(np.full((RECORDINGS, 2), 7.0), rng)
    if case == "wrong":
        noise = genuine[..., 0] - 7
        for step in range(1, STEPS):
            noise[:, step] = 0.8 * noise[:, step - 1] + 0.6 * noise[:, step]
        genuine = 7 + noise[..., None]
    settings = {"run.threads": 1}
    result = tl.infer(
        genuine=genuine, simulate=simulate, parameters=RANGES, trials=TRIALS, seed=seed, settings=settings
    )
    found = result.check(effort=EFFORT, seed=seed)
    offset, inert = found.parameters
    values = (case, seed, found.fault, f"{found.test.accuracy:.4f}", offset.pinned_down, inert.pinned_down)
    return dict(zip(FIELDS, values, strict=True))


def main(first: int, last: int) -> None:
    """Make the checks that the table lacks."""
    rows = list(csv.DictReader(PATH.open())) if PATH.exists() else []
    done = {(row["case"], int(row["seed"])) for row in rows}
    for seed in range(first, last + 1):
        for case in ("right", "wrong"):
            if (case, seed) not in done:
                curves.append(PATH, FIELDS, [check(case, seed)])


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
