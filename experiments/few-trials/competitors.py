"""Why intervals of many_competitors are missed: ``python competitors.py``, by the rows of awkward.csv.

The logarithm of the growth of each species is linear in the abundances, so least squares on the same
recordings are the answer that nothing can beat. Of each group of parameters: how many intervals hold,
the mean error of the runs and that of least squares in half-widths of the stated intervals, and the
half-width of 90 % of least squares as a share of the stated one.
"""

import sys

import awkward
import numpy as np
import pandas as pd

NAME = "many_competitors"
NOISE = 0.2
"""Standard deviation of the logarithm of the growth, as the system has it."""
IMMIGRANTS = 1e-3
"""What the system adds in each year."""
NORMAL_90 = 1.645


def least_squares(recordings: int, seed: int) -> dict[str, tuple[float, float]]:
    """Return name -> error and half-width (90 %) of least squares on the recordings of a run."""
    system = awkward.SYSTEMS[NAME]
    rng = np.random.default_rng([seed, 100, *NAME.encode()])
    truth = [rng.uniform(low, high) for low, high in system.truths]
    recorded = system.simulate(np.tile(truth, (recordings, 1)), rng)
    before = recorded[:, :-1].reshape(-1, 3)
    after = recorded[:, 1:].reshape(-1, 3)
    growth = np.log((after - IMMIGRANTS) / before)
    design = np.column_stack([np.ones(len(before)), -before])
    inverse = np.linalg.inv(design.T @ design)
    fitted = inverse @ design.T @ growth
    width = NORMAL_90 * NOISE * np.sqrt(np.diag(inverse))
    # growth rates of all species come first, then what each suffers from all
    values = np.concatenate([fitted[0], fitted[1:].T.ravel()])
    widths = np.concatenate([np.repeat(width[0], 3), np.tile(width[1:], 3)])
    return dict(zip(system.ranges, zip(values - truth, widths, strict=True), strict=True))


def group_of(parameter: str) -> str:
    """Return to which group a parameter belongs."""
    if parameter.startswith("growth"):
        return "growth"
    return "own pressure" if parameter[-1] == parameter[-2] else "pressure of others"


def main() -> None:
    """Print a row for each number of trials and group."""
    rows = pd.read_csv(awkward.PATH)
    rows = rows[(rows.system == NAME) & rows.low.notna()].copy()
    half = (rows.high - rows.low) / 2
    best = []
    for row in rows.itertuples():
        best.append(least_squares(row.recordings, row.seed)[row.parameter])
    errors, widths = np.array(best).T
    rows["holds"] = rows.holds.astype(str) == "True"
    rows["error"] = (rows.estimate - rows.truth) / half
    rows["least_squares_error"] = errors / half
    rows["least_squares_width"] = widths / half
    rows["group"] = rows.parameter.map(group_of)
    table = rows.groupby(["trials", "group"]).agg(
        intervals=("holds", "size"),
        held=("holds", "sum"),
        error=("error", "mean"),
        least_squares_error=("least_squares_error", "mean"),
        least_squares_width=("least_squares_width", "median"),
    )
    sys.stdout.write(f"{table.round(2).to_string()}\n")


if __name__ == "__main__":
    main()
