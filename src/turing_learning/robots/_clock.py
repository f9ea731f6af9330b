"""Clocks: the computer's, and the virtual one of an emulated laboratory."""

import heapq
import time
from collections.abc import Callable
from itertools import count
from typing import Protocol

from turing_learning.errors import number


class Clock(Protocol):
    """Tells the time and waits. Everything that waits takes one as an argument."""

    def now(self) -> float:
        """Return the time (s) since a fixed moment."""

    def sleep(self, seconds: float) -> None:
        """Wait; not at all if `seconds` is 0 or less."""


class RealClock:
    """The monotonic clock of this computer; it shows `speed` seconds in one, as a faster emulated laboratory does."""

    def __init__(self, speed: float = 1.0) -> None:
        self.speed = number("speed", speed, above=0)

    def now(self) -> float:
        return self.speed * time.monotonic()

    def sleep(self, seconds: float) -> None:
        if seconds > 0:
            time.sleep(seconds / self.speed)


class VirtualClock:
    """A clock that advances only while somebody waits on it. Waiting runs the actions that are due, by their
    times, and among the same times in that in which they were scheduled.
    """

    def __init__(self) -> None:
        self._now = 0.0
        self._number = count()
        self._busy = False
        self._due: list[tuple[float, int, Callable[[], None]]] = []

    def now(self) -> float:
        return self._now

    def call_at(self, time_s: float, action: Callable[[], None]) -> None:
        """Schedule an action for a time (s); if that has passed, it runs as soon as somebody waits."""
        heapq.heappush(self._due, (max(time_s, self._now), next(self._number), action))

    def sleep(self, seconds: float) -> None:
        """Let time pass; actions that are due now run even if `seconds` is 0. Raise RuntimeError if an action waits."""
        self.sleep_until(self._now + max(seconds, 0.0))

    def sleep_until(self, time_s: float, ready: Callable[[], bool] = lambda: False) -> None:
        """Let time pass until `time_s`, or until an action has made `ready` true; see `sleep`."""
        if self._busy:
            raise RuntimeError(
                "`sleep` must not be called by an action of the clock; got one that waits."
            )
        self._busy = True
        try:
            while not ready() and self._due and self._due[0][0] <= time_s:
                self._now, _, action = heapq.heappop(self._due)
                action()
        finally:
            self._busy = False
        if not ready():
            self._now = max(self._now, time_s)
