"""Measure how detectors of runs in the emulated laboratory do, calibrated with what the runs observed and with simulations.

Run with ``python docs/laboratory_detection.py`` after ``turing-learning reproduce 5``. Every detector is tried on the motion of
another run: agents of its post-evaluations, by one sample and by ten, and replicas of its first models.
"""

from pathlib import Path

import numpy as np

from turing_learning.detection import Detector, Motion, random_controllers, simulate_behaviors
from turing_learning.robots import rehearse
from turing_learning.runs import (
    load_run,
    read_post_evaluation,
    read_trials,
    resume_laboratory,
    stored_laboratory,
)

PIECES = Path(__file__).parents[1] / "experiments" / "5" / "pieces"
TEN, FIRST, NEAR, MODELS = 10, 20, 0.2, 200


def motion(run: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return agents by one sample and by ten, and the replicas of the first models, far from the estimate, by one."""
    result, again = load_run(run), read_post_evaluation(run)
    held_out = [read_trials(run, f"post-evaluation-{k + 1}") for k in range(again.repeats)]
    agents = np.concatenate([trials.samples().genuine for trials in held_out])
    agents = agents.reshape(
        -1, result.configuration.scenario.agents, *agents.shape[1:]
    )  # (trials, agents, T, 2)
    first = [read_trials(run, f"generation-{g:04d}") for g in range(min(FIRST, result.generations))]
    replicas = np.concatenate([trials.samples().counterfeit[:, 0] for trials in first])
    models = np.concatenate([trials.models.reshape(-1, 4) for trials in first])
    estimate = np.array(list(result.estimate.values()))
    far = replicas[np.abs(models - estimate).mean(axis=1) >= NEAR][:MODELS]
    by_ten = agents.swapaxes(0, 1).reshape(-1, TEN, *agents.shape[2:])
    return agents.reshape(-1, 1, *agents.shape[2:]), by_ten, far[:, None]


def detectors(run: Path, seed: int) -> tuple[Detector, Detector]:
    """Return a detector calibrated with simulations of the scenario, and one with what the run observed."""
    if not (run / "calibration.npz").exists():
        resume_laboratory(run, equipment=rehearse(stored_laboratory(run)))
    result, rng = load_run(run), np.random.default_rng(seed)
    scenario = result.configuration.scenario
    simulated = simulate_behaviors(scenario, random_controllers(scenario, 100, rng), rng=rng)
    return (
        Detector.from_run(result, genuine=simulated.genuine, abnormal=simulated.abnormal),
        Detector.from_run(result),
    )


def called(detector: Detector, samples: np.ndarray) -> float:
    """Return the share of individuals (N, S, T, D) that are called abnormal, in %."""
    names = tuple(str(k) for k in range(len(samples)))
    return 100 * float(
        np.mean([verdict.abnormal for verdict in detector.verdicts(Motion(names, samples))])
    )


def show(name: str, cells: np.ndarray) -> None:
    """Print a row: simulated / observed for each kind of motion (kinds, 2)."""
    print("|", name, *(f"| {one:.1f} / {two:.1f}" for one, two in cells), "|", flush=True)  # noqa: T201


def main() -> None:
    """Print a row for each run: agents by one sample, by ten, and the first models by one; and the means."""
    runs, rows = sorted(PIECES.glob("emulated-run-seed*")), []
    for k, run in enumerate(runs):
        both, others = detectors(run, k), motion(runs[(k + 1) % len(runs)])
        rows.append([[called(detector, kind) for detector in both] for kind in others])
        show(run.name, np.array(rows[-1]))
    show("mean", np.mean(rows, axis=0))


if __name__ == "__main__":
    main()
