"""Ctrl-C, SIGTERM and SIGHUP stop a command after the present generation; a second signal stops it at once."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

DONE, FAILED, REFUSED, INTERRUPTED = 0, 1, 2, 130
"""Exit codes."""

_SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


class Interrupted(Exception):
    """A run was stopped and can be resumed."""


class StopRequest:
    """Whether somebody has asked the run to stop; call it to know."""

    def __init__(self) -> None:
        self._asked = False

    def __call__(self) -> bool:
        """Return whether the run should stop."""
        return self._asked

    def receive(self, number: int, frame: FrameType | None) -> None:
        """Take note of a signal; the second one raises KeyboardInterrupt."""
        if self._asked:
            raise KeyboardInterrupt
        self._asked = True


@contextmanager
def stopping(ahead: str | Callable[[], str]) -> Iterator[StopRequest]:
    """Let signals ask for a stop inside the block; one that was ended at once says how to resume."""
    request = StopRequest()
    before = {number: signal.signal(number, request.receive) for number in _SIGNALS}
    try:
        yield request
    except KeyboardInterrupt as error:
        raise Interrupted(f"interrupted; {ahead}" if isinstance(ahead, str) else ahead()) from error
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
