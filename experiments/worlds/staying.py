"""Are lost runs of the paper's algorithm never right, or do they leave? ``python staying.py FIRST LAST [RATES]``.

Object clustering, preset `authors`, in the paper's world, 1000 generations with seeds FIRST to LAST, as in runs.py. A row of
staying.csv is a run: the first generation in which the median of the models' mean absolute errors is below 0.1, the share of
the generations 401 to 1000 in which it is, and that in which the subjectively best model is as near; and both errors in
the last generation. A run takes one to two minutes. One that has its row is not repeated.

RATES are the learning rates of the step sizes: "group", as in TL_source (the default), or "textbook", twice as large: 1 / sqrt(2 n)
and 1 / sqrt(2 sqrt(n)), as in Eiben and Smith (2003), Introduction to Evolutionary Computing, which the paper cites. They are the
setting `adaptation`, which was none when the table was made: its strategy was a subclass with both rates doubled.
"""

import csv
import sys
from pathlib import Path

import numpy as np

import turing_learning as tl

TABLE = Path(__file__).parent / "staying.csv"
GENERATIONS = 1000
SETTLED = 400
"""Generations after which the paper's models have converged (section 4.3)."""
NEAR = 0.1
HEADER = ("rates", "seed", "first", "share_median", "share_best", "last_median", "last_best")


ADAPTATION = {"group": 0.5, "textbook": 1.0}
"""Rates -> what multiplies those of the textbook."""


def row(rates: str, seed: int) -> list[str]:
    """Return the row of a run."""
    settings = {"scenario.world": "paper", "run.threads": 1}
    for population in ("models", "classifiers"):
        settings[f"{population}.adaptation"] = ADAPTATION[rates]
    result = tl.infer(
        "object-clustering",
        preset="authors",
        generations=GENERATIONS,
        seed=seed,
        settings=settings,
        progress=False,
    )
    history = result.history.load()
    truth = np.array(tl.swarm.SCENARIOS["object-clustering"].controller)
    median = np.median(np.abs(history["model"].to_numpy() - truth).mean(axis=-1), axis=1)
    best = np.abs(history["best_model"].to_numpy() - truth).mean(axis=-1)
    near = np.flatnonzero(median < NEAR)
    first = str(near[0] + 1) if len(near) else ""
    numbers = (
        (median[SETTLED:] < NEAR).mean(),
        (best[SETTLED:] < NEAR).mean(),
        median[-1],
        best[-1],
    )
    return [rates, str(seed), first, *(f"{number:.3f}" for number in numbers)]


def main() -> None:
    """Execute the runs that the table lacks."""
    first, last = map(int, sys.argv[1:3])
    rates = sys.argv[3] if len(sys.argv) > 3 else "group"
    done = set()
    if TABLE.exists():
        with TABLE.open(newline="") as file:
            done = {(line["rates"], int(line["seed"])) for line in csv.DictReader(file)}
    for seed in range(first, last + 1):
        if (rates, seed) in done:
            continue
        values = row(rates, seed)
        with TABLE.open("a", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            if file.tell() == 0:
                writer.writerow(HEADER)
            writer.writerow(values)


if __name__ == "__main__":
    main()
