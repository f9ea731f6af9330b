"""Lines to robots, the messages on them, and the driver of an e-puck, which may be a replica that takes models."""

import math
import re
import struct
import threading
from binascii import crc_hqx
from collections import deque
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from turing_learning.errors import choice, integer, number, optional, require

from ._clock import Clock, RealClock

PARAMETER_UNIT = 1e-4  #: Models are sent as integer multiples of this
SIGNALS = ("START", "STOP")
LARGEST_SEQUENCE = 65535


@dataclass(frozen=True)
class Model:
    """A model that is sent to a replica."""

    #: Its number, 0 to 65535; the replica reports by it which model it executes
    sequence: int
    #: 1 to 16 wheel speeds as fractions of the maximum, in [-1, 1], rounded to 0.0001
    parameters: tuple[float, ...]

    def __post_init__(self) -> None:
        integer("sequence", self.sequence, 0, LARGEST_SEQUENCE)
        rule = "be 1 to 16 numbers"
        require(1 <= len(self.parameters) <= 16, "parameters", rule, len(self.parameters))
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
    """Where a replica is in its loop."""

    state: str  #: R1 to R5 of the paper; R0 before the loop has begun
    in_state_s: float  #: Time in that state
    waiting: int  #: Sequence number of the model in the buffer, -1 for none
    executing: int  #: Sequence number of the executed model, -1 for none
    battery_ok: bool  #: Whether the battery is above its limit


class Replica(Protocol):
    """A robot in its loop of the states R1 to R5, whatever it is and speaks; `EPuck` is one. An agent with an address is one, too.

    Every method raises `LinkError`, or another OSError, if the robot cannot be reached. Each may be called
    again without harm.
    """

    #: How often the connection was lost so far, and signals perhaps with it
    reconnections: int

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
    if star and text.isascii() and line == sealed(text) and len(seal) == 4:
        return text
    return None


#: What a PC sends to say that it is there
ALIVE = sealed("X,A").encode("ascii") + b"\r"
ALIVE_S = 0.5  #: How often (s), at the ordinary speed
LARGEST_LINE = 4096
_POLL_S = 0.02
# After a deadline, in which a busy program reads what came before it
_GRACE_S = 1.0
_END = re.compile(rb"[\r\n]")


class LinkError(ConnectionError):
    """A robot cannot be reached, or does not answer."""


class Device(Protocol):
    """The near end of a line, as of pyserial: what does not arrive within a short timeout is not read; failures raise OSError."""

    @property
    def in_waiting(self) -> int: ...
    def read(self, size: int) -> bytes: ...
    def write(self, data: bytes) -> object: ...
    def close(self) -> None: ...


class Link(AbstractContextManager["Link"]):
    """A line to a robot that can be reopened; see `open_link`. Methods raise `LinkError` if the line is lost.

    `port` is a serial device ("/dev/rfcomm0", "COM3") with a `baud` rate, the e-puck's by default, or
    "socket://host:port". `clock` is for deadlines and pauses, the computer's by default; `connect` opens the
    near end, by default that of the port. Every `alive_s`, or never if 0, a thread says to a replica that the
    PC is there, so that it does not move when this process is dead.
    """

    def __init__(
        self, port: str, *, baud: int = 115200, clock: Clock | None = None,
        connect: Callable[[], Device] | None = None, alive_s: float = 0.0,
    ) -> None:  # fmt: skip
        self.port = port
        self.clock = clock or RealClock()
        self._alive_s = alive_s
        self._writing = threading.Lock()
        self._closed = threading.Event()
        timeouts = {"timeout": _POLL_S, "write_timeout": 1.0}
        self._connect = connect or (
            lambda: optional("serial", "pyserial", "robot").serial_for_url(port, baud, **timeouts)
        )
        self._device: Device | None = None
        self._buffer = bytearray()

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def is_open(self) -> bool:
        """Whether the line is open, as far as is known."""
        return self._device is not None

    def open(self) -> "Link":
        """Open the line; if it is open, close it first. Return it."""
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
            threading.Thread(
                target=self._stay_alive, args=(self._device, self._closed), daemon=True
            ).start()
        return self

    def close(self) -> None:
        """Close the line and drop unread bytes."""
        device = self._device
        self._device = None
        self._closed.set()
        self._buffer.clear()
        if device is not None:
            device.close()

    def send(self, data: bytes) -> None:
        """Send bytes."""
        with self._writing:
            self._guarded(lambda device: device.write(data))

    def _stay_alive(self, device: Device, closed: threading.Event) -> None:
        # The first time at once, before any model is sent
        while not closed.is_set():
            # Of a device that is being closed; others notice a lost line
            with self._writing, suppress(Exception):
                device.write(ALIVE)
            closed.wait(self._alive_s)

    def read_line(self, deadline: float) -> str | None:
        """Return the next line without its end, None if it is incomplete at the deadline (by the clock).

        Bytes that are not printable ASCII are left out: form feeds and bells of greetings, and noise.
        """
        while True:
            if line_end := _END.search(self._buffer):
                line = bytes(byte for byte in self._buffer[: line_end.start()] if 32 <= byte < 127)
                del self._buffer[: line_end.end()]
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

    def _receive(self, deadline: float) -> bool:
        """Read what has arrived; return False if the deadline has passed and nothing has, or the peer never stops sending."""
        late_s = self.clock.now() - deadline
        if late_s >= 0 and (
            late_s >= _GRACE_S or not self._guarded(lambda device: device.in_waiting)
        ):
            return False
        self._buffer += self._guarded(lambda device: bytes(device.read(max(1, device.in_waiting))))
        return True

    def _guarded(self, exchange: Callable[[Device], Any]) -> Any:
        if self._device is None:
            raise LinkError(f"`link` to {self.port} must be open; got a closed one. Open it.")
        try:
            return exchange(self._device)
        except OSError as error:
            self.close()
            raise LinkError(f"the link to {self.port} is lost ({error})") from error


