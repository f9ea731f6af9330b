"""Where the camera is and how its lens bends lines: pixels to centimetres and back."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning._files import whole
from turing_learning.robots._files import refuse_taken

from ._opencv import gray, require_image, vision

FORMAT = "turing-learning camera calibration"
VERSION = 1
LEAST_VIEWS = 5
LEAST_CORNERS = 8
"""Corners of the board that a view must show to be used."""
LARGEST_ERROR_PX = 1.0
"""Root mean square reprojection error (pixels) beyond which a calibration is refused."""
_SHAPES = {"camera_matrix": (3, 3), "distortion": (5,), "rotation": (3, 3), "translation": (3,)}


@dataclass(frozen=True)
class Board:
    """A printed ChArUco board, chess squares with ArUco markers in the white ones: any part of it that is seen counts.

    Attributes
    ----------
    columns, rows
        Number of squares.
    square_cm
        Side of a square as printed.
    """

    columns: int = 8
    rows: int = 6
    square_cm: float = 5.0

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 3 or self.columns * self.rows > 100:
            raise ValueError(
                f"`board` must have 3 x 3 to 100 squares; got {self.columns} columns and {self.rows} rows."
            )
        if not self.square_cm > 0:
            raise ValueError(f"`board.square_cm` must be above 0; got {self.square_cm}.")

    @cached_property
    def _charuco(self) -> Any:
        aruco = vision().aruco
        dictionary = aruco.getPredefinedDictionary(aruco.DICT_4X4_50)
        return aruco.CharucoBoard((self.columns, self.rows), self.square_cm, 0.75 * self.square_cm, dictionary)

    def image(self, pixels_per_square: int = 60) -> np.ndarray:
        """Return the board (rows * pixels, columns * pixels), in gray, to be printed without scaling."""
        size = (self.columns * pixels_per_square, self.rows * pixels_per_square)
        return np.asarray(self._charuco.generateImage(size))

    def find(self, image: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the inner corners that are seen: on the board (n, 3) in cm, and in the image (n, 2) in pixels."""
        corners, identities, _, _ = vision().aruco.CharucoDetector(self._charuco).detectBoard(gray(image))
        if identities is None or len(identities) == 0:
            return np.empty((0, 3)), np.empty((0, 2))
        on_board = np.asarray(self._charuco.getChessboardCorners(), dtype=np.float64)[np.asarray(identities).ravel()]
        return on_board, np.asarray(corners, dtype=np.float64).reshape(-1, 2)


