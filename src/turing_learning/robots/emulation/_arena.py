"""The emulated arena: robots, walls and camera in one virtual time."""

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from turing_learning.errors import choice, number, refuse, require
from turing_learning.robots._clock import VirtualClock
from turing_learning.robots._link import Link
from turing_learning.robots.tracking._camera import Calibration, CameraError
from turing_learning.robots.tracking._markers import Markers, TriangleMarkers
from turing_learning.swarm import AGGREGATION, Arena, Robot, Scenario, Trial, initial_poses, simulate

from ._camera import EmulatedCamera, Optics, overhead_camera
from ._emulated_robot import EmulatedRobot
from ._lines import Line, VirtualLine
from ._robot import SENSOR_ANGLES, ArenaRobot, avoid_walls

BRIGHTEST, DARK, HALF_CM = 3800.0, 60.0, 0.75
"""Reading with a white wall at the sensor, above that of nothing; of nothing; distance at which it is half the brightest (cm)."""
SKIRT = 0.06  #: Share of a white wall's light that a black skirt reflects
NOISE = 5.0
LARGEST_READING = 4095


def read_infrared(
    poses: np.ndarray, arena_cm: tuple[float, float], radius_cm: float, rng: np.random.Generator
) -> np.ndarray:
    """Return the readings (A, 8) of robots at poses (A, 3), with noise.

    A surface at a distance d whose nearest point lies at an angle a from the sensor's axis gives b cos(a)^2 /
    (1 + (d / h)^2); of all surfaces the strongest counts. The light falls off with the square of the distance,
    as it does.
    """
    angles = poses[:, 2, None] + SENSOR_ANGLES
    axes = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    sensors = poses[:, None, :2] + radius_cm * axes
    robots = SKIRT * _from_robots(sensors, axes, poses[:, :2], radius_cm)
    light = np.maximum(_from_walls(sensors, axes, arena_cm), robots)
    readings = np.rint(DARK + BRIGHTEST * light + rng.normal(0, NOISE, light.shape))
    return np.clip(readings, 0, LARGEST_READING).astype(int)


