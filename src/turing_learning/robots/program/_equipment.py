"""What the PC program works with: a clock, links, a camera, and an operator."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from turing_learning.config import ConfigurationError
from turing_learning.errors import refuse, refusing_as
from turing_learning.robots._clock import Clock, RealClock
from turing_learning.robots.links._link import Link, open_link
from turing_learning.robots.tracking._calibration import Calibration
from turing_learning.robots.tracking._images import Capture, LiveCapture
from turing_learning.robots.tracking._markers import ArucoMarkers, TriangleMarkers
from turing_learning.robots.tracking._tracker import Tracker
from turing_learning.swarm import Robot

from ._setup import CAMERA_SETTINGS, LaboratoryError, LaboratorySetup


class Camera(Protocol):
    """A camera that waits for its next image. Where it has `taken_s`, that is the time stamp of the last one, by the clock."""

    def take(self) -> np.ndarray:
        """Return the next image (H, W, 3), blue, green, red; raise CameraError if there is none."""

    def close(self) -> None:
        """Release the camera."""


class Operator(Protocol):
    """Somebody in the laboratory."""

    def ask(self, what_to_do: str) -> None:
        """Return when it is done."""


class TerminalOperator:
    """A human at the terminal, who presses Enter when it is done."""

    def ask(self, what_to_do: str) -> None:
        """Print and wait for Enter; raise `LaboratoryError` if nobody can answer."""
        try:
            input(f"\a\n{what_to_do}\nPress Enter when it is done: ")
        except EOFError as error:
            raise LaboratoryError(f"nobody answers at the terminal. To do: {what_to_do}") from error


@dataclass(frozen=True)
class Equipment:
    """The devices of a laboratory, real or emulated; the program cannot tell which."""

    clock: Clock  #: For all waiting
    open_link: Callable[[str], Link]  #: Address -> line to the replica there; raises LinkError if nobody answers
    open_camera: Callable[[], Camera]  #: Raises CameraError, or FileNotFoundError, if there is none
    operator: Operator  #: Helps when asked


def real_equipment(setup: LaboratorySetup, operator: Operator | None = None) -> Equipment:
    """Return the equipment that a setup names; nothing is opened yet."""
    clock, operator = RealClock(), operator or TerminalOperator()
    camera = setup.camera
    file = isinstance(camera.source, str) and "://" not in camera.source
    settings = {name: getattr(camera, name) for name in CAMERA_SETTINGS}
    if any(value is not None for value in settings.values()):
        settings["fps"] = camera.fps
    open_camera = (
        partial(Capture, camera.source) if file else partial(LiveCapture, camera.source, settings, clock=clock)
    )
    alive_s = setup.timing.loop_s / 36  # a replica stands after a ninth of a loop, 2 s of 18 s
    return Equipment(clock, partial(open_link, clock=clock, alive_s=alive_s), open_camera, operator)


def laboratory_tracker(setup: LaboratorySetup, robot: Robot | None = None) -> Tracker:
    """Return a tracker of all robots, agents first, which move and turn no faster than the configured robot.

    Raises
    ------
    ConfigurationError
        If the calibration cannot be read, or a robot cannot wear its marker.
    """
    camera = setup.camera
    kind = TriangleMarkers if camera.markers == "triangles" else ArucoMarkers
    with refusing_as(ConfigurationError):
        markers = kind(height_cm=camera.marker_height_cm)
        robot = robot or Robot()
        speed, turn = robot.maximum_speed_cm_s, 2 * robot.maximum_speed_cm_s / robot.wheel_distance_cm
        limits: dict[str, Any] = {"maximum_speed_cm_s": speed, "maximum_turn_rad_s": turn}
        return Tracker(markers, laboratory_calibration(setup), setup.labels, interval_s=1 / camera.fps, **limits)


def laboratory_calibration(setup: LaboratorySetup) -> Calibration:
    """Return the calibration of the camera; raise ConfigurationError if it cannot be read."""
    path = setup.camera.calibration
    try:
        with refusing_as(ConfigurationError):
            return Calibration.load(path)
    except OSError as error:
        got = f"{path} ({error.strerror or error})"
        refuse("camera.calibration", "be a readable file", got, "Calibrate the camera first.", error=ConfigurationError)
