"""The program of the robots, states R1 to R5, and one robot around it, emulated or real: battery, wheels and sensors.

Source: paper, sections 5.1.2 and 5.2. How the robots disperse and avoid walls is only in the paper's
supplement; the rules here are ours (docs/robots/arena.md).
"""

import math
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from turing_learning.robots._clock import Clock, RealClock

from ._emulated_robot import Body, EmulatedRobot
from ._lines import Line, TcpServer

LOOP = {"R1": 1.0, "R2": 8.0, "R3": 1.0, "R4": 1.0, "R5": 7.0}  #: States and how long they last (s)
_AFTER = dict(zip(LOOP, (*tuple(LOOP)[1:], "R1"), strict=True))
_SIGNALS = {"R1": "STOP", "R4": "START"}
#: Of the infrared sensors, from the heading
SENSOR_ANGLES = np.radians([-17.0, -47.0, -90.0, -151.0, 151.0, 90.0, 47.0, 17.0])
OBSTACLE = 120  #: Least infrared reading at which a dispersing robot turns: walls at about 5 cm, black skirts at 1 cm
WALL = 400  #: Infrared reading that only a wall causes, nearer than 2 cm: a black skirt does not, even when it touches
_AHEAD, _ALONG = math.cos(math.radians(75)), math.cos(math.radians(100))
_ANYWHERE_S = (0.0, 1.25)  # up to once around in place, at full speed
_AWAY_S = (0.2, 0.8)
_TICK = 1e-9
ALONE_S = 2.0  #: A replica stands when its PC, which says that it is there, was not heard so long; its loop goes on
MOST_LOOPS = 5  #: A replica that its PC has asked nothing for so many loops halts, and waits for the remote control
Wheels = tuple[float, float]  #: Left and right wheel speed, fractions of the maximum
STILL: Wheels = (0.0, 0.0)
FULL_SPEED = 1000


def is_in_the_way(proximity: Sequence[int], threshold: int, least: float, forward: float = 1.0) -> bool:
    """Return whether the strongest reading reaches a threshold, at a sensor whose direction, from where the robot goes, has a
    cosine above `least`; `forward` is negative for a robot that drives backward.
    """
    strongest = int(np.argmax(proximity))
    toward = math.copysign(1.0, forward) * math.cos(SENSOR_ANGLES[strongest])
    return proximity[strongest] >= threshold and toward > least


def avoid_walls(wheels: Wheels, proximity: Sequence[int]) -> Wheels:
    """Return the wheel speeds, or a turn in place to the same side while a wall is in front of the robot or beside it.

    One that drives straight turns anticlockwise. A robot that turns in place, as the agents do when they see another, goes on
    turning; one that meets a robot goes on, because its skirt is too dark.
    """
    left, right = wheels
    if left + right == 0 or not is_in_the_way(proximity, WALL, _ALONG, left + right):
        return wheels
    return (-1.0, 1.0) if right >= left else (1.0, -1.0)


class Firmware:
    """Lead a robot, which holds the state and the models, through its loop; `rng` is that of dispersal.

    An agent has a `controller` (2 n,), wheel speeds for each sensor state; a replica has none. Both `signal` START and STOP.
    """

    def __init__(
        self, robot: EmulatedRobot, rng: np.random.Generator, *, controller: tuple[float, ...] | None = None,
        signal: Callable[[str], None] = lambda kind: None,
    ) -> None:  # fmt: skip
        self._robot, self._rng, self._controller, self._signal = robot, rng, controller, signal
        self._until, self._turn_until, self._side = 0.0, 0.0, 1.0
        self._stood = False  # in this trial, for want of the PC

    def start(self, time_s: float) -> None:
        """Begin the loop, anew if it runs: the remote control was pressed."""
        self._stood = False
        self._enter("R1", time_s)

    def step(self, time_s: float, sight: int, proximity: Sequence[int]) -> Wheels:
        """Return the wheel speeds of a control cycle at a time by the robot's own clock: before the loop, what the PC commands.

        `sight` is the reading I of the line-of-sight sensor, `proximity` (8,) are infrared readings.
        """
        if self._robot.called:
            self._robot.called = False
            self.start(time_s)
        if self._robot.state not in LOOP:
            left, right = self._robot.wheels
            return left / FULL_SPEED, right / FULL_SPEED
        while time_s >= self._until - _TICK:
            self._enter(_AFTER[self._robot.state], self._until)
        if self._controller is None and self._robot.unasked_s > MOST_LOOPS * sum(LOOP.values()):
            self._robot.halt()
        if self._robot.alone_s > ALONE_S:
            self._stood |= self._robot.state == "R5"
            return STILL
        # Dispersal: turn to a random direction, then drive straight, and turn a while where anything is in the way.
        if self._robot.state == "R2":
            if time_s >= self._turn_until and is_in_the_way(proximity, OBSTACLE, _AHEAD):
                self._turn(time_s, _AWAY_S)
            return (-self._side, self._side) if time_s < self._turn_until else (1.0, 1.0)
        model = self._robot.executing
        table = self._controller or (model.parameters if model is not None else ())
        wheels = table[2 * sight : 2 * sight + 2]
        if self._robot.state != "R5" or len(wheels) < 2:
            return STILL
        return avoid_walls((wheels[0], wheels[1]), proximity)

    def _enter(self, state: str, time_s: float) -> None:
        self._robot.enter(state)
        self._until = time_s + LOOP[state]
        if state == "R2":
            self._turn(time_s, _ANYWHERE_S)
        if state in _SIGNALS and not self._stood:
            self._signal(_SIGNALS[state])
        self._stood &= state == "R5"

    def _turn(self, time_s: float, lasting_s: tuple[float, float]) -> None:
        """Turn in place from now on, to either side."""
        self._turn_until = time_s + self._rng.uniform(*lasting_s)
        self._side = float(self._rng.choice((-1.0, 1.0)))


