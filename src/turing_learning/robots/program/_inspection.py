"""An inspection of the laboratory before anything moves."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from turing_learning._files import whole
from turing_learning.errors import require
from turing_learning.robots.tracking._calibration import find_landmarks
from turing_learning.robots.tracking._images import vision
from turing_learning.robots.tracking._tracker import Tracker, compare_labels, impossible
from turing_learning.swarm import Scenario

from ._equipment import CameraPoses, Equipment, PoseSource, drop_old_images, fastest_turn, take_stamped
from ._setup import LaboratorySetup, RobotSection

IMAGES = 20  #: Taken to measure the camera's rate
RATE_TOLERANCE = 0.1
RATE_TRIES = 5  #: A PC that is busy for a moment takes images late, and then many at once
LANDMARK_CM = 1.0  #: Largest distance between where a landmark lies by the file and where it is seen


@dataclass(frozen=True)
class Finding:
    """The result of inspecting one thing."""

    what: str  #: The thing: a replica, the camera, its calibration, the markers
    text: str  #: What was found
    fine: bool  #: Whether a run can begin with it


def inspect(
    setup: LaboratorySetup, scenario: Scenario, equipment: Equipment, picture: Path | None = None
) -> Iterator[Finding]:
    """Yield what is found: links, versions and batteries of the robots; images and rate; calibration; markers.

    No robot moves. Of a tracker that is not the camera's: whether it sees everybody.

    Parameters
    ----------
    setup, scenario
        The laboratory, and its arena.
    equipment
        Its devices; what is opened is closed again.
    picture
        File for an image from the camera, in which the markers that were found are circled.
    """
    for robot in setup.linked:
        yield _look(f"{robot.role} {robot.name}", partial(_replica, robot, equipment))
    try:
        poses = equipment.open_tracker()
    except OSError as error:
        yield Finding("camera", str(error), False)
        return
    try:
        if setup.tracker:
            yield _look("tracker", partial(_poses, poses, scenario, equipment))
            return
        assert isinstance(poses, CameraPoses)
        camera, tracker = poses.camera, poses.tracker
        rate = _look("camera", partial(_rate, poses, setup))
        yield rate
        if rate.fine:
            image = camera.take()
            yield _look("calibration", partial(_calibration, image, setup, scenario, tracker))
            yield _look("markers", partial(_markers, image, setup, tracker))
            if picture is not None:
                yield _look("picture", partial(_picture, image, tracker, picture))
    finally:
        poses.close()


def _look(what: str, find: Callable[[], str]) -> Finding:
    try:
        return Finding(what, find(), True)
    except (OSError, ValueError) as error:
        return Finding(what, str(error), False)


def _replica(replica: RobotSection, equipment: Equipment) -> str:
    robot = equipment.open_replica(str(replica.address))
    try:
        version, status = robot.version(), robot.status()
    finally:
        robot.close()
    if not status.battery_ok:
        raise ValueError(f"the battery of {replica.name} must be charged; got a low one. Change it.")
    return f"{version}; battery good; state {status.state}"


def _poses(poses: PoseSource, scenario: Scenario, equipment: Equipment) -> str:
    track, robot = poses.track(equipment.clock.now(), IMAGES), scenario.robot
    wrong = [fault.text for fault in (*track.faults, *impossible(track, robot.maximum_speed_cm_s, fastest_turn(robot)))]
    require(not wrong, "tracker", "see all robots", "; ".join(wrong))
    return f"all {len(track.labels)} seen, {IMAGES} times"


def _rate(poses: CameraPoses, setup: LaboratorySetup) -> str:
    camera, clock, tracker = poses.camera, poses.clock, poses.tracker
    first = camera.take()
    expected = (tracker.image_size[1], tracker.image_size[0], 3)
    rule, remedy = f"give images {expected}, as its calibration says", "Calibrate it again, or set it to that size."
    require(first.shape == expected, "camera", rule, str(first.shape), remedy)
    for _ in range(RATE_TRIES):
        begun = drop_old_images(camera, clock, 1 / setup.camera.fps)
        images, stamps = zip(*(take_stamped(camera, clock) for _ in range(IMAGES)), strict=True)
        rate = IMAGES / max(stamps[-1] - begun, 1e-9)
        if abs(rate / setup.camera.fps - 1) <= RATE_TOLERANCE:
            break
    got = f"{setup.camera.fps:g}, and images at {rate:.2f} per second"
    require(abs(rate / setup.camera.fps - 1) <= RATE_TOLERANCE, "camera.fps", "be the camera's rate", got)
    frozen = all(np.array_equal(first, image) for image in images)
    require(not frozen, "camera", "give new images", "the same one again and again", "Restart it.")
    granted = getattr(camera, "granted", "")
    text = f"{expected[1]} x {expected[0]} pixels, {rate:.1f} images per second"
    return f"{text}; granted {granted}" if granted else text


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
    smallest = min(width for _, width in _disks(image, tracker))
    return f"all {len(setup.labels)} in sight, the smallest {smallest:.0f} pixels wide"


def _disks(image: np.ndarray, tracker: Tracker) -> list[tuple[np.ndarray, float]]:
    """Return centre (2,) and width (pixels) of each marker's disk that was found."""
    markers, disks = tracker.markers, []
    for x, y in tracker.detect(image).positions:
        points = [(x + dx * markers.disk_radius_cm, y, markers.height_cm) for dx in (-1, 0, 1)]
        left, center, right = tracker.calibration.project(np.array(points))
        disks.append((center, float(np.hypot(*(right - left)))))
    return disks


def _picture(image: np.ndarray, tracker: Tracker, path: Path) -> str:
    """Write an image with a circle around each marker, and its label."""
    cv2, drawn, black = vision(), image.copy(), (0, 0, 0)
    for label, (center, width) in zip(tracker.detect(image).labels, _disks(image, tracker), strict=True):
        x, y = (round(float(value)) for value in center)
        cv2.circle(drawn, (x, y), round(0.7 * width), black, 2)
        cv2.putText(drawn, label, (x + round(width), y), cv2.FONT_HERSHEY_SIMPLEX, 0.5, black, 1, cv2.LINE_AA)
    _, encoded = cv2.imencode(path.suffix, drawn)
    with whole(path) as temporary:
        temporary.write_bytes(encoded.tobytes())
    return str(path)
