"""The level once more, with more splits of two systems and other seeds. Rows of level-again.csv.

Run with ``python experiments/examination/level_again.py``.
"""

import csv
from pathlib import Path

import numpy as np
from level import halves, walkers

TABLE = Path(__file__).parent / "level-again.csv"
FIRST = 1000
"""Seeds begin here."""


def main() -> None:
    """Write how often the panel rejects."""
    systems = {
        "zebrafish, halves of the blocks of time": (8, 250, lambda rng: halves("zebrafish", rng)),
        "8 walkers against 8, 10 samples each": (7, 300, walkers(8, 10)),
    }
    with TABLE.open("w") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["system", "splits", "rejected_at_0.05", "rejected_at_0.01"])
        for name, (use, splits, examined) in systems.items():
            seeds = range(FIRST, FIRST + splits)
            p_values = np.array(
                [examined(np.random.default_rng((use, seed))).p_value for seed in seeds]
            )
            shares = [f"{(p_values <= level).mean():.3f}" for level in (0.05, 0.01)]
            writer.writerow([name, splits, *shares])


if __name__ == "__main__":
    main()
