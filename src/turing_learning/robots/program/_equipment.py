"""What the PC program works with: clock, replicas, tracker, operator; and its inspection before anything moves."""

import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from turing_learning._files import whole
from turing_learning.config import ConfigurationError, part_of
from turing_learning.errors import refuse, refusing_as, require, require_extras
from turing_learning.swarm import Robot, Scenario

from .._clock import Clock, RealClock
from .._link import EPuck, Replica, open_link
from ..tracking._camera import (
    SETTINGS,
    Calibration,
    CameraError,
    Capture,
    LiveCapture,
    aruco_centers,
    cv2,
)
from ..tracking._markers import ArucoMarkers, Detections, Markers, TriangleMarkers
from ..tracking._tracker import IRREGULAR, Fault, Track, Tracker, compare_labels, impossible
from ._setup import Laboratory, LaboratoryError, LaboratorySetup, RobotSection

_MOST_OLD = 200  # images that a camera may have kept for later
# Images taken to tell whether the last ones were late, or one was left out
_MOST_MORE = 5
_MOST_LOST = 0.1  # share of the images that may be lost, each alone


class Camera(Protocol):
    """A camera that waits for its next image. Where it has `taken_s`, that is the time stamp of the last one, by the clock."""

    def take(self) -> np.ndarray:
        """Return the next image (H, W, 3), blue, green, red; raise CameraError if there is none."""

    def close(self) -> None:
        """Release the camera."""


