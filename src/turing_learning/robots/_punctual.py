"""Images at the right moments."""

from collections.abc import Iterator

import numpy as np

from ._capture import CameraError
from ._clock import Clock
from ._equipment import Camera

_MOST_OLD = 200  # images that a camera may have kept for later


def punctual_images(
    camera: Camera, clock: Clock, begin_s: float, count: int, interval_s: float
) -> Iterator[np.ndarray]:
    """Yield images (H, W, 3) that were taken one interval after the other.

    Parameters
    ----------
    begin_s
        When the first is taken, by the clock; not before.
    count
        How many.
    interval_s
        Time between two images.

    Raises
    ------
    CameraError
        If there is none, or one comes more than half an interval too early or too late: one was left out, or the camera is
        not as fast as it should be.
    """
    clock.sleep(begin_s - interval_s - clock.now())
    _drop_old(camera, clock, interval_s)
    start = 0.0
    for number in range(count):
        image = camera.take()
        now = clock.now()
        start = now if number == 0 else start
        late = now - start - number * interval_s
        if abs(late) > interval_s / 2:
            raise CameraError(
                f"`camera` must give an image every {interval_s:.3g} s; got image {number} {abs(late):.2f} s too "
                f"{'late' if late > 0 else 'early'}. Check camera.fps, and that the PC has nothing else to do."
            )
        yield image


def _drop_old(camera: Camera, clock: Clock, interval_s: float) -> None:
    """Take images until one has to be waited for: cameras keep some for who does not come in time."""
    for _ in range(_MOST_OLD):
        asked = clock.now()
        camera.take()
        if clock.now() - asked >= interval_s / 4:
            return
    raise CameraError(f"`camera` must give an image every {interval_s:.3g} s; got {_MOST_OLD} without a pause.")
