"""What phases of the robots' control cycles do to the intervals of a run of 200 trials, in plain simulation.

    python experiments/laboratory/phases.py redrawn 1 100   # kind, first seed, number of seeds; rows of phases.csv
    python experiments/laboratory/phases.py                 # prints how many intervals hold

Kinds: "step" (all cycles begin together), "fixed" (each robot has its own phase, always), "replicas" (they draw theirs anew in
each trial), "redrawn" (all robots do), "moment" (fixed, but each trial is observed from another moment on). Three controllers.
The tracker's noise is 0.03 cm and 0.005 rad. A run takes about 10 s of one core.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from table import append_row

from turing_learning.coevolution import Samples
from turing_learning.config import load_configuration
from turing_learning.robots.emulation import SimulatedLaboratory
from turing_learning.robots.program import trial_samples
from turing_learning.robots.tracking import signed_speeds
from turing_learning.runs._run import Run, conduct
from turing_learning.swarm import Scenario, initial_poses, simulate

TABLE = Path(__file__).with_name("phases.csv")
NAMES = ("vl0", "vr0", "vl1", "vr1")
KINDS = ("step", "fixed", "replicas", "redrawn", "moment")
CONTROLLERS = ((0.85, 0.45, -0.4, 0.6), (-0.7, -1.0, 1.0, -1.0), (0.3, 0.9, 0.9, -0.2))
TRIALS = 200
PARTS = 5  # of a control cycle, at whose ends robots may act
NOISE = (0.03, 0.03, 0.005)  # of a pose (cm, cm, rad)
SETTINGS = {
    "scenario.agents": 8, "scenario.replicas": 2, "scenario.arena.width_cm": 200.0, "scenario.arena.height_cm": 225.0,
    "scenario.robot.clamp_wheel_speeds": True, "scenario.trial.duration_s": 5.0, "models.redraw": 0.0,
    "models.exchange": 0.0, "run.trials": TRIALS, "run.threads": 1,
}  # fmt: skip


class PhasedLaboratory(SimulatedLaboratory):
    """A laboratory in plain simulation whose robots act at their own moments of a control cycle."""

    def __init__(self, scenario: Scenario, seed: int, kind: str) -> None:
        super().__init__(scenario, seed, of_trials=True)
        self._kind, self._robots = kind, scenario.individuals
        self._phases = np.random.default_rng([seed, 77]).integers(0, PARTS, self._robots)
        interval_s = scenario.trial.control_interval_s / PARTS
        trial = replace(scenario.trial, control_interval_s=interval_s, physics_steps=2)
        self._exact = replace(scenario, trial=trial, robot=replace(scenario.robot, wheel_noise=0.0))

    def _phases_of(self, trials: int, rng: np.random.Generator) -> np.ndarray:
        """Return phases (R, A), in parts of a cycle."""
        shape = (trials, self._robots)
        if self._kind == "step":
            return np.zeros(shape, int)
        if self._kind == "redrawn":
            return rng.integers(0, PARTS, shape)
        phases = np.tile(self._phases, (trials, 1))
        if self._kind == "replicas":
            phases[:, self._scenario.agents :] = rng.integers(
                0, PARTS, (trials, self._scenario.replicas)
            )
        if self._kind == "moment":
            phases += rng.integers(0, PARTS, (trials, 1))
        return phases

    def observe(
        self, speeds: np.ndarray, stage: str = "", rng: np.random.Generator | None = None
    ) -> Samples:
        """Return samples of models (M, P) in wheel speeds."""
        rng = rng or np.random.default_rng([self._seed, *stage.encode()])
        scenario, trials = self._scenario, len(speeds) // self._scenario.replicas
        controllers = np.empty((trials, self._robots, speeds.shape[1]))
        controllers[:, : scenario.agents] = scenario.controller
        controllers[:, scenario.agents :] = speeds.reshape(trials, scenario.replicas, -1)
        states = controllers.reshape(trials, self._robots, -1, 2)
        poses, phases = initial_poses(scenario, trials, rng), self._phases_of(trials, rng)
        sights = np.zeros((trials, self._robots), int)
        wheels = np.zeros((trials, self._robots, 2))
        images = []
        for part in range(PARTS * (scenario.control_steps + 1) + 1):
            if part >= PARTS and part % PARTS == 0:
                images.append(poses)
            acting = (part + phases) % PARTS == 0
            wanted = np.take_along_axis(states, sights[:, :, None, None].repeat(2, axis=3), axis=2)[
                :, :, 0
            ]
            noise = scenario.robot.wheel_noise * rng.uniform(-1, 1, wheels.shape)
            wheels = np.where(acting[..., None], wanted * (1 + noise), wheels)
            held = np.tile(wheels, (1, 1, self._exact.sensor.states))
            seed = int(rng.integers(2**31))
            motion = simulate(self._exact, held, poses, control_steps=1, seed=seed, threads=1)
            poses, sights = motion.poses[:, 1], motion.sensors[:, 1]
        seen = np.array(images) + rng.normal(0, 1, (len(images), *poses.shape)) * NOISE
        interval_s = scenario.trial.control_interval_s
        motions = [signed_speeds(seen[:, trial], interval_s) for trial in range(trials)]
        return trial_samples(np.array(motions), scenario.replicas)


def rows(kind: str, controller: tuple[float, ...], seed: int) -> list[dict[str, object]]:
    """Return the row of one run: how many intervals it states, and how many hold the truth."""
    settings = SETTINGS | {"scenario.controller": list(controller), "run.seed": seed}
    configuration = load_configuration(None, "default", settings)
    source = PhasedLaboratory(configuration.swarm, seed, kind)
    result = conduct(Run.begin(configuration, source=source), None, None)
    estimate = np.array(list(result.estimate.values()))
    low, high = np.array(list(result.interval.values())).T
    stated = ~np.isnan(low)
    row: dict[str, object] = {"kind": kind}
    row |= dict(zip(NAMES, controller, strict=True))
    row |= {"seed": seed, "verdict": result.verdict, "stated": int(stated.sum())}
    row["holding"] = int((stated & (low <= controller) & (controller <= high)).sum())
    for name, width in zip(NAMES, (high - low).round(4), strict=True):
        row[f"width of {name}"] = width
    return [row | {"mean error": round(float(np.abs(estimate - controller).mean()), 4)}]


def summary() -> None:
    """Print, by kind and controller, how many intervals hold."""
    table = pd.read_csv(TABLE)
    table["below 0.05"] = table["mean error"] < 0.05
    sums = table.groupby(["kind", *NAMES])[["stated", "holding", "below 0.05"]].sum()
    sums.insert(0, "runs", table.groupby(["kind", *NAMES]).size())
    sys.stdout.write(sums.to_string() + "\n")


def main(kind: str, first: int, count: int) -> None:
    """Conduct the runs that the table lacks."""
    done = set()
    if TABLE.exists():
        done = set(pd.read_csv(TABLE)[["kind", "vl0", "seed"]].itertuples(index=False, name=None))
    for seed in range(first, first + count):
        for controller in CONTROLLERS:
            if (kind, controller[0], seed) in done:
                continue
            for row in rows(kind, controller, seed):
                append_row(TABLE, row)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
    else:
        summary()
