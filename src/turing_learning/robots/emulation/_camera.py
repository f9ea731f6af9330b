"""The emulated camera: images of the arena as an overhead camera would take them.

The tracker is measured on them, and the emulated laboratory gives the program under test nothing else.
"""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from turing_learning.arrays import array
from turing_learning.errors import number
from turing_learning.robots.tracking._camera import Calibration, Lens, vision
from turing_learning.robots.tracking._markers import Markers, Shapes

_FLOOR, _WALL, _BEYOND, _SKIRT, _DISK = (200,) * 3, (232,) * 3, (96,) * 3, (26,) * 3, (235,) * 3
_COVER = (70, 80, 90)
_FINE = 4  # supersampling of robots
_BITS = 6  # binary digits after the point of a vertex
_CIRCLE = np.column_stack([f(np.linspace(0, 2 * math.pi, 28, endpoint=False)) for f in (np.cos, np.sin)])


@dataclass(frozen=True)
class Optics:
    """What degrades an image."""

    blur_px: float = 0.9  #: Standard deviation of the blur (pixels)
    noise: float = 4.0  #: Standard deviation of a pixel's noise (gray levels of 256), independent in each channel
    shade: float = 0.35  #: Share of the light that is missing in the darkest corner, in [0, 0.6]

    def __post_init__(self) -> None:
        number("optics.blur_px", self.blur_px, above=0, most=5)
        number("optics.noise", self.noise, least=0, most=30)
        number("optics.shade", self.shade, least=0, most=0.6)


def overhead_camera(
    width_cm: float = 200.0, height_cm: float = 225.0, *, above_cm: float = 270.0,
    image_size: tuple[int, int] = (1280, 960),
) -> Calibration:  # fmt: skip
    """Return a camera a little off the arena's middle, looking at it through a lens with barrel distortion.

    The image's longer side shows the arena's y axis. Source of the sizes: paper, section 5.1.
    """
    columns, rows = image_size
    focal = 1.03 * above_cm * min(columns / height_cm, rows / width_cm) * 0.93
    matrix = np.array([[focal, 0, 0.503 * columns], [0, focal * 1.002, 0.496 * rows], [0, 0, 1]])
    lens = Lens(image_size, matrix, np.array([-0.21, 0.06, 0.0006, -0.0004, 0.0]))
    middle = np.array([width_cm / 2, height_cm / 2, 0.0])
    position = middle + np.array([0.03 * width_cm, -0.02 * height_cm, above_cm])
    forward = (middle - position) / np.linalg.norm(middle - position)
    right = np.array([0.02, 1.0, 0.0])
    right -= (right @ forward) * forward
    right /= np.linalg.norm(right)
    rotation = np.array([right, np.cross(forward, right), forward])
    return Calibration(lens, rotation, -rotation @ position)


