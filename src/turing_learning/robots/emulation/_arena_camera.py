"""The overhead camera of an emulated laboratory: an image is rendered when one is taken, and not before."""

import math
from collections.abc import Callable, Iterator
from typing import Self

import numpy as np

from turing_learning.robots._clock import VirtualClock
from turing_learning.robots.tracking._capture import CameraError

from ._camera import EmulatedCamera

_TICK = 1e-6


class ArenaCamera:
    """Take images as `Capture` does: each one waits, by the laboratory's clock, for the next.

    Parameters
    ----------
    clock
        Of the laboratory.
    snapshot
        Returns the image (H, W, 3) of this moment.
    interval_s
        Time between images.
    lag_s
        Time of the first image.

    Attributes
    ----------
    frozen
        Whether it gives the same image again and again.
    unplugged
        Whether it gives none.
    """

    def __init__(
        self, clock: VirtualClock, snapshot: Callable[[], np.ndarray], interval_s: float, lag_s: float
    ) -> None:
        self._clock, self._snapshot, self._interval_s, self._lag_s = clock, snapshot, interval_s, lag_s
        self._last: np.ndarray | None = None
        self._number = -1
        self.frozen = self.unplugged = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[np.ndarray]:
        while True:
            yield self.take()

    def take(self) -> np.ndarray:
        """Return the next image (H, W, 3), blue, green, red.

        Raises
        ------
        CameraError
            If the camera is unplugged.
        """
        if self.unplugged:
            raise CameraError("`source` must give images; got none more from the emulated camera. Check its cable.")
        self._number = max(self._number + 1, math.ceil((self._clock.now() - self._lag_s) / self._interval_s - _TICK))
        self._clock.sleep_until(self._lag_s + self._number * self._interval_s)
        return self.snapshot()

    def snapshot(self) -> np.ndarray:
        """Return the image (H, W, 3) of this moment, or the last one if the camera is frozen."""
        if self._last is None or not self.frozen:
            self._last = self._snapshot()
        return self._last.copy()

    def close(self) -> None:
        """Release the camera: nothing to do."""


class Eye:
    """Render what is to be seen.

    Parameters
    ----------
    camera
        The renderer.
    poses
        Returns where the robots are (A, 3).

    Attributes
    ----------
    covered
        Robots whose marker is hidden.
    """

    def __init__(self, camera: EmulatedCamera, poses: Callable[[], np.ndarray]) -> None:
        self._camera, self._poses = camera, poses
        self.covered: set[int] = set()

    def __call__(self) -> np.ndarray:
        """Return the image (H, W, 3) of this moment."""
        return self._camera.render(self._poses(), tuple(self.covered))
