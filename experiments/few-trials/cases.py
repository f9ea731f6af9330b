"""Runs of trials beside runs by generations, in cases that nothing was tuned on: ``python cases.py TRIALS FIRST LAST CASE...``.

Cases: the families of examples/recovery.py, where the seed is also the number of the recording; own-system, the walkers of
docs/own-system.md; the systems of literature.py, with 100 recordings of a truth that the seed draws; scenarios by name;
two-state and three-state, the random controller of curves.py whose number is the seed.

Rows go to cases.csv; a run that has its rows is not repeated. ``python cases.py`` alone prints the median error beside
that of the single runs by generations on the same recordings (docs/results/recovery-pools.csv).
"""

import sys
import time
from pathlib import Path

import curves
import literature
import numpy as np
import pandas as pd

import turing_learning as tl

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "examples"))

import recovery  # noqa: E402

PATH = Path(__file__).with_name("cases.csv")
FIELDS = (
    "case",
    "trials",
    "seed",
    "parameter",
    "truth",
    "estimate",
    "matched",
    "low",
    "high",
    "error",
    "verdict",
    "cpu_s",
)
WALKERS = {"speed": (0.0, 20.0), "turn_noise": (0.0, 3.0)}


def walk(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return speed and turn (M, 50, 2) of walkers that differ in mean speed and in how much they turn (M, 2)."""
    speed, turn_noise = parameters.T[:, :, None]
    shape = (len(parameters), 50)
    return np.stack(
        [speed + rng.standard_normal(shape), turn_noise * rng.standard_normal(shape)], axis=-1
    )


def run(case: str, trials: int, seed: int) -> list[dict[str, object]]:
    """Return a row for each parameter of a run; `error` is a share of the range of the first models."""
    begun, settings = time.process_time(), {"run.threads": 1}
    if case in recovery.CASES:
        known = recovery.CASES[case]
        result = tl.infer(
            genuine=known.family.observe(known.truth, groups=recovery.GROUPS, rng=np.random.default_rng([seed, 100])),
            simulate=known.family, parameters=known.family.parameters, signals=known.family.signals,
            trials=trials, seed=seed, settings=settings,
        )  # fmt: skip
        truth = known.truth
        widths = {name: one.high - one.low for name, one in known.family.parameters.items()}
    elif case == "own-system":
        genuine = walk(np.tile([6.0, 0.6], (100, 1)), np.random.default_rng([seed, 100]))
        result = tl.infer(
            genuine=genuine,
            simulate=walk,
            parameters=WALKERS,
            trials=trials,
            seed=seed,
            settings=settings,
        )
        truth, widths = (
            dict(zip(WALKERS, (6.0, 0.6), strict=True)),
            {"speed": 20.0, "turn_noise": 3.0},
        )
    elif case in literature.SYSTEMS:
        system, rng = literature.SYSTEMS[case], np.random.default_rng([seed, 100])
        truth = system.truth(rng)
        genuine = system.simulate(np.tile(list(truth.values()), (100, 1)), rng)
        result = tl.infer(
            genuine=genuine, simulate=system.simulate, parameters=system.ranges, vectorized=True, held_out=0.0,
            trials=trials, seed=seed, settings=settings,
        )  # fmt: skip
        widths = {name: high - low for name, (low, high) in system.ranges.items()}
    else:
        agents = curves.system(case if case in tl.swarm.SCENARIOS else f"{case}-{seed}")
        result = tl.infer(agents, trials=trials, seed=seed, settings=settings)
        truth = {name: row["truth"] for name, row in result.to_dataframe().T.to_dict().items()}
        widths = dict.fromkeys(truth, 2.0)
    common = {"case": case, "trials": trials, "seed": seed, "verdict": result.verdict}
    cpu_s = round(time.process_time() - begun, 1)
    draws = (
        dict.fromkeys(truth, np.nan)
        if result.covariance is None
        else dict(zip(truth, np.median(result.draws(), axis=0), strict=True))
    )
    rows = []
    for name, estimate in result.estimate.items():
        low, high = result.interval[name]
        error = abs(estimate - truth[name]) / widths[name]
        numbers = {
            "truth": truth[name],
            "estimate": estimate,
            "matched": draws[name],
            "low": low,
            "high": high,
            "error": error,
        }
        rows.append(
            common
            | {"parameter": name, "cpu_s": cpu_s}
            | {k: f"{v:.6g}" for k, v in numbers.items()}
        )
    return rows


def summary() -> pd.DataFrame:
    """Return, for each parameter, median errors of both ways, and how many of the intervals that were given hold the truth."""
    rows = pd.read_csv(PATH)
    rows["given"] = rows.low.notna()
    rows["held"] = (rows.low <= rows.truth) & (rows.truth <= rows.high)
    table = rows.groupby(["case", "trials", "parameter"], sort=False).agg(
        runs=("error", "size"), error=("error", "median"), worst=("error", "max"), given=("given", "sum"), held=("held", "sum"),
        cpu_s=("cpu_s", "median"),
    )  # fmt: skip
    pools = pd.read_csv(ROOT / "docs/results/recovery-pools.csv")
    before = {}
    for (family, name), own in pools.groupby(["family", "parameter"]):
        one = recovery.CASES[family].family.parameters[name]
        alone = np.concatenate([np.fromstring(text, sep=" ") for text in own.estimates])
        before[family, name] = np.median(np.abs(alone - own.truth.iloc[0])) / (one.high - one.low)
    table["by_generations"] = [before.get((case, name), np.nan) for case, _, name in table.index]
    return table


def main() -> None:
    """Run what the table lacks, or print what it holds."""
    if len(sys.argv) < 5:
        sys.stdout.write(summary().round(4).to_string() + "\n")
        return
    trials, first, last = map(int, sys.argv[1:4])
    done = (
        pd.read_csv(PATH)[["case", "trials", "seed"]].drop_duplicates().values.tolist()
        if PATH.exists()
        else []
    )
    for seed in range(first, last + 1):
        for case in sys.argv[4:]:
            if [case, trials, seed] not in done:
                curves.append(PATH, FIELDS, run(case, trials, seed))


if __name__ == "__main__":
    main()
