"""Images from a camera, or from a recorded video."""

from collections.abc import Iterator
from pathlib import Path
from typing import Self

import numpy as np

from ._opencv import vision


class CameraError(ConnectionError):
    """A camera gives no images."""


class Capture:
    """Take images from a camera or a video. A context manager; iterating takes all that are left of a video.

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
        self._source = source
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
        """Return the next image (H, W, 3), blue, green, red.

        Raises
        ------
        CameraError
            If there is none.
        """
        taken, image = self._device.read()
        if not taken:
            raise CameraError(f"`source` must give images; got none more from {self._name}. {self._remedy}")
        return np.asarray(image)

    def close(self) -> None:
        """Release the camera."""
        self._device.release()

    @property
    def _name(self) -> str:
        return f"camera {self._source}" if isinstance(self._source, int) else f"{str(self._source)!r}"

    @property
    def _remedy(self) -> str:
        if "://" in str(self._source):
            return "Check that it is served."
        camera = isinstance(self._source, int)
        return "Check its cable, and that no other program uses it." if camera else "Check that it plays elsewhere."
