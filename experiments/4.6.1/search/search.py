"""Search the controller with which a swarm gathers best, on a grid over all wheel speeds (decision 0016).

``python search.py`` repeats the three tables of this folder, in minutes; ``python search.py NAME`` repeats one of them.
All controllers are tried in one trial, the better ones in ten, and the finalists in 100 fresh ones, which alone decide.
"""

import math
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from turing_learning.analysis import dispersion
from turing_learning.swarm import (
    AGGREGATION_VIEW_0,
    AGGREGATION_VIEW_60,
    Scenario,
    initial_poses,
    simulate,
)

HERE = Path(__file__).parent
SEED = 1
STARTS, NOISE = 1, 2  # which of the seed's random numbers
CYCLES_PER_S = 10  # control cycles of 0.1 s; dispersion is observed once a second
BLOCK, BATCH = 500, 128  # controllers and trials with random numbers of their own


class Search(NamedTuple):
    """What is searched, and how large the search is."""

    scenario: Scenario
    steps: int = 21  # settings of each wheel speed
    finalists: int = 50
    final_trials: int = 100
    duration_s: int = 180


SEARCHES = {
    "0-degrees": Search(AGGREGATION_VIEW_0),
    "0-degrees-600-s": Search(AGGREGATION_VIEW_0, steps=11, finalists=20, duration_s=600),
    "60-degrees": Search(AGGREGATION_VIEW_60),
}


def grid_controllers(steps: int) -> np.ndarray:
    """Return all controllers (N, 4) on a grid from -1 to 1; of a controller and its mirror image only one."""
    positions = np.indices((steps,) * 4).reshape(4, -1).T
    mirrored = positions[:, [1, 0, 3, 2]]
    rank = steps ** np.arange(4)[::-1]
    return np.linspace(-1, 1, steps).round(12)[positions[positions @ rank >= mirrored @ rank]]


def costs_of(search: Search, controllers: np.ndarray, starts: np.ndarray, seed: int) -> np.ndarray:
    """Return the costs of controllers (M, 4) from initial poses (R, A, 3), and the dispersion at the end: (M, R, 2).

    The cost is sum t u(t) / sum t over the seconds t = 1, 2, ..., where u is the dispersion of the robots.
    """
    executed = np.repeat(controllers, len(starts), axis=0)[:, None].repeat(
        search.scenario.individuals, axis=1
    )
    poses = np.tile(starts, (len(controllers), 1, 1))
    motion = simulate(
        search.scenario, executed, poses, control_steps=CYCLES_PER_S * search.duration_s, seed=seed
    )
    spread = dispersion(
        motion.poses[:, CYCLES_PER_S::CYCLES_PER_S, :, :2], search.scenario.robot.radius_cm
    )
    seconds = np.arange(1, spread.shape[1] + 1)
    costs = spread @ seconds / seconds.sum()
    return np.stack((costs, spread[:, -1]), axis=-1).reshape(len(controllers), len(starts), 2)


def ranked(search: Search) -> pd.DataFrame:
    """Return the finalists, best first."""
    controllers = grid_controllers(search.steps)
    costs = np.zeros((len(controllers), 1, 2))
    rounds = (
        (len(controllers), 1),
        (20 * search.finalists, math.isqrt(search.final_trials)),
        (search.finalists, search.final_trials),
    )
    for number, (count, trials) in enumerate(rounds, start=1):
        controllers = controllers[np.argsort(costs[..., 0].mean(axis=1), kind="stable")[:count]]
        starts = initial_poses(
            search.scenario, trials, np.random.default_rng((STARTS, SEED, number))
        )
        results = []
        for block in range(0, len(controllers), BLOCK):
            for first in range(
                block, min(block + BLOCK, len(controllers)), max(1, BATCH // trials)
            ):
                last = min(first + max(1, BATCH // trials), block + BLOCK)
                entropy = np.random.SeedSequence((NOISE, SEED, number, first))
                noise = int(entropy.generate_state(1, np.uint64)[0])
                results.append(costs_of(search, controllers[first:last], starts, noise))
        costs = np.concatenate(results)
    order = np.argsort(costs[..., 0].mean(axis=1), kind="stable")
    cost, end = costs[order, :, 0], costs[order, :, 1]
    table = pd.DataFrame(controllers[order], columns=["vl0", "vr0", "vl1", "vr1"])
    table["trials"] = search.final_trials
    table["cost"] = cost.mean(axis=1)
    table["standard_error"] = cost.std(axis=1, ddof=1) / np.sqrt(search.final_trials)
    table["median_cost"] = np.median(cost, axis=1)
    table["median_dispersion_at_the_end"] = np.median(end, axis=1)
    return table.set_index(pd.RangeIndex(1, len(table) + 1, name="rank"))


if __name__ == "__main__":
    for name in sys.argv[1:] or SEARCHES:
        ranked(SEARCHES[name]).to_csv(
            HERE / name / "controllers.csv", float_format="%.6g", lineterminator="\n"
        )
