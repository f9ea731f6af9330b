"""Cameras: OpenCV, imported when it is first used, images, and where a camera is and how its lens bends lines."""

import json
import threading
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning._files import whole
from turing_learning.arrays import array
from turing_learning.errors import integer, number, optional, refuse, require
from turing_learning.robots._clock import Clock, RealClock

PATIENCE_S = 5.0  #: Time without an image after which a camera has failed
# So long after an image was taken, the next ones are decoded and kept
_WANTED_S = 2.0
_MOST_KEPT = 64  # images that wait for a busy program
SETTINGS = {
    "fourcc": "FOURCC", "width": "FRAME_WIDTH", "height": "FRAME_HEIGHT", "fps": "FPS", "exposure": "EXPOSURE",
    "white_balance": "WB_TEMPERATURE",
}  # fmt: skip
"""What a camera may be asked for, and OpenCV's name of it; first the format, on which others depend."""
# The automatics of a setting, and the value that switches them off
_AUTOMATIC = {"exposure": ("AUTO_EXPOSURE", 1), "white_balance": ("AUTO_WB", 0)}


class CameraError(ConnectionError):
    """A camera gives no images."""


class _Vision:
    """OpenCV, imported when it is first used; `MissingExtraError` says that it is not installed."""

    def __getattr__(self, name: str) -> Any:
        return getattr(optional("cv2", "OpenCV", "vision"), name)


cv2 = _Vision()


def require_image(name: str, image: np.ndarray, size: tuple[int, int] | None = None) -> None:
    """Reject what is not a color image (H, W, 3) of 8 bits, or not of `size`, width and height in pixels."""
    expected = "(H, W, 3)" if size is None else f"({size[1]}, {size[0]}, 3)"
    if size is None:
        fits = image.ndim == 3 and image.shape[2] == 3
    else:
        fits = image.shape == (size[1], size[0], 3)
    got = f"{image.shape} of {image.dtype}"
    require(fits and image.dtype == np.uint8, name, f"be an image {expected} of uint8", got)