def open_link(
    port: str, *, baud: int = 115200, clock: Clock | None = None, alive_s: float = 0.0
) -> Link:
    """Open a line to a robot; see `Link`. Raise `LinkError` if there is none, `MissingExtraError` without pyserial."""
    return Link(port, baud=baud, clock=clock, alive_s=alive_s).open()


Answer = TypeVar("Answer")
#: Wheel speed (steps per second) that an e-puck reaches; one turn of a wheel has 1000 steps
MAXIMUM_SPEED = 1000
SENSORS = 8
# Greetings, versions, the stop above
_EXPECTED = ("WELCOME", "the EPFL education robot", "HW version", "s", "r")
LEAST_CHARGE = 15  #: Percent
_WHOLE = r", *(-?\d{1,9}) *"  # a number in an answer; a longer one is noise
_MOST_SIGNALS = 1000  # that wait for the program; a replica sends two in a loop
_SIGNAL = re.compile(rf"x,({'|'.join(SIGNALS)}){2 * _WHOLE}")
RESYNCHRONIZE = b"\0" * 36 + b"\rS\r"
"""Ends any unfinished command: 35 bytes of arguments and the end of a binary request, or of a line. Whatever
the robot made of it, it stops, and waits for a command of either kind: after an end of line alone it would take
a binary request for text."""


