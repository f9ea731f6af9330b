"""Intervals on 48, 40 and 8 awkward systems, written by people who had not read the method, and
on 18 with products and ratios, whose writer had, 12 whose writer had not, 10 that are symmetric
or nearly so, and 5 with a ridge, whose writers had.

``python awkward.py TRIALS RECORDINGS FIRST LAST``: for each system and each of these seeds a truth
is drawn, and as many recordings of it. Rows go to awkward.csv; a run that has its rows is not
repeated. Names of systems may follow, "blind" for the 40, "further" for the 8, "logarithms" for
the 18, "products" for the 12, "nearly" for the 10 or "ridges" for the 5; without them the 48 are run.
``python awkward.py`` alone prints how many of the intervals hold, how many runs are called converged
though they are far off, and how many of the systems with several solutions are found as such.
"""

import sys
import time
from pathlib import Path

import awkward_systems
import blind_systems
import curves
import further_systems
import logarithm_systems
import nearly_symmetric
import numpy as np
import pandas as pd
import ridge_systems
import symmetric_products

import turing_learning as tl

PATH = Path(__file__).with_name("awkward.csv")
FIELDS = (
    "system",
    "kind",
    "trials",
    "recordings",
    "seed",
    "parameter",
    "truth",
    "estimate",
    "low",
    "high",
    "holds",
    "solutions",
    "modes",
    "verdict",
    "cpu_s",
)
SETS = {
    "blind": blind_systems.SYSTEMS,
    "further": further_systems.SYSTEMS,
    "logarithms": logarithm_systems.SYSTEMS,
    "products": symmetric_products.SYSTEMS,
    "nearly": nearly_symmetric.SYSTEMS,
    "ridges": ridge_systems.SYSTEMS,
}
SYSTEMS = awkward_systems.SYSTEMS | SETS["blind"] | SETS["further"] | SETS["logarithms"]
SYSTEMS |= SETS["products"] | SETS["nearly"] | SETS["ridges"]
FAR = 5.0
"""Half-widths of the interval beyond which an estimate is far off."""


def run(name: str, trials: int, recordings: int, seed: int) -> list[dict[str, object]]:
    """Return a row for each parameter of a run."""
    system = SYSTEMS[name]
    rng = np.random.default_rng([seed, 100, *name.encode()])
    truth = {
        key: rng.uniform(low, high)
        for key, (low, high) in zip(system.ranges, system.truths, strict=True)
    }
    genuine = system.simulate(np.tile(list(truth.values()), (recordings, 1)), rng)
    begun = time.process_time()
    result = tl.infer(
        genuine=genuine,
        simulate=system.simulate,
        parameters=system.ranges,
        vectorized=True,
        trials=trials,
        seed=seed,
        settings={"run.threads": 1},
    )
    common = {
        "system": name,
        "kind": system.kind,
        "trials": trials,
        "recordings": recordings,
        "seed": seed,
        "solutions": len(system.solutions(truth)),
        "modes": len(result.modes),
        "verdict": result.verdict,
        "cpu_s": round(time.process_time() - begun, 1),
    }
    rows = []
    for key, estimate in result.estimate.items():
        low, high = result.interval[key]
        numbers = {"truth": truth[key], "estimate": estimate, "low": low, "high": high}
        holds = "" if np.isnan(low) else bool(low <= truth[key] <= high)
        rows.append(
            common
            | {"parameter": key, "holds": holds}
            | {k: f"{v:.6g}" for k, v in numbers.items()}
        )
    return rows


def summary() -> str:
    """Return what the table says, by trials and recordings, and by kind."""
    rows = pd.read_csv(PATH)
    rows["stated"] = rows.holds.notna()
    rows["held"] = rows.holds.fillna(False).astype(bool)
    half = (rows.high - rows.low) / 2
    # of several solutions each is right: an estimate is far off only where there is one
    off = (rows.estimate - rows.truth).abs() > FAR * half
    rows["far"] = off & rows.stated & (rows.solutions == 1) & (rows.verdict == "converged")
    keys = ["trials", "recordings", "seed", "system"]
    runs = rows.groupby(keys).agg(
        kind=("kind", "first"), stated=("stated", "max"), far=("far", "max"), solutions=("solutions", "first"),
        modes=("modes", "first"),
    )  # fmt: skip
    runs["several"] = runs.solutions > 1
    runs["found"] = runs.several & (runs.modes > 1)
    runs["single"] = ~runs.several & (runs.modes > 1)
    text = []
    for by in (["trials", "recordings"], ["kind"]):
        table = rows.groupby(by).agg(intervals=("stated", "sum"), hold=("held", "sum"))
        table["share"] = (table.hold / table.intervals).round(3)
        columns = runs.reset_index().groupby(by).agg(
            runs=("stated", "size"), state=("stated", "sum"), far=("far", "sum"), several=("several", "sum"),
            found=("found", "sum"), wrongly=("single", "sum"),
        )  # fmt: skip
        text.append(table.join(columns).to_string())
    systems = rows[rows.stated].groupby("system").held.agg(["size", "mean"])
    few = systems[(systems["size"] >= 40) & (systems["mean"] < 0.75)]
    text.append(
        f"systems with 40 or more intervals of which fewer than 75 % hold: {list(few.index)}"
    )
    return "\n\n".join(text) + "\n"


def main() -> None:
    """Run what the table lacks, or print what it holds."""
    if len(sys.argv) < 5:
        sys.stdout.write(summary())
        return
    trials, recordings, first, last = map(int, sys.argv[1:5])
    columns = ["system", "trials", "recordings", "seed"]
    done = pd.read_csv(PATH)[columns].drop_duplicates().values.tolist() if PATH.exists() else []
    names = sys.argv[5:] or list(awkward_systems.SYSTEMS)
    if len(names) == 1:
        names = list(SETS.get(names[0], names))
    for seed in range(first, last + 1):
        for name in names:
            if [name, trials, recordings, seed] not in done:
                curves.append(PATH, FIELDS, run(name, trials, recordings, seed))


if __name__ == "__main__":
    main()
