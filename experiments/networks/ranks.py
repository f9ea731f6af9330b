"""Gains of any size, inferred from samples of the network itself: ``python ranks.py FIRST LAST``.

Attraction and alignment are drawn from their ranges, the other gains are 1. The network of `gains.py` simulates 720
groups with them, and a run of 1,000 trials infers these two gains. The rank is the share of the run's draws below the
truth. If the inference leans nowhere, ranks are uniform and 90 % of the intervals hold. Rows go to ranks.csv; what is
there is not done again. Without arguments it prints the shares. The extra `networks` has to be installed.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from gains import SAMPLES, network
from table import append_rows, keys_done

import turing_learning as tl

PATH = Path(__file__).with_name("ranks.csv")
INFERRED = ("attraction", "alignment")
TRIALS = 1000
FIELDS = ("seed", "gain", "truth", "estimate", "low", "high", "rank", "verdict")


def rows(seed: int) -> list[dict[str, object]]:
    """Return what is inferred with a seed, a row for each gain."""
    learned = network()
    names = list(learned.parameters)
    columns = [names.index(name) for name in INFERRED]
    ranges = {name: learned.parameters[name] for name in INFERRED}

    def simulate(parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        gains = np.ones((len(parameters), len(names)))
        gains[:, columns] = parameters
        return learned(gains, rng)

    rng = np.random.default_rng([seed, 640])
    truth = {name: rng.uniform(bounds.low, bounds.high) for name, bounds in ranges.items()}
    genuine = learned.observe(dict.fromkeys(names, 1.0) | truth, groups=SAMPLES, rng=rng)
    result = tl.infer(
        genuine=genuine, simulate=simulate, parameters=ranges, trials=TRIALS, seed=seed, vectorized=True,
        progress=False, settings={"run.threads": 1},
    )  # fmt: skip
    draws = result.draws()
    table = []
    for k, gain in enumerate(INFERRED):
        low, high = result.interval[gain] if result.interval else (np.nan, np.nan)
        table.append({
            "seed": seed, "gain": gain, "truth": f"{truth[gain]:.3f}", "estimate": f"{result.estimate[gain]:.3f}",
            "low": f"{low:.3f}", "high": f"{high:.3f}", "rank": f"{(draws[:, k] < truth[gain]).mean():.3f}",
            "verdict": result.verdict,
        })  # fmt: skip
    return table


def print_shares() -> None:
    """Print means over all seeds, and over thirds of the range of the truth."""
    table = pd.read_csv(PATH)
    table["error"] = table.estimate - table.truth
    table["holds"] = (table.low <= table.truth) & (table.truth <= table.high)
    table["third"] = pd.cut(table.truth, [0, 2 / 3, 4 / 3, 2], labels=["low", "middle", "high"])
    for keys in (["gain"], ["gain", "third"]):
        groups = table.groupby(keys, observed=True)
        print(groups.agg(runs=("seed", "size"), holds=("holds", "sum"), rank=("rank", "mean"),
                         error=("error", "mean"), standard_error=("error", "sem")).round(3))  # fmt: skip


def main() -> None:
    """Write the rows that are missing, or print the shares."""
    if len(sys.argv) == 1:
        print_shares()
        return
    done = keys_done(PATH, ("seed",))
    for seed in range(int(sys.argv[1]), int(sys.argv[2]) + 1):
        if (str(seed),) not in done:
            append_rows(PATH, FIELDS, rows(seed))


if __name__ == "__main__":
    main()
