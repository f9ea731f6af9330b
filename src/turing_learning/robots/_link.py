"""Lines to robots, and the messages on them."""

import math
import re
import threading
from binascii import crc_hqx
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol, Self

from turing_learning.errors import integer, optional, require

from ._clock import Clock, RealClock

PARAMETER_UNIT = 1e-4  #: Models are sent as integer multiples of this
SIGNALS = ("START", "STOP")
LARGEST_SEQUENCE = 65535
ALIVE, HALT, HALTED = "X,A*209D", "X,H*B1B4", "x,H*3772"
"""The PC says that it is there, which has no answer; it halts a replica; the replica has halted."""
GO, GOES = "X,G*405B", "x,G*C69D"
"""The PC lets a robot begin its loop; the robot does."""


@dataclass(frozen=True)
class Model:
    """A model that is sent to a replica."""

    sequence: int  #: Its number, 0 to 65535; the replica reports by it which model it executes
    parameters: tuple[float, ...]  #: 1 to 16 wheel speeds as fractions of the maximum, in [-1, 1], rounded to 0.0001

    def __post_init__(self) -> None:
        integer("sequence", self.sequence, 0, LARGEST_SEQUENCE)
        require(1 <= len(self.parameters) <= 16, "parameters", "be 1 to 16 numbers", len(self.parameters))
        fits = all(math.isfinite(value) and abs(value) <= 1 for value in self.parameters)
        require(fits, "parameters", "be in [-1, 1]", list(self.parameters), "Apply tanh before.")


@dataclass(frozen=True)
class Signal:
    """A replica's message that a trial starts or has stopped."""

    kind: str  #: "START" or "STOP"
    trial: int  #: The replica's count of trials
    sequence: int  #: The model that it executes, -1 for none
    received_s: float  #: When it arrived, by the link's clock


@dataclass(frozen=True)
class Status:
    """Where a replica is in its loop.

    Attributes
    ----------
    state
        R1 to R5 of the paper; R0 before the loop has begun.
    in_state_s
        Time in that state.
    waiting, executing
        Sequence numbers of the model in the buffer and of the executed one, -1 for none.
    battery_ok
        Whether the battery is above its limit.
    """

    state: str
    in_state_s: float
    waiting: int
    executing: int
    battery_ok: bool


class Replica(Protocol):
    """A robot in its loop of the states R1 to R5, whatever it is and speaks; `EPuck` is one. An agent with an address is one, too.

    Every method raises `LinkError`, or another OSError, if the robot cannot be reached. Each may be called again without harm.
    """

    reconnections: int  #: How often the connection was lost so far, and signals perhaps with it

    def version(self) -> str:
        """Return what it is, in words, for `robots check`."""

    def status(self) -> Status:
        """Return where it is in its loop."""

    def start(self) -> None:
        """Begin the loop with R1, also if it runs; what a remote control does."""

    def halt(self) -> None:
        """Stand, leave the loop (R0), and forget the models."""

    def send_model(self, model: Model) -> None:
        """Put a model into the buffer, to be executed from the next R5 on. Agents are never sent one."""

    def wait_for(self, kind: str, timeout_s: float) -> Signal:
        """Return the next signal of a kind, drop earlier ones of the other kind; raise TimeoutError if none arrives in time."""

    def drop_signals(self) -> None:
        """Drop the signals that have arrived."""

    def close(self) -> None:
        """Close the connection; the robot goes on."""


def sealed(text: str) -> str:
    """Return a line with its checksum: CRC-16 (polynomial 0x1021, start 0xFFFF) of what is before the asterisk."""
    return f"{text}*{crc_hqx(text.encode('ascii'), 0xFFFF):04X}"


def opened(line: str) -> str | None:
    """Return a line without its checksum, None if the checksum is wrong or missing."""
    text, star, seal = line.rpartition("*")
    return text if star and text.isascii() and line == sealed(text) and len(seal) == 4 else None


def whole_numbers(fields: Sequence[str]) -> list[int] | None:
    """Return fields as integers, None if one is none."""
    digits = (field.strip().removeprefix("-") for field in fields)
    return [int(field) for field in fields] if all(part.isascii() and part.isdecimal() for part in digits) else None


def write_model(model: Model) -> str:
    """Return the line that carries a model."""
    numbers = (round(value / PARAMETER_UNIT) for value in model.parameters)
    return sealed(",".join(["X", "M", str(model.sequence), *map(str, numbers)]))


def read_model(numbers: Sequence[int]) -> Model | None:
    """Return the model in a message's integers, None if they are no valid model."""
    try:
        return Model(numbers[0], tuple(round(number * PARAMETER_UNIT, 4) for number in numbers[1:]))
    except (IndexError, ValueError):
        return None


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
    """A line to a robot that can be reopened; see `open_link`. Methods raise `LinkError` if the line is lost.

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
