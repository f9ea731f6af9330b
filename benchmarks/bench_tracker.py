"""The tracker on rendered images (1280 x 960, blur, noise, uneven light): time of an image on one core, and accuracy.

``pytest -c benchmarks/pytest.ini benchmarks/bench_tracker.py`` prints a row for each condition; docs/robots/tracking.md has them.
"""

import math
import time

import cv2
import numpy as np
import pytest

from turing_learning.robots import (
    ArucoMarkers,
    EmulatedCamera,
    Optics,
    RoundMarkers,
    Tracker,
    TriangleMarkers,
    overhead_camera,
)

IMAGES = 100
TEAM = ("blue",) * 8 + ("orange", "purple")
CONDITIONS = {
    "triangles": (TriangleMarkers(), TEAM, Optics()),
    "triangles, sharp and clean": (
        TriangleMarkers(),
        TEAM,
        Optics(blur_px=0.5, noise=1.0, shade=0.1),
    ),
    "triangles, blur 1.5 px": (TriangleMarkers(), TEAM, Optics(blur_px=1.5)),
    "triangles, noise 10": (TriangleMarkers(), TEAM, Optics(noise=10.0)),
    "triangles, shade 0.6": (TriangleMarkers(), TEAM, Optics(shade=0.6)),
    "40 round markers": (RoundMarkers(), ("blue",) * 40, Optics()),
    "ArUco markers": (ArucoMarkers(), tuple(map(str, range(10))), Optics()),
}


def scattered(rng, robots):
    """Poses (A, 3) uniform in the arena; every second robot touches the one before."""
    poses = []
    while len(poses) < robots:
        place = rng.uniform([3.8, 3.8], [196.2, 221.2])
        if len(poses) % 2:
            angle = rng.uniform(-math.pi, math.pi)
            place = poses[-1][:2] + 7.1 * np.array([math.cos(angle), math.sin(angle)])
        inside = (place > 3.7).all() and place[0] < 196.3 and place[1] < 221.3
        if inside and all(math.dist(place, other[:2]) > 7.0 for other in poses):
            poses.append(np.array([*place, rng.uniform(-math.pi, math.pi)]))
    return np.array(poses)


def errors(truth, labels, seen):
    """Return distances (cm), angles (degrees) of the robots that were seen, and how many were not."""
    distances, angles = [], []
    for pose, label in zip(truth, labels, strict=True):
        away = np.hypot(*(seen.positions - pose[:2]).T) if len(seen.labels) else np.array([np.inf])
        nearest = int(away.argmin())
        if away[nearest] > 2 or seen.labels[nearest] != label:
            continue
        distances.append(away[nearest])
        if seen.headings is not None:
            angles.append(
                abs((seen.headings[nearest] - pose[2] + math.pi) % (2 * math.pi) - math.pi)
            )
    return distances, np.degrees(angles).tolist(), len(truth) - len(distances)


@pytest.mark.parametrize("condition", CONDITIONS)
def test_tracking(benchmark, condition):
    markers, labels, optics = CONDITIONS[condition]
    cv2.setNumThreads(1)
    place = overhead_camera()
    camera, tracker = (
        EmulatedCamera(place, markers, labels, optics=optics),
        Tracker(markers, place, labels),
    )
    rng, truths, spent = np.random.default_rng(1), [], []
    results = ([], [], 0)

    def next_image():
        truths.append(scattered(rng, len(labels)))
        start = time.perf_counter()
        image = camera.render(truths[-1])
        spent.append(time.perf_counter() - start)
        return (image,), {}

    def detect(image):
        nonlocal results
        seen = tracker.detect(image)
        new = errors(truths[-1], labels, seen)
        results = (results[0] + new[0], results[1] + new[1], results[2] + new[2])

    benchmark.pedantic(detect, setup=next_image, rounds=IMAGES)
    distances, angles, missed = results
    turns = (
        f"{np.median(angles):.2f} | {np.percentile(angles, 95):.2f} | {np.max(angles):.1f}"
        if angles
        else "- | - | -"
    )
    print(
        f"\n| {condition} | {np.median(distances):.3f} | {np.percentile(distances, 95):.3f} | {turns} | "
        f"{missed} of {IMAGES * len(labels)} | {1e3 * benchmark.stats.stats.median:.1f} | {1e3 * np.median(spent):.1f} |"
    )
