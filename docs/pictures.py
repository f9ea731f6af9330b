"""Draw the pictures of README.md and the site: a swarm of agents beside its inferred twin, still and moving.

Run with ``python docs/pictures.py RUN``, where RUN is a finished run of ``turing-learning infer aggregation``. It writes
``images/twins.png``, ``images/twins.gif`` for the README, 180 s in 15 s, and ``_static/twins.html``, the replay at the
site's beginning. The first two are of a run with ``--generations 1000``, the replay is of one with 3,000 trials and seed 1:
``python docs/pictures.py RUN --replay`` writes it alone.
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import turing_learning as tl
from turing_learning.report import Replay, Swarm, replay_page, write_gif, write_page

ROBOTS = 25
ROBOT_RADIUS_CM = 5.5  # larger than they are
TIMES_S = (0, 60, 120, 180)
IMAGES = Path(__file__).parent / "images"
REPLAY = Path(__file__).parent / "_static" / "twins.html"
REPLAY_STEP = 5  # of the steps one is in the replay, twice a second


def simulate_twins(run: tl.Result) -> tuple[np.ndarray, float]:
    """Return poses (2, steps + 1, robots, 3) of agents and of replicas from the same start, and the time between steps (s)."""
    scenario = tl.swarm.SCENARIOS[run.scenario]
    model = [run.estimate[name] for name in scenario.parameter_names]
    controllers = np.repeat([[scenario.controller], [model]], ROBOTS, axis=1)
    poses = np.repeat(
        tl.swarm.initial_poses(scenario, 1, np.random.default_rng(4), robots=ROBOTS), 2, axis=0
    )
    interval = scenario.trial.control_interval_s
    return tl.swarm.simulate(
        scenario, controllers, poses, control_steps=round(TIMES_S[-1] / interval), seed=1
    ).poses, interval


def draw_twins(moved: np.ndarray, interval: float) -> Figure:
    """Return a figure of agents (top) and replicas of the inferred model (bottom)."""
    figure = Figure(figsize=(9.6, 5.0), layout="constrained")
    axes = figure.subplots(2, len(TIMES_S))
    low, high = moved[..., :2].min(axis=(0, 1, 2)) - 10, moved[..., :2].max(axis=(0, 1, 2)) + 10
    for row, label in enumerate(("agents", "replicas of the inferred model")):
        for column, time in enumerate(TIMES_S):
            panel = axes[row, column]
            step = round(time / interval)
            replicas = np.full(ROBOTS, row == 1)
            trail = moved[row, max(0, step - 100) : step + 1]
            tl.figures.swarm_frame(
                panel,
                moved[row, step],
                robots=ROBOTS,
                replicas=replicas,
                trail=trail,
                robot_radius_cm=ROBOT_RADIUS_CM,
            )
            panel.set_axis_on()
            panel.spines[:].set_color("0.8")
            panel.set(
                xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=[], yticks=[], aspect="equal"
            )
            if row == 0:
                panel.set_title(f"{time} s", fontsize=11)
        axes[row, 0].set_ylabel(label, fontsize=11)
    return figure


def twins(moved: np.ndarray, interval: float) -> Replay:
    """Return the replay of the two swarms."""
    labels = ("Agents", "Replicas")
    swarms = tuple(Swarm(labels[k], moved[k], ROBOTS, np.full(ROBOTS, k == 1)) for k in (0, 1))
    return Replay("A swarm and its inferred twin", ROBOT_RADIUS_CM, 1.0, interval, swarms)


def main() -> None:
    """Draw the pictures of the run named on the command line."""
    IMAGES.mkdir(exist_ok=True)
    moved, interval = simulate_twins(tl.load_run(sys.argv[1]))
    sparse = twins(moved[:, ::REPLAY_STEP], REPLAY_STEP * interval)
    write_page(replay_page(sparse), REPLAY)
    if "--replay" in sys.argv:
        return
    draw_twins(moved, interval).savefig(IMAGES / "twins.png", dpi=130)
    gif = IMAGES / "twins.gif"
    write_gif(twins(moved, interval), gif, speed=12.0, frames_per_second=10)


if __name__ == "__main__":
    main()
