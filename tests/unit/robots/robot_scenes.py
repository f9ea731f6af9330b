"""Swarms to be photographed."""

import math

import cv2
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


def render_prints(camera, textures, corners):
    """Return the image (H, W, 3) of the empty arena with flat prints on the floor, or held anywhere.

    Parameters
    ----------
    textures : n of (h, w)
        What each shows, in gray.
    corners : (n, 3, 3)
        Where the upper left, upper right and lower left corners of each are (x, y, height in cm).
    """
    canvas = camera._ground.copy()
    for texture, places in zip(textures, corners, strict=True):
        _paste(camera, canvas, texture, places)
    return camera._add_noise(camera._expose(canvas, slice(None), slice(None)))


def _paste(camera, canvas, texture, corners):
    """Draw a flat texture (h, w) whose upper left, upper right and lower left corners are at `corners` (3, 3)."""
    height, width = texture.shape
    across, down = (corners[1] - corners[0]) / width, (corners[2] - corners[0]) / height
    start = corners[0] + 0.5 * (across + down)
    grid = np.meshgrid(np.linspace(0, 1, 12), np.linspace(0, 1, 12))
    edge = corners[0] + np.stack([g.ravel() for g in grid], 1) @ np.array(
        [across * width, down * height]
    )
    rows, columns = camera._region(camera._calibration.project(edge), 2)
    fine = 3
    xs = columns.start + (np.arange((columns.stop - columns.start) * fine) + 0.5) / fine - 0.5
    ys = rows.start + (np.arange((rows.stop - rows.start) * fine) + 0.5) / fine - 0.5
    pixels = np.stack([grid.ravel() for grid in np.meshgrid(xs, ys)], axis=1)
    rotation, translation = camera._calibration.rotation, camera._calibration.translation
    plane = np.column_stack([rotation @ across, rotation @ down, rotation @ start + translation])
    rays = np.column_stack([camera._calibration.lens.rays(pixels), np.ones(len(pixels))])
    places = rays @ np.linalg.inv(plane).T
    at = (places[:, :2] / places[:, 2:]).reshape(len(ys), len(xs), 2).astype(np.float32)
    drawn = cv2.remap(texture, at, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    inside = ((at > -0.5) & (at < [width - 0.5, height - 0.5])).all(axis=2).astype(np.float32)
    size = (columns.stop - columns.start, rows.stop - rows.start)
    ink = cv2.resize(
        np.where(inside > 0, 20 + drawn * (215 / 255), 0).astype(np.float32),
        size,
        interpolation=cv2.INTER_AREA,
    )
    share = cv2.resize(inside, size, interpolation=cv2.INTER_AREA)
    mixed = canvas[rows, columns] * (1 - share[..., None]) + ink[..., None]
    canvas[rows, columns] = np.clip(np.rint(mixed), 0, 255).astype(np.uint8)
