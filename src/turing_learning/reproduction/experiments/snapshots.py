"""Section 3.2: snapshots of both behaviors."""

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from turing_learning.analysis import dispersion, largest_cluster
from turing_learning.figures._swarms import snapshots_figure
from turing_learning.swarm import AGGREGATION, OBJECT_CLUSTERING, Scenario

from .._experiment import Captions, Experiment, Findings, stacked
from .._verdicts import PRINTED, REASONS, ClaimVerdict
from .._work import Work
from ._shared import gathered, moved

ID, CLAIM = "3.2", "3.2-snapshots"
SHARE = 0.9  # of all robots, or objects, in the largest cluster: then they count as one cluster


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


def conduct(work: Work) -> Findings:
    """Simulate both behaviors, and show the trial of median dispersion at the end."""
    sizes: SnapshotSizes = work.sizes
    captions, frames, pictures, texts, agrees = Captions(ID), {}, [], [], True
    for scenario, robots, times_s, later_s in (
        (AGGREGATION, sizes.aggregating_robots, sizes.aggregation_times_s, ()),
        (OBJECT_CLUSTERING, sizes.clustering_robots, sizes.clustering_times_s, sizes.clustering_later_s),
    ):
        compute = partial(_simulated, scenario, robots, times_s, later_s, sizes)
        found = work.piece(f"snapshots-{scenario.name}", compute)
        total, largest, end = found["gathering"], np.array(found["largest_cluster"]), len(times_s) - 1
        shown, trials = int(largest[found["shown"], end]), len(largest)
        enough = np.count_nonzero(largest >= math.ceil(SHARE * total), axis=0)
        agrees = agrees and shown >= SHARE * total
        later = "".join(f", in {enough[end + 1 + k]} after {time} s" for k, time in enumerate(later_s))
        texts.append(
            f"{scenario.title.lower()}: {shown} of {total} {'objects' if scenario.objects.count else 'robots'} in one cluster "
            f"after {times_s[-1]} s in the trial shown, 90 % or more in {enough[end]} of {trials} trials{later}"
        )
        measured_s = times_s + later_s
        frame = {"trial": np.repeat(np.arange(1, trials + 1), len(measured_s)), "time_s": np.tile(measured_s, trials)}
        frame |= {name: np.ravel(found[name]) for name in ("dispersion", "largest_cluster")}
        frames[scenario.name] = pd.DataFrame(frame)
        radii: dict[str, Any] = {"robot_radius_cm": scenario.robot.radius_cm}
        radii["object_radius_cm"] = scenario.objects.radius_cm
        figure = snapshots_figure(np.array(found["poses"]), times_s=times_s, robots=robots, **radii)
        objects = f" and {total} objects" if scenario.objects.count else ""
        words = {"scenario": scenario, "robots": robots, "objects": objects, "trials": trials}
        pictures.append(captions.picture("{scenario.name}", CLAIM, figure, **words))
    reason = "" if agrees else REASONS[CLAIM]
    verdict = ClaimVerdict(CLAIM, agrees, PRINTED[CLAIM], "; ".join(texts), "snapshots", reason=reason)
    return Findings([verdict], [captions.table("snapshots", stacked(frames, "behavior"))], pictures)


def _simulated(
    scenario: Scenario, robots: int, times_s: tuple[int, ...], later_s: tuple[int, ...], sizes: SnapshotSizes
) -> dict[str, Any]:
    trials, seed, last = sizes.trials, sizes.seed, len(times_s) - 1
    steps = [round(time / scenario.trial.control_interval_s) for time in times_s + later_s]
    poses = moved(scenario, scenario.controller, trials, robots, steps[-1], starts=seed, noise=seed).poses[:, steps]
    positions, radius = gathered(scenario, poses, robots)
    spread = dispersion(positions, radius)
    shown = int(np.argsort(spread[:, last], kind="stable")[(trials - 1) // 2])
    return {
        "dispersion": spread.tolist(),
        "largest_cluster": largest_cluster(positions, radius).tolist(),
        "gathering": positions.shape[2],
        "shown": shown,
        "poses": poses[shown, : last + 1].tolist(),
    }


EXPERIMENT = Experiment.of(
    ID, conduct, full=SnapshotSizes(),
    fast=SnapshotSizes(trials=3, aggregating_robots=12, aggregation_times_s=(0, 30, 90, 150)),
)  # fmt: skip
