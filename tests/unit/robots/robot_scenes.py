"""Swarms to be photographed."""

import math

import numpy as np

LABELS = ("blue",) * 8 + ("orange", "purple")


def moving(rng, images, robots=10):
    """Robots that drive arcs like the agents', backwards, at any place of the arena."""
    start = scattered(rng, robots)
    agents = robots - 2
    start[:agents] = start[np.argsort(start[:agents, 0])]
    speed, turn = rng.uniform(-11, -3, robots), rng.uniform(-4, 4, robots)
    poses = [start]
    for _ in range(images - 1):
        pose = poses[-1].copy()
        pose[:, 0] += 0.1 * speed * np.cos(pose[:, 2])
        pose[:, 1] += 0.1 * speed * np.sin(pose[:, 2])
        pose[:, 2] += 0.1 * turn
        poses.append(pose)
    return np.array(poses)


def scattered(rng, robots):
    """Poses (A, 3) uniform in the arena; nobody within 7.4 cm of another or 16 cm of a wall."""
    kept = []
    while len(kept) < robots:
        place = rng.uniform([16, 16], [184, 209])
        if all(math.dist(place, other[:2]) >= 7.4 for other in kept):
            kept.append([*place, rng.uniform(-math.pi, math.pi)])
    return np.array(kept)


def angle_between(first, second):
    return np.abs((first - second + math.pi) % (2 * math.pi) - math.pi)
