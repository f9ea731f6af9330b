"""What robots wear on their tops, and how it is found in an image."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from turing_learning.errors import choice, require
from turing_learning.trajectories import wrap

from ._camera import aruco_detector, cv2, find_squares

HUES = {"blue": 220.0, "orange": 28.0, "purple": 290.0, "green": 130.0, "red": 0.0}
"""Hue (degrees) of each color that a marker may have."""
HUE_TOLERANCE = 27.0
UNKNOWN = "unknown color"
_LEAST_PIXELS = 8  # of a spot, at half the resolution
Shapes = list[tuple[np.ndarray, tuple[int, int, int]]]
"""The print on the white disk: outlines (k, 2) in the robot's axes (cm, x ahead), and their colors (blue, green, red)."""
_PAINTS = dict(
    zip(
        HUES,
        [(200, 90, 20), (30, 120, 235), (190, 50, 150), (60, 170, 40), (40, 40, 210)],
        strict=True,
    )
)


@dataclass(frozen=True, eq=False)
class Detections:
    """The n markers found in one image."""

    positions: np.ndarray  #: (n, 2): Centre of the robot (cm)
    #: (n,) or None: Heading of the robot (rad, anticlockwise); None for markers that do not show it
    headings: np.ndarray | None
    #: For each, the color, or the identity of an ArUco marker as text
    labels: tuple[str, ...]


class Markers(Protocol):
    """A kind of marker."""

    @property
    def height_cm(self) -> float:
        """Height of the marker above the floor."""

    @property
    def disk_radius_cm(self) -> float:
        """Radius of the white disk that it is printed on."""

    @property
    def has_heading(self) -> bool:
        """Whether it shows where the robot is heading."""

    def shapes(self, label: str) -> Shapes:
        """Return what is printed on the disk of a robot with this label."""

    def check_label(self, label: str) -> None:
        """Reject a label that such a marker cannot have."""

    def detect(self, image: np.ndarray, places: np.ndarray) -> Detections:
        """Find all markers in an image (H, W, 3), given x, y (H, W, 2) of all pixels at the markers' height."""


@dataclass(frozen=True)
class _Spot:
    """A colored spot."""

    center: np.ndarray  # (2,), weighted mean
    label: str  # its color
    # (rad) in which it tapers off: the axis of largest variance, on the side of the third moment
    direction: float
    skewness: float  # that way: a triangle's long tail is its tip
    elongation: float  # variance along over that across


