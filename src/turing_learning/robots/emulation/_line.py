"""The line between a PC and an emulated robot in one process, in virtual time: late, and sometimes worse."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Protocol

import numpy as np

from turing_learning.robots._clock import VirtualClock
from turing_learning.robots.links._link import Link

from ._emulated_robot import EmulatedRobot

PAUSE_S = 0.05
_POLL_S = 0.02


Spoil = Callable[[bytes], Iterable[bytes]]
"""Turns what a robot sends into the pieces that arrive."""


def whole(data: bytes) -> Iterable[bytes]:
    """Return data in one piece."""
    return [data]


class Line(Protocol):
    """The robot's end of a line; a `RobotServer` is one too."""

    port: str
    spoil: Spoil

    def link(self) -> Link:
        """Return an open link to the robot; raises LinkError if there is none."""

    def signal(self, kind: str) -> None:
        """Send a signal; without a link it is lost."""

    def drop(self) -> None:
        """Lose the link."""

    def restore(self) -> None:
        """Make it possible to connect again."""

    def close(self) -> None:
        """End the service."""


class VirtualLine:
    """A line whose bytes take time.

    Parameters
    ----------
    robot
        At the far end.
    name
        Of the robot.
    clock
        Of the laboratory.
    latency_s
        Shortest and longest time that bytes take.
    rng
        Of the latency.
    """

    def __init__(
        self,
        robot: EmulatedRobot,
        name: str,
        clock: VirtualClock,
        latency_s: tuple[float, float],
        rng: np.random.Generator,
    ) -> None:
        self.port = name
        self.spoil: Spoil = whole
        self._robot, self._clock, self._latency_s, self._rng = robot, clock, latency_s, rng
        self._there = True
        self._near: _NearEnd | None = None
        self._last = {"in": 0.0, "out": 0.0}

    def link(self) -> Link:
        """Return an open link to the robot; raises LinkError if there is none."""
        link = Link(self.port, clock=self._clock, connect=self._connect)
        link.open()
        return link

    def signal(self, kind: str) -> None:
        """Send a signal; without a link it is lost."""
        self.transmit(self._robot.signal(kind))

    def drop(self) -> None:
        """Lose the link."""
        self._there, self._near = False, None

    def restore(self) -> None:
        """Make it possible to connect again."""
        self._there = True

    def close(self) -> None:
        """End the service."""
        self.drop()

    def transmit(self, data: bytes) -> None:
        """Send to the PC, piece by piece."""
        if self._near is not None:
            for number, piece in enumerate(self.spoil(data)):
                self._later("out", number * PAUSE_S, partial(self._near.arrived.extend, piece))

    def is_near(self, end: "_NearEnd") -> bool:
        """Return whether an end is that of the present connection."""
        return self._near is end

    def receive(self, data: bytes) -> None:
        """Take what the PC sends."""

        def arrive() -> None:
            answer = self._robot.receive(data) if self._there else b""
            if answer:
                self.transmit(answer)

        self._later("in", 0.0, arrive)

    def _connect(self) -> "_NearEnd":
        if not self._there:
            raise OSError("no connection")
        self._near = _NearEnd(self, self._clock)
        return self._near

    def _later(self, way: str, pause_s: float, action: Callable[[], None]) -> None:
        """Do something when the bytes have arrived; they do not overtake each other."""
        due = self._clock.now() + pause_s + self._rng.uniform(*self._latency_s)
        self._last[way] = due = max(due, self._last[way])
        self._clock.call_at(due, action)


class _NearEnd:
    """The PC's end of a connection, as pyserial has it."""

    def __init__(self, line: VirtualLine, clock: VirtualClock) -> None:
        self._line, self._clock = line, clock
        self.arrived = bytearray()

    @property
    def in_waiting(self) -> int:
        """How many bytes have come."""
        self._require()
        return len(self.arrived)

    def read(self, size: int) -> bytes:
        """Return up to `size` bytes, fewer if they do not come in a short while."""
        self._require()
        self._clock.sleep_until(self._clock.now() + _POLL_S, ready=lambda: len(self.arrived) > 0)
        self._require()
        data = bytes(self.arrived[:size])
        del self.arrived[:size]
        return data

    def write(self, data: bytes) -> int:
        """Send."""
        self._require()
        self._line.receive(bytes(data))
        return len(data)

    def close(self) -> None:
        """Let go of the line."""

    def _require(self) -> None:
        if not self._line.is_near(self):
            raise OSError("connection lost")
