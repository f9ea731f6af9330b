"""An inspection of the laboratory before anything moves."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from turing_learning.errors import require
from turing_learning.robots.links._epuck import EPuck
from turing_learning.robots.links._link import LinkError
from turing_learning.robots.tracking._calibration import find_landmarks
from turing_learning.robots.tracking._images import CameraError
from turing_learning.robots.tracking._tracker import Tracker, compare_labels
from turing_learning.swarm import Scenario

from ._equipment import Camera, Equipment
from ._punctual import drop_old_images
from ._setup import LaboratorySetup, RobotSection

IMAGES = 20
"""Taken to measure the camera's rate."""
RATE_TOLERANCE = 0.1
LANDMARK_CM = 1.0
"""Largest distance between where a landmark lies by the file and where it is seen."""


@dataclass(frozen=True)
class Finding:
    """The result of inspecting one thing.

    Attributes
    ----------
    what
        The thing: a replica, the camera, its calibration, the markers.
    text
        What was found.
    fine
        Whether a run can begin with it.
    """

    what: str
    text: str
    fine: bool


def inspect(setup: LaboratorySetup, scenario: Scenario, equipment: Equipment, tracker: Tracker) -> Iterator[Finding]:
    """Yield what is found: links, versions and batteries of the replicas; images and rate; calibration; markers.

    No robot moves.

    Parameters
    ----------
    setup, scenario
        The laboratory, and its arena.
    equipment
        Its devices; what is opened is closed again.
    tracker
        Of all robots.
    """
    for replica in setup.replicas:
        yield _look(f"replica {replica.name}", partial(_replica, replica, equipment))
    try:
        camera = equipment.open_camera()
    except (CameraError, FileNotFoundError) as error:
        yield Finding("camera", str(error), False)
        return
    try:
        rate = _look("camera", partial(_rate, camera, setup, equipment, tracker))
        yield rate
        if rate.fine:
            image = camera.take()
            yield _look("calibration", partial(_calibration, image, setup, scenario, tracker))
            yield _look("markers", partial(_markers, image, setup, tracker))
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
    rule, remedy = f"give images {expected}, as its calibration says", "Calibrate it again, or set it to that size."
    require(first.shape == expected, "camera", rule, str(first.shape), remedy)
    drop_old_images(camera, equipment.clock, 1 / setup.camera.fps)
    begun = equipment.clock.now()
    images = [camera.take() for _ in range(IMAGES)]
    rate = IMAGES / max(equipment.clock.now() - begun, 1e-9)
    got = f"{setup.camera.fps:g}, and images at {rate:.2f} per second"
    require(abs(rate / setup.camera.fps - 1) <= RATE_TOLERANCE, "camera.fps", "be the camera's rate", got)
    frozen = all(np.array_equal(first, image) for image in images)
    require(not frozen, "camera", "give new images", "the same one again and again", "Restart it.")
    return f"{expected[1]} x {expected[0]} pixels, {rate:.1f} images per second"


def _calibration(image: np.ndarray, setup: LaboratorySetup, scenario: Scenario, tracker: Tracker) -> str:
    """Reject a calibration that sees landmarks elsewhere than they are, or robots outside the arena."""
    name, remedy = "camera.calibration", "Place the camera again."
    width, height = float(scenario.arena.width_cm or np.inf), float(scenario.arena.height_cm or np.inf)
    for x, y in tracker.detect(image).positions:
        inside = 0 <= x <= width and 0 <= y <= height
        rule = f"place robots inside the arena of {width:g} x {height:g} cm"
        require(inside, name, rule, f"one at x, y = {x:.1f}, {y:.1f} cm", remedy)
    landmarks = {int(identity): place for identity, place in setup.camera.landmarks.items()}
    if not landmarks:
        return "all markers inside the arena; no landmarks to compare with"
    seen = find_landmarks(image, tracker.calibration)
    missing = sorted(landmarks.keys() - seen.keys())
    clear = "Clear the sight, or leave them out."
    require(not missing, "camera.landmarks", "be in sight", f"no sight of {missing}", clear)
    errors = {identity: float(np.hypot(*(seen[identity] - place))) for identity, place in landmarks.items()}
    worst = max(errors, key=lambda identity: errors[identity])
    rule = f"see landmark {worst} where it lies, to {LANDMARK_CM:g} cm"
    require(errors[worst] <= LANDMARK_CM, name, rule, f"{errors[worst]:.1f} cm", remedy)
    return f"{len(landmarks)} landmarks to {errors[worst]:.2f} cm"


def _markers(image: np.ndarray, setup: LaboratorySetup, tracker: Tracker) -> str:
    landmarks = setup.camera.landmarks if setup.camera.markers == "aruco" else {}
    wrong = compare_labels(setup.labels, [label for label in tracker.detect(image).labels if label not in landmarks])
    require(not wrong, "robots", "wear the markers of the file, each its own", "; ".join(wrong), "Check the markers.")
    return f"all {len(setup.labels)} in sight"