@dataclass
class PunctualImages:
    """Images (H, W, 3) that a camera takes at a regular interval, the first not before `begin_s`, by the clock.

    An image may be late if the next ones are not. One that was lost alone, by the time stamps of the next two,
    is None. After the last of `count` images, `fault` says if others were left out, or they came too fast; it
    is empty otherwise.
    """

    camera: Camera
    clock: Clock
    begin_s: float
    count: int
    interval_s: float
    fault: str = ""

    def __iter__(self) -> Iterator[np.ndarray | None]:
        camera = self.camera
        clock = self.clock
        count = self.count
        interval_s = self.interval_s
        clock.sleep(self.begin_s - interval_s - clock.now())
        begun = drop_old_images(camera, clock, interval_s)
        # Of each image after the time at which a regular camera takes it
        delays: list[float] = []
        ahead: deque[tuple[np.ndarray, float]] = deque()
        frame = 0
        lost = 0

        def late(stamp_s: float) -> float:
            return stamp_s - begun - frame * interval_s

        while frame < count:
            image, stamp_s = ahead.popleft() if ahead else take_stamped(camera, clock)
            delay_s = 0.0
            if delays and hasattr(camera, "taken_s"):
                delay_s = late(stamp_s) - delays[-1]
            if (
                0.75 < delay_s / interval_s < 1.5
                and frame < count - 1
                and lost < _MOST_LOST * count
            ):
                ahead.append(take_stamped(camera, clock))
                if late(ahead[0][1]) - delays[-1] > 1.75 * interval_s:
                    yield None
                    frame = frame + 1
                    lost = lost + 1
            delays.append(late(stamp_s))
            frame += 1
            if frame <= count:
                yield image
        while delays[-1] - min(delays) > interval_s / 2 and len(delays) < count + _MOST_MORE:
            delays.append(late(take_stamped(camera, clock)[1]))
            frame += 1
        late_s = np.array(delays)
        third = max(len(delays) // 3, 1)
        trouble = ""
        before, after = np.minimum.accumulate(late_s), np.minimum.accumulate(late_s[::-1])[::-1]
        sooner = np.median(late_s[-third:]) - np.median(late_s[:third]) < -interval_s / 2
        # All images come later after one that was left out
        if (after - before).max() > interval_s / 2:
            trouble = f"one left out before image {int(np.argmax(after - before > interval_s / 2))}, or more"
        elif sooner or (lost and before[0] - before[-1] > interval_s / 2):
            # Or some were taken for lost that were not
            trouble = "them faster"
        if trouble:
            advice = "Check camera.fps, and that the PC has nothing else to do."
            self.fault = (
                f"`camera` must give an image every {interval_s:.3g} s; got {trouble}. {advice}"
            )


def take_stamped(camera: Camera, clock: Clock) -> tuple[np.ndarray, float]:
    """Return the next image and its time stamp: the camera's, else the time at which it was taken."""
    image = camera.take()
    return image, getattr(camera, "taken_s", clock.now())


def drop_old_images(camera: Camera, clock: Clock, interval_s: float) -> float:
    """Take the images that a camera has buffered, and the first new one; return its time stamp, or raise CameraError."""
    begun = clock.now()
    stamped = hasattr(camera, "taken_s")
    for _ in range(_MOST_OLD):
        asked = clock.now()
        _, taken_s = take_stamped(camera, clock)
        if taken_s - (begun if stamped else asked) >= interval_s / 4:
            return taken_s
    raise CameraError(
        f"`camera` must give an image every {interval_s:.3g} s; got {_MOST_OLD} without a pause."
    )


class PoseSource(Protocol):
    """What follows all robots of a laboratory: a tracker with its camera, motion capture, a simulator."""

    def track(self, begin_s: float, images: int) -> Track:
        """Return where everybody is at `images` moments, one each interval, the first at about `begin_s`, by the clock.

        Individuals are in the order of `LaboratorySetup.labels`. What it is not sure of is not `present`, or a
        `Fault`. Raises `CameraError`, or another OSError, if it sees nothing at all.
        """

    def close(self) -> None:
        """Release its devices."""


class Operator(Protocol):
    """Somebody in the laboratory."""

    def ask(self, what_to_do: str) -> None:
        """Return when it is done."""


class TerminalOperator(Operator):
    """A human at the terminal, who presses Enter when it is done, or Ctrl-C, once, to leave.

    `ask` raises KeyboardInterrupt then, and `LaboratoryError` if nobody can answer.
    """

    def ask(self, what_to_do: str) -> None:
        try:
            with _interruptible():
                input(f"\a\n{what_to_do}\nPress Enter when it is done, Ctrl-C to leave: ")
        except EOFError as error:
            raise LaboratoryError(f"nobody answers at the terminal. To do: {what_to_do}") from error


@contextmanager
def _interruptible() -> Iterator[None]:
    """Let Ctrl-C and a request to terminate raise KeyboardInterrupt, also where a command waits for the end of a batch."""
    # Signals are handled there
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {}
    for number in (signal.SIGINT, signal.SIGTERM):
        before[number] = signal.signal(number, signal.default_int_handler)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@dataclass(frozen=True)
class Equipment:
    """The devices of a laboratory, real or emulated; the program cannot tell which."""

    clock: Clock  #: For all waiting
    #: Address -> robot there; raises LinkError if nobody answers
    open_replica: Callable[[str], Replica]
    #: Raises CameraError, or FileNotFoundError, if there is none
    open_tracker: Callable[[], PoseSource]
    operator: Operator  #: Helps when asked

    def replica(self, address: str) -> Replica:
        """Open the robot at an address; raise ConfigurationError for one that lacks a method of `Replica`."""
        return _complete("open_replica", self.open_replica(address), Replica)

    def tracker(self) -> PoseSource:
        """Open the tracker; raise ConfigurationError for one that lacks a method of `PoseSource`."""
        return _complete("tracker", self.open_tracker(), PoseSource)


def _complete(argument: str, device: Any, protocol: type) -> Any:
    """Return a device that has all that its protocol says; a run would find out in its middle."""
    members = {*vars(protocol), *protocol.__annotations__}
    needed = sorted(name for name in members if not name.startswith("_"))
    missing = [name for name in needed if not hasattr(device, name)]
    got = f"{type(device).__name__} without {', '.join(missing)}"
    rule = f"give a `{protocol.__name__}`"
    remedy = "See docs/robots/any-robot.md."
    require(not missing, argument, rule, got, remedy, error=ConfigurationError)
    return device


def require_libraries(setup: LaboratorySetup | None = None, *, emulated: bool = False) -> None:
    """Raise `MissingExtraError` that names all libraries that a laboratory needs and that are not installed."""
    libraries = []
    if emulated or setup is None or not setup.tracker:
        libraries.append(("cv2", "OpenCV", "vision"))
    if not emulated and setup is not None and not setup.open_replica:
        libraries.append(("serial", "pyserial", "robot"))
    require_extras(*libraries)


class CameraPoses(PoseSource):
    """A tracker with its camera: a `PoseSource` that rejects images that come late, or not at all."""

    def __init__(self, camera: Camera, tracker: Tracker, clock: Clock) -> None:
        self.camera = camera
        self.tracker = tracker
        self.clock = clock

    def track(self, begin_s: float, images: int) -> Track:
        punctual = PunctualImages(self.camera, self.clock, begin_s, images, self.tracker.interval_s)
        track = self.tracker.track(punctual)
        irregular = []
        if punctual.fault:
            irregular = [Fault(0, IRREGULAR, punctual.fault)]
        return replace(track, faults=(*irregular, *track.faults))

    def close(self) -> None:
        self.camera.close()


def real_equipment(laboratory: Laboratory, operator: Operator | None = None) -> Equipment:
    """Return the equipment that a laboratory's file names; nothing is opened yet.

    Raise ConfigurationError if an `open_replica` or a `tracker` of the file cannot be imported.
    """
    setup = laboratory.setup
    clock = RealClock()
    # A replica stands after a ninth of a loop, 2 s of 18 s
    alive_s = setup.timing.loop_s / 36

    def part(
        argument: str, name: str
    ) -> Any:  # an entry point of an installed package, or as in any configuration
        registered = list(entry_points(group="turing_learning.robots", name=name))
        if registered:
            return registered[0].load()
        return part_of(argument, name)

    def open_camera(tracker: Tracker) -> CameraPoses:
        source = setup.camera.source
        settings = {name: getattr(setup.camera, name) for name in SETTINGS}
        if isinstance(source, str) and "://" not in source:
            return CameraPoses(Capture(source), tracker, clock)
        asked = None
        if any(settings[name] is not None for name in settings if name != "fps"):
            asked = settings
        return CameraPoses(LiveCapture(source, asked, clock=clock), tracker, clock)

    def open_epuck(address: str) -> EPuck:
        return EPuck(open_link(address, clock=clock, alive_s=alive_s))

    open_replica = open_epuck
    if setup.open_replica:
        open_replica = part("open_replica", setup.open_replica)
    if setup.tracker:
        open_tracker = partial(part("tracker", setup.tracker), setup)
    else:
        open_tracker = partial(
            open_camera, laboratory_tracker(setup, laboratory.configuration.swarm.robot)
        )
    return Equipment(clock, open_replica, open_tracker, operator or TerminalOperator())


def laboratory_tracker(setup: LaboratorySetup, robot: Robot) -> Tracker:
    """Return a tracker of all robots, agents first; raise ConfigurationError for a calibration or a marker that it cannot use."""
    camera = setup.camera
    with refusing_as(ConfigurationError):
        # Another size of marker scales the usual triangle
        height = camera.marker_height_cm
        share = (camera.marker_cm or 4.5) / 4.5
        tip, base, half, disk = (share * size for size in (3.0, 1.5, 1.6, 3.3))
        markers: Markers = TriangleMarkers(tip, base, half, disk, height)
        if camera.markers == "aruco":
            markers = ArucoMarkers(
                camera.marker_cm or 4.8, height_cm=height, dictionary=camera.dictionary
            )
        return Tracker(
            markers, laboratory_calibration(setup), setup.labels, interval_s=1 / camera.fps,
            maximum_speed_cm_s=robot.maximum_speed_cm_s, maximum_turn_rad_s=fastest_turn(robot),
        )  # fmt: skip


def laboratory_calibration(setup: LaboratorySetup) -> Calibration:
    """Return the calibration of the camera; raise ConfigurationError if it cannot be read."""
    path = setup.camera.calibration or ""
    try:
        with refusing_as(ConfigurationError):
            return Calibration.load(path)
    except OSError as error:
        got = f"{path} ({error.strerror or error})"
        remedy = "Calibrate the camera first."
        refuse("camera.calibration", "be a readable file", got, remedy, error=ConfigurationError)


def fastest_turn(robot: Robot) -> float:
    """Return how fast a robot turns in place (rad/s)."""
    return 2 * robot.maximum_speed_cm_s / robot.wheel_distance_cm


IMAGES = 20  #: Taken to measure the camera's rate
RATE_TOLERANCE = 0.1
#: A PC that is busy for a moment takes images late, and then many at once
RATE_TRIES = 5
#: Largest distance between where a landmark lies by the file and where it is seen
LANDMARK_CM = 1.0


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
    setup, scenario, equipment
        The laboratory, its arena, and its devices; what is opened is closed again.
    picture
        File for an image from the camera, in which the markers that were found are circled.
    """

    def look_at(robot: RobotSection) -> str:
        with closing(equipment.replica(str(robot.address))) as opened:
            version = opened.version()
            status = opened.status()
        if not status.battery_ok:
            raise ValueError(
                f"the battery of {robot.name} must be charged; got a low one. Change it."
            )
        return f"{version}; battery good; state {status.state}"

    for robot in setup.linked:
        yield _look(f"{robot.role} {robot.name}", look_at, robot)
    try:
        poses = equipment.tracker()
    except OSError as error:
        yield Finding("camera", str(error), False)
        return
    with closing(poses):
        if setup.tracker:
            yield _look("tracker", _poses, poses, scenario, equipment)
            return
        assert isinstance(poses, CameraPoses)
        # Without images in time nothing else can be looked at
        rate = _look("camera", _rate, poses, setup.camera.fps)
        yield rate
        if rate.fine:
            image = poses.camera.take()
            detections = poses.tracker.detect(image)
            yield _look(
                "calibration", _calibration, image, detections, setup, scenario, poses.tracker
            )
            yield _look("markers", _markers, detections, setup, poses.tracker)
            if picture is not None:
                yield _look("picture", _picture, image, detections, poses.tracker, picture)


def _look(subject: str, find: Callable[..., str], *arguments: object) -> Finding:
    try:
        return Finding(subject, find(*arguments), True)
    except (OSError, ValueError) as error:
        return Finding(subject, str(error), False)


def _poses(poses: PoseSource, scenario: Scenario, equipment: Equipment) -> str:
    track = poses.track(equipment.clock.now(), IMAGES)
    faults = (*track.faults, *impossible(track, scenario.robot, scenario.arena))
    wrong = [fault.text for fault in faults]
    require(not wrong, "tracker", "see all robots", "; ".join(wrong))
    return f"all {len(track.labels)} seen, {IMAGES} times"


def _rate(poses: CameraPoses, fps: float) -> str:
    camera, clock, (width, height) = poses.camera, poses.clock, poses.tracker.image_size
    first_image = camera.take()
    rule = f"give images {(height, width, 3)}, as its calibration says"
    remedy = "Calibrate it again, or set it to that size."
    require(first_image.shape == (height, width, 3), "camera", rule, str(first_image.shape), remedy)
    for _ in range(RATE_TRIES):
        begun = drop_old_images(camera, clock, 1 / fps)
        images, stamps = zip(*(take_stamped(camera, clock) for _ in range(IMAGES)), strict=True)
        rate = IMAGES / max(stamps[-1] - begun, 1e-9)
        if fits := abs(rate / fps - 1) <= RATE_TOLERANCE:
            break
    rule = "be the camera's rate"
    require(fits, "camera.fps", rule, f"{fps:g}, and images at {rate:.2f} per second")
    frozen = all(np.array_equal(first_image, image) for image in images)
    require(not frozen, "camera", "give new images", "the same one again and again", "Restart it.")
    granted = getattr(camera, "granted", "")
    if granted:
        granted = f"; granted {granted}"
    return f"{width} x {height} pixels, {rate:.1f} images per second{granted}"


def _calibration(
    image: np.ndarray,
    detections: Detections,
    setup: LaboratorySetup,
    scenario: Scenario,
    tracker: Tracker,
) -> str:
    """Reject a calibration that sees landmarks elsewhere than they are, or robots outside the arena."""
    name = "camera.calibration"
    remedy = "Place the camera again."
    width = float(scenario.arena.width_cm or np.inf)
    height = float(scenario.arena.height_cm or np.inf)
    for x, y in detections.positions:
        inside = 0 <= x <= width and 0 <= y <= height
        rule = f"place robots inside the arena of {width:g} x {height:g} cm"
        require(inside, name, rule, f"one at x, y = {x:.1f}, {y:.1f} cm", remedy)
    landmarks = {int(identity): position for identity, position in setup.camera.landmarks.items()}
    if not landmarks:
        return "all markers inside the arena; no landmarks to compare with"
    centers = aruco_centers(image)
    missing = sorted(landmarks.keys() - centers.keys())
    got = f"no sight of {missing}"
    require(not missing, "camera.landmarks", "be in sight", got, "Clear it, or leave them out.")
    lie = tracker.calibration.locate(np.array([centers[identity] for identity in landmarks]))
    errors = np.hypot(*(lie - list(landmarks.values())).T)
    worst = int(np.argmax(errors))
    rule = f"see landmark {[*landmarks][worst]} where it lies, to {LANDMARK_CM:g} cm"
    require(errors[worst] <= LANDMARK_CM, name, rule, f"{errors[worst]:.1f} cm", remedy)
    return f"{len(landmarks)} landmarks to {errors[worst]:.2f} cm"


def _markers(detections: Detections, setup: LaboratorySetup, tracker: Tracker) -> str:
    landmarks = {}
    if setup.camera.markers == "aruco":
        landmarks = setup.camera.landmarks
    wrong = compare_labels(
        setup.labels, [label for label in detections.labels if label not in landmarks]
    )
    rule = "wear the markers of the file, each its own"
    require(not wrong, "robots", rule, "; ".join(wrong), "Check the markers.")
    smallest = min(width for _, _, width in _disks(detections, tracker))
    return f"all {len(setup.labels)} in sight, the smallest {smallest:.0f} pixels wide"


def _disks(detections: Detections, tracker: Tracker) -> list[list[float]]:
    """Return x, y of the centre and the width (pixels) of each marker's disk that was found."""
    if not detections.labels:
        return []
    positions = np.insert(detections.positions, 2, tracker.markers.height_cm, axis=1)
    radius = np.array([tracker.markers.disk_radius_cm, 0.0, 0.0])
    left, center, right = (tracker.calibration.project(positions + k * radius) for k in (-1, 0, 1))
    return np.column_stack([center, np.hypot(*(right - left).T)]).tolist()


def _picture(image: np.ndarray, detections: Detections, tracker: Tracker, path: Path) -> str:
    """Write an image with a circle around each marker, and its label."""
    drawn = image.copy()
    black = (0, 0, 0)
    for label, (x, y, width) in zip(detections.labels, _disks(detections, tracker), strict=True):
        cv2.circle(drawn, (round(x), round(y)), round(0.7 * width), black, 2)
        at = (round(x) + round(width), round(y))
        cv2.putText(drawn, label, at, cv2.FONT_HERSHEY_SIMPLEX, 0.5, black, 1, cv2.LINE_AA)
    _, encoded = cv2.imencode(path.suffix, drawn)
    with whole(path) as temporary:
        temporary.write_bytes(encoded.tobytes())
    return str(path)