def _reflected(distance: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    return np.maximum(cosine, 0) ** 2 / (1 + (np.maximum(distance, 0) / HALF_CM) ** 2)


def _from_walls(sensors: np.ndarray, axes: np.ndarray, arena_cm: tuple[float, float]) -> np.ndarray:
    """Return the strongest light (A, 8) of the four walls, whose nearest points lie along x and y."""
    low, high = _reflected(sensors, -axes), _reflected(np.array(arena_cm) - sensors, axes)
    return np.asarray(np.maximum(low, high).max(axis=-1))


def _from_robots(sensors: np.ndarray, axes: np.ndarray, centers: np.ndarray, radius_cm: float) -> np.ndarray:
    """Return the strongest light (A, 8) of the other robots (A, 2), were they white."""
    apart = centers[None, None] - sensors[:, :, None]
    distance = np.maximum(np.linalg.norm(apart, axis=-1), 1e-6)
    cosine = np.einsum("askc,asc->ask", apart, axes) / distance
    light = _reflected(distance - radius_cm, cosine)
    light[np.arange(len(centers)), :, np.arange(len(centers))] = 0.0
    return np.asarray(light.max(axis=-1))


def move_for_a_cycle(
    scenario: Scenario, poses: np.ndarray, wheels: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return poses (A, 3) after a control cycle with wheel speeds (A, 2), and readings I (A,) at its end.

    A trial of one step, in which every sensor state has the same wheel speeds.
    """
    controllers = np.tile(wheels, (1, scenario.sensor.states))[None]
    trial = simulate(scenario, controllers, poses[None], control_steps=1, seed=seed, threads=1)
    return trial.poses[0, 1], trial.sensors[0, 1]


def move_alone(
    scenario: Scenario, controller: np.ndarray, start: np.ndarray, *, cycles: int, seed: int
) -> Iterator[np.ndarray]:
    """Let robots execute a controller among walls without a PC, as in state R5: they avoid walls, and meet each other.

    Parameters
    ----------
    scenario
        Robots, sensor and walls of the laboratory; their numbers do not matter.
    controller : (2 n,)
        Wheel speeds for each sensor state, fractions of the maximum.
    start : (A, 3)
        x, y (cm), heading (rad).
    cycles, seed
        Number of control cycles; seed of the wheels' and the infrared sensors' noise.

    Yields
    ------
    (A, 3)
        The poses at the start, and after each cycle.

    Source: paper, section 5.4: trials of 600 s with 40 robots.
    """
    arena = float(scenario.arena.width_cm or 0), float(scenario.arena.height_cm or 0)
    rng, table = np.random.default_rng(seed), np.reshape(controller, (-1, 2))
    poses, sight = start, np.zeros(len(start), int)
    yield poses
    for _ in range(cycles):
        proximity = read_infrared(poses, arena, scenario.robot.radius_cm, rng).tolist()
        pairs = zip(table[sight].tolist(), proximity, strict=True)
        wheels = [avoid_walls((left, right), readings) for (left, right), readings in pairs]
        poses, sight = move_for_a_cycle(scenario, poses, np.array(wheels), int(rng.integers(2**63)))
        yield poses


LABORATORY = replace(
    AGGREGATION,
    name="laboratory",
    title="Physical aggregation",
    description="As aggregation, in an arena with walls (paper, section 5).",
    agents=8,
    replicas=2,
    robot=Robot(clamp_wheel_speeds=True),
    arena=Arena(200.0, 225.0),
    trial=Trial(duration_s=5.0),
)
"""The paper's laboratory, section 5: walls, and motors whose speed is limited."""

_REPLICA_COLORS = ("orange", "purple", "green", "red")
_BEST_BATTERY = 1.4


@dataclass(frozen=True)
class Conditions:
    """What is not ideal in a laboratory."""

    clock_drift: float = 5e-5  #: Largest relative error of a robot's clock
    battery_s: float = 6000.0  #: How long the weakest battery lasts; the best lasts 1.4 times as long
    #: Shortest and longest time that bytes take between a robot and the PC
    latency_s: tuple[float, float] = (0.01, 0.04)
    intervention_s: float = 60.0  #: How long the operator needs when asked
    #: Time of an image after the beginning of a control cycle: the camera is not synchronous with the robots
    camera_lag_s: float = 0.037
    optics: Optics = field(default_factory=Optics)  #: Of the camera

    def __post_init__(self) -> None:
        number("conditions.clock_drift", self.clock_drift, least=0, below=0.01)
        number("conditions.battery_s", self.battery_s, above=0)
        first, last = self.latency_s
        rule = "be two times, the first not above the second"
        require(0 <= first <= last < math.inf, "conditions.latency_s", rule, self.latency_s)
        number("conditions.intervention_s", self.intervention_s, least=0)
        number("conditions.camera_lag_s", self.camera_lag_s, least=0, below=0.1)


class ArenaCamera:
    """Take images as `Capture` does: each waits, by the laboratory's clock, for the next, and is rendered when it is taken.

    The first image is taken at `lag_s`. A `frozen` camera gives the same image again and again, an `unplugged` one none.
    """

    def __init__(self, clock: VirtualClock, render: Callable[[], np.ndarray], interval_s: float, lag_s: float) -> None:
        self._clock, self._render, self._interval_s, self._lag_s = clock, render, interval_s, lag_s
        self._last: np.ndarray | None = None
        self._number, self.taken_s = -1, 0.0
        self.frozen = self.unplugged = False

    def take(self) -> np.ndarray:
        """Return the next image (H, W, 3), blue, green, red; raise CameraError if the camera is unplugged."""
        if self.unplugged:
            raise CameraError("`source` must give images; got none more from the emulated camera. Check its cable.")
        self._number = max(self._number + 1, math.ceil((self._clock.now() - self._lag_s) / self._interval_s - 1e-6))
        self._clock.sleep_until(self._lag_s + self._number * self._interval_s)
        self.taken_s = self._clock.now()
        return self.snapshot()

    def snapshot(self) -> np.ndarray:
        """Return the image (H, W, 3) of this moment, or the last one if the camera is frozen."""
        if self._last is None or not self.frozen:
            self._last = self._render()
        return self._last.copy()

    def close(self) -> None:
        """Release the camera: nothing to do."""


class EmulatedArena:
    """Everything that a PC program finds in a laboratory, and nothing that a real one lacks; see `EmulatedLaboratory`.

    Time passes while somebody waits by its clock: for a line, an image, or nothing.

    Parameters
    ----------
    scenario
        Robots, walls, and the agents' controller.
    conditions
        What is not ideal.
    seed
        Of places, noise, batteries and the robots' own choices.
    calibration
        Where the camera is, and its lens; by default above the arena's middle.
    markers, labels
        What the robots wear, agents first; by default triangles, blue ones, and one of another color for each replica.
    make_line
        Robot and its name -> the robot's end of a line; by default one in this process, in virtual time.

    Attributes
    ----------
    clock
        Its time.
    names
        Of all robots, agents first, then replicas.
    labels
        Of their markers.
    camera
        The overhead camera.
    stuck, covered
        Numbers of the robots that do not move, and of those whose marker is hidden.

    Source: paper, section 5.
    """

    def __init__(
        self, scenario: Scenario = LABORATORY, *, conditions: Conditions | None = None, seed: int = 0,
        calibration: Calibration | None = None, markers: Markers | None = None, labels: Sequence[str] = (),
        make_line: Callable[[EmulatedRobot, str], Line] | None = None,
    ) -> None:  # fmt: skip
        remedy = "Give its width_cm and height_cm."
        require(scenario.arena.bounded, "scenario.arena", "have walls", "an unbounded one", remedy)
        rule = f"be at most {len(_REPLICA_COLORS)}, one for each color"
        require(labels or scenario.replicas <= len(_REPLICA_COLORS), "scenario.replicas", rule, scenario.replicas)
        self.scenario, self.conditions, self._seed = scenario, conditions or Conditions(), seed
        self.clock, self.lock = VirtualClock(), threading.RLock()
        agents, replicas = scenario.agents, scenario.replicas
        roles = (("agent", agents), ("replica", replicas))
        self.names = tuple(f"{role}-{k + 1}" for role, number in roles for k in range(number))
        self.labels = tuple(labels) or ("blue",) * agents + _REPLICA_COLORS[:replicas]
        self.markers: Markers = markers or TriangleMarkers()
        self.calibration = calibration or overhead_camera(*self.arena_cm)
        streams = np.random.SeedSequence(seed).spawn(4 + 2 * scenario.individuals)
        self._rng, self._air, places, batteries = (np.random.default_rng(stream) for stream in streams[:4])
        self._robots = [
            ArenaRobot(
                name,
                scenario.controller if k < agents else None,
                clock=self.clock.now,
                drift=batteries.uniform(-1, 1) * self.conditions.clock_drift,
                battery_s=batteries.uniform(1, _BEST_BATTERY) * self.conditions.battery_s,
                rng=np.random.default_rng(streams[4 + k]),
            )
            for k, name in enumerate(self.names)
        ]
        for robot, stream in zip(self._robots, streams[4 + scenario.individuals :], strict=True):
            if make_line is None:
                rng, latency_s = np.random.default_rng(stream), self.conditions.latency_s
                robot.line = VirtualLine(robot.emulated, robot.name, self.clock, latency_s, rng)
            else:
                robot.line = make_line(robot.emulated, robot.name)
        self.stuck: set[int] = set()
        self.covered: set[int] = set()
        self._before = self._after = initial_poses(scenario, 1, places)[0]
        self._sight = np.zeros(scenario.individuals, int)
        self._cycle = 0
        self.camera = ArenaCamera(self.clock, self._render, self.interval_s, self.conditions.camera_lag_s)
        self.clock.call_at(0.0, self._advance)

    @property
    def arena_cm(self) -> tuple[float, float]:
        """Width and height of the arena."""
        return float(self.scenario.arena.width_cm or 0), float(self.scenario.arena.height_cm or 0)

    @property
    def interval_s(self) -> float:
        """Duration of a control cycle, and time between images."""
        return self.scenario.trial.control_interval_s

    @cached_property
    def _eye(self) -> EmulatedCamera:
        worn, optics, arena = (self.markers, self.labels), self.conditions.optics, self.arena_cm
        return EmulatedCamera(self.calibration, *worn, arena_cm=arena, optics=optics, seed=self._seed)

    def _render(self) -> np.ndarray:
        return self._eye.render(self.poses(), tuple(self.covered))

    def link(self, name: str) -> Link:
        """Return an open link to a robot, as `open_link` does; raise LinkError if the connection is lost."""
        return self.line(name).link()

    def poses(self) -> np.ndarray:
        """Return where the robots are now (A, 3): x, y (cm), heading (rad)."""
        share = np.clip((self.clock.now() - (self._cycle - 1) * self.interval_s) / self.interval_s, 0, 1)
        poses = self._after - self._before
        poses[:, 2] = (poses[:, 2] + np.pi) % (2 * np.pi) - np.pi
        return np.asarray(self._before + share * poses)

    def put(self, name: str, pose: tuple[float, float, float]) -> None:
        """Put a robot at a place inside the arena: x, y (cm), heading (rad)."""
        radius, (width, height) = self.scenario.robot.radius_cm, self.arena_cm
        if not (radius <= pose[0] <= width - radius and radius <= pose[1] <= height - radius):
            refuse("pose", f"be inside the arena of {width} x {height} cm", f"{pose} for {name!r}")
        number = self.number(name)
        self._before, self._after = self._before.copy(), self._after.copy()
        self._before[number] = self._after[number] = pose

    def number(self, name: str) -> int:
        """Return a robot's number."""
        return self.names.index(choice("name", name, self.names))

    def robot(self, name: str) -> ArenaRobot:
        """Return a robot."""
        return self._robots[self.number(name)]

    def line(self, name: str) -> Line:
        """Return the robot's end of its line."""
        line = self.robot(name).line
        assert line is not None
        return line

    def close(self) -> None:
        """End all lines."""
        for name in self.names:
            self.line(name).close()

    def _advance(self) -> None:
        """Let everybody sense, decide and move for a control cycle; schedule the next one."""
        before = self._after
        proximity = read_infrared(before, self.arena_cm, self.scenario.robot.radius_cm, self._air).tolist()
        sensed = zip(self._robots, self._sight, proximity, strict=True)
        wheels = np.array([robot.step(self.interval_s, int(sight), readings) for robot, sight, readings in sensed])
        stuck = list(self.stuck)
        wheels[stuck] = 0.0
        after, sight = move_for_a_cycle(self.scenario, before, wheels, int(self._rng.integers(2**63)))
        after[stuck] = before[stuck]
        self._before, self._after, self._sight = before, after, sight
        self._cycle += 1
        self.clock.call_at(self._cycle * self.interval_s, self._advance)
