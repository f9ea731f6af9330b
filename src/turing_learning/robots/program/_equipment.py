"""What the PC program works with: time, links, a camera, and somebody who helps."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from turing_learning.config import ConfigurationError
from turing_learning.robots._clock import Clock, RealClock
from turing_learning.robots._errors import LaboratoryError
from turing_learning.robots.links._link import Link, open_link

from ._laboratory_config import LaboratorySetup

if TYPE_CHECKING:
    from turing_learning.robots.tracking._calibration import Calibration
    from turing_learning.robots.tracking._tracker import Tracker


class Camera(Protocol):
    """A camera that waits for its next image."""

    def take(self) -> np.ndarray:
        """Return the next image (H, W, 3), blue, green, red; raise CameraError if there is none."""
        ...

    def close(self) -> None:
        """Release the camera."""
        ...


class Operator(Protocol):
    """Somebody in the laboratory."""

    def ask(self, what_to_do: str) -> None:
        """Return when it is done."""
        ...


class TerminalOperator:
    """A human at the terminal, who presses Enter when it is done."""

    def ask(self, what_to_do: str) -> None:
        """Print and wait for Enter.

        Raises
        ------
        LaboratoryError
            If nobody can answer.
        """
        try:
            input(f"\a\n{what_to_do}\nPress Enter when it is done: ")
        except EOFError as error:
            raise LaboratoryError(f"nobody answers at the terminal. To do: {what_to_do}") from error


@dataclass(frozen=True)
class Equipment:
    """The doors to a laboratory, real or emulated; the program cannot tell.

    Attributes
    ----------
    clock
        Whatever waits, waits by it.
    open_link
        Address -> line to the replica there; raises LinkError if nobody answers.
    open_camera
        Raises CameraError, or FileNotFoundError, if there is none.
    operator
        Is asked for help.
    """

    clock: Clock
    open_link: Callable[[str], Link]
    open_camera: Callable[[], Camera]
    operator: Operator


def real_equipment(setup: LaboratorySetup, operator: Operator | None = None) -> Equipment:
    """Return the equipment that a setup names; nothing is opened yet."""
    clock = RealClock()

    def open_camera() -> Camera:
        from turing_learning.robots.tracking._capture import Capture

        return Capture(setup.camera.source)

    return Equipment(
        clock, lambda address: open_link(address, clock=clock), open_camera, operator or TerminalOperator()
    )


def laboratory_tracker(setup: LaboratorySetup) -> "Tracker":
    """Return a tracker of all robots, agents first.

    Raises
    ------
    ConfigurationError
        If the calibration cannot be read, or a robot cannot wear its marker.
    """
    from turing_learning.robots.tracking._markers import ArucoMarkers, TriangleMarkers
    from turing_learning.robots.tracking._tracker import Tracker

    camera = setup.camera
    kind = TriangleMarkers if camera.markers == "triangles" else ArucoMarkers
    try:
        markers = kind(height_cm=camera.marker_height_cm)
        return Tracker(markers, laboratory_calibration(setup), setup.labels, interval_s=1 / camera.fps)
    except ValueError as error:
        raise ConfigurationError(str(error)) from error


def laboratory_calibration(setup: LaboratorySetup) -> "Calibration":
    """Return the calibration of the camera.

    Raises
    ------
    ConfigurationError
        If it cannot be read.
    """
    from turing_learning.robots.tracking._calibration import Calibration

    path = setup.camera.calibration
    try:
        return Calibration.load(path)
    except OSError as error:
        raise ConfigurationError(
            f"`camera.calibration` must be a readable file; got {path} ({error.strerror or error}). Calibrate the camera first."
        ) from error
    except ValueError as error:
        raise ConfigurationError(str(error)) from error
