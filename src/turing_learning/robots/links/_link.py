"""Bytes and lines to and from a robot, over a serial line or a TCP port."""

import re
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Protocol, Self

from turing_learning.errors import optional
from turing_learning.robots._clock import Clock, RealClock

from ._messages import ALIVE

LARGEST_LINE = 4096
_POLL_S = 0.02
_GRACE_S = 1.0  # after a deadline, in which a busy program reads what came before it
_END = re.compile(rb"[\r\n]")


class LinkError(ConnectionError):
    """A robot cannot be reached, or does not answer."""


class Device(Protocol):
    """The near end of a line, with the interface of pyserial; failures raise OSError."""

    @property
    def in_waiting(self) -> int:
        """Number of bytes that have arrived."""

    def read(self, size: int) -> bytes:
        """Return up to `size` bytes, fewer if they do not arrive within a short timeout."""

    def write(self, data: bytes) -> object:
        """Send bytes."""

    def close(self) -> None:
        """Release the line."""


class Link:
    """A line to a robot that can be reopened; see `open_link`. All methods raise `LinkError` if the line is lost.

    Parameters
    ----------
    port
        A serial device ("/dev/rfcomm0", "COM3") or "socket://host:port".
    baud
        Of a serial line; the e-puck's is 115200.
    clock
        For deadlines and pauses; the computer's by default.
    connect
        Opens the near end; by default that of the port.
    alive_s
        How often a thread says to a replica that the PC is there, so that it does not move when this process is dead; 0 for never.
    """

    def __init__(
        self, port: str, *, baud: int = 115200, clock: Clock | None = None,
        connect: Callable[[], Device] | None = None, alive_s: float = 0.0,
    ) -> None:  # fmt: skip
        self.port, self.clock = port, clock or RealClock()
        self._baud, self._alive_s = baud, alive_s
        self._writing, self._closed = threading.Lock(), threading.Event()
        self._connect = connect or self._open_port
        self._device: Device | None = None
        self._buffer = bytearray()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def is_open(self) -> bool:
        """Whether the line is open, as far as is known."""
        return self._device is not None

    def open(self) -> None:
        """Open the line; if it is open, close it first."""
        self.close()
        try:
            self._device = self._connect()
        except (OSError, ValueError) as error:
            raise LinkError(
                f"`port` must be a serial device or socket://host:port at which a robot listens; got {self.port!r} "
                f"({error}). Check that the robot is switched on and paired."
            ) from error
        if self._alive_s:
            self._closed = threading.Event()
            threading.Thread(target=self._stay_alive, args=(self._device, self._closed), daemon=True).start()

    def close(self) -> None:
        """Close the line and drop unread bytes."""
        device, self._device = self._device, None
        self._closed.set()
        self._buffer.clear()
        if device is not None:
            device.close()

    def send(self, data: bytes) -> None:
        """Send bytes."""
        with self._writing:
            self._guarded(lambda device: device.write(data))

    def _stay_alive(self, device: Device, closed: threading.Event) -> None:
        while not closed.is_set():  # the first time at once, before any model is sent
            with (
                self._writing,
                suppress(Exception),
            ):  # whatever a device says that is being closed; others notice a lost line
                device.write(ALIVE.encode("ascii") + b"\r")
            closed.wait(self._alive_s)

    def read_line(self, deadline: float) -> str | None:
        """Return the next line without its end, None if it is incomplete at the deadline (by the clock).

        Bytes that are not printable ASCII are left out: form feeds and bells of greetings, and noise.
        """
        while True:
            if end := _END.search(self._buffer):
                line = bytes(byte for byte in self._buffer[: end.start()] if 32 <= byte < 127)
                del self._buffer[: end.end()]
                if line:
                    return line.decode("ascii")
                continue
            if len(self._buffer) > LARGEST_LINE:
                self._buffer.clear()
            if not self._receive(deadline):
                return None

    def read_bytes(self, count: int, deadline: float) -> bytes | None:
        """Return exactly `count` bytes, None if fewer have arrived at the deadline."""
        while len(self._buffer) < count:
            if not self._receive(deadline):
                return None
        data = bytes(self._buffer[:count])
        del self._buffer[:count]
        return data

    def drop_rest(self) -> None:
        """Drop the beginning of an incomplete line."""
        self._buffer.clear()

    def _open_port(self) -> Device:
        serial = optional("serial", "pyserial", "robot")
        device: Device = serial.serial_for_url(self.port, self._baud, timeout=_POLL_S, write_timeout=1.0)
        return device

    def _receive(self, deadline: float) -> bool:
        """Read what has arrived; return False if the deadline has passed and nothing has, or the peer never stops sending."""
        late_s = self.clock.now() - deadline
        if late_s >= 0 and (late_s >= _GRACE_S or not self._guarded(lambda device: device.in_waiting)):
            return False
        self._buffer += self._guarded(lambda device: bytes(device.read(max(1, device.in_waiting))))
        return True

    def _guarded(self, use: Callable[[Device], Any]) -> Any:
        if self._device is None:
            raise LinkError(f"`link` to {self.port} must be open; got a closed one. Open it.")
        try:
            return use(self._device)
        except OSError as error:
            self.close()
            raise LinkError(f"the link to {self.port} is lost ({error})") from error


def open_link(port: str, *, baud: int = 115200, clock: Clock | None = None, alive_s: float = 0.0) -> Link:
    """Open a line to a robot; see `Link`. Raise `LinkError` if there is none, `MissingExtraError` without pyserial."""
    link = Link(port, baud=baud, clock=clock, alive_s=alive_s)
    link.open()
    return link
