"""Draw the pictures of README.md: a swarm of agents beside its inferred twin.

Run with ``python docs/pictures.py RUN``, where RUN is a finished run of ``turing-learning infer aggregation``.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import turing_learning as tl

ROBOTS = 25
TIMES_S = (0, 60, 120, 180)
IMAGES = Path(__file__).parent / "images"


def draw_twins(run: tl.Result) -> Figure:
    """Return a figure of agents (top) and replicas of the inferred model (bottom) from the same initial configuration."""
    scenario = tl.swarm.SCENARIOS[run.scenario]
    model = [run.estimate[name] for name in scenario.parameter_names]
    controllers = np.repeat([[scenario.controller], [model]], ROBOTS, axis=1)
    poses = np.repeat(tl.swarm.initial_poses(scenario, 1, np.random.default_rng(4), robots=ROBOTS), 2, axis=0)
    steps = round(TIMES_S[-1] / scenario.trial.control_interval_s)
    moved = tl.swarm.simulate(scenario, controllers, poses, control_steps=steps, seed=1).poses
    figure = Figure(figsize=(9.6, 5.0), layout="constrained")
    axes = figure.subplots(2, len(TIMES_S))
    low, high = moved[..., :2].min(axis=(0, 1, 2)) - 10, moved[..., :2].max(axis=(0, 1, 2)) + 10
    for row, label in enumerate(("agents", "replicas of the inferred model")):
        for column, time in enumerate(TIMES_S):
            panel = axes[row, column]
            step = round(time / scenario.trial.control_interval_s)
            replicas = np.full(ROBOTS, row == 1)
            trail = moved[row, max(0, step - 100) : step + 1]
            tl.figures.swarm_frame(
                panel, moved[row, step], robots=ROBOTS, replicas=replicas, trail=trail, robot_radius_cm=5.5
            )
            panel.set_axis_on()
            panel.spines[:].set_color("0.8")
            panel.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=[], yticks=[], aspect="equal")
            if row == 0:
                panel.set_title(f"{time} s", fontsize=11)
        axes[row, 0].set_ylabel(label, fontsize=11)
    return figure


def main() -> None:
    """Draw the pictures of the run named on the command line."""
    IMAGES.mkdir(exist_ok=True)
    figure = draw_twins(tl.load_run(sys.argv[1]))
    figure.savefig(IMAGES / "twins.png", dpi=130)


if __name__ == "__main__":
    main()
