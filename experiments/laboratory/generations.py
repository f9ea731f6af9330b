"""How often a run of 100 generations is lost in a laboratory, by phases and by learning rates, in plain simulation.

    python experiments/laboratory/generations.py redrawn "1 2" 2001 100   # phases, variant, first seed, number of seeds
    python experiments/laboratory/generations.py    # prints errors, and how often ten runs do as well as the paper's

Phases: "step" (all cycles begin with an image), "redrawn" (each robot has another phase in each trial, and a period of its
own). Variants: what is in `VARIANTS`. "other" behind them takes three other controllers. The tracker's noise is 0.03 cm and
0.005 rad. Robots move in whole cycles; where they are between two is interpolated. A run takes about 1.5 s of one core.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
from table import append_row

from turing_learning.coevolution import Samples
from turing_learning.config import load_configuration
from turing_learning.robots.emulation import SimulatedLaboratory
from turing_learning.robots.program import trial_samples
from turing_learning.robots.tracking import signed_speeds
from turing_learning.runs import Progress
from turing_learning.runs._run import Run, conduct
from turing_learning.runs._trials import judged_again
from turing_learning.swarm import Scenario, initial_poses, simulate

TABLE = Path(__file__).with_name("generations.csv")
NAMES = ("vl0", "vr0", "vl1", "vr1")
CONTROLLER = (-0.7, -1.0, 1.0, -1.0)
OTHERS = ((0.85, 0.45, -0.4, 0.6), (0.3, 0.9, 0.9, -0.2), (-0.7, -1.0, 0.6, -1.0))
PAPER = np.array([0.08, 0.01, 0.05, 0.02])  # mean errors of ten runs
RUNS, DRAWS = 10, 20_000
LOST = 0.2  # error of a parameter from which on a run is lost
REPEATS = 5
PARTS = 5  # of a control cycle, in whose middles images are taken
PERIODS = 0.005  # by which control cycles differ
NOISE = (0.03, 0.03, 0.005)  # of a pose (cm, cm, rad)
SETTINGS = {
    "scenario.agents": 8, "scenario.replicas": 2, "scenario.arena.width_cm": 200.0, "scenario.arena.height_cm": 225.0,
    "scenario.robot.clamp_wheel_speeds": True, "scenario.trial.duration_s": 5.0, "models.parents": 10, "models.offspring": 10,
    "models.redraw": 0.0, "models.exchange": 0.0, "run.generations": 100, "run.threads": 1,
}  # fmt: skip
INPUTS = (12.8, 5.02)  # scale of the classifiers' inputs (cm/s, rad/s)
VARIANTS = {
    "inputs twice as large": {"classifiers.input_scale": [INPUTS[0] / 2, INPUTS[1] / 2]},
    "no memory": {"models.memory": 0.0},
    "wider classifiers": {"classifiers.initial_low": -3.0, "classifiers.initial_high": 3.0},
    "mean of two images": {},
    "preset paper": {},
}
RATES = ("0.5 0.5", "1 1", "0.5 2", "0.5 3", "1 2", "1 3", "2 1", "2 2")  # of models, classifiers


class PhasedLaboratory(SimulatedLaboratory):
    """A laboratory in plain simulation whose images are taken at another moment of each robot's control cycle.

    Classifiers see means of the speeds between so many `images`.
    """

    def __init__(self, scenario: Scenario, seed: int, phases: str, images: int) -> None:
        super().__init__(scenario, seed)
        self._redrawn = phases == "redrawn"
        self._images = images

    def observe(
        self, speeds: np.ndarray, stage: str = "", rng: np.random.Generator | None = None
    ) -> Samples:
        """Return samples of models (M, P) in wheel speeds."""
        rng = rng or np.random.default_rng([77, self._seed, *stage.encode()])
        scenario, trials = self._scenario, len(speeds) // self._scenario.replicas
        robots, steps = scenario.individuals, scenario.control_steps
        controllers = np.empty((trials, robots, speeds.shape[1]))
        controllers[:, : scenario.agents] = scenario.controller
        controllers[:, scenario.agents :] = speeds.reshape(trials, scenario.replicas, -1)
        poses, seed = initial_poses(scenario, trials, rng), int(rng.integers(2**31))
        motion = simulate(
            scenario, controllers, poses, control_steps=steps + 3, seed=seed, threads=1
        )
        known = motion.poses.copy()
        known[..., 2] = np.unwrap(known[..., 2], axis=1)
        phases, periods = np.zeros((trials, robots)), np.zeros((trials, robots))
        if self._redrawn:
            phases = (rng.integers(0, PARTS, (trials, robots)) + 0.5) / PARTS
            periods = rng.uniform(-PERIODS, PERIODS, (trials, robots))
        # In cycles of each robot; the first one is not seen
        cycles = 1 + phases[:, None] + np.arange(steps + 1)[:, None] * (1 + periods[:, None])
        begun = np.floor(cycles).astype(int)[..., None]
        before = np.take_along_axis(known, begun, axis=1)
        after = np.take_along_axis(known, begun + 1, axis=1)
        seen = before + (cycles[..., None] - begun) * (after - before)
        seen += rng.normal(0, 1, seen.shape) * NOISE
        interval_s = scenario.trial.control_interval_s
        motions = np.array([signed_speeds(trial, interval_s) for trial in seen])
        kept = motions.shape[2] - self._images + 1
        shifted = [motions[:, :, first : first + kept] for first in range(self._images)]
        return trial_samples(np.mean(shifted, axis=0), scenario.replicas)


def settings_of(variant: str) -> dict[str, object]:
    """Return the settings of a variant: of `VARIANTS`, or learning rates of models and of classifiers."""
    rates = variant if variant in RATES else RATES[0]
    models, classifiers = map(float, rates.split())
    learning = {"models.adaptation": models, "classifiers.adaptation": classifiers}
    return SETTINGS | learning | VARIANTS.get(variant, {})


def row(phases: str, variant: str, controller: tuple[float, ...], seed: int) -> dict[str, object]:
    """Return the row of one run: the errors of the model that is best when observed again, and of the estimate."""
    settings = settings_of(variant)
    settings |= {"scenario.controller": list(controller), "run.seed": seed}
    preset = "paper" if variant == "preset paper" else "default"
    configuration = load_configuration(None, preset, settings)
    images = 2 if variant == "mean of two images" else 1
    source = PhasedLaboratory(configuration.swarm, seed, phases, images)
    last = []

    def watch(progress: Progress) -> None:
        last[:] = [progress.scored.models, progress.scored.classifiers]

    result = conduct(Run.begin(configuration, source=source), watch, None)
    models, classifiers = last
    fitness = []
    for repeat in range(REPEATS):
        samples = source.observe(models, f"post-{repeat}")
        fitness.append(judged_again(configuration, classifiers, samples))
    best = models[np.mean(fitness, axis=0).argmax()]
    estimate = np.array(list(result.estimate.values()))
    found: dict[str, object] = {"phases": phases, "variant": variant}
    found |= dict(zip(NAMES, controller, strict=True)) | {"seed": seed}
    for name, model in (("best", best), ("estimate", estimate)):
        errors = np.abs(model - controller).round(5).tolist()
        found |= {f"{name} {wheel}": error for wheel, error in zip(NAMES, errors, strict=True)}
    return found


def summary() -> None:
    """Print mean errors, shares of runs that are lost, and of draws of ten runs whose mean errors are at most the paper's."""
    table = pd.read_csv(TABLE)
    table["seeds"] = np.where(table["seed"] < 1000, "tuning", "fresh")
    lines = []
    for kind, runs in table.groupby(["vl0", "vl1", "seeds", "phases", "variant"]):
        rng = np.random.default_rng(0)
        errors = runs[[f"best {name}" for name in NAMES]].to_numpy()
        means = errors[rng.integers(0, len(errors), (DRAWS, RUNS))].mean(axis=1)
        line: dict[str, object] = dict(
            zip(("vl0", "vl1", "seeds", "phases", "variant"), kind, strict=True)
        )
        line |= {"runs": len(runs), "best": errors.mean(axis=0).round(3)}
        estimates = runs[[f"estimate {name}" for name in NAMES]].to_numpy()
        line["estimate"] = estimates.mean(axis=0).round(3)
        line["lost"] = (errors.max(axis=1) > LOST).mean().round(2)
        line["lost in vl1"] = (errors[:, 2] > LOST).mean().round(2)
        line["ten: vl1"] = (means[:, 2] <= PAPER[2]).mean().round(2)
        line["ten: all"] = (means <= PAPER).all(axis=1).mean().round(2)
        lines.append(line)
    sys.stdout.write(pd.DataFrame(lines).to_string(index=False) + "\n")


def main(phases: str, variant: str, first: int, count: int, controllers: str = "") -> None:
    """Conduct the runs that the table lacks."""
    done = set()
    keys = ["phases", "variant", "vl0", "vl1", "seed"]
    if TABLE.exists():
        done = set(pd.read_csv(TABLE)[keys].itertuples(index=False, name=None))
    for seed in range(first, first + count):
        for controller in OTHERS if controllers else (CONTROLLER,):
            if (phases, variant, controller[0], controller[2], seed) in done:
                continue
            append_row(TABLE, row(phases, variant, controller, seed))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]), *sys.argv[5:])
    else:
        summary()
