"""Images: OpenCV, imported when it is first used, and cameras and videos that it opens."""

from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Self

import numpy as np

from turing_learning.errors import optional, require


class CameraError(ConnectionError):
    """A camera gives no images."""


def vision() -> ModuleType:
    """Return OpenCV; raise `MissingExtraError` if it is not installed."""
    return optional("cv2", "OpenCV", "vision")


def require_image(name: str, image: np.ndarray, size: tuple[int, int] | None = None) -> None:
    """Reject what is not a color image (H, W, 3) of 8 bits, or not of `size`, width and height in pixels."""
    expected = "(H, W, 3)" if size is None else f"({size[1]}, {size[0]}, 3)"
    fits = image.ndim == 3 and image.shape[2] == 3 if size is None else image.shape == (size[1], size[0], 3)
    got = f"{image.shape} of {image.dtype}"
    require(fits and image.dtype == np.uint8, name, f"be an image {expected} of uint8", got)


def gray(image: np.ndarray) -> np.ndarray:
    """Return the brightness (H, W) of an image (H, W, 3) in blue, green, red."""
    cv2 = vision()
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))


class Capture:
    """Take images from a camera or a video. A context manager; iterating gives the remaining images of a video.

    Parameters
    ----------
    source
        Number of a camera, path of a video, or the URL of a stream.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    CameraError
        If the camera or the video cannot be opened.
    """

    def __init__(self, source: int | str | Path) -> None:
        if not isinstance(source, int) and "://" not in str(source) and not Path(source).is_file():
            raise FileNotFoundError(f"`source` must be a camera's number, a video file or a URL; got {str(source)!r}.")
        if isinstance(source, int):
            self._name, self._remedy = f"camera {source}", "Check its cable, and that no other program uses it."
        else:
            served = "://" in str(source)
            self._name = repr(str(source))
            self._remedy = "Check that it is served." if served else "Check that it plays elsewhere."
        self._device = vision().VideoCapture(source if isinstance(source, int) else str(source))
        if not self._device.isOpened():
            raise CameraError(f"`source` must be a camera or a video that opens; got {self._name}. {self._remedy}")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[np.ndarray]:
        while True:
            taken, image = self._device.read()
            if not taken:
                return
            yield np.asarray(image)

    def take(self) -> np.ndarray:
        """Return the next image (H, W, 3), blue, green, red; raise `CameraError` if there is none."""
        taken, image = self._device.read()
        if not taken:
            raise CameraError(f"`source` must give images; got none more from {self._name}. {self._remedy}")
        return np.asarray(image)

    def close(self) -> None:
        """Release the camera."""
        self._device.release()
