"""Numbers that say how a group moves."""

import numpy as np


def steps(positions):
    """Return displacements (M, F - 1, A, 2)."""
    return np.diff(positions, axis=1)


def order(positions):
    """Return how well directions of motion agree in the last step of each group (M,), from 0 to 1."""
    last = steps(positions)[:, -1]
    return np.linalg.norm(
        (last / np.linalg.norm(last, axis=-1, keepdims=True)).mean(axis=1), axis=-1
    )


def spread(positions):
    """Return the mean distance from the center of each group in each frame (M, F)."""
    return np.linalg.norm(positions - positions.mean(axis=2, keepdims=True), axis=-1).mean(axis=2)


def turns(positions):
    """Return how much directions change from step to step (M, F - 2, A)."""
    moved = steps(positions)
    angle = np.diff(np.arctan2(moved[..., 1], moved[..., 0]), axis=1)
    return (angle + np.pi) % (2 * np.pi) - np.pi