def gray(image: np.ndarray) -> np.ndarray:
    """Return the brightness (H, W) of an image (H, W, 3) in blue, green, red."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))


class Capture(AbstractContextManager["Capture"]):
    """Take images from a camera or a video. A context manager; iterating gives the remaining images of a video.

    Raises FileNotFoundError if there is no such file, `CameraError` if the camera or the video cannot be
    opened.

    Parameters
    ----------
    source
        Number of a camera, path of a video, or the URL of a stream.
    settings
        What a camera is asked for: `fourcc` (four letters), `width`, `height` (pixels), `fps`, `exposure` and
        `white_balance` (the units of its driver; both switch the automatic off). None leaves a setting alone.
        What it has granted says `granted`, in words.
    """

    def __init__(self, source: int | str | Path, settings: Mapping[str, Any] | None = None) -> None:
        served = "://" in str(source)
        self._name = f"camera {source}"
        self._remedy = "Check its cable, and that no other program uses it."
        if not isinstance(source, int):
            self._name = repr(str(source))
            source = str(source)
            self._remedy = (
                "Check that it is served." if served else "Check that it plays elsewhere."
            )
            if not served and not Path(source).is_file():
                raise FileNotFoundError(
                    f"`source` must be a camera's number, a video file or a URL; got {self._name}."
                )
        self._device = cv2.VideoCapture(source)
        if not self._device.isOpened():
            raise CameraError(
                f"`source` must be a camera or a video that opens; got {self._name}. {self._remedy}"
            )
        settings = settings or {}
        asked = {name: settings[name] for name in SETTINGS if settings.get(name) is not None}
        properties = {name: getattr(cv2, f"CAP_PROP_{SETTINGS[name]}") for name in asked}
        for name, value in asked.items():
            if name in _AUTOMATIC:
                automatic, off = _AUTOMATIC[name]
                self._device.set(getattr(cv2, f"CAP_PROP_{automatic}"), off)
            if name == "fourcc":
                value = cv2.VideoWriter_fourcc(*value)
            self._device.set(properties[name], float(value))
        got = {name: format(self._device.get(properties[name]), "g") for name in asked}
        if "fourcc" in got:
            code = int(self._device.get(properties["fourcc"]))
            got["fourcc"] = code.to_bytes(4, "little", signed=True).decode("latin-1").strip("\0")
        self.granted = ", ".join(f"{name} {value}" for name, value in got.items())

    def __exit__(self, *_: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[np.ndarray]:
        while (image := self._next()) is not None:
            yield image

    def take(self) -> np.ndarray:
        """Return the next image (H, W, 3), blue, green, red, that was not taken yet; raise `CameraError` if there is none."""
        image = self._next()
        if image is None:
            raise CameraError(
                f"`source` must give images; got none more from {self._name}. {self._remedy}"
            )
        return image

    def _next(self) -> np.ndarray | None:
        return self._device.read()[1]

    def require_rate(self, fps: float) -> None:
        """Reject a video whose frame rate is another one, by more than 1 %; one that names none is taken."""
        rate = float(self._device.get(cv2.CAP_PROP_FPS))
        fits = not rate > 0 or abs(fps / rate - 1) <= 0.01
        require(fits, "camera.fps", f"be the frame rate of the video, {rate:g}", f"{fps:g}")

    def close(self) -> None:
        """Release the camera."""
        self._device.release()


class LiveCapture(Capture):
    """Take images from a camera as they come: a thread takes and stamps them while the program is busy.

    So no image waits in a buffer of the driver, and an image that was lost shows in the time stamps of the
    others. `source` and `settings` are those of `Capture`, `clock` is for the time stamps, the computer's by
    default; `taken_s` is when the image came that `take` returned last.
    """

    def __init__(
        self,
        source: int | str | Path,
        settings: Mapping[str, Any] | None = None,
        *,
        clock: Clock | None = None,
    ) -> None:
        super().__init__(source, settings)
        self._clock = clock or RealClock()
        self.taken_s = self._wanted_until = self._clock.now()
        self._images: deque[tuple[float, np.ndarray]] = deque(maxlen=_MOST_KEPT)
        self._news = threading.Condition()
        self._done = False
        self._thread = threading.Thread(target=self._follow, daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[np.ndarray]:
        while True:
            yield self.take()

    def _next(self) -> np.ndarray | None:
        with self._news:
            self._wanted_until = self._clock.now() + _WANTED_S
            self._news.wait_for(lambda: self._images or self._done, PATIENCE_S)
            if not self._images:
                return None
            self._wanted_until = self._clock.now() + _WANTED_S
            self.taken_s, image = self._images.popleft()
        return image

    def close(self) -> None:
        self._done = True
        self._thread.join(PATIENCE_S)
        # One that a driver does not let go must not lose its device
        if not self._thread.is_alive():
            super().close()

    def _follow(self) -> None:
        while not self._done and self._device.grab():
            came_s = self._clock.now()
            # Nobody takes images: what is old is of no use
            if came_s > self._wanted_until:
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


FORMAT = "turing-learning camera calibration"
VERSION = 1
LEAST_VIEWS = 5
LEAST_CORNERS = 8  #: Corners of the board that a view must show to be used
#: Root mean square reprojection error (pixels) above which a calibration is rejected
LARGEST_ERROR_PX = 1.0


@dataclass(frozen=True)
class Board:
    """A printed ChArUco board: chess squares with ArUco markers in the white ones. Views may show a part of it."""

    columns: int = 8  #: Number of squares in a row
    rows: int = 6  #: Number of rows
    square_cm: float = 5.0  #: Side of a square as printed

    def __post_init__(self) -> None:
        fits = min(self.columns, self.rows) >= 3 and self.columns * self.rows <= 100
        rule = "have 3 x 3 to 100 squares"
        require(fits, "board", rule, f"{self.columns} columns and {self.rows} rows")
        number("board.square_cm", self.square_cm, above=0)

    @cached_property
    def _charuco(self) -> Any:
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        return cv2.aruco.CharucoBoard(
            (self.columns, self.rows), self.square_cm, 0.75 * self.square_cm, dictionary
        )

    def image(self, pixels_per_square: int = 60) -> np.ndarray:
        """Return the board (rows * pixels, columns * pixels), in gray, to be printed without scaling."""
        size = (self.columns * pixels_per_square, self.rows * pixels_per_square)
        return np.asarray(self._charuco.generateImage(size))

    def find(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the inner corners in sight: on the board (n, 3) in cm, and in the image (n, 2) in pixels."""
        corners, identities, _, _ = cv2.aruco.CharucoDetector(self._charuco).detectBoard(
            gray(image)
        )
        if identities is None:
            return np.empty((0, 3)), np.empty((0, 2))
        on_board = np.asarray(self._charuco.getChessboardCorners(), dtype=np.float64)[
            np.ravel(identities)
        ]
        return on_board, np.asarray(corners, dtype=np.float64).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Lens:
    """A lens, wherever the camera is."""

    image_size: tuple[int, int]  #: Width and height in pixels
    camera_matrix: np.ndarray  #: (3, 3): Focal lengths and principal point (pixels)
    distortion: np.ndarray  #: (5,): k1, k2, p1, p2, k3 of OpenCV
    error_px: float = 0.0  #: Root mean square reprojection error (pixels)

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Return where the lines of sight of pixels (n, 2) cross the plane at distance 1, (n, 2)."""
        points = np.ascontiguousarray(pixels, dtype=np.float64).reshape(-1, 1, 2)
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 12, 1e-9)
        straight = cv2.undistortPoints(points, self.camera_matrix, self.distortion, criteria=stop)
        return np.asarray(straight).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Calibration:
    """A lens at its place above the arena."""

    lens: Lens  #: The lens
    #: (3, 3): From the arena's axes (x, y on the floor, z up) to the camera's (right, down, forward)
    rotation: np.ndarray
    translation: np.ndarray  #: (3,): The arena's origin in the camera's axes (cm)
    #: Root mean square reprojection error of the landmarks (pixels)
    error_px: float = 0.0

    @property
    def position_cm(self) -> np.ndarray:
        """Position of the camera (3,): x, y and height above the floor (cm)."""
        return np.asarray(-self.rotation.T @ self.translation)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return the pixels (n, 2) at which points (n, 3) of the arena (cm) appear."""
        vector, _ = cv2.Rodrigues(self.rotation)
        points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 1, 3)
        pixels, _ = cv2.projectPoints(
            points, vector, self.translation, self.lens.camera_matrix, self.lens.distortion
        )
        return np.asarray(pixels).reshape(-1, 2)

    def locate(self, pixels: np.ndarray, height_cm: float = 0.0) -> np.ndarray:
        """Return x, y (n, 2) in cm of points that appear at pixels (n, 2) and lie `height_cm` above the floor.

        A robot's marker is nearer to the camera than the floor: without its height, a robot 150 cm from a
        camera at 270 cm whose marker is 6 cm high would be found 3.4 cm too far out.
        """
        above = self.rotation[:, 2] * height_cm + self.translation
        # From x, y at that height to rays
        plane = np.column_stack([self.rotation[:, 0], self.rotation[:, 1], above])
        rays = self.lens.rays(pixels)
        on_plane = np.column_stack([rays, np.ones(len(rays))]) @ np.linalg.inv(plane).T
        return np.asarray(on_plane[:, :2] / on_plane[:, 2:])

    def map_pixels(self, height_cm: float) -> np.ndarray:
        """Return x, y (H, W, 2) in cm, float32, of every pixel's line of sight at a height."""
        width, height = self.lens.image_size
        pixels = np.indices((height, width), np.float64)[::-1].reshape(2, -1).T
        return self.locate(pixels, height_cm).reshape(height, width, 2).astype(np.float32)

    def save(self, path: str | Path, *, force: bool = False) -> None:
        """Write plain JSON, atomically; raise FileExistsError for a file that exists, unless `force`."""
        refuse_taken(Path(path), name="path", force=force)
        content = {
            "format": FORMAT, "version": VERSION, "image_size": self.lens.image_size,
            "camera_matrix": self.lens.camera_matrix.tolist(), "distortion": self.lens.distortion.tolist(),
            "lens_error_px": self.lens.error_px, "rotation": self.rotation.tolist(),
            "translation": self.translation.tolist(), "error_px": self.error_px,
        }  # fmt: skip
        with whole(Path(path)) as temporary:
            temporary.write_text(
                json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8"
            )

    @classmethod
    def load(cls, path: str | Path) -> "Calibration":
        """Read a file that `save` has written; reject anything else."""
        file = str(path)
        try:
            content = json.loads(Path(path).read_text(encoding="utf-8"))
        except ValueError as error:
            refuse("calibration", "be a JSON file", str(error), place=file)
        rule = f"be a {FORMAT} of version {VERSION}"
        known = {"format": FORMAT, "version": VERSION}
        readable = isinstance(content, dict) and known.items() <= content.items()
        require(readable, "calibration", rule, "something else", place=file)

        def read(name: str, shape: str, **kind: Any) -> np.ndarray:
            return array(name, content.get(name), shape, place=file, **kind)

        rotation = read("rotation", "3 3")
        orthogonal = np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6)
        require(orthogonal, "rotation", "be a rotation", rotation.tolist(), place=file)
        size = read("image_size", "2", dtype=np.int64).tolist()
        width, height = (integer("image_size", side, 1, place=file) for side in size)
        lens_px = number("lens_error_px", content.get("lens_error_px"), place=file)
        error_px = number("error_px", content.get("error_px"), place=file)
        lens = Lens((width, height), read("camera_matrix", "3 3"), read("distortion", "5"), lens_px)
        return cls(lens, rotation, read("translation", "3"), error_px)


