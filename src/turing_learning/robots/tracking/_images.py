"""Images: OpenCV, imported when it is first used, and cameras and videos that it opens."""

import threading
from collections import deque
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any, Self

import numpy as np

from turing_learning.errors import optional, require
from turing_learning.robots._clock import Clock, RealClock

PATIENCE_S = 5.0  #: Time without an image after which a camera has failed
_WANTED_S = 2.0  # so long after an image was taken, the next ones are decoded and kept
_MOST_KEPT = 64  # images that wait for a busy program


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
    settings
        What a camera is asked for: `fourcc` (four letters), `width`, `height` (pixels), `fps`, `exposure` and
        `white_balance` (the units of its driver; both switch the automatic off). None leaves a setting alone.

    Attributes
    ----------
    granted
        What a camera with settings has granted, in words; empty without settings.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    CameraError
        If the camera or the video cannot be opened.
    """

    def __init__(self, source: int | str | Path, settings: Mapping[str, Any] | None = None) -> None:
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
        asked = {name: value for name, value in (settings or {}).items() if value is not None}
        self.granted = self._configure(asked) if asked else ""

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
            raise self._failed()
        return np.asarray(image)

    def require_rate(self, fps: float) -> None:
        """Reject a video whose frame rate is another one, by more than 1 %; one that names none is taken."""
        rate = float(self._device.get(vision().CAP_PROP_FPS))
        fits = not rate > 0 or abs(fps / rate - 1) <= 0.01
        require(fits, "camera.fps", f"be the frame rate of the video, {rate:g}", f"{fps:g}")

    def close(self) -> None:
        """Release the camera."""
        self._device.release()

    def _failed(self) -> CameraError:
        return CameraError(f"`source` must give images; got none more from {self._name}. {self._remedy}")

    def _configure(self, asked: Mapping[str, Any]) -> str:
        """Ask the camera for settings, first the format, on which others depend; return what it has granted."""
        cv2 = vision()
        known = {
            "fourcc": cv2.CAP_PROP_FOURCC,
            "width": cv2.CAP_PROP_FRAME_WIDTH,
            "height": cv2.CAP_PROP_FRAME_HEIGHT,
            "fps": cv2.CAP_PROP_FPS,
            "exposure": cv2.CAP_PROP_EXPOSURE,
            "white_balance": cv2.CAP_PROP_WB_TEMPERATURE,
        }
        manual = {"exposure": (cv2.CAP_PROP_AUTO_EXPOSURE, 1), "white_balance": (cv2.CAP_PROP_AUTO_WB, 0)}
        for name in [name for name in known if name in asked]:
            if name in manual:
                self._device.set(*manual[name])
            value = cv2.VideoWriter_fourcc(*asked[name]) if name == "fourcc" else asked[name]
            self._device.set(known[name], float(value))
        got = {name: self._device.get(known[name]) for name in known if name in asked}
        if "fourcc" in got:
            got["fourcc"] = int(got["fourcc"]).to_bytes(4, "little", signed=True).decode("latin-1").strip("\0")
        texts = (f"{name} {value if isinstance(value, str) else format(value, 'g')}" for name, value in got.items())
        return ", ".join(texts)


class LiveCapture(Capture):
    """Take images from a camera as they come: a thread takes and stamps them while the program is busy.

    So no image waits in a buffer of the driver, and an image that was lost shows in the time stamps of the others.

    Parameters
    ----------
    source, settings
        See `Capture`.
    clock
        For the time stamps; the computer's by default.

    Attributes
    ----------
    taken_s
        When the image came that `take` returned last, by the clock.
    """

    def __init__(
        self, source: int | str | Path, settings: Mapping[str, Any] | None = None, *, clock: Clock | None = None
    ) -> None:
        super().__init__(source, settings)
        self._clock = clock or RealClock()
        self.taken_s = self._wanted_until = self._clock.now()
        self._images: deque[tuple[float, np.ndarray]] = deque(maxlen=_MOST_KEPT)
        self._news, self._done = threading.Condition(), False
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[np.ndarray]:
        while True:
            yield self.take()

    def take(self) -> np.ndarray:
        """Return the next image (H, W, 3) that was not taken yet; raise `CameraError` if none comes."""
        with self._news:
            self._wanted_until = self._clock.now() + _WANTED_S
            self._news.wait_for(lambda: self._images or self._done, PATIENCE_S)
            if not self._images:
                raise self._failed()
            self._wanted_until = self._clock.now() + _WANTED_S
            self.taken_s, image = self._images.popleft()
        return image

    def close(self) -> None:
        """Release the camera."""
        self._done = True
        self._thread.join(PATIENCE_S)
        if not self._thread.is_alive():  # one that a driver does not let go must not lose its device
            super().close()

    def _follow(self) -> None:
        while not self._done and self._device.grab():
            came_s = self._clock.now()
            if came_s > self._wanted_until:  # nobody takes images: what is old is of no use
                self._images.clear()
                continue
            taken, image = self._device.retrieve()
            if taken:
                with self._news:
                    self._images.append((came_s, np.asarray(image)))
                    self._news.notify()
        with self._news:
            self._done = True
            self._news.notify()
