"""The emulated laboratory: robots, arena, camera and operator in one virtual time."""

import threading
from collections.abc import Callable
from functools import cached_property

import numpy as np

from turing_learning.robots._clock import VirtualClock
from turing_learning.robots.links._link import Link
from turing_learning.robots.tracking._calibration import Calibration
from turing_learning.robots.tracking._markers import Markers, TriangleMarkers
from turing_learning.swarm import Scenario, initial_poses

from ._arena_camera import ArenaCamera, Eye
from ._camera import EmulatedCamera, overhead_camera
from ._conditions import LABORATORY, Conditions
from ._emulated_robot import EmulatedRobot
from ._hands import EmulatedOperator, Faults
from ._infrared import read_infrared
from ._line import Line, VirtualLine
from ._motion import move_for_a_cycle
from ._robot import ArenaRobot

_REPLICA_COLORS = ("orange", "purple", "green", "red")
_BEST_BATTERY = 1.4


class EmulatedLaboratory:
    """Everything that a PC program finds in a laboratory, and nothing that a real one lacks.

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
    faults, operator
        What goes wrong, and who helps.

    Source
    ------
    Paper, section 5.
    """

    def __init__(
        self,
        scenario: Scenario = LABORATORY,
        *,
        conditions: Conditions | None = None,
        seed: int = 0,
        calibration: Calibration | None = None,
        make_line: Callable[[EmulatedRobot, str], Line] | None = None,
    ) -> None:
        if not scenario.arena.bounded:
            raise ValueError("`scenario.arena` must have walls; got an unbounded one. Give its width_cm and height_cm.")
        if scenario.replicas > len(_REPLICA_COLORS):
            raise ValueError(
                f"`scenario.replicas` must be at most {len(_REPLICA_COLORS)}, one for each color; got {scenario.replicas}."
            )
        self.scenario, self.conditions = scenario, conditions or Conditions()
        self.clock, self.lock = VirtualClock(), threading.RLock()
        agents, replicas = scenario.agents, scenario.replicas
        self.names = (*_numbered("agent", agents), *_numbered("replica", replicas))
        self.labels = ("blue",) * agents + _REPLICA_COLORS[:replicas]
        self.markers: Markers = TriangleMarkers()
        self.calibration = calibration or overhead_camera(*self.arena_cm)
        streams = np.random.SeedSequence(seed).spawn(4 + 2 * scenario.individuals)
        self._rng, self._air, places, batteries = (np.random.default_rng(stream) for stream in streams[:4])
        self._optics_seed = seed
        self._robots = self._build_robots(batteries, streams[4 : 4 + scenario.individuals])
        self._lines = self._build_lines(make_line, streams[4 + scenario.individuals :])
        self.stuck: set[int] = set()
        self._before = self._after = initial_poses(scenario, 1, places)[0]
        self._sight = np.zeros(scenario.individuals, int)
        self._cycle = 0
        self.faults, self.operator = Faults(self), EmulatedOperator(self, self.conditions.intervention_s)
        self.clock.call_at(0.0, self._advance)

    @property
    def arena_cm(self) -> tuple[float, float]:
        """Width and height of the arena."""
        return float(self.scenario.arena.width_cm or 0), float(self.scenario.arena.height_cm or 0)

    @cached_property
    def camera(self) -> ArenaCamera:
        """The overhead camera."""
        return ArenaCamera(self.clock, self._eye, self._interval_s, self.conditions.camera_lag_s)

    @property
    def covered(self) -> set[int]:
        """Numbers of the robots whose marker is hidden."""
        return self._eye.covered

    def link(self, name: str) -> Link:
        """Return an open link to a robot, as `open_link` does.

        Raises
        ------
        LinkError
            If the connection is lost.
        ValueError
            If there is no such robot.
        """
        return self.line(name).link()

    def poses(self) -> np.ndarray:
        """Return where the robots are now (A, 3): x, y (cm), heading (rad)."""
        share = np.clip((self.clock.now() - (self._cycle - 1) * self._interval_s) / self._interval_s, 0, 1)
        poses = self._after - self._before
        poses[:, 2] = (poses[:, 2] + np.pi) % (2 * np.pi) - np.pi
        return np.asarray(self._before + share * poses)

    def put(self, name: str, pose: tuple[float, float, float]) -> None:
        """Put a robot somewhere: x, y (cm), heading (rad).

        Raises
        ------
        ValueError
            If that is not inside the arena.
        """
        radius, (width, height) = self.scenario.robot.radius_cm, self.arena_cm
        if not (radius <= pose[0] <= width - radius and radius <= pose[1] <= height - radius):
            raise ValueError(f"`pose` must be inside the arena of {width} x {height} cm; got {pose} for {name!r}.")
        number = self.number(name)
        self._before, self._after = self._before.copy(), self._after.copy()
        self._before[number] = self._after[number] = pose

    def number(self, name: str) -> int:
        """Return a robot's number.

        Raises
        ------
        ValueError
            If there is no such robot.
        """
        if name not in self.names:
            raise ValueError(f"`name` must be one of {', '.join(self.names)}; got {name!r}.")
        return self.names.index(name)

    def robot(self, name: str) -> ArenaRobot:
        """Return a robot."""
        return self._robots[self.number(name)]

    def line(self, name: str) -> Line:
        """Return the robot's end of its line."""
        return self._lines[self.number(name)]

    def wake_camera(self) -> None:
        """Bring the camera back to work, if there ever was one."""
        if "camera" in self.__dict__:
            self.camera.frozen = self.camera.unplugged = False

    def close(self) -> None:
        """End all lines."""
        for line in self._lines:
            line.close()

    @cached_property
    def _eye(self) -> Eye:
        camera = EmulatedCamera(
            self.calibration,
            self.markers,
            self.labels,
            arena_cm=self.arena_cm,
            optics=self.conditions.optics,
            seed=self._optics_seed,
        )
        return Eye(camera, self.poses)

    @property
    def _interval_s(self) -> float:
        return self.scenario.trial.control_interval_s

    def _build_robots(self, rng: np.random.Generator, streams: list[np.random.SeedSequence]) -> list[ArenaRobot]:
        agents, conditions = self.scenario.agents, self.conditions
        return [
            ArenaRobot(
                name,
                self.scenario.controller if number < agents else None,
                clock=self.clock.now,
                drift=rng.uniform(-1, 1) * conditions.clock_drift,
                battery_s=rng.uniform(1, _BEST_BATTERY) * conditions.battery_s,
                rng=np.random.default_rng(streams[number]),
            )
            for number, name in enumerate(self.names)
        ]

    def _build_lines(
        self, make_line: Callable[[EmulatedRobot, str], Line] | None, streams: list[np.random.SeedSequence]
    ) -> list[Line]:
        lines: list[Line] = []
        for robot, stream in zip(self._robots, streams, strict=True):
            if make_line is None:
                rng = np.random.default_rng(stream)
                line: Line = VirtualLine(robot.emulated, robot.name, self.clock, self.conditions.latency_s, rng)
            else:
                line = make_line(robot.emulated, robot.name)
            robot.wire(line)
            lines.append(line)
        return lines

    def _advance(self) -> None:
        """Let everybody sense, decide and move for a control cycle, and come again after it."""
        before = self._after
        proximity = read_infrared(before, self.arena_cm, self.scenario.robot.radius_cm, self._air).tolist()
        wheels = np.array(
            [
                robot.step(self._interval_s, int(sight), readings)
                for robot, sight, readings in zip(self._robots, self._sight, proximity, strict=True)
            ]
        )
        wheels[list(self.stuck)] = 0.0
        self._move(before, wheels)
        self._cycle += 1
        self.clock.call_at(self._cycle * self._interval_s, self._advance)

    def _move(self, before: np.ndarray, wheels: np.ndarray) -> None:
        """Advance all robots by a control cycle."""
        after, sight = move_for_a_cycle(self.scenario, before, wheels, int(self._rng.integers(2**63)))
        after[list(self.stuck)] = before[list(self.stuck)]
        self._before, self._after, self._sight = before, after, sight


def _numbered(role: str, count: int) -> tuple[str, ...]:
    return tuple(f"{role}-{number}" for number in range(1, count + 1))
