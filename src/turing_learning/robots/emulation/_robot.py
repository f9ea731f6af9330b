"""One robot of the emulated laboratory: battery, wheels and sensors around the program that runs on it."""

from collections.abc import Callable, Sequence

import numpy as np

from ._emulated_robot import EmulatedRobot
from ._firmware import STILL, Firmware, Wheels
from ._lines import Line

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