def refuse_taken(path: Path, *, name: str, force: bool) -> None:
    """Raise FileExistsError if a file exists that may not be replaced; `name` is the argument that names it."""
    if path.exists() and not force:
        raise FileExistsError(
            f"`{name}` must be a new file; got {path}. Choose another, or force=True."
        )


def calibrate_lens(images: Sequence[np.ndarray], board: Board) -> Lens:
    """Calibrate a lens from views of a printed board, tilted and shown in all parts of the image.

    Parameters
    ----------
    images : sequence of (H, W, 3)
        At least `LEAST_VIEWS` that show `LEAST_CORNERS` corners each.
    board
        What they show.
    """
    for image in images:
        require_image("images", image)
    sizes = sorted({image.shape for image in images})
    require(len(sizes) <= 1, "images", "have one size", sizes)
    views = [view for view in map(board.find, images) if len(view[0]) >= LEAST_CORNERS]
    rule = f"show {LEAST_CORNERS} or more corners of the board in {LEAST_VIEWS} or more views"
    got = f"{len(views)} such views of {len(images)}"
    remedy = "Check that the printed board is the one that is configured."
    require(len(views) >= LEAST_VIEWS, "images", rule, got, remedy)
    size = (images[0].shape[1], images[0].shape[0])
    points = [view[0].astype(np.float32).reshape(-1, 1, 3) for view in views]
    pixels = [view[1].astype(np.float32).reshape(-1, 1, 2) for view in views]
    error, matrix, distortion, _, _ = cv2.calibrateCamera(points, pixels, size, None, None)
    _require_fit(
        "images", float(error), "Hold the board flat and still, and print it without scaling."
    )
    return Lens(size, np.asarray(matrix), np.asarray(distortion).ravel()[:5], float(error))


