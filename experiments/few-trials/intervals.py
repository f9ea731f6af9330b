"""Intervals that runs of trials state: ``python intervals.py TRIALS FIRST LAST CASE...``; rows for each run in intervals.csv.

Cases: walker-K, the walker with K recordings; two-state and three-state, the random controller of curves.py whose number is the
seed. A run that has its rows is not repeated. ``python intervals.py`` alone prints how many intervals hold.
"""

import csv
import sys
from itertools import groupby
from pathlib import Path

import curves
import numpy as np
import walker

import turing_learning as tl

PATH = Path(__file__).with_name("intervals.csv")
FIELDS = (
    "case",
    "trials",
    "seed",
    "parameter",
    "truth",
    "estimate",
    "low",
    "high",
    "deviation",
    "likelihood",
    "error",
    "seconds",
)
KNOWN = (
    "v0",
    "tau_v",
    "sig_v",
    "tau_w",
)  # of the walker; gain and noise are known by their product, r_att is not


def run(case: str, trials: int, seed: int) -> list[dict[str, object]]:
    """Return the rows of one run."""
    kind, _, number = case.rpartition("-")
    settings, likelihood, errors = {"run.threads": 1}, {}, {}
    if kind == "walker":
        genuine = walker.simulate(
            np.tile(walker.TRUTH, (int(number), 1)), np.random.default_rng([seed, int(number)])
        )
        best, deviations = walker.maximum_likelihood(genuine)
        likelihood, errors = (
            dict(zip((*KNOWN, "gain x noise"), each, strict=True)) for each in (best, deviations)
        )
        ranges = dict(
            zip(
                walker.NAMES,
                zip(walker.LOW.tolist(), walker.HIGH.tolist(), strict=True),
                strict=True,
            )
        )
        result = tl.infer(
            genuine=genuine, simulate=walker.simulate, parameters=ranges, vectorized=True, held_out=0.0,
            trials=trials, seed=seed, settings=settings,
        )  # fmt: skip
        truth = dict(zip(walker.NAMES, walker.TRUTH, strict=True)) | {"gain x noise": 1.2}
    else:
        agents = curves.system(f"{case}-{seed}")
        result = tl.infer(agents, trials=trials, seed=seed, settings=settings)
        truth = dict(zip(result.estimate, agents.controller, strict=True))
    columns = {}
    if result.covariance is not None:
        columns = dict(zip(result.estimate, result.draws().T, strict=True))
        if kind == "walker":
            columns["gain x noise"] = columns["gain"] * columns["noise"]
    rows = []
    for name, true in truth.items():
        draws = columns.get(name, np.full(1, np.nan))
        ends = result.interval.get(name) or np.quantile(draws, (0.05, 0.95))
        stated = result.estimate.get(name, float(np.median(draws)))
        more = (
            draws.std(),
            likelihood.get(name, np.nan),
            errors.get(name, np.nan),
            result.seconds_total,
        )
        values = (case, trials, seed, name, true, stated, *ends, *more)
        rows.append(
            dict(
                zip(
                    FIELDS, (f"{v:.6g}" if isinstance(v, float) else v for v in values), strict=True
                )
            )
        )
    return rows


def summary(rows: list[dict[str, str]]) -> None:
    """Print, for each kind of case and number of trials, how many runs give intervals, and how many of these hold the truth."""

    def kind(row: dict[str, str]) -> tuple[str, str]:
        return row["case"], row["trials"]

    for (case, trials), group in groupby(sorted(rows, key=kind), key=kind):
        own = [row for row in group if row["parameter"] not in ("gain", "noise", "r_att")]
        given = [row for row in own if row["low"] != "nan"]
        held = sum(float(row["low"]) <= float(row["truth"]) <= float(row["high"]) for row in given)
        runs, settled = (len({row["seed"] for row in some}) for some in (own, given))
        widths = [
            float(row["deviation"]) / float(row["error"]) for row in given if row["error"] != "nan"
        ]
        width = f", median deviation {np.median(widths):.1f} standard errors" if widths else ""
        sys.stdout.write(
            f"{case}, {trials} trials: {settled} of {runs} runs give intervals, {held} of {len(given)} hold{width}\n"
        )


def main() -> None:
    """Run what the table lacks, or print what it holds."""
    rows = list(csv.DictReader(PATH.open())) if PATH.exists() else []
    if len(sys.argv) < 5:
        summary(rows)
        return
    trials, first, last = map(int, sys.argv[1:4])
    done = {(row["case"], int(row["trials"]), int(row["seed"])) for row in rows}
    for seed in range(first, last + 1):
        for case in sys.argv[4:]:
            if (case, trials, seed) not in done:
                curves.append(PATH, FIELDS, run(case, trials, seed))


if __name__ == "__main__":
    main()
