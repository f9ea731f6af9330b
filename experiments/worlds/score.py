"""Hold every world against the numbers that are cheap to compute: ``python score.py``, after shares.py and snapshots.py.

worlds.csv has a row for each gravity and lag: how far the shares of both case studies are from the printed ones at the length of
trial that fits best, and how many standard errors that is; the left wheel's error that least squares have by theorem 1, from
the share at 10 s (0.13 printed); and in how many trials all ten objects are in one cluster after 60 s, as in figure 3.
"""

import csv
from pathlib import Path

import numpy as np
from shares import GRAVITIES, LAGS, PRINTED

HERE = Path(__file__).parent
ROUNDING = 0.0005  # of a printed share
TRIALS = 100  # from which the paper has its shares
LEFT = 1.7  # difference of the left wheel's speeds for I = 1 and I = 0 in aggregation
PRINTED_LEFT_ERROR = 0.13  # paper, section 4.5, vl0; a comment of its source
FIELDS = (
    "gravity_cm_s2", "lag_cycles", "aggregation_s", "aggregation_distance", "aggregation_errors", "clustering_s",
    "clustering_distance", "clustering_errors", "least_squares_vl0", "least_squares_printed", "one_cluster", "of_trials",
)  # fmt: skip


def rows_of(name: str) -> list[dict[str, str]]:
    """Return the rows of a table beside this file."""
    with (HERE / name).open(newline="") as file:
        return list(csv.DictReader(file))


def fit(row: dict[str, str]) -> tuple[float, float]:
    """Return the largest distance of shares from the printed ones, in itself and in standard errors of both."""
    shares, errors = (
        np.array([float(row[f"{of}_{k}"]) for k in range(3)]) for of in ("share", "standard_error")
    )
    distance = np.abs(shares - PRINTED[row["scenario"]])
    both = np.maximum(errors * np.sqrt(1 + float(row["trials"]) / TRIALS), 1e-4)
    return float(distance.max()), float((np.maximum(distance - ROUNDING, 0) / both).max())


def best(rows: list[dict[str, str]]) -> tuple[int, float, float]:
    """Return the length of trial (s) whose shares are nearest to the printed ones, and how far they are."""
    fits = [(int(row["duration_s"]), *fit(row)) for row in rows]
    return min(fits, key=lambda each: each[1])


if __name__ == "__main__":
    shares, snapshots = rows_of("shares.csv"), rows_of("snapshots.csv")
    with (HERE / "worlds.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(FIELDS)
        for gravity in sorted(GRAVITIES):
            for lag in LAGS[:3]:
                chosen = [row for row in shares if int(row["lag_cycles"]) == lag]
                gathering = [row for row in chosen if row["scenario"] == "aggregation"]
                clustering = [
                    row
                    for row in chosen
                    if float(row["gravity_cm_s2"]) == gravity and row not in gathering
                ]
                (ten,) = [float(row["share_1"]) for row in gathering if row["duration_s"] == "10"]
                world = ("object-clustering", str(gravity), str(lag))
                pictures = [row for row in snapshots if tuple(row.values())[:3] == world]
                counts = [(row["all_in_one_cluster"], row["trials"]) for row in pictures] or [
                    ("", "")
                ]
                fits = [f"{value:.4g}" for value in (*best(gathering), *best(clustering))]
                writer.writerow(
                    [gravity, lag, *fits, f"{LEFT * ten:.3f}", PRINTED_LEFT_ERROR, *counts[0]]
                )