def _require_fit(name: str, error: float, remedy: str) -> None:
    rule = f"fit the calibration to {LARGEST_ERROR_PX} pixels (root mean square)"
    require(error <= LARGEST_ERROR_PX, name, rule, f"{error:.2f}", remedy)


def place_camera(
    lens: Lens, image: np.ndarray, landmarks: Mapping[int, tuple[float, float]]
) -> Calibration:
    """Find where the camera is, from printed ArUco markers on the floor.

    Parameters
    ----------
    lens, image : (H, W, 3)
        Of the camera; the arena, its landmarks in sight.
    landmarks
        The centre of each marker (cm, in the arena's axes) by its identity in `DICT_4X4_50`; four or more.
        Far apart is best: the corners and the middles of the walls.
    """
    require_image("image", image, lens.image_size)
    centers = aruco_centers(image)
    identities = sorted(centers.keys() & landmarks.keys())
    rule = f"show 4 or more of the landmarks {sorted(landmarks)}"
    require(len(identities) >= 4, "image", rule, identities)
    points = np.array([(*landmarks[identity], 0.0) for identity in identities])
    pixels = np.array([centers[identity] for identity in identities])
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    in_sight = f"those in sight at {points[:, :2].tolist()}"
    require(spread[1] >= 0.05 * spread[0], "landmarks", "not lie on one line", in_sight)
    _, vector, translation = cv2.solvePnP(points, pixels, lens.camera_matrix, lens.distortion)
    rotation, _ = cv2.Rodrigues(vector)
    calibration = Calibration(lens, np.asarray(rotation), np.asarray(translation).ravel())
    error = float(np.sqrt(np.mean(np.sum((calibration.project(points) - pixels) ** 2, axis=1))))
    _require_fit(
        "landmarks", error, "Measure their places again, and check which identity lies where."
    )
    return replace(calibration, error_px=error)


def aruco_centers(image: np.ndarray) -> dict[int, np.ndarray]:
    """Return the centre (2,), in pixels, of each landmark in sight: where the diagonals of its corners meet."""
    centers = {}
    for identity, corners in zip(*find_squares(aruco_detector("4X4_50"), image), strict=True):
        diagonal = corners[2] - corners[0]
        second = corners[3] - corners[1]
        share, _ = np.linalg.solve(np.column_stack([diagonal, -second]), corners[1] - corners[0])
        centers[identity] = corners[0] + share * diagonal
    return centers


def aruco_detector(dictionary: str, **settings: float) -> Any:
    """Return OpenCV's detector of square markers, with its settings over the usual ones."""
    parameters = cv2.aruco.DetectorParameters()
    words = getattr(cv2.aruco, f"DICT_{dictionary}")
    for name, value in (
        {"cornerRefinementMethod": cv2.aruco.CORNER_REFINE_SUBPIX} | settings
    ).items():
        setattr(parameters, name, value)
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(words), parameters)


def find_squares(detector: Any, image: np.ndarray) -> tuple[list[int], np.ndarray]:
    """Return the identities of the square markers in an image (H, W, 3), and their corners (n, 4, 2) in pixels."""
    squares, identities, _ = detector.detectMarkers(gray(image))
    corners = np.array([np.reshape(square, (4, 2)) for square in squares], np.float64).reshape(
        -1, 4, 2
    )
    return [] if identities is None else np.ravel(identities).tolist(), corners
