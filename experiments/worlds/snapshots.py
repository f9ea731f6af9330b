"""In how many trials all has gathered, as in the paper's figures 2 and 3, over gravity and lag: ``python snapshots.py``.

Figure 2 shows 50 agents in one cluster after 300 s, figure 3 ten objects, pushed by 5 agents, in one cluster after 60 s. A row of
snapshots.csv is appended as soon as a world is done, and not repeated.
"""

import csv
from pathlib import Path

import numpy as np
from shares import CASES, changed

from turing_learning.analysis import dispersion, largest_cluster
from turing_learning.swarm import initial_poses, simulate

HERE = Path(__file__).parent
TABLE = HERE / "snapshots.csv"
SIZES = {
    "aggregation": (50, 300, 30),
    "object-clustering": (5, 60, 100),
}  # robots, duration (s), trials
NAMES = ("scenario", "gravity_cm_s2", "lag_cycles")
FIELDS = (
    *NAMES,
    "time_s",
    "trials",
    "all_in_one_cluster",
    "nine_tenths_in_one_cluster",
    "median_dispersion",
)


def gathered(name: str, gravity: float, lag: int) -> list[float]:
    """Return the numbers of a row: what has gathered at the end of the trials."""
    scenario = changed({case.name: case for case, _, _ in CASES}[name], gravity, lag)
    robots, duration, trials = SIZES[name]
    poses = initial_poses(scenario, trials, np.random.default_rng(1), robots=robots)
    controllers = np.broadcast_to(scenario.controller, (trials, robots, len(scenario.controller)))
    end = simulate(
        scenario, controllers, poses, control_steps=10 * duration, seed=1, threads=1
    ).poses[:, -1]
    objects = scenario.objects.count > 0
    chosen = end[:, robots:, :2] if objects else end[:, :, :2]
    radius = scenario.objects.radius_cm if objects else scenario.robot.radius_cm
    largest, count = largest_cluster(chosen, radius), chosen.shape[1]
    spread = float(np.median(dispersion(chosen, radius)))
    return [
        duration,
        trials,
        int((largest == count).sum()),
        int((largest >= 0.9 * count).sum()),
        round(spread, 1),
    ]


if __name__ == "__main__":
    done = set()
    if TABLE.exists():
        with TABLE.open(newline="") as file:
            done = {tuple(row[name] for name in NAMES) for row in csv.DictReader(file)}
    for case, gravity, lag in CASES:
        world = (case.name, str(gravity), str(lag))
        if world in done:
            continue
        numbers = gathered(*world[:1], gravity, lag)
        with TABLE.open("a", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            if file.tell() == 0:
                writer.writerow(FIELDS)
            writer.writerow([*world, *numbers])
