"""Section 3.2: snapshots of both behaviors."""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import dispersion, largest_cluster
from turing_learning.figures import Picture
from turing_learning.figures._swarms import snapshots_figure
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Scenario

from .._experiment import Experiment, Findings, Table, stacked
from .._verdicts import Verdict
from .._work import Work
from ._shared import gathered, moved

CLAIM = "3.2-snapshots"
SHARE = 0.9
"""Of all robots, or objects, in the largest cluster: then they count as one cluster."""
OPENS_AND_CLOSES = (
    "where objects are clustered the agents never stop pushing, so that the cluster opens and closes, and does not become more "
    "compact later; the paper shows one trial at one moment, here it is the median trial"
)


@dataclass(frozen=True)
class SnapshotSizes:
    """How many trials, of how many robots, when they are shown, and when else they are measured."""

    trials: int = 30
    aggregating_robots: int = 50
    aggregation_times_s: tuple[int, ...] = (0, 60, 180, 300)
    clustering_robots: int = 5
    clustering_times_s: tuple[int, ...] = (0, 20, 40, 60)
    clustering_later_s: tuple[int, ...] = (120, 240)
    seed: int = 1


@dataclass(frozen=True)
class _Row:
    """A behavior: what is simulated, and what is to gather."""

    scenario: Scenario
    robots: int
    times_s: tuple[int, ...]
    later_s: tuple[int, ...] = ()

    @property
    def measured_s(self) -> tuple[int, ...]:
        return self.times_s + self.later_s

    @property
    def gathers_objects(self) -> bool:
        return self.scenario.objects.count > 0


def conduct(work: Work) -> Findings:
    """Simulate both behaviors, and show the trial of median dispersion at the end."""
    sizes: SnapshotSizes = work.sizes
    rows = (
        _Row(AGGREGATION, sizes.aggregating_robots, sizes.aggregation_times_s),
        _Row(OBJECT_CLUSTERING, sizes.clustering_robots, sizes.clustering_times_s, sizes.clustering_later_s),
    )
    found = {
        row: work.piece(f"snapshots-{row.scenario.name}", partial(_simulated, row, sizes.trials, sizes.seed))
        for row in rows
    }
    return Findings([_verdict(found)], [_table(found)], [_picture(*one) for one in found.items()])


def _simulated(row: _Row, trials: int, seed: int) -> dict[str, Any]:
    scenario, last = row.scenario, len(row.times_s) - 1
    steps = [round(time / scenario.trial.control_interval_s) for time in row.measured_s]
    found = moved(scenario, scenario.controller, trials, row.robots, steps[-1], starts=seed, noise=seed)
    poses = found.poses[:, steps]
    positions, radius = gathered(scenario, poses, row.robots)
    spread = dispersion(positions, radius)
    shown = int(np.argsort(spread[:, last], kind="stable")[(trials - 1) // 2])
    return {
        "dispersion": spread.tolist(),
        "largest_cluster": largest_cluster(positions, radius).tolist(),
        "gathering": positions.shape[2],
        "shown": shown,
        "poses": poses[shown, : last + 1].tolist(),
    }


def _verdict(measured: dict[_Row, dict[str, Any]]) -> Verdict:
    texts, agrees = [], True
    for row, found in measured.items():
        total, largest, end = found["gathering"], np.array(found["largest_cluster"]), len(row.times_s) - 1
        shown = int(largest[found["shown"], end])
        enough = np.count_nonzero(largest >= math.ceil(SHARE * total), axis=0)
        agrees = agrees and shown >= SHARE * total
        what = "objects" if row.gathers_objects else "robots"
        later = "".join(f", in {enough[end + 1 + k]} after {time} s" for k, time in enumerate(row.later_s))
        texts.append(
            f"{row.scenario.title.lower()}: {shown} of {total} {what} in one cluster after {row.times_s[-1]} s in the trial "
            f"shown, 90 % or more in {enough[end]} of {len(largest)} trials{later}"
        )
    printed = "a single compact cluster at the end of each row"
    return Verdict(CLAIM, agrees, printed, "; ".join(texts), "snapshots", reason="" if agrees else OPENS_AND_CLOSES)


def _table(measured: dict[_Row, dict[str, Any]]) -> Table:
    frames = {}
    for row, found in measured.items():
        trials = len(found["dispersion"])
        columns = {name: np.ravel(found[name]) for name in ("dispersion", "largest_cluster")}
        moments = {
            "trial": np.repeat(np.arange(1, trials + 1), len(row.measured_s)), "time_s": np.tile(row.measured_s, trials)
        }  # fmt: skip
        frames[row.scenario.name] = pd.DataFrame(moments | columns)
    caption = "Dispersion, and number of robots or objects in the largest cluster, of every trial"
    return Table("snapshots", caption, stacked(frames, "behavior"))


def _picture(row: _Row, found: dict[str, Any]) -> Picture:
    objects = f" and {found['gathering']} objects" if row.gathers_objects else ""
    figure = snapshots_figure(
        np.array(found["poses"]),
        times_s=row.times_s,
        robots=row.robots,
        robot_radius_cm=row.scenario.robot.radius_cm,
        object_radius_cm=row.scenario.objects.radius_cm,
    )
    caption = (
        f"{row.scenario.title}: {row.robots} agents{objects}; of {len(found['dispersion'])} trials the one with the median "
        "dispersion at the end. A robot is a disk with its heading, an object a plain disk."
    )
    return Picture(row.scenario.name, CLAIM, caption, figure)


EXPERIMENT = Experiment.of(
    "3.2",
    conduct,
    full=SnapshotSizes(),
    fast=SnapshotSizes(
        trials=3,
        aggregating_robots=12,
        aggregation_times_s=(0, 30, 90, 150),
    ),
)
