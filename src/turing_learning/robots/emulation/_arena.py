"""The emulated arena: how robots move in it and what they sense, and images of it as an overhead camera would take them."""

import math
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from turing_learning.arrays import array
from turing_learning.errors import number, require
from turing_learning.purposes import WHEELS
from turing_learning.robots._clock import VirtualClock
from turing_learning.robots.tracking._camera import Calibration, CameraError, Lens, cv2
from turing_learning.robots.tracking._markers import Markers, Shapes
from turing_learning.swarm import AGGREGATION, Arena, Cycles, Robot, Scenario, Trial

from ._emulated_robot import SENSOR_ANGLES, avoid_walls

BRIGHTEST, DARK, HALF_CM = 3800.0, 60.0, 0.75
"""Reading with a white wall at the sensor, above that of nothing; of nothing; distance at which it is half the brightest (cm)."""
SKIRT = 0.06  #: Share of a white wall's light that a black skirt reflects
NOISE = 5.0
LARGEST_READING = 4095


def read_infrared(
    poses: np.ndarray, arena_cm: tuple[float, float], radius_cm: float, rng: np.random.Generator
) -> np.ndarray:
    """Return the readings (A, 8) of robots at poses (A, 3), with noise: of all surfaces the strongest counts.

    A surface at a distance d whose nearest point lies at an angle a from the sensor's axis gives b cos(a)^2 /
    (1 + (d / h)^2).
    """
    angles = poses[:, 2, None] + SENSOR_ANGLES
    everybody = np.arange(len(poses))
    axes = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    sensors = poses[:, None, :2] + radius_cm * axes
    walls = np.maximum(
        _reflected(sensors, -axes), _reflected(np.array(arena_cm) - sensors, axes)
    ).max(axis=-1)
    apart = poses[None, None, :, :2] - sensors[:, :, None]
    distance = np.maximum(np.linalg.norm(apart, axis=-1), 1e-6)
    robots = SKIRT * _reflected(
        distance - radius_cm, np.einsum("askc,asc->ask", apart, axes) / distance
    )
    robots[everybody, :, everybody] = 0.0
    light = np.maximum(walls, robots.max(axis=-1))
    readings = np.rint(DARK + BRIGHTEST * light + rng.normal(0, NOISE, light.shape))
    return np.clip(readings, 0, LARGEST_READING).astype(int)