@dataclass(frozen=True, eq=False)
class Lens:
    """What a lens does to light, wherever the camera is.

    Attributes
    ----------
    image_size
        Width and height in pixels.
    camera_matrix : (3, 3)
        Focal lengths and principal point (pixels).
    distortion : (5,)
        k1, k2, p1, p2, k3 of OpenCV.
    error_px
        Root mean square reprojection error (pixels).
    """

    image_size: tuple[int, int]
    camera_matrix: np.ndarray
    distortion: np.ndarray
    error_px: float = 0.0

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Return where the lines of sight of pixels (n, 2) cross the plane at distance 1, (n, 2)."""
        cv2 = vision()
        points = np.ascontiguousarray(pixels, dtype=np.float64).reshape(-1, 1, 2)
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 12, 1e-9)
        straight = cv2.undistortPoints(points, self.camera_matrix, self.distortion, criteria=stop)
        return np.asarray(straight).reshape(-1, 2)


def calibrate_lens(images: Sequence[np.ndarray], board: Board) -> Lens:
    """Calibrate a lens from views of a printed board, tilted and shown in all parts of the image.

    Parameters
    ----------
    images : sequence of (H, W, 3)
        At least `LEAST_VIEWS` that show `LEAST_CORNERS` corners each.

    Raises
    ------
    ValueError
        If too few views show the board, or the model of the lens does not fit them.
    """
    for image in images:
        require_image("images", image)
    if len({image.shape for image in images}) > 1:
        raise ValueError(f"`images` must have one size; got {sorted({image.shape for image in images})}.")
    views = [view for view in map(board.find, images) if len(view[0]) >= LEAST_CORNERS]
    if len(views) < LEAST_VIEWS:
        raise ValueError(
            f"`images` must show {LEAST_CORNERS} or more corners of the board in {LEAST_VIEWS} or more views; got "
            f"{len(views)} such views of {len(images)}. Check that the printed board is the one that is configured."
        )
    size = (images[0].shape[1], images[0].shape[0])
    points = [view[0].astype(np.float32).reshape(-1, 1, 3) for view in views]
    pixels = [view[1].astype(np.float32).reshape(-1, 1, 2) for view in views]
    error, matrix, distortion, _, _ = vision().calibrateCamera(points, pixels, size, None, None)
    _require_fit("images", float(error), "Hold the board flat and still, and print it without scaling.")
    return Lens(size, np.asarray(matrix), np.asarray(distortion).ravel()[:5], float(error))


def _require_fit(name: str, error: float, remedy: str) -> None:
    if not error <= LARGEST_ERROR_PX:
        raise ValueError(
            f"`{name}` must fit the calibration to {LARGEST_ERROR_PX} pixels (root mean square); got {error:.2f}. {remedy}"
        )


@dataclass(frozen=True, eq=False)
class Calibration:
    """A lens at its place above the arena.

    Attributes
    ----------
    lens
        The lens.
    rotation : (3, 3)
        From the arena's axes (x, y on the floor, z up) to the camera's (right, down, forward).
    translation : (3,)
        The arena's origin as the camera sees it (cm).
    error_px
        Root mean square reprojection error of the landmarks (pixels).
    """

    lens: Lens
    rotation: np.ndarray
    translation: np.ndarray
    error_px: float = 0.0

    @property
    def position_cm(self) -> np.ndarray:
        """Where the camera is (3,), x, y and height above the floor (cm)."""
        return np.asarray(-self.rotation.T @ self.translation)

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return the pixels (n, 2) at which points (n, 3) of the arena (cm) appear."""
        cv2 = vision()
        vector, _ = cv2.Rodrigues(self.rotation)
        points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 1, 3)
        pixels, _ = cv2.projectPoints(points, vector, self.translation, self.lens.camera_matrix, self.lens.distortion)
        return np.asarray(pixels).reshape(-1, 2)

    def locate(self, pixels: np.ndarray, height_cm: float = 0.0) -> np.ndarray:
        """Return x, y (n, 2) in cm of what appears at pixels (n, 2) and lies `height_cm` above the floor.

        A robot's marker is nearer to the camera than the floor: without its height, a robot 150 cm from a camera at
        270 cm whose marker is 6 cm high would be found 3.4 cm too far out.
        """
        homography = np.linalg.inv(self._plane(height_cm))
        rays = self.lens.rays(pixels)
        on_plane = np.column_stack([rays, np.ones(len(rays))]) @ homography.T
        return np.asarray(on_plane[:, :2] / on_plane[:, 2:])

    def _plane(self, height_cm: float) -> np.ndarray:
        """Return the homography (3, 3) from x, y at a height to rays."""
        return np.column_stack(
            [self.rotation[:, 0], self.rotation[:, 1], self.rotation[:, 2] * height_cm + self.translation]
        )

    def map_pixels(self, height_cm: float) -> np.ndarray:
        """Return x, y (H, W, 2) in cm, float32, of every pixel's line of sight at a height."""
        width, height = self.lens.image_size
        columns, rows = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
        places = self.locate(np.column_stack([columns.ravel(), rows.ravel()]), height_cm)
        return places.reshape(height, width, 2).astype(np.float32)

    def save(self, path: str | Path, *, force: bool = False) -> None:
        """Write plain JSON; a file is written whole or left as it is.

        Parameters
        ----------
        path
            Where.
        force
            Whether a file that is there may be replaced.

        Raises
        ------
        FileExistsError
            If it is there, and may not be replaced.
        """
        refuse_taken(Path(path), name="path", force=force)
        content = {
            "format": FORMAT,
            "version": VERSION,
            "image_size": list(self.lens.image_size),
            "camera_matrix": self.lens.camera_matrix.tolist(),
            "distortion": self.lens.distortion.tolist(),
            "lens_error_px": self.lens.error_px,
            "rotation": self.rotation.tolist(),
            "translation": self.translation.tolist(),
            "error_px": self.error_px,
        }
        with whole(Path(path)) as temporary:
            temporary.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")

    @classmethod
    def load(cls, path: str | Path) -> "Calibration":
        """Read what `save` has written.

        Raises
        ------
        ValueError
            If the file is not such a calibration, with what is wrong.
        """
        content = _read_json(Path(path))
        arrays = {name: _array(content, name, shape, path) for name, shape in _SHAPES.items()}
        if not np.allclose(arrays["rotation"] @ arrays["rotation"].T, np.eye(3), atol=1e-6):
            raise ValueError(f"`rotation` must be a rotation; got {arrays['rotation'].tolist()} at {path}.")
        size = content.get("image_size")
        if not (isinstance(size, list) and len(size) == 2 and all(type(side) is int and side > 0 for side in size)):
            raise ValueError(f"`image_size` must be two positive whole numbers; got {size!r} at {path}.")
        errors = [float(_array(content, name, (), path)) for name in ("lens_error_px", "error_px")]
        lens = Lens((size[0], size[1]), arrays["camera_matrix"], arrays["distortion"], errors[0])
        return cls(lens, arrays["rotation"], arrays["translation"], errors[1])


