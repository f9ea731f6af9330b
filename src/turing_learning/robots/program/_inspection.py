"""A look at the laboratory before anything moves."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from turing_learning.robots.links._epuck import EPuck
from turing_learning.robots.links._link import LinkError
from turing_learning.robots.tracking._calibration import find_landmarks
from turing_learning.robots.tracking._capture import CameraError
from turing_learning.robots.tracking._tracker import Tracker, compare_labels
from turing_learning.swarm import Scenario

from ._equipment import Camera, Equipment
from ._laboratory_config import LaboratorySetup, RobotSection
from ._punctual import drop_old_images

IMAGES = 20
"""Taken to measure the camera's rate."""
RATE_TOLERANCE = 0.1
LANDMARK_CM = 1.0
"""Largest distance between where a landmark is said to lie and where it is seen."""


@dataclass(frozen=True)
class Finding:
    """What a look at one thing has shown.

    Attributes
    ----------
    what
        The thing: a replica, the camera, its calibration, the markers.
    text
        What was found.
    fine
        Whether a run can begin.
    """

    what: str
    text: str
    fine: bool


def inspect(setup: LaboratorySetup, scenario: Scenario, equipment: Equipment, tracker: Tracker) -> Iterator[Finding]:
    """Yield what is found: links, versions and batteries of the replicas; images and rate; calibration; markers.

    Nothing is asked of the robots that moves them.

    Parameters
    ----------
    setup, scenario
        The laboratory, and its arena.
    equipment
        Its doors; whatever is opened is closed again.
    tracker
        Of all robots.
    """
    for replica in setup.replicas:
        yield _look(f"replica {replica.name}", lambda replica=replica: _replica(replica, equipment))  # type: ignore[misc]
    try:
        camera = equipment.open_camera()
    except (CameraError, FileNotFoundError) as error:
        yield Finding("camera", str(error), False)
        return
    try:
        rate = _look("camera", lambda: _rate(camera, setup, equipment, tracker))
        yield rate
        if rate.fine:
            image = camera.take()
            yield _look("calibration", lambda: _calibration(image, setup, scenario, tracker))
            yield _look("markers", lambda: _markers(image, setup, tracker))
    finally:
        camera.close()


def _look(what: str, find: Callable[[], str]) -> Finding:
    try:
        return Finding(what, find(), True)
    except (LinkError, CameraError, ValueError) as error:
        return Finding(what, str(error), False)


def _replica(replica: RobotSection, equipment: Equipment) -> str:
    link = equipment.open_link(str(replica.address))
    try:
        robot = EPuck(link)
        version, status = robot.version(), robot.status()
    finally:
        link.close()
    if not status.battery_ok:
        raise ValueError(f"the battery of {replica.name} must be charged; got a low one. Change it.")
    return f"{version}; battery good; state {status.state}"


def _rate(camera: Camera, setup: LaboratorySetup, equipment: Equipment, tracker: Tracker) -> str:
    first = camera.take()
    expected = (tracker.image_size[1], tracker.image_size[0], 3)
    if first.shape != expected:
        raise ValueError(
            f"`camera` must give images {expected}, as its calibration says; got {first.shape}. Calibrate it again, or set "
            "it to that size."
        )
    drop_old_images(camera, equipment.clock, 1 / setup.camera.fps)
    begun = equipment.clock.now()
    images = [camera.take() for _ in range(IMAGES)]
    rate = IMAGES / max(equipment.clock.now() - begun, 1e-9)
    if abs(rate / setup.camera.fps - 1) > RATE_TOLERANCE:
        raise ValueError(
            f"`camera.fps` must be the camera's rate; got {setup.camera.fps:g}, and images at {rate:.2f} per second."
        )
    if all(np.array_equal(first, image) for image in images):
        raise ValueError("`camera` must give new images; got the same one again and again. Restart it.")
    return f"{expected[1]} x {expected[0]} pixels, {rate:.1f} images per second"


def _calibration(image: np.ndarray, setup: LaboratorySetup, scenario: Scenario, tracker: Tracker) -> str:
    """Refuse a calibration that sees landmarks elsewhere than they are, or robots outside the arena."""
    width, height = float(scenario.arena.width_cm or np.inf), float(scenario.arena.height_cm or np.inf)
    for x, y in tracker.detect(image).positions:
        if not (0 <= x <= width and 0 <= y <= height):
            raise ValueError(
                f"`camera.calibration` must place robots inside the arena of {width:g} x {height:g} cm; got one at x, y = "
                f"{x:.1f}, {y:.1f} cm. Place the camera again."
            )
    said = {int(identity): place for identity, place in setup.camera.landmarks.items()}
    if not said:
        return "all markers inside the arena; no landmarks to compare with"
    seen = find_landmarks(image, tracker.calibration)
    missing = sorted(said.keys() - seen.keys())
    if missing:
        raise ValueError(
            f"`camera.landmarks` must be in sight; got no sight of {missing}. Clear the sight, or leave them out."
        )
    errors = {identity: float(np.hypot(*(seen[identity] - place))) for identity, place in said.items()}
    worst = max(errors, key=lambda identity: errors[identity])
    if errors[worst] > LANDMARK_CM:
        raise ValueError(
            f"`camera.calibration` must see landmark {worst} where it lies, to {LANDMARK_CM:g} cm; got {errors[worst]:.1f} cm. "
            "Place the camera again."
        )
    return f"{len(said)} landmarks to {errors[worst]:.2f} cm"


def _markers(image: np.ndarray, setup: LaboratorySetup, tracker: Tracker) -> str:
    landmarks = setup.camera.landmarks if setup.camera.markers == "aruco" else {}
    seen = [label for label in tracker.detect(image).labels if label not in landmarks]
    wrong = compare_labels(setup.labels, seen)
    if wrong:
        raise ValueError(
            f"`robots` must wear the markers of the file, each its own; got {'; '.join(wrong)}. Check the markers."
        )
    return f"all {len(setup.labels)} in sight"
