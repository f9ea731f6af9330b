"""Draw the pictures of docs/results.md: how far the models of many runs are from the truth.

Run with ``python docs/error_boxes.py``; it takes the tables in docs/results.
"""

import csv
from pathlib import Path

import numpy as np

from turing_learning.figures import box_figure

DOCS = Path(__file__).parent
STUDIES = ("aggregation", "object-clustering")


def deviations(study: str) -> tuple[list[str], np.ndarray]:
    """Return the names of the parameters, and (R, P) of the subjectively best model of each run minus the truth."""
    with (DOCS / "results" / f"{study}-runs.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    names = [key.removeprefix("truth_") for key in rows[0] if key.startswith("truth_")]
    return names, np.array(
        [
            [float(row[f"best_model_{name}"]) - float(row[f"truth_{name}"]) for name in names]
            for row in rows
        ]
    )


def main() -> None:
    """Draw a picture of each study."""
    for study in STUDIES:
        names, values = deviations(study)
        figure = box_figure(values, names=names, truth=np.zeros(len(names)))
        figure.axes[0].set_ylabel("Inferred minus true value")
        figure.savefig(DOCS / "images" / f"{study}-boxes.png", dpi=200)


if __name__ == "__main__":
    main()