class EPuck(Replica):
    """The driver of an e-puck, a `Replica`: docs/robots/protocol.md; GCtronic wiki, "Advanced sercom protocol".

    A command without a valid answer within `timeout_s` is repeated, up to `retries` times; a link that breaks
    meanwhile is reopened. All commands may be repeated without harm. Every method raises `LinkError` if the
    robot does not answer. `garbled` counts invalid lines received, `reconnections` how often the link was
    reopened.
    """

    def __init__(self, link: Link, *, timeout_s: float = 0.5, retries: int = 3) -> None:
        self._link = link
        self._timeout_s = number("timeout_s", timeout_s, above=0)
        self._retries = integer("retries", retries)
        self._signals: deque[Signal] = deque(maxlen=_MOST_SIGNALS)
        self.garbled = self.reconnections = 0
        # how often a command, since it was first sent, was answered as one that is not known
        self._refused = 0

    def version(self) -> str:
        """Return the version of the robot's protocol."""
        return self._ask("V", "v,(.*)")[1].strip()

    def set_speed(self, left: int, right: int) -> None:
        """Set the wheel speeds (steps per second, -1000 to 1000)."""
        _check_speeds(left, right)
        self._ask(f"D,{left},{right}", "d")

    def speed(self) -> tuple[int, int]:
        """Return the wheel speeds (steps per second), left and right."""
        numbers = self._ask("E", "e" + 2 * _WHOLE)
        return int(numbers[1]), int(numbers[2])

    def proximity(self) -> tuple[int, ...]:
        """Return the readings of the eight infrared sensors, from the front right one clockwise."""
        # Some robots state those of two cliff sensors, too.
        numbers = self._ask("N", f"n{SENSORS * _WHOLE}({2 * _WHOLE})?")
        return tuple(map(int, numbers.groups()[:SENSORS]))

    def battery_ok(self) -> bool:
        """Return whether the battery is above its limit; of a robot that states its charge, whether that is above 15 %."""
        # An e-puck answers with one number, an e-puck2 with a voltage and a charge
        numbers = self._ask("b", r"b,(\d{1,9})(?: \((\d{1,9})%\))?")
        if numbers[2]:
            return int(numbers[2]) > LEAST_CHARGE
        return int(numbers[1]) > 0

    def stop(self) -> None:
        """Stop the wheels and switch the lights off."""
        self._ask("S", "s")

    def halt(self) -> None:
        self._ask("X,H", "x,H")

    def start(self) -> None:
        self._ask("X,G", "x,G")

    def close(self) -> None:
        self._link.close()

    def reset(self) -> None:
        """Start the robot's program anew; an e-puck2 ignores that. No answer is certain, so the version is asked for then."""
        if not self._link.is_open:
            self._link.open()
        self._link.send(RESYNCHRONIZE + b"R\r")
        self.version()

    def drive(self, left: int, right: int) -> tuple[int, ...]:
        """Set the wheel speeds and return the eight infrared readings, in one binary request of 7 bytes."""
        _check_speeds(left, right)
        request = struct.pack("<bhhbb", -ord("D"), left, right, -ord("N"), 0)

        def exchange() -> tuple[int, ...] | None:
            self._link.send(request)
            answer = self._link.read_bytes(2 * SENSORS, self._deadline())
            if answer is None:
                return None
            return struct.unpack(f"<{SENSORS}h", answer)

        return self._try(f"a binary request {request.hex(' ')}", exchange)

    def send_model(self, model: Model) -> None:
        numbers = (model.sequence, *(round(value / PARAMETER_UNIT) for value in model.parameters))
        self._ask(f"X,M,{','.join(map(str, numbers))}", f"x,M,{model.sequence}")

    def status(self) -> Status:
        """Return where the replica is in its loop; a LinkError tells one without a replica's firmware."""
        state, *numbers = self._ask("X,Q", "x,Q,([^,]*)" + 4 * _WHOLE).groups()
        elapsed_ms, waiting, executing, battery = map(int, numbers)
        return Status(state, 1e-3 * elapsed_ms, waiting, executing, battery > 0)

    def wait_for(self, kind: str, timeout_s: float) -> Signal:
        choice("kind", kind, SIGNALS)
        deadline = self._link.clock.now() + timeout_s
        while True:
            while self._signals:
                signal = self._signals.popleft()
                if signal.kind == kind:
                    return signal
            line = self._link.read_line(deadline)
            if line is None:
                nothing = f"nothing from {self._link.port}. Check the replica."
                raise TimeoutError(
                    f"`{kind}` must be signalled within {timeout_s} s; got {nothing}"
                )
            self._sort(line)

    def drop_signals(self) -> None:
        self._drain(0.0)
        self._signals.clear()

    def _deadline(self) -> float:
        return self._link.clock.now() + self._timeout_s

    def _ask(self, command: str, answer: str) -> re.Match[str]:
        """Send a line and return the one that matches the answer; messages are sealed. `_sort` takes the other lines."""
        message = command.startswith("X,")
        sent = sealed(command) if message else command

        def exchange() -> re.Match[str] | None:
            self._link.send(sent.encode("ascii") + b"\r")
            deadline = self._deadline()
            while (line := self._link.read_line(deadline)) is not None:
                if match := re.fullmatch(answer, (opened(line) or "") if message else line):
                    return match
                # The robot has not understood what arrived
                if line.startswith("z,"):
                    self.garbled, self._refused = self.garbled + 1, self._refused + 1
                    return None
                self._sort(line)
            return None

        return self._try(repr(sent), exchange)

    def _try(self, request: str, exchange: Callable[[], Answer | None]) -> Answer:
        trouble = "no answer that makes sense"
        self._refused = 0
        for attempt in range(self._retries + 1):
            try:
                if not self._link.is_open:
                    self._link.open()
                    self.reconnections += 1
                # Let both ends wait for the beginning of a command
                if attempt:
                    self._link.send(RESYNCHRONIZE)
                    self._drain(0.1)
                    self._link.drop_rest()
                else:
                    self._drain(0.0)
                answer = exchange()
            except LinkError as error:
                trouble = str(error)
                answer = None
                # A port that has just gone may come back
                self._link.clock.sleep(min(self._timeout_s, 0.2))
            if answer is not None:
                return answer
        if self._refused > self._retries and request.startswith("'X,"):
            device = "an ordinary e-puck without replica firmware (docs/robots/firmware.md)"
            trouble = f"'Command not found', as of {device},"
        got = f"{trouble} in {self._retries + 1} attempts"
        raise LinkError(f"the robot at {self._link.port} must answer {request}; got {got}.")

    def _drain(self, quiet_s: float) -> None:
        """Read unsolicited lines until the line is quiet: a late answer must not be taken for the next one."""
        limit = self._deadline()
        while self._link.clock.now() < limit:
            line = self._link.read_line(self._link.clock.now() + quiet_s)
            if line is None:
                break
            self._sort(line)

    def _sort(self, line: str) -> None:
        """Keep signals; count everything else that is not a greeting."""
        if match := _SIGNAL.fullmatch(opened(line) or ""):
            self._signals.append(
                Signal(match[1], int(match[2]), int(match[3]), self._link.clock.now())
            )
        else:
            self.garbled += not line.startswith(_EXPECTED)


def _check_speeds(left: int, right: int) -> None:
    integer("left", left, -MAXIMUM_SPEED, MAXIMUM_SPEED)
    integer("right", right, -MAXIMUM_SPEED, MAXIMUM_SPEED)
