"""Whether the jury of a run of generations tells the wheel speed `vl1`: what it gives to models that are right but for this.

    python experiments/laboratory/accepted.py LABEL RUN...   # rows of accepted.csv, for run folders in experiment 5's pieces
    python experiments/laboratory/accepted.py                # prints them, a line for each run and generation

The jury: the classifiers of a generation and the best of each one before, weighted as in decision 0011. Samples come from plain
simulation with phases that are drawn anew (`generations.py`), 150 trials with two models each. About 20 s for a run.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from generations import CONTROLLER, SETTINGS, PhasedLaboratory
from table import append_row

from turing_learning.coevolution import THRESHOLD
from turing_learning.config import classifier_of, load_configuration
from turing_learning.runs import load_run

TABLE = Path(__file__).with_name("accepted.csv")
SPEEDS = (-1.0, -0.5, 0.0, 0.4, 0.7, 0.9, 1.0)
GENERATIONS = (30, 60, 99)
TRIALS = 150
AGENTS = 600  # whose samples say how specific a juror is
SEED = 1


def rows(label: str, path: Path) -> list[dict[str, object]]:
    """Return a row for each generation: by value of vl1, the mean share of votes; and how far votes on one sample scatter."""
    configuration = load_configuration(None, "default", SETTINGS)
    classifier = classifier_of(configuration)
    laboratory = PhasedLaboratory(configuration.swarm, SEED, "redrawn", images=1)
    seen = {}
    for speed in SPEEDS:
        model = (CONTROLLER[0], CONTROLLER[1], speed, CONTROLLER[3])
        seen[speed] = laboratory.observe(np.tile(model, (2 * TRIALS, 1)), f"vl1 {speed}")
    agents = seen[SPEEDS[0]].genuine[:AGENTS]
    history = load_run(path).history
    classifiers = history["classifier"].to_numpy().astype(np.float64)
    fittest = history["classifier_fitness"].to_numpy().argmax(axis=1)
    models = history["model"].to_numpy()
    found = []
    for generation in GENERATIONS:
        archive = classifiers[np.arange(generation), fittest[:generation]]
        jury = np.concatenate([classifiers[generation], archive])
        present = laboratory.observe(models[generation], f"generation {generation}")
        specificity = (classifier.judge(jury, agents) >= THRESHOLD).mean(axis=1)
        misled = (classifier.judge(jury, present.counterfeit[:, 0]) >= THRESHOLD).mean(axis=1)
        weights = np.maximum(specificity - misled, 0)
        row: dict[str, object] = {"runs": label, "run": path.name, "generation": generation}
        votes = np.empty(0)
        for speed, samples in seen.items():
            judged = classifier.judge(jury, samples.counterfeit[:, 0]) >= THRESHOLD
            votes = weights @ judged / weights.sum()
            row[f"vl1 {speed:g}"] = round(float(votes.mean()), 3)
        row["scatter"] = round(float(votes.std()), 3)
        row["median vl1"] = round(float(np.median(models[generation, :, 2])), 3)
        found.append(row)
    return found


def main(label: str, *paths: str) -> None:
    """Write the rows of runs."""
    for path in paths:
        for row in rows(label, Path(path)):
            append_row(TABLE, row)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(*sys.argv[1:])
    else:
        sys.stdout.write(pd.read_csv(TABLE).to_string(index=False) + "\n")
