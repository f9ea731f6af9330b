"""How far off may an estimate of simulated robots be before the panel tells it? Rows of near.csv.

Run with ``python experiments/examination/near.py``. The robots aggregate; each of their four wheel speeds, from -1 to 1, is
off by the same amount.
"""

import csv
from pathlib import Path

import numpy as np

from turing_learning.config import load_configuration
from turing_learning.examination import QUICK, examine
from turing_learning.identifiability import Effort
from turing_learning.identifiability.evidence import evidence_of
from turing_learning.systems import Arguments

TABLE = Path(__file__).parent / "near.csv"
TRUTH = np.array([-0.7, -1.0, 1.0, -1.0])
INWARD = np.array([1.0, 1.0, -1.0, 1.0])
"""Changes that leave speeds in their range."""
SAMPLES = 200


def main() -> None:
    """Write a row for each error."""
    configuration = load_configuration()
    with configuration.system.open(Arguments()) as source, TABLE.open("w") as file:
        evidence = evidence_of(configuration, source, Effort(samples=SAMPLES), 0)
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["error", "accuracy", "p_value"])
        for error in (0.0, 0.001, 0.002, 0.005, 0.01, 0.02):
            models = np.tile(TRUTH + error * INWARD, (SAMPLES, 1))
            simulated = evidence.simulate(models, np.random.default_rng(45))[:, 0]
            found = examine(evidence.testing, simulated, names=("speed", "turn"), examiners=QUICK)
            writer.writerow([error, f"{found.accuracy:.3f}", f"{found.p_value:.2f}"])
            file.flush()


if __name__ == "__main__":
    main()
