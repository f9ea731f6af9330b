"""Bytes and lines to and from a robot, over a serial line or a TCP port."""

from collections.abc import Callable
from types import ModuleType
from typing import Any, Protocol, Self

from turing_learning.robots._clock import Clock, RealClock

LARGEST_LINE = 4096
_POLL_S = 0.02


class LinkError(ConnectionError):
    """A robot cannot be reached, or does not answer."""


def _pyserial() -> ModuleType:
    try:
        import serial
    except ImportError as error:
        raise ImportError("pyserial must be installed. Run: pip install 'turing-learning[robot]'") from error
    return serial


class Device(Protocol):
    """The near end of a line, as pyserial has it; what fails raises OSError."""

    @property
    def in_waiting(self) -> int:
        """How many bytes have come."""

    def read(self, size: int) -> bytes:
        """Return up to `size` bytes, fewer if they do not come in a short while."""

    def write(self, data: bytes) -> object:
        """Send."""

    def close(self) -> None:
        """Let go of the line."""


class Link:
    """A line to a robot that can be opened again; see `open_link`.

    Parameters
    ----------
    port
        A serial device ("/dev/rfcomm0", "COM3") or "socket://host:port".
    baud
        Of a serial line.
    clock
        For deadlines and pauses; the computer's by default.
    connect
        Opens the near end; by default that of the port.
    """

    def __init__(
        self,
        port: str,
        *,
        baud: int = 115200,
        clock: Clock | None = None,
        connect: Callable[[], Device] | None = None,
    ) -> None:
        self.port, self.clock = port, clock or RealClock()
        self._baud = baud
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
        """Open the line, anew if it is open.

        Raises
        ------
        LinkError
            If there is nothing at the port.
        """
        self.close()
        try:
            self._device = self._connect()
        except (OSError, ValueError) as error:
            raise LinkError(
                f"`port` must be a serial device or socket://host:port at which a robot listens; got {self.port!r} "
                f"({error}). Check that the robot is switched on and paired."
            ) from error

    def close(self) -> None:
        """Close the line; what was received and not read is dropped."""
        device, self._device = self._device, None
        self._buffer.clear()
        if device is not None:
            device.close()

    def send(self, data: bytes) -> None:
        """Send bytes.

        Raises
        ------
        LinkError
            If the line is closed or broken. It is closed then.
        """
        self._guarded(lambda device: device.write(data))

    def read_line(self, deadline: float) -> str | None:
        """Return the next line without its end, None if it is not whole at the deadline (by the clock).

        Bytes that are not printable ASCII are left out: form feeds and bells of greetings, and noise.

        Raises
        ------
        LinkError
            If the line is closed or broken.
        """
        while True:
            end = next((k for k, byte in enumerate(self._buffer) if byte in b"\r\n"), None)
            if end is not None:
                line = bytes(byte for byte in self._buffer[:end] if 32 <= byte < 127)
                del self._buffer[: end + 1]
                if line:
                    return line.decode("ascii")
                continue
            if len(self._buffer) > LARGEST_LINE:
                self._buffer.clear()
            if self.clock.now() >= deadline and not self._is_waiting():
                return None
            self._receive()

    def read_bytes(self, count: int, deadline: float) -> bytes | None:
        """Return exactly `count` bytes, None if there are fewer at the deadline.

        Raises
        ------
        LinkError
            If the line is closed or broken.
        """
        while len(self._buffer) < count:
            if self.clock.now() >= deadline and not self._is_waiting():
                return None
            self._receive()
        data = bytes(self._buffer[:count])
        del self._buffer[:count]
        return data

    def drop_rest(self) -> None:
        """Forget the beginning of a line whose end has not come."""
        self._buffer.clear()

    def _open_port(self) -> Device:
        device: Device = _pyserial().serial_for_url(self.port, self._baud, timeout=_POLL_S, write_timeout=1.0)
        return device

    def _is_waiting(self) -> bool:
        return bool(self._guarded(lambda device: device.in_waiting))

    def _receive(self) -> None:
        def read(device: Device) -> bytes:
            return bytes(device.read(max(1, device.in_waiting)))

        self._buffer += self._guarded(read)

    def _guarded(self, use: Callable[[Device], Any]) -> Any:
        if self._device is None:
            raise LinkError(f"`link` to {self.port} must be open; got a closed one. Open it.")
        try:
            return use(self._device)
        except OSError as error:
            self.close()
            raise LinkError(f"the link to {self.port} is lost ({error})") from error


def open_link(port: str, *, baud: int = 115200, clock: Clock | None = None) -> Link:
    """Open a line to a robot.

    Parameters
    ----------
    port
        A serial device ("/dev/rfcomm0", "COM3") or "socket://host:port".
    baud
        Of a serial line; the e-puck's is 115200.
    clock
        For deadlines and pauses; the computer's by default.

    Raises
    ------
    LinkError
        If there is nothing at the port.
    ImportError
        If pyserial is not installed.
    """
    link = Link(port, baud=baud, clock=clock)
    link.open()
    return link
