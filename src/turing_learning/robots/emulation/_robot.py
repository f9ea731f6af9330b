"""A robot around its program, emulated or real: battery, wheels and sensors."""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from turing_learning.robots._clock import Clock, RealClock

from ._emulated_robot import FULL_SPEED, STILL, Body, EmulatedRobot, Wheels
from ._lines import Line, TcpServer

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
        self.emulated = EmulatedRobot(self, clock=self._own_time, controller=controller, tell=self._tell, rng=rng)
        self.line, self.silent, self.charge = make_line(self.emulated, name), False, 1.0
        self._readings: Sequence[int] = (0,) * 8

    def proximity(self) -> Sequence[int]:
        return self._readings

    def battery_ok(self) -> bool:
        return self.charge > LOW_BATTERY

    def hear_remote(self) -> None:
        if self.charge > 0:
            self.emulated.start(self._own_time())

    def restart(self) -> None:
        """Switch off and on: state, models and silence are forgotten, the connection is lost."""
        self.silent = False
        self.emulated.restart()
        self.line.drop()
        self.line.restore()

    def step(self, interval_s: float, sight: int, proximity: Sequence[int]) -> Wheels:
        """Return the wheel speeds of a control cycle; see `EmulatedRobot.step`."""
        if self.charge <= 0:
            return STILL
        self._readings = proximity
        self.charge = max(self.charge - interval_s / self._battery_s, 0.0)
        self.emulated.lights[BATTERY_LIGHT] = int(not self.battery_ok())
        if self.charge == 0.0:
            self.line.drop()
        return self.emulated.step(self._own_time(), sight, proximity)

    def _tell(self, kind: str) -> None:
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
    robot = EmulatedRobot(body, clock=clock.now, controller=controller, tell=lambda kind: line.signal(kind))
    try:
        with TcpServer(robot, host=host, port=port) as line:
            due = clock.now()
            while not ended():
                left, right = robot.step(clock.now(), body.sight(), body.proximity())
                body.set_speed(round(FULL_SPEED * left), round(FULL_SPEED * right))
                due = max(due + interval_s, clock.now())
                clock.sleep(due - clock.now())
    finally:
        body.set_speed(0, 0)
