"""Ctrl-C and SIGTERM stop a run after the present generation; a second one stops it at once."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class StopRequest:
    """Whether somebody has asked the run to stop; call it to know."""

    def __init__(self) -> None:
        self._asked = False

    def __call__(self) -> bool:
        """Return whether the run should stop."""
        return self._asked

    def receive(self, number: int, frame: FrameType | None) -> None:
        """Take note of a signal.

        Raises
        ------
        KeyboardInterrupt
            If it is the second one.
        """
        if self._asked:
            raise KeyboardInterrupt
        self._asked = True


@contextmanager
def stop_on_signals() -> Iterator[StopRequest]:
    """Let signals ask for a stop inside the block; what handled them before does so again after it."""
    request = StopRequest()
    before = {number: signal.signal(number, request.receive) for number in _SIGNALS}
    try:
        yield request
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
