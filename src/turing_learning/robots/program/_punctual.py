"""Images at the right moments: regular in time, and none left out."""

from collections import deque
from collections.abc import Iterator
from typing import Protocol

import numpy as np

from turing_learning.robots._clock import Clock
from turing_learning.robots.tracking._images import CameraError

_MOST_OLD = 200  # images that a camera may have kept for later
_MOST_MORE = 5  # images taken to tell whether the last ones were late, or one was left out
_MOST_LOST = 0.1  # share of the images that may be lost, each alone


class Camera(Protocol):
    """A camera that waits for its next image. Where it has `taken_s`, that is the time stamp of the last one, by the clock."""

    def take(self) -> np.ndarray:
        """Return the next image (H, W, 3), blue, green, red; raise CameraError if there is none."""

    def close(self) -> None:
        """Release the camera."""


class PunctualImages:
    """Images (H, W, 3) that a camera takes at a regular interval, the first not before `begin_s`, by the clock.

    A camera takes its images regularly, but they arrive when the computer has time: an image may be late if
    the next ones are not. One that was lost alone, by the time stamps of the next two, is None. After the last of `count` images,
    `fault` says if others were left out, or they came too fast; it is empty otherwise. Iterating raises CameraError if there are
    no images.
    """

    def __init__(self, camera: Camera, clock: Clock, begin_s: float, count: int, interval_s: float) -> None:
        self._camera, self._clock, self._begin_s, self._count = camera, clock, begin_s, count
        self._interval_s = interval_s
        self.fault = ""

    def __iter__(self) -> Iterator[np.ndarray | None]:
        interval_s, camera, clock = self._interval_s, self._camera, self._clock
        clock.sleep(self._begin_s - interval_s - clock.now())
        begun = drop_old_images(camera, clock, interval_s)
        delays: list[float] = []  # of each image after the time at which a regular camera takes it
        ahead: deque[tuple[np.ndarray, float]] = deque()
        frame, lost = 0, 0

        def late(stamp_s: float) -> float:
            return stamp_s - begun - frame * interval_s

        while frame < self._count:
            image, stamp_s = ahead.popleft() if ahead else take_stamped(camera, clock)
            most = late(stamp_s) - delays[-1] if delays and hasattr(camera, "taken_s") else 0.0
            if 0.75 < most / interval_s < 1.5 and frame < self._count - 1 and lost < _MOST_LOST * self._count:
                ahead.append(take_stamped(camera, clock))
                if late(ahead[0][1]) - delays[-1] > 1.75 * interval_s:
                    yield None
                    frame, lost = frame + 1, lost + 1
            delays.append(late(stamp_s))
            frame += 1
            if frame <= self._count:
                yield image
        while delays[-1] - min(delays) > interval_s / 2 and len(delays) < self._count + _MOST_MORE:
            delays.append(late(take_stamped(camera, clock)[1]))
            frame += 1
        if found := _irregularity(np.array(delays), interval_s, lost):
            advice = "Check camera.fps, and that the PC has nothing else to do."
            self.fault = f"`camera` must give an image every {interval_s:.3g} s; got {found}. {advice}"


def _irregularity(delays: np.ndarray, interval_s: float, lost: int) -> str:
    """Return what is wrong: images came too fast, or one was left out, after which all come later; empty if nothing is.

    If images were taken for lost that were not, all come earlier afterwards.
    """
    before, after = np.minimum.accumulate(delays), np.minimum.accumulate(delays[::-1])[::-1]
    third = max(len(delays) // 3, 1)
    if (after - before).max() > interval_s / 2:
        return f"one left out before image {int(np.argmax(after - before > interval_s / 2))}, or more"
    too_fast = np.median(delays[-third:]) - np.median(delays[:third]) < -interval_s / 2
    return "them faster" if too_fast or (lost and before[0] - before[-1] > interval_s / 2) else ""


def take_stamped(camera: Camera, clock: Clock) -> tuple[np.ndarray, float]:
    """Return the next image and its time stamp: the camera's, else the time at which it was taken."""
    image = camera.take()
    return image, getattr(camera, "taken_s", clock.now())


def drop_old_images(camera: Camera, clock: Clock, interval_s: float) -> float:
    """Take the images that a camera has buffered, and the first new one; return its time stamp.

    Raise CameraError if all are old.
    """
    begun, stamped = clock.now(), hasattr(camera, "taken_s")
    for _ in range(_MOST_OLD):
        asked = clock.now()
        _, taken_s = take_stamped(camera, clock)
        if taken_s - (begun if stamped else asked) >= interval_s / 4:
            return taken_s
    raise CameraError(f"`camera` must give an image every {interval_s:.3g} s; got {_MOST_OLD} without a pause.")
