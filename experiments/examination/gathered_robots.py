"""What is inferred of robots that had gathered when they were recorded? Rows of gathered-robots.csv.

Eleven robots of the paper's aggregation are recorded for 120 s, with headings. Models begin as was recorded, as in ``infer``, or
scattered. Run with ``python experiments/examination/gathered_robots.py``.
"""

import csv
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

import turing_learning as tl
from turing_learning.families import Robots, as_recorded
from turing_learning.trajectories import Trajectories

TABLE = Path(__file__).parent / "gathered-robots.csv"
TRUTH = (-0.7, -1.0, 1.0, -1.0)
"""Wheel speeds. Source: paper, section 4.1."""
RECORDED_S = 120
SEEDS = 4


def recording(seed: int) -> Trajectories:
    """Return the robots, from the moment on at which they begin scattered."""
    swarm = Robots(steps=10 * RECORDED_S - 2)
    positions, headings = swarm._paths(np.array([TRUTH]), np.random.default_rng((49, seed)))
    present = np.ones(positions.shape[1:3], dtype=bool)
    names = tuple(map(str, range(swarm.individuals)))
    return Trajectories(positions[0], present, 10.0, names, headings=headings[0])


def main() -> None:
    """Write errors and intervals."""
    with TABLE.open("w", buffering=1) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["seed", "models_begin", "verdict", "parameter", "error", "holds"])
        for seed, begin in product(range(SEEDS), ("as recorded", "scattered")):
            robots = recording(seed)
            windows = robots.windows(length_s=4.0)
            swarm = as_recorded(Robots, robots, windows)
            if begin == "scattered":
                swarm = replace(swarm, starts=None, settling_steps=0)
            result = tl.infer(
                genuine=windows,
                simulate=swarm,
                parameters=swarm.parameters,
                seed=seed + 1,
                progress=False,
            )
            for value, (name, estimate) in zip(TRUTH, result.estimate.items(), strict=True):
                low, high = result.interval[name]
                holds = "" if np.isnan(low) else int(low <= value <= high)
                error = abs(estimate - value)
                writer.writerow([seed, begin, str(result.found[0]), name, f"{error:.4f}", holds])


if __name__ == "__main__":
    main()