def _reflected(distance: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    return np.maximum(cosine, 0) ** 2 / (1 + (np.maximum(distance, 0) / HALF_CM) ** 2)


def sides_cm(scenario: Scenario) -> tuple[float, float]:
    """Return the width and height of a scenario's arena, 0 without walls."""
    return float(scenario.arena.width_cm or 0), float(scenario.arena.height_cm or 0)


class Drives:
    """The wheels of robots in a laboratory: each has its own scale throughout, and acts as late as the scenario says.

    Robots move for a part of a control cycle at a time, of which there are `parts`: so each may act at its own
    moment of the cycle. Its wheels' noise is that of its own cycle.
    """

    def __init__(self, scenario: Scenario, robots: int, seed: int, parts: int = 1) -> None:
        robot = scenario.robot
        trial = scenario.trial
        scales = 1 - robot.wheel_scale_spread, 1 + robot.wheel_scale_spread
        self._scales = np.random.default_rng([WHEELS, seed]).uniform(*scales, (robots, 2))
        self._robot = robot
        self._factors = np.ones((robots, 2, 2))
        self._waiting = deque([np.zeros((robots, 2))] * robot.actuation_lag_cycles * parts)
        at_once = replace(
            scenario,
            robot=replace(
                robot, wheel_scale_spread=0.0, actuation_lag_cycles=0, wheel_noise=0.0, slip=0.0
            ),
            trial=replace(
                trial,
                duration_s=trial.control_interval_s / parts,
                control_interval_s=trial.control_interval_s / parts,
                physics_steps=max(trial.physics_steps // parts, 1),
            ),
        )
        self._states = scenario.sensor.states
        self._cycles = Cycles(at_once, robots)

    def move(
        self,
        poses: np.ndarray,
        wheels: np.ndarray,
        seed: int,
        acting: Sequence[int] | slice = slice(None),
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return poses (A, 3) after a part of a cycle in which wheel speeds (A, 2) are commanded, and readings I (A,) at its end.

        Cycles of the robots `acting` begin with it.
        """
        # As in the kernel, but for a whole cycle of each robot: noise, the largest speed, slip.
        chance = np.random.default_rng(seed).uniform(size=self._factors.shape)
        self._factors[acting] = chance[acting]
        noise, slip = np.moveaxis(self._factors, -1, 0)
        turned = wheels * self._scales * (1 + self._robot.wheel_noise * (2 * noise - 1))
        if self._robot.clamp_wheel_speeds:
            turned = np.clip(turned, -1, 1)
        self._waiting.append(turned * (1 - self._robot.slip * slip))
        controllers = np.tile(self._waiting.popleft(), (1, self._states))
        return self._cycles.move(poses, controllers, seed)


def move_alone(
    scenario: Scenario, controller: np.ndarray, start: np.ndarray, *, cycles: int, seed: int
) -> Iterator[np.ndarray]:
    """Yield the poses (A, 3), x, y (cm), heading (rad), at the start and after each cycle, of robots that
    execute a controller (2 n,) among walls without a PC, as in state R5 (paper, section 5.4). Of the scenario
    only robot, sensor and walls count.
    """
    arena = sides_cm(scenario)
    rng = np.random.default_rng(seed)
    table = np.reshape(controller, (-1, 2))
    poses = start
    sight = np.zeros(len(start), int)
    drives = Drives(scenario, len(start), seed)
    yield poses
    for _ in range(cycles):
        proximity = read_infrared(poses, arena, scenario.robot.radius_cm, rng).tolist()
        pairs = zip(table[sight].tolist(), proximity, strict=True)
        wheels = [avoid_walls((left, right), readings) for (left, right), readings in pairs]
        poses, sight = drives.move(poses, np.array(wheels), int(rng.integers(2**63)))
        yield poses


_FLOOR, _WALL, _BEYOND, _SKIRT, _DISK = (200,) * 3, (232,) * 3, (96,) * 3, (26,) * 3, (235,) * 3
_COVER = (70, 80, 90)
_FINE = 4  # supersampling of robots
_BITS = 6  # binary digits after the point of a vertex
_CIRCLE = np.column_stack(
    [f(np.linspace(0, 2 * math.pi, 28, endpoint=False)) for f in (np.cos, np.sin)]
)


@dataclass(frozen=True)
class Optics:
    """What degrades an image."""

    blur_px: float = 0.9  #: Standard deviation of the blur (pixels)
    #: Standard deviation of a pixel's noise (gray levels of 256), independent in each channel
    noise: float = 4.0
    #: Share of the light that is missing in the darkest corner, in [0, 0.6]
    shade: float = 0.35

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
    markers, labels
        What the robots wear: the kind of marker, and for each robot its label.
    arena_cm, wall_cm, body_radius_cm
        Width (x) and height (y) of the arena; height of the walls; radius of the robots with their black
        skirts.
    optics, seed
        Blur, noise and light; seed of the floor's stains and the noise.
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
        self._margin = math.ceil(3 * self._optics.blur_px)
        self._height = markers.height_cm
        self._body = _CIRCLE * body_radius_cm
        disk: Shapes = [(_CIRCLE * markers.disk_radius_cm, _DISK)]
        self._tops = [disk + markers.shapes(label) for label in labels]
        self._covered: Shapes = [(_CIRCLE * body_radius_cm, _COVER)]
        self._ground = self._paint_ground(arena_cm, wall_cm)
        columns, rows = self.image_size
        across, down = np.meshgrid(np.linspace(-1, 1, columns), np.linspace(-1, 1, rows))
        # From a lamp off the middle
        away = np.hypot(across - 0.3, down + 0.2)
        self._light = (1 - self._optics.shade * (away / away.max()) ** 1.6).astype(np.float32)
        self._empty = self._expose(self._ground, slice(None), slice(None))
        # Larger than the image, to be shifted at random
        shape = (rows + 256, columns + 256, 3)
        noise = np.rint(
            self._rng.standard_normal(shape, dtype=np.float32) * self._optics.noise
        ).astype(np.int16)
        self._noise = tuple(np.clip(pixels, 0, 255).astype(np.uint8) for pixels in (noise, -noise))

    @property
    def image_size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self._calibration.lens.image_size

    def render(self, poses: np.ndarray, covered: Collection[int] = ()) -> np.ndarray:
        """Return the image (H, W, 3), blue, green, red, of robots at poses (A, 3): x, y (cm), heading (rad).

        The marker of a `covered` robot is hidden by something, a hand or a cable.
        """
        poses = array("poses", poses, "A 3", A=len(self._tops))
        canvas = self._ground.copy()
        image = self._empty.copy()
        away = np.hypot(*(poses[:, :2] - self._calibration.position_cm[:2]).T)
        changed = []
        # from the farthest one on, whose picture nearer ones may hide
        for k in np.argsort(-away):
            top = self._covered if k in covered else self._tops[k]
            changed.append(self._draw(canvas, poses[k], top))
        for rows, columns in changed:
            image[rows, columns] = self._expose(canvas, rows, columns)
        return self._add_noise(image)

    def _add_noise(self, image: np.ndarray) -> np.ndarray:
        width, height = self.image_size
        # the noise is drawn once, and shifted for each image
        down, right = self._rng.integers(0, 257, 2).tolist()
        window = slice(down, down + height), slice(right, right + width)
        brighter, darker = self._noise
        return np.asarray(cv2.subtract(cv2.add(image, brighter[window]), darker[window]))

    def _draw(self, canvas: np.ndarray, pose: np.ndarray, top: Shapes) -> tuple[slice, slice]:
        """Draw a robot, finely, and return the rows and columns that it changes once blurred."""
        turn = np.array(
            [[math.cos(pose[2]), math.sin(pose[2])], [-math.sin(pose[2]), math.cos(pose[2])]]
        )
        flat = (
            np.concatenate([self._body, self._body, *(outline for outline, _ in top)]) @ turn
            + pose[:2]
        )
        pixels = self._project(
            flat, np.where(np.arange(len(flat)) < len(self._body), 0.0, self._height)
        )
        body = pixels[: 2 * len(self._body)]
        outlines = pixels[2 * len(self._body) :]
        rows, columns = self._region(body, 1)
        if rows.start >= rows.stop or columns.start >= columns.stop:
            return rows, columns
        patch = canvas[rows, columns].repeat(_FINE, axis=0).repeat(_FINE, axis=1)
        origin = (columns.start, rows.start)
        hull = cv2.convexHull(body.astype(np.float32)).reshape(-1, 2)
        cv2.fillConvexPoly(patch, _enlarged(hull - origin, _FINE), _SKIRT, shift=_BITS)
        for outline, color in top:
            corners = outlines[: len(outline)]
            outlines = outlines[len(outline) :]
            cv2.fillConvexPoly(patch, _enlarged(corners - origin, _FINE), color, shift=_BITS)
        size = (columns.stop - columns.start, rows.stop - rows.start)
        canvas[rows, columns] = cv2.resize(patch, size, interpolation=cv2.INTER_AREA)
        return self._region(body, 1 + self._margin)

    def _region(self, pixels: np.ndarray, margin: int) -> tuple[slice, slice]:
        width, height = self.image_size
        low = np.floor(pixels.min(axis=0)).astype(int) - margin
        high = np.ceil(pixels.max(axis=0)).astype(int) + margin
        rows = np.clip([low[1], high[1] + 1], 0, height)
        columns = np.clip([low[0], high[0] + 1], 0, width)
        return slice(int(rows[0]), int(rows[1])), slice(int(columns[0]), int(columns[1]))

    def _expose(self, canvas: np.ndarray, rows: slice, columns: slice) -> np.ndarray:
        margin, (height, width) = self._margin, canvas.shape[:2]
        (top, bottom, _), (left, right, _) = rows.indices(height), columns.indices(width)
        if bottom <= top or right <= left:
            return canvas[rows, columns]
        above = max(top - margin, 0)
        before = max(left - margin, 0)
        side = 2 * margin + 1
        wide = canvas[above : bottom + margin, before : right + margin]
        blurred = cv2.GaussianBlur(wide, (side, side), self._optics.blur_px)
        inner = blurred[top - above : bottom - above, left - before : right - before]
        return np.rint(inner * self._light[rows, columns, None]).astype(np.uint8)

    def _paint_ground(self, arena_cm: tuple[float, float], wall_cm: float) -> np.ndarray:
        """Return floor, walls and what is beyond them (H, W, 3), in even light."""
        (columns, rows), (width, height) = self.image_size, arena_cm
        large = np.full((2 * rows, 2 * columns, 3), _BEYOND, np.uint8)
        corners = np.array(
            [(0, 0), (width, 0), (width, height), (0, height), (0, 0)], dtype=np.float64
        )
        steps = np.linspace(0, 1, 40)[:, None]
        edges = [start + steps * (stop - start) for start, stop in pairwise(corners)]
        for side, edge in enumerate(edges):
            face = np.concatenate([self._project(edge, 0.0), self._project(edge[::-1], wall_cm)])
            shade = tuple(value - 6 * (side % 2) for value in _WALL)
            cv2.fillPoly(large, [_enlarged(face, 2)], shade, shift=_BITS)
        cv2.fillPoly(
            large, [_enlarged(self._project(np.concatenate(edges), 0.0), 2)], _FLOOR, shift=_BITS
        )
        ground = cv2.resize(large, (columns, rows), interpolation=cv2.INTER_AREA)
        stains = self._rng.normal(0, 3.0, (rows // 24 + 1, columns // 24 + 1)).astype(np.float32)
        stains = cv2.resize(stains, (columns, rows), interpolation=cv2.INTER_CUBIC)
        return np.clip(np.rint(ground + stains[..., None]), 0, 255).astype(np.uint8)

    def _project(self, positions: np.ndarray, heights: float | np.ndarray) -> np.ndarray:
        return self._calibration.project(np.insert(positions, 2, heights, axis=1))


def _enlarged(pixels: np.ndarray, times: int) -> np.ndarray:
    """Return pixels in an image that is so many times as large, as OpenCV draws them with `_BITS`."""
    return np.rint(np.clip((pixels + 0.5) * times - 0.5, -8000, 8000) * 2**_BITS).astype(np.int32)


LABORATORY = replace(
    AGGREGATION, name="laboratory", title="Physical aggregation",
    description="As aggregation, in an arena with walls (paper, section 5).", agents=8, replicas=2,
    robot=Robot(clamp_wheel_speeds=True), arena=Arena(200.0, 225.0), trial=Trial(duration_s=5.0),
)  # fmt: skip
"""The paper's laboratory, section 5: walls, and motors whose speed is limited."""


@dataclass(frozen=True)
class Conditions:
    """What is not ideal in a laboratory."""

    clock_drift: float = 5e-5  #: Largest relative error of a robot's clock
    #: How long the weakest battery lasts; the best lasts 1.4 times as long
    battery_s: float = 6000.0
    #: Shortest and longest time that bytes take between a robot and the PC
    latency_s: tuple[float, float] = (0.01, 0.04)
    intervention_s: float = 60.0  #: How long the operator needs when asked
    #: Time of an image after the beginning of a control cycle: the camera is not synchronous with the robots
    camera_lag_s: float = 0.037
    #: Whether robots begin their control cycles at moments of their own, which stay the same, as real ones do
    own_phases: bool = True
    #: Largest relative error of a robot's control cycle; only with phases of their own
    period_spread: float = 0.005
    optics: Optics = field(default_factory=Optics)  #: Of the camera

    def __post_init__(self) -> None:
        number("conditions.clock_drift", self.clock_drift, least=0, below=0.01)
        number("conditions.battery_s", self.battery_s, above=0)
        shortest, longest = self.latency_s
        rule = "be two times, the first not above the second"
        require(0 <= shortest <= longest < math.inf, "conditions.latency_s", rule, self.latency_s)
        number("conditions.intervention_s", self.intervention_s, least=0)
        number("conditions.camera_lag_s", self.camera_lag_s, least=0, below=0.1)
        number("conditions.period_spread", self.period_spread, least=0, below=0.1)


class ArenaCamera:
    """Take images as `Capture` does, the first at `lag_s`: each shows where the robots were when it was due, even if it is late.

    A `frozen` camera gives the same image again and again, an `unplugged` one none.
    """

    def __init__(
        self,
        clock: VirtualClock,
        render: Callable[[float | None], np.ndarray],
        interval_s: float,
        lag_s: float,
    ) -> None:
        self._clock = clock
        self._render = render
        self._interval_s = interval_s
        self._lag_s = lag_s
        self._last: np.ndarray | None = None
        self._number, self.taken_s = -1, 0.0
        self.frozen = self.unplugged = False

    def take(self) -> np.ndarray:
        """Return the next image (H, W, 3), blue, green, red; raise CameraError if the camera is unplugged."""
        if self.unplugged:
            raise CameraError(
                "`source` must give images; got none more from the emulated camera. Check its cable."
            )
        self._number = max(
            self._number + 1, math.ceil((self._clock.now() - self._lag_s) / self._interval_s - 1e-6)
        )
        self._clock.sleep_until(self.due_s(self._number))
        self.taken_s = self._clock.now()
        return self.snapshot(self.due_s(self._number))

    def due_s(self, number: int) -> float:
        return self._lag_s + number * self._interval_s

    def snapshot(self, at_s: float | None = None) -> np.ndarray:
        """Return the image (H, W, 3) of this moment, or of `at_s`, or the last one if the camera is frozen."""
        if self._last is None or not self.frozen:
            self._last = self._render(at_s)
        return self._last.copy()

    def close(self) -> None:
        """Release the camera: nothing to do."""
