"""Time: of the wall, or of a laboratory that is not there."""

import heapq
import time
from collections.abc import Callable
from itertools import count
from typing import Protocol


class Clock(Protocol):
    """Tells the time and waits. Whatever waits is given one."""

    def now(self) -> float:
        """Return the time (s) since some moment that stays the same."""
        ...

    def sleep(self, seconds: float) -> None:
        """Wait; not at all if `seconds` is 0 or less."""
        ...


class RealClock:
    """The time of this computer, which nobody can set back.

    Parameters
    ----------
    speed
        Seconds that it shows in one second; above 1 beside an emulated laboratory that runs as fast.

    Raises
    ------
    ValueError
        If the speed is not above 0.
    """

    def __init__(self, speed: float = 1.0) -> None:
        if not 0 < speed < float("inf"):
            raise ValueError(f"`speed` must be a finite number above 0; got {speed}.")
        self.speed = float(speed)

    def now(self) -> float:
        """Return the time (s)."""
        return self.speed * time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait."""
        if seconds > 0:
            time.sleep(seconds / self.speed)


class VirtualClock:
    """A time that passes only when somebody waits: waiting does what is due meanwhile, in order, and takes no longer than that.

    What is to happen is put down with `call_at`. Of actions due at one time the first that was put down comes first.
    """

    def __init__(self) -> None:
        self._now = 0.0
        self._due: list[tuple[float, int, Callable[[], None]]] = []
        self._number = count()
        self._busy = False

    def now(self) -> float:
        """Return the time (s), 0 at first."""
        return self._now

    def call_at(self, time_s: float, action: Callable[[], None]) -> None:
        """Do something at a time (s); at once when somebody waits, if that has passed."""
        heapq.heappush(self._due, (max(time_s, self._now), next(self._number), action))

    def sleep(self, seconds: float) -> None:
        """Let time pass; also for 0 seconds what is due now is done.

        Raises
        ------
        RuntimeError
            If an action waits.
        """
        self.sleep_until(self._now + max(seconds, 0.0))

    def sleep_until(self, time_s: float, ready: Callable[[], bool] = lambda: False) -> None:
        """Let time pass until `time_s`, or until something is `ready` that an action brought about; see `sleep`."""
        if self._busy:
            raise RuntimeError("`sleep` must not be called by an action of the clock; got one that waits.")
        self._busy = True
        try:
            while not ready() and self._due and self._due[0][0] <= time_s:
                self._now, _, action = heapq.heappop(self._due)
                action()
        finally:
            self._busy = False
        if not ready():
            self._now = max(self._now, time_s)
