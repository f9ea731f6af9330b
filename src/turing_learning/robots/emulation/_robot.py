"""One robot, emulated or real: battery, wheels and sensors around the program that runs on it."""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from turing_learning.robots._clock import Clock, RealClock

from ._emulated_robot import Body, EmulatedRobot
from ._firmware import STILL, Firmware, Wheels
from ._lines import Line, serve_tcp

FULL_SPEED = 1000
LOW_BATTERY = 0.15  #: Share of its charge below which a robot's LED lights
BATTERY_LIGHT = 8


class ArenaRobot:
    """A robot with its battery, its clock and its line; one with a `controller` is an agent, others are replicas.

    Its clock is wrong by the share `drift`, its battery (`charge` 1 if full) lasts `battery_s`. The signals
    of a `silent` robot get lost.
    """

    def __init__(
        self, name: str, controller: tuple[float, ...] | None, *, clock: Callable[[], float], drift: float,
        battery_s: float, rng: np.random.Generator,
    ) -> None:  # fmt: skip
        self.name = name
        self._clock, self._rate, self._battery_s = clock, 1 + drift, battery_s
        self.emulated = EmulatedRobot(self, clock=self._own_time)
        self.line: Line | None = None
        self.silent = False
        self.charge = 1.0
        self._firmware = Firmware(self.emulated, rng, controller=controller, signal=self._signal)
        self._manual: Wheels = STILL
        self._readings: Sequence[int] = (0,) * 8

    def set_speed(self, left: int, right: int) -> None:
        """Turn the wheels (steps per second); during the loop, the program decides."""
        self._manual = (left / FULL_SPEED, right / FULL_SPEED)

    def proximity(self) -> Sequence[int]:
        """Return the eight infrared readings."""
        return self._readings

    def battery_ok(self) -> bool:
        """Return whether the battery is above its limit."""
        return self.charge > LOW_BATTERY

    def hear_remote(self) -> None:
        """Begin the loop."""
        if self.charge > 0:
            self._firmware.start(self._own_time())

    def restart(self) -> None:
        """Switch off and on: state, models and silence are forgotten, the connection is lost."""
        self.silent, self._manual = False, STILL
        self.emulated.restart()
        if self.line is not None:
            self.line.drop()
            self.line.restore()

    def replace_battery(self) -> None:
        """Put a full battery in."""
        self.charge = 1.0
        self.restart()

    def step(self, interval_s: float, sight: int, proximity: Sequence[int]) -> Wheels:
        """Return the wheel speeds of a control cycle; see `Firmware.step`."""
        if self.charge <= 0:
            return STILL
        self._readings = proximity
        self.charge = max(self.charge - interval_s / self._battery_s, 0.0)
        self.emulated.lights[BATTERY_LIGHT] = int(not self.battery_ok())
        if self.charge == 0.0 and self.line is not None:
            self.line.drop()
        return self._firmware.step(self._own_time(), sight, proximity, self._manual)

    def _own_time(self) -> float:
        return self._clock() * self._rate

    def _signal(self, kind: str) -> None:
        if not self.silent and self.line is not None:
            self.line.signal(kind)


class RobotBody(Body, Protocol):
    """The hardware of a real robot on whose computer Python runs."""

    def sight(self) -> int:
        """Return the reading I of the line-of-sight sensor: 1 if a robot is ahead."""


class _Held:
    """A body whose wheels the loop turns: what the PC commands is kept for the loop, which obeys it until it has begun."""

    def __init__(self, body: RobotBody) -> None:
        self.proximity, self.battery_ok, self.manual = body.proximity, body.battery_ok, STILL

    def set_speed(self, left: int, right: int) -> None:
        self.manual = (left / FULL_SPEED, right / FULL_SPEED)


def live(
    body: RobotBody, *, controller: tuple[float, ...] | None = None, host: str = "0.0.0.0", port: int = 5000,
    clock: Clock | None = None, interval_s: float = 0.1, ended: Callable[[], bool] = lambda: False,
) -> None:  # fmt: skip
    """Be a replica on a robot's own computer, or with a `controller` an agent, at a TCP port: docs/robots/firmware.md.

    Speaks the protocol, and goes through the loop, dispersing and avoiding walls, until `ended` returns true. Then, and after an
    error, it stands. The PC must have an address of it, and starts it.
    """
    clock, held = clock or RealClock(), _Held(body)
    robot = EmulatedRobot(held, clock=clock.now)
    try:
        with serve_tcp(robot, host=host, port=port) as line:
            firmware = Firmware(robot, np.random.default_rng(), controller=controller, signal=line.signal)
            due = clock.now()
            while not ended():
                left, right = firmware.step(clock.now(), body.sight(), body.proximity(), held.manual)
                body.set_speed(round(FULL_SPEED * left), round(FULL_SPEED * right))
                due = max(due + interval_s, clock.now())
                clock.sleep(due - clock.now())
    finally:
        body.set_speed(0, 0)