LOW_BATTERY = 0.15  #: Share of its charge below which a robot's LED lights
BATTERY_LIGHT = 8


class ArenaRobot:
    """A robot whose clock is wrong by the share `drift`, whose battery (`charge` 1 if full) lasts `battery_s`, and whose signals
    get lost if it is `silent`.
    """

    def __init__(
        self, name: str, controller: tuple[float, ...] | None, *, clock: Callable[[], float], drift: float,
        battery_s: float, rng: np.random.Generator, make_line: Callable[[EmulatedRobot, str], Line],
    ) -> None:  # fmt: skip
        self._own_time, self._battery_s = lambda: clock() * (1 + drift), battery_s
        self.emulated = EmulatedRobot(self, clock=self._own_time)
        self.line, self.silent, self.charge = make_line(self.emulated, name), False, 1.0
        self._firmware = Firmware(self.emulated, rng, controller=controller, signal=self._signal)
        self._readings: Sequence[int] = (0,) * 8

    def proximity(self) -> Sequence[int]:
        return self._readings

    def battery_ok(self) -> bool:
        return self.charge > LOW_BATTERY

    def hear_remote(self) -> None:
        if self.charge > 0:
            self._firmware.start(self._own_time())

    def restart(self) -> None:
        """Switch off and on: state, models and silence are forgotten, the connection is lost."""
        self.silent = False
        self.emulated.restart()
        self.line.drop()
        self.line.restore()

    def step(self, interval_s: float, sight: int, proximity: Sequence[int]) -> Wheels:
        """Return the wheel speeds of a control cycle; see `Firmware.step`."""
        if self.charge <= 0:
            return STILL
        self._readings = proximity
        self.charge = max(self.charge - interval_s / self._battery_s, 0.0)
        self.emulated.lights[BATTERY_LIGHT] = int(not self.battery_ok())
        if self.charge == 0.0:
            self.line.drop()
        return self._firmware.step(self._own_time(), sight, proximity)

    def _signal(self, kind: str) -> None:
        if not self.silent:
            self.line.signal(kind)


class RobotBody(Body, Protocol):
    """The hardware of a real robot on whose computer Python runs."""

    def set_speed(self, left: int, right: int) -> None:
        """Turn the wheels (steps per second, -1000 to 1000)."""

    def sight(self) -> int:
        """Return the reading I of the line-of-sight sensor: 1 if a robot is ahead."""


def live(
    body: RobotBody, *, controller: tuple[float, ...] | None = None, host: str = "0.0.0.0", port: int = 5000,
    clock: Clock | None = None, interval_s: float = 0.1, ended: Callable[[], bool] = lambda: False,
) -> None:  # fmt: skip
    """Be a replica on a robot's own computer, or with a `controller` an agent, at a TCP port: docs/robots/firmware.md.

    Speaks the protocol, and goes through the loop, dispersing and avoiding walls, until `ended` returns true.
    Then, and after an error, it stands. The PC must have an address of it, and starts it.
    """
    clock = clock or RealClock()
    robot = EmulatedRobot(body, clock=clock.now)
    try:
        with TcpServer(robot, host=host, port=port) as line:
            firmware = Firmware(robot, np.random.default_rng(), controller=controller, signal=line.signal)
            due = clock.now()
            while not ended():
                left, right = firmware.step(clock.now(), body.sight(), body.proximity())
                body.set_speed(round(FULL_SPEED * left), round(FULL_SPEED * right))
                due = max(due + interval_s, clock.now())
                clock.sleep(due - clock.now())
    finally:
        body.set_speed(0, 0)