class EmulatedCamera:
    """Render images of robots in a walled arena.

    Parameters
    ----------
    calibration
        Where the camera really is; the tracker may assume another one.
    markers
        What the robots wear.
    labels
        For each robot, its marker's label.
    arena_cm
        Width (x) and height (y) of the arena.
    wall_cm, body_radius_cm
        Height of the walls; radius of the robots with their black skirts.
    optics
        Blur, noise and light.
    seed
        Of the floor's stains and the noise.
    """

    def __init__(
        self, calibration: Calibration, markers: Markers, labels: Sequence[str], *,
        arena_cm: tuple[float, float] = (200.0, 225.0), wall_cm: float = 50.0, body_radius_cm: float = 3.7,
        optics: Optics | None = None, seed: int = 0,
    ) -> None:  # fmt: skip
        for label in labels:
            markers.check_label(label)
        self._calibration = calibration
        self._optics = optics or Optics()
        self._rng = np.random.default_rng(seed)
        self._heights = markers.height_cm
        self._body = _CIRCLE * body_radius_cm
        disk: Shapes = [(_CIRCLE * markers.disk_radius_cm, _DISK)]
        self._tops = [disk + markers.shapes(label) for label in labels]
        self._covered: Shapes = [(_CIRCLE * body_radius_cm, _COVER)]
        self._ground = self._paint_ground(arena_cm, wall_cm)
        self._light = self._shine()
        self._empty = self._expose(self._ground, slice(None), slice(None))
        self._noise = self._prepare_noise()

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self._calibration.lens.image_size

    def render(self, poses: np.ndarray, covered: Collection[int] = ()) -> np.ndarray:
        """Return the image (H, W, 3), blue, green, red, of robots at poses (A, 3): x, y (cm), heading (rad).

        The marker of a `covered` robot is hidden by something, a hand or a cable.
        """
        poses = array("poses", poses, "A 3", A=len(self._tops))
        canvas, image = self._ground.copy(), self._empty.copy()
        away = np.hypot(*(poses[:, :2] - self._calibration.position_cm[:2]).T)
        tops = [self._covered if k in covered else top for k, top in enumerate(self._tops)]
        for rows, columns in [self._draw(canvas, poses[k], tops[k]) for k in np.argsort(-away)]:
            image[rows, columns] = self._expose(canvas, rows, columns)
        return self._add_noise(image)

    def _draw(self, canvas: np.ndarray, pose: np.ndarray, top: Shapes) -> tuple[slice, slice]:
        """Draw a robot, finely, and return the rows and columns that it changes once blurred."""
        cv2 = vision()
        turn = np.array([[math.cos(pose[2]), math.sin(pose[2])], [-math.sin(pose[2]), math.cos(pose[2])]])
        flat = np.concatenate([self._body, self._body, *(outline for outline, _ in top)]) @ turn + pose[:2]
        heights = np.full(len(flat), self._heights)
        heights[: len(self._body)] = 0.0
        pixels = self._calibration.project(np.column_stack([flat, heights]))
        body, outlines = pixels[: 2 * len(self._body)], pixels[2 * len(self._body) :]
        rows, columns = self._region(body, 1)
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return rows, columns
        patch = np.repeat(np.repeat(canvas[rows, columns], _FINE, axis=0), _FINE, axis=1)
        origin = (columns.start, rows.start)
        hull = cv2.convexHull(body.astype(np.float32)).reshape(-1, 2)
        cv2.fillConvexPoly(patch, _fine(hull, origin), _SKIRT, shift=_BITS)
        first = 0
        for outline, color in top:
            cv2.fillConvexPoly(patch, _fine(outlines[first : first + len(outline)], origin), color, shift=_BITS)
            first += len(outline)
        size = (columns.stop - columns.start, rows.stop - rows.start)
        canvas[rows, columns] = cv2.resize(patch, size, interpolation=cv2.INTER_AREA)
        return self._region(body, 1 + self._margin)

    @property
    def _margin(self) -> int:
        return math.ceil(3 * self._optics.blur_px)

    def _region(self, pixels: np.ndarray, margin: int) -> tuple[slice, slice]:
        """Return the rows and columns around pixels (n, 2), within the image."""
        width, height = self.image_size
        low, high = np.floor(pixels.min(axis=0)).astype(int) - margin, np.ceil(pixels.max(axis=0)).astype(int) + margin
        rows, columns = np.clip([low[1], high[1] + 1], 0, height), np.clip([low[0], high[0] + 1], 0, width)
        return slice(int(rows[0]), int(rows[1])), slice(int(columns[0]), int(columns[1]))

    def _expose(self, canvas: np.ndarray, rows: slice, columns: slice) -> np.ndarray:
        """Return a region of the canvas, blurred and lit."""
        cv2 = vision()
        height, width = canvas.shape[:2]
        top, bottom, _ = rows.indices(height)
        left, right, _ = columns.indices(width)
        margin = self._margin
        above, before = max(top - margin, 0), max(left - margin, 0)
        wide = canvas[above : bottom + margin, before : right + margin]
        if wide.size == 0 or bottom <= top or right <= left:
            return canvas[rows, columns]
        side = 2 * margin + 1
        blurred = cv2.GaussianBlur(wide, (side, side), self._optics.blur_px)
        inner = blurred[top - above : bottom - above, left - before : right - before]
        return np.rint(inner * self._light[rows, columns, None]).astype(np.uint8)

    def _paint_ground(self, arena_cm: tuple[float, float], wall_cm: float) -> np.ndarray:
        """Return floor, walls and what is beyond them (H, W, 3), in even light."""
        cv2 = vision()
        columns, rows = self.image_size
        width, height = arena_cm
        large = np.full((2 * rows, 2 * columns, 3), _BEYOND, np.uint8)
        corners = np.array([(0, 0), (width, 0), (width, height), (0, height), (0, 0)], dtype=np.float64)
        steps = np.linspace(0, 1, 40)[:, None]
        edges = [start + steps * (end - start) for start, end in pairwise(corners)]
        for side, edge in enumerate(edges):
            face = np.concatenate([_at(edge, 0.0), _at(edge[::-1], wall_cm)])
            shade = tuple(value - 6 * (side % 2) for value in _WALL)
            cv2.fillPoly(large, [self._doubled(face)], shade, shift=_BITS)
        cv2.fillPoly(large, [self._doubled(_at(np.concatenate(edges), 0.0))], _FLOOR, shift=_BITS)
        ground = cv2.resize(large, (columns, rows), interpolation=cv2.INTER_AREA)
        stains = self._rng.normal(0, 3.0, (rows // 24 + 1, columns // 24 + 1)).astype(np.float32)
        stains = cv2.resize(stains, (columns, rows), interpolation=cv2.INTER_CUBIC)
        return np.clip(np.rint(ground + stains[..., None]), 0, 255).astype(np.uint8)

    def _doubled(self, points: np.ndarray) -> np.ndarray:
        pixels = (self._calibration.project(points) + 0.5) * 2 - 0.5
        return np.rint(np.clip(pixels, -8000, 8000) * 2**_BITS).astype(np.int32)

    def _shine(self) -> np.ndarray:
        """Return the light (H, W): a lamp off the middle, and less of it towards the corners."""
        columns, rows = self.image_size
        x, y = np.meshgrid(np.linspace(-1, 1, columns), np.linspace(-1, 1, rows))
        distance = np.hypot(x - 0.3, y + 0.2)
        return (1 - self._optics.shade * (distance / distance.max()) ** 1.6).astype(np.float32)

    def _prepare_noise(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the positive and the negative part of noise somewhat larger than the image, to be shifted at random."""
        columns, rows = self.image_size
        shape = (rows + 256, columns + 256, 3)
        noise = np.rint(self._rng.standard_normal(shape, dtype=np.float32) * self._optics.noise).astype(np.int16)
        return np.clip(noise, 0, 255).astype(np.uint8), np.clip(-noise, 0, 255).astype(np.uint8)

    def _add_noise(self, image: np.ndarray) -> np.ndarray:
        cv2 = vision()
        columns, rows = self.image_size
        down, right = (int(value) for value in self._rng.integers(0, 257, 2))
        more, less = (part[down : down + rows, right : right + columns] for part in self._noise)
        return np.asarray(cv2.subtract(cv2.add(image, more), less))


def _at(points: np.ndarray, height: float) -> np.ndarray:
    """Return points (n, 3) at a height over (n, 2)."""
    return np.column_stack([points, np.full(len(points), height)])


def _fine(pixels: np.ndarray, origin: tuple[int, int]) -> np.ndarray:
    """Return pixels (n, 2) as fixed-point vertices of a supersampled patch."""
    return np.rint(((pixels - origin + 0.5) * _FINE - 0.5) * 2**_BITS).astype(np.int32)