def _find_spots(
    image: np.ndarray, positions: np.ndarray, area_cm2: float, chroma: float
) -> list[_Spot]:
    """Return the spots of about the expected area whose chroma, largest minus smallest channel, is high: that of colored paper.

    They are found at half the resolution, where there is less noise, and measured at the full one: pixels
    weighted by their chroma give places much finer than a pixel.
    """
    half = cv2.resize(image, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
    colored = cv2.threshold(_chroma(half), chroma, 255, cv2.THRESH_BINARY)[1]
    _, _, boxes, _ = cv2.connectedComponentsWithStats(colored, connectivity=8)
    spots = []
    for left, top, width, height, _ in boxes[1:][boxes[1:, 4] >= _LEAST_PIXELS]:
        rows = slice(max(2 * top - 3, 0), 2 * (top + height) + 3)
        columns = slice(max(2 * left - 3, 0), 2 * (left + width) + 3)
        spots.append(_measure(image[rows, columns], positions[rows, columns], area_cm2, chroma))
    return [spot for spot in spots if spot is not None]


def _chroma(image: np.ndarray) -> np.ndarray:
    blue, green, red = cv2.split(image)
    return np.asarray(
        cv2.subtract(cv2.max(cv2.max(blue, green), red), cv2.min(cv2.min(blue, green), red))
    )


def _measure(
    image: np.ndarray, positions: np.ndarray, area_cm2: float, least_chroma: float
) -> _Spot | None:
    """Weigh the pixels of a cut-out by their chroma above a fifth of the spot's own; None if the area does not fit."""
    chroma = _chroma(image).astype(np.float64)
    full = max(
        float(np.partition(chroma.ravel(), -chroma.size // 6)[-chroma.size // 6]), least_chroma
    )
    weights = np.clip(chroma / full - 0.2, 0.0, 0.8) / 0.8
    across, down = positions[0, -1] - positions[0, 0], positions[-1, 0] - positions[0, 0]
    area = abs(float(across[0] * down[1] - across[1] * down[0])) * float(weights.mean())
    if not 0.75 * area_cm2 <= area <= 1.3 * area_cm2:
        return None
    blue, green, red = map(float, image[weights > 0.7].mean(axis=0))
    hue = math.degrees(math.atan2(math.sqrt(3) * (green - blue), 2 * red - green - blue)) % 360
    distances = {name: abs((hue - reference + 180) % 360 - 180) for name, reference in HUES.items()}
    nearest = min(distances, key=lambda name: distances[name])
    label = nearest if distances[nearest] <= HUE_TOLERANCE else UNKNOWN
    weights, positions = weights[weights > 0], positions[weights > 0].astype(np.float64)
    center = weights @ positions / weights.sum()
    shares = weights / weights.sum()
    (xx, xy), (_, yy) = ((positions - center) * shares[:, None]).T @ (positions - center)
    angle = 0.5 * math.atan2(2 * xy, xx - yy)
    along = (positions - center) @ np.array([math.cos(angle), math.sin(angle)])
    longest = float(shares @ along**2)
    third = float(shares @ along**3) / max(longest, 1e-9) ** 1.5
    elongation = longest / max(xx + yy - longest, 1e-9)
    return _Spot(center, label, angle if third > 0 else angle + math.pi, abs(third), elongation)


class _ColoredMarkers(Markers):
    def check_label(self, label: str) -> None:
        choice("label", label, HUES)


@dataclass(frozen=True)
class TriangleMarkers(_ColoredMarkers):
    """Colored isosceles triangles on white disks, longer than wide, whose tip points to the robot's back.

    Source: paper, section 5.1.3 and figure 16.
    """

    tip_cm: float = 3.0  #: Distance of the tip behind the robot's centre
    base_cm: float = 1.5  #: Distance of the base in front of it
    half_width_cm: float = 1.6  #: Half the base
    disk_radius_cm: float = 3.3  #: Radius of the white disk
    height_cm: float = 6.0  #: Height of the marker above the floor
    #: Least difference between the largest and the smallest channel (0 to 255) of a colored pixel
    chroma: int = 40
    has_heading = True

    def __post_init__(self) -> None:
        length = self.tip_cm + self.base_cm
        width = 2 * self.half_width_cm
        rule = "be triangles at least 1.1 times as long as wide"
        require(0 < 1.1 * width <= length, "markers", rule, f"{length} cm by {width} cm")

    def shapes(self, label: str) -> Shapes:
        corners = [
            (-self.tip_cm, 0.0),
            (self.base_cm, -self.half_width_cm),
            (self.base_cm, self.half_width_cm),
        ]
        return [(np.array(corners), _PAINTS[label])]

    def detect(self, image: np.ndarray, places: np.ndarray) -> Detections:
        length = self.tip_cm + self.base_cm
        width = 2 * self.half_width_cm
        # variance along over that across of a triangle, whose skewness is 0.57; blur and noise reduce both. What a cable or a hand
        # leaves of one, and other colored things, have others
        expected = length**2 / 18 / (width**2 / 24)
        triangles = _find_spots(image, places, length * self.half_width_cm, self.chroma)
        spots = []
        for spot in triangles:
            elongated = 0.55 * expected < spot.elongation < 1.4 * expected
            if spot.skewness > 0.2 and elongated:
                spots.append(spot)
        headings = np.array([spot.direction + math.pi for spot in spots])
        offset = (2 * self.base_cm - self.tip_cm) / 3
        ahead = np.column_stack([np.cos(headings), np.sin(headings)])
        centers = np.array([spot.center for spot in spots]).reshape(-1, 2)
        return Detections(
            centers - offset * ahead, wrap(headings), tuple(spot.label for spot in spots)
        )


@dataclass(frozen=True)
class RoundMarkers(_ColoredMarkers):
    """Colored disks of `radius_cm` on the white ones, for positions alone; otherwise as `TriangleMarkers`.

    Source: paper, section 5.4, 40 robots of which only positions were taken.
    """

    radius_cm: float = 2.0
    disk_radius_cm: float = 3.3
    height_cm: float = 6.0
    chroma: int = 40
    has_heading = False

    def shapes(self, label: str) -> Shapes:
        angles = np.linspace(0, 2 * math.pi, 32, endpoint=False)
        return [
            (self.radius_cm * np.column_stack([np.cos(angles), np.sin(angles)]), _PAINTS[label])
        ]

    def detect(self, image: np.ndarray, places: np.ndarray) -> Detections:
        spots = _find_spots(image, places, math.pi * self.radius_cm**2, self.chroma)
        centers = np.array([spot.center for spot in spots]).reshape(-1, 2)
        return Detections(centers, None, tuple(spot.label for spot in spots))


@dataclass(frozen=True)
class ArucoMarkers(Markers):
    """Square markers of an OpenCV dictionary, ArUco's or AprilTag's, each with an identity; the upper edge is the front."""

    side_cm: float = 4.8  #: Side of the black square
    disk_radius_cm: float = 3.7
    height_cm: float = 6.0  #: Height of the marker above the floor
    #: OpenCV's name of it without ``DICT_``, for example 5X5_100 or APRILTAG_36h11
    dictionary: str = "4X4_50"
    has_heading = True

    def check_label(self, label: str) -> None:
        largest = len(self._words.bytesList) - 1
        fits = label.isdecimal() and int(label) <= largest
        rule = f"be an identity of the dictionary {self.dictionary}, 0 to {largest}"
        require(fits, "label", rule, repr(label))

    @cached_property
    def _words(self) -> Any:
        dictionaries = []
        for name in dir(cv2.aruco):
            if name.startswith("DICT_"):
                dictionaries.append(name.removeprefix("DICT_"))
        choice("camera.dictionary", self.dictionary, dictionaries, noun="dictionary")
        return self._detector.getDictionary()

    def shapes(self, label: str) -> Shapes:
        # Cells along a side, with the black edge
        count = self._words.markerSize + 2
        cells = self._words.generateImageMarker(int(label), count)
        square = self.side_cm * np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
        step = self.side_cm / count
        shapes: Shapes = [(square, (20, 20, 20))]
        for row, column in np.argwhere(cells > 0):
            center = ((count - 1) / 2 - np.array([row, column])) * step
            shapes.append((center + square / count, (235, 235, 235)))
        return shapes

    @cached_property
    def _detector(self) -> Any:
        return aruco_detector(
            self.dictionary,
            cornerRefinementWinSize=2,
            adaptiveThreshWinSizeMin=11,
            adaptiveThreshWinSizeMax=19,
            adaptiveThreshWinSizeStep=8,
            errorCorrectionRate=1.0,  # all that the dictionary can correct: one bit
            polygonalApproxAccuracyRate=0.08,  # a cell is four pixels wide, and corners are blurred
            perspectiveRemovePixelPerCell=8,
            perspectiveRemoveIgnoredMarginPerCell=0.25,
        )

    def detect(self, image: np.ndarray, places: np.ndarray) -> Detections:
        identities, corners = find_squares(self._detector, image)
        if len(corners):
            # x, y between the pixels of `places`
            at = corners.astype(np.float32).reshape(-1, 1, 2)
            corners = cv2.remap(
                places, at, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
            ).astype(np.float64)
        on_plane = corners.reshape(-1, 4, 2)
        ahead = (on_plane[:, 0] + on_plane[:, 1]) - (on_plane[:, 2] + on_plane[:, 3])
        return Detections(
            on_plane.mean(axis=1), np.arctan2(ahead[:, 1], ahead[:, 0]), tuple(map(str, identities))
        )
