"""Trials of many robots: how the cost of 10 s grows from 10 to 1,000 robots, and the long trials of section 4.3 of the paper.

Times are CPU times of one thread, the shortest of a few rounds. Small swarms are measured one trial at a time, as large
ones are, and side by side, as in a generation; the growth is against the trial alone.
"""

import time
from dataclasses import replace

import numpy as np
import pytest

import turing_learning as tl
from turing_learning.swarm._trials import observe

ROBOTS = (10, 30, 100, 300, 1000)
SIDE_BY_SIDE = 64
CROWD = (
    10.0  # cm of side for each square root of a robot: disks of 7 cm cover two fifths of the square
)


def milliseconds(scenario, robots, trials=1, side_cm=None, duration_s=10.0, rounds=3):
    """Return the CPU time of a trial (ms)."""
    scenario = replace(scenario, trial=replace(scenario.trial, duration_s=duration_s))
    poses = tl.swarm.initial_poses(
        scenario, trials, np.random.default_rng(0), robots=robots, side_cm=side_cm
    )
    controllers = np.tile(scenario.controller, (trials, robots, 1))
    keys = np.arange(trials, dtype=np.uint64)
    observe(
        replace(scenario, trial=replace(scenario.trial, duration_s=0.2)),
        controllers,
        poses,
        keys,
        1,
    )
    best = np.inf
    for _ in range(rounds):
        start = time.process_time()
        observe(scenario, controllers, poses, keys, 1)
        best = min(best, time.process_time() - start)
    return 1e3 * best / trials


def print_growth(label, times):
    print(f"\n{label}: robots, ms per trial of 10 s, growth, growth of the number of robots")
    for robots, spent in times.items():
        print(f"{robots:6d} {spent:9.2f} {spent / times[ROBOTS[0]]:7.1f} {robots / ROBOTS[0]:7.1f}")


@pytest.mark.parametrize("label", ["the preset's density", "a dense crowd"])
def test_growth_of_a_trial(benchmark, label):
    def measure():
        return {
            robots: milliseconds(
                tl.swarm.AGGREGATION,
                robots,
                side_cm=CROWD * robots**0.5 if label == "a dense crowd" else None,
            )
            for robots in ROBOTS
        }

    print_growth(label, benchmark.pedantic(measure))
    together = milliseconds(tl.swarm.AGGREGATION, ROBOTS[0], SIDE_BY_SIDE, rounds=10)
    print(
        f"{ROBOTS[0]} robots, {SIDE_BY_SIDE} trials side by side, sparse: {together:.3f} ms per trial"
    )


@pytest.mark.parametrize(("name", "robots"), [("aggregation", 50), ("object-clustering", 25)])
def test_a_trial_of_400_seconds(benchmark, name, robots):
    scenario = tl.swarm.SCENARIOS[name]
    spent = benchmark.pedantic(
        lambda: milliseconds(scenario, robots, 4, duration_s=400.0, rounds=2)
    )
    objects = round(scenario.objects.count * robots / scenario.individuals)
    print(f"\n{robots} robots and {objects} objects for 400 s: {spent:.0f} ms per trial")


@pytest.mark.parametrize("name", ["aggregation-field-of-view-0", "aggregation-field-of-view-60"])
def test_trials_of_100_seconds_side_by_side(benchmark, name):
    scenario = tl.swarm.SCENARIOS[name]
    spent = benchmark.pedantic(
        lambda: milliseconds(
            scenario, scenario.individuals, SIDE_BY_SIDE, duration_s=100.0, rounds=6
        )
    )
    print(f"\n{name}, {SIDE_BY_SIDE} trials side by side for 100 s: {spent:.2f} ms per trial")
