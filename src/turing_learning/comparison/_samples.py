"""New samples of a simulator, as many as are asked for."""

from collections.abc import Callable
from typing import Any

import numpy as np

from turing_learning.errors import refuse
from turing_learning.trajectories import Windows

SIMULATION_ATTEMPTS = 10
"""Times that a simulator is asked for the samples that are still missing, as it may fail for some."""

Simulate = Callable[[np.ndarray, np.random.Generator], np.ndarray]


def samples_of(
    simulate: Simulate, model: np.ndarray, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Return samples (count, T, D) of a model (P,), each of an execution of its own."""
    batches: list[np.ndarray] = []
    missing = count
    for _ in range(SIMULATION_ATTEMPTS):
        samples = simulate(np.tile(model, (missing, 1)), rng)[:, 0]
        batches.append(samples)
        missing -= len(samples)
        if missing <= 0:
            return np.concatenate(batches)
    return refuse("simulate", "return samples of the estimate", f"failures in {missing} of {count}")


def require_windows(genuine: Any, run: str) -> Windows:
    """Return what a run was given as windows of recorded motion; reject anything else."""
    if isinstance(genuine, Windows):
        return genuine
    remedy = "Of others, `turing-learning test` compares two sets of samples."
    return refuse("run", "be on windows of recorded motion", "another one", remedy, place=run)
