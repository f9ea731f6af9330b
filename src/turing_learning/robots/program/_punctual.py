"""Images at the right moments: regular in time, and none left out."""

from collections.abc import Iterator

import numpy as np

from turing_learning.robots._clock import Clock
from turing_learning.robots.tracking._images import CameraError

from ._equipment import Camera

_MOST_OLD = 200  # images that a camera may have kept for later
_MOST_MORE = 5  # images taken to tell whether the last ones were late, or one was left out


def punctual_images(
    camera: Camera, clock: Clock, begin_s: float, count: int, interval_s: float
) -> Iterator[np.ndarray]:
    """Yield `count` images (H, W, 3) that were taken at a regular interval, the first not before `begin_s`, by the clock.

    A camera takes its images regularly, but they arrive when the computer has time: an image may be late if the next ones
    are not. Raise CameraError if there is none; after the last one, if one was left out, or they came too fast.
    """
    clock.sleep(begin_s - interval_s - clock.now())
    begun = drop_old_images(camera, clock, interval_s)
    delays: list[float] = []  # of each image after the time at which a regular camera takes it
    for number in range(count):
        image, taken_s = take_stamped(camera, clock)
        delays.append(taken_s - begun - number * interval_s)
        yield image
    while delays[-1] - min(delays) > interval_s / 2 and len(delays) < count + _MOST_MORE:
        delays.append(take_stamped(camera, clock)[1] - begun - len(delays) * interval_s)
    _require_regular(np.array(delays), interval_s)


def _require_regular(delays: np.ndarray, interval_s: float) -> None:
    """Reject images that came too fast, and a step in the delays: after an image that was left out, all come later."""
    before, after = np.minimum.accumulate(delays), np.minimum.accumulate(delays[::-1])[::-1]
    lost = after - before
    third = max(len(delays) // 3, 1)
    drift = float(np.median(delays[-third:]) - np.median(delays[:third]))
    if lost.max() > interval_s / 2:
        place = int(np.argmax(lost > interval_s / 2))
        fault = f"one left out before image {place}, or more"
    elif drift < -interval_s / 2:
        fault = "them faster"
    else:
        return
    raise CameraError(
        f"`camera` must give an image every {interval_s:.3g} s; got {fault}. Check camera.fps, and that the PC has nothing "
        "else to do."
    )


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