def _read_json(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise ValueError(f"`calibration` must be a JSON file; got {error} at {path}.") from error
    if not isinstance(content, dict) or (content.get("format"), content.get("version")) != (FORMAT, VERSION):
        raise ValueError(f"`calibration` must be a {FORMAT} of version {VERSION}; got something else at {path}.")
    return content


def _array(content: Mapping[str, Any], name: str, shape: tuple[int, ...], path: str | Path) -> np.ndarray:
    try:
        array = np.array(content.get(name), dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty((0, 0))
    if array.shape != shape or not np.isfinite(array).all():
        raise ValueError(f"`{name}` must be finite numbers of shape {shape}; got {content.get(name)!r} at {path}.")
    return array


def place_camera(lens: Lens, image: np.ndarray, landmarks: Mapping[int, tuple[float, float]]) -> Calibration:
    """Find where the camera is, from printed ArUco markers on the floor.

    Parameters
    ----------
    image : (H, W, 3)
        The arena, its landmarks in sight.
    landmarks
        The centre of each marker (cm, in the arena's axes) by its identity in `DICT_4X4_50`. Far apart is best: the corners
        and the middles of the walls.

    Raises
    ------
    ValueError
        If fewer than four landmarks are seen, or their places do not fit the lens.
    """
    require_image("image", image, lens.image_size)
    seen = _aruco_centers(image)
    known = sorted(seen.keys() & landmarks.keys())
    if len(known) < 4:
        raise ValueError(f"`image` must show 4 or more of the landmarks {sorted(landmarks)}; got {known}.")
    points = np.array([(*landmarks[identity], 0.0) for identity in known])
    return _place(lens, points, np.array([seen[identity] for identity in known]))


def find_landmarks(image: np.ndarray, calibration: Calibration) -> dict[int, np.ndarray]:
    """Return where on the floor (2,), in cm, each ArUco marker in an image (H, W, 3) lies, by its identity."""
    require_image("image", image, calibration.lens.image_size)
    return {identity: calibration.locate(center[None])[0] for identity, center in sorted(_aruco_centers(image).items())}


def _aruco_centers(image: np.ndarray) -> dict[int, np.ndarray]:
    """Return the centre (2,), in pixels, of each ArUco marker that is seen."""
    aruco = vision().aruco
    settings = aruco.DetectorParameters()
    settings.cornerRefinementMethod = aruco.CORNER_REFINE_SUBPIX
    detector = aruco.ArucoDetector(aruco.getPredefinedDictionary(aruco.DICT_4X4_50), settings)
    corners, identities, _ = detector.detectMarkers(gray(image))
    found = [] if identities is None else np.asarray(identities).ravel().tolist()
    return {
        identity: _cross(np.asarray(square, dtype=np.float64).reshape(4, 2))
        for identity, square in zip(found, corners, strict=False)
    }


def _cross(corners: np.ndarray) -> np.ndarray:
    """Return where the diagonals of four corners (4, 2) meet: the centre of a square in perspective."""
    first, second = corners[2] - corners[0], corners[3] - corners[1]
    share, _ = np.linalg.solve(np.column_stack([first, -second]), corners[1] - corners[0])
    return np.asarray(corners[0] + share * first)


def _place(lens: Lens, points: np.ndarray, pixels: np.ndarray) -> Calibration:
    cv2 = vision()
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if spread[1] < 0.05 * spread[0]:
        raise ValueError(f"`landmarks` must not lie on one line; got those in sight at {points[:, :2].tolist()}.")
    _, vector, translation = cv2.solvePnP(points, pixels, lens.camera_matrix, lens.distortion)
    rotation, _ = cv2.Rodrigues(vector)
    calibration = Calibration(lens, np.asarray(rotation), np.asarray(translation).ravel())
    error = float(np.sqrt(np.mean(np.sum((calibration.project(points) - pixels) ** 2, axis=1))))
    _require_fit("landmarks", error, "Measure their places again, and check which identity lies where.")
    return Calibration(lens, calibration.rotation, calibration.translation, error)
