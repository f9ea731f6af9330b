"""The driver of an e-puck that speaks the public serial protocol, and of a replica that also takes models."""

import re
import struct
from collections import deque
from collections.abc import Callable, Sequence
from typing import TypeVar

from turing_learning.errors import choice, integer, number

from ._link import (
    GO,
    GOES,
    HALT,
    HALTED,
    SIGNALS,
    Link,
    LinkError,
    Model,
    Signal,
    Status,
    opened,
    sealed,
    whole_numbers,
    write_model,
)

Answer = TypeVar("Answer")
MAXIMUM_SPEED = 1000  #: Wheel speed (steps per second) that an e-puck reaches; one turn of a wheel has 1000 steps
SENSORS = 8
_EXPECTED = ("WELCOME", "the EPFL education robot", "HW version", "s", "r")  # greetings, versions, the stop above
LEAST_CHARGE = 15  #: Percent
_BATTERY = re.compile(r"b,(\d+)(?: \((\d+)%\))?")  # of an e-puck, and of an e-puck2
RESYNCHRONIZE = b"\0" * 36 + b"\rS\r"
"""Ends any unfinished command: 35 bytes of arguments, of the RGB panel, and the end of a binary request, or the end of a line.

Whatever the robot made of it, it stops; and the line makes it wait for a command of either kind: after an end
of line alone it would take a binary request for text.
"""


class _NotUnderstoodError(Exception):
    """The robot answers that it does not know what arrived."""


class EPuck:
    """The driver of an e-puck, a `Replica`.

    A command without a valid answer in time is repeated; a link that breaks meanwhile is reopened. All
    commands may be repeated without harm. Every method raises `LinkError` if the robot does not answer.

    Parameters
    ----------
    link
        The line to it.
    timeout_s, retries
        How long to wait for an answer, and how often a command is repeated.

    Attributes
    ----------
    garbled, reconnections
        Number of invalid lines received, and of times that the link was reopened.

    Source: GCtronic wiki, "Advanced sercom protocol"; docs/robots/protocol.md.
    """

    def __init__(self, link: Link, *, timeout_s: float = 0.5, retries: int = 3) -> None:
        self._link, self._timeout_s = link, number("timeout_s", timeout_s, above=0)
        self._retries = integer("retries", retries)
        self._signals: deque[Signal] = deque()
        self.garbled = 0
        self.reconnections = 0

    def version(self) -> str:
        """Return the version of the robot's protocol."""
        return self._ask("V", lambda line: line[2:].strip() if line.startswith("v,") else None)

    def set_speed(self, left: int, right: int) -> None:
        """Set the wheel speeds (steps per second, -1000 to 1000)."""
        _check_speeds(left, right)
        self._ask(f"D,{left},{right}", lambda line: True if line == "d" else None)

    def speed(self) -> tuple[int, int]:
        """Return the wheel speeds (steps per second), left and right."""
        left, right = self._ask("E", lambda line: _numbers(line, "e", (2,)))
        return left, right

    def proximity(self) -> tuple[int, ...]:
        """Return the readings of the eight infrared sensors, from the front right one clockwise."""
        return tuple(self._ask("N", lambda line: _numbers(line, "n", (SENSORS, 10)))[:SENSORS])

    def battery_ok(self) -> bool:
        """Return whether the battery is above its limit; of a robot that states its charge, whether that is above 15 %."""

        def read(line: str) -> bool | None:
            found = _BATTERY.fullmatch(line)
            return None if found is None else int(found[2]) > LEAST_CHARGE if found[2] else int(found[1]) > 0

        return self._ask("b", read)

    def stop(self) -> None:
        """Stop the wheels and switch the lights off."""
        self._ask("S", lambda line: True if line == "s" else None)

    def halt(self) -> None:
        """Halt a replica: it stands and waits for the remote control; its models are forgotten."""
        self._ask(HALT, lambda line: True if line == HALTED else None)

    def start(self) -> None:
        """Let a robot begin its loop, as the remote control does."""
        self._ask(GO, lambda line: True if line == GOES else None)

    def close(self) -> None:
        """Close the line."""
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
            return None if answer is None else struct.unpack(f"<{SENSORS}h", answer)

        return self._try(f"a binary request {request.hex(' ')}", exchange)

    def send_model(self, model: Model) -> None:
        """Put a model into the replica's buffer, to be executed from its next trial on."""
        expected = sealed(f"x,M,{model.sequence}")
        self._ask(write_model(model), lambda line: True if line == expected else None)

    def status(self) -> Status:
        """Return where the replica is in its loop; a LinkError tells one without a replica's firmware."""

        def read(line: str) -> Status | None:
            fields = (opened(line) or "").split(",")
            numbers = whole_numbers(fields[3:])
            if fields[:2] != ["x", "Q"] or numbers is None or len(numbers) != 4:
                return None
            return Status(fields[2], 1e-3 * numbers[0], numbers[1], numbers[2], numbers[3] > 0)

        return self._ask(sealed("X,Q"), read)

    def wait_for(self, kind: str, timeout_s: float) -> Signal:
        """Return the next signal of a kind, drop earlier ones of the other kind; raise TimeoutError if none arrives in time."""
        choice("kind", kind, SIGNALS)
        deadline = self._link.clock.now() + timeout_s
        while True:
            while self._signals:
                signal = self._signals.popleft()
                if signal.kind == kind:
                    return signal
            line = self._link.read_line(deadline)
            if line is None:
                raise TimeoutError(
                    f"`{kind}` must be signalled within {timeout_s} s; got nothing from {self._link.port}. Check the replica."
                )
            self._sort(line)

    def drop_signals(self) -> None:
        """Drop the signals that have arrived, so that `wait_for` waits for a new one."""
        self._drain(0.0)
        self._signals.clear()

    def _deadline(self) -> float:
        return self._link.clock.now() + self._timeout_s

    def _ask(self, command: str, read: Callable[[str], Answer | None]) -> Answer:
        """Send a line and return what `read` makes of the answer; `_sort` takes the other lines."""

        def exchange() -> Answer | None:
            self._link.send(command.encode("ascii") + b"\r")
            deadline = self._deadline()
            while (line := self._link.read_line(deadline)) is not None:
                answer = read(line)
                if answer is not None:
                    return answer
                if line.startswith("z,"):  # the robot has not understood what arrived
                    self.garbled += 1
                    raise _NotUnderstoodError
                self._sort(line)
            return None

        return self._try(repr(command), exchange)

    def _try(self, what: str, exchange: Callable[[], Answer | None]) -> Answer:
        trouble, refused = "no answer that makes sense", 0
        for attempt in range(self._retries + 1):
            try:
                if not self._link.is_open:
                    self._link.open()
                    self.reconnections += 1
                if attempt:  # let both ends wait for the beginning of a command
                    self._link.send(RESYNCHRONIZE)
                    self._drain(0.1)
                    self._link.drop_rest()
                else:
                    self._drain(0.0)
                answer = exchange()
            except _NotUnderstoodError:
                refused, answer = refused + 1, None
            except LinkError as error:
                trouble, answer = str(error), None
                self._link.clock.sleep(min(self._timeout_s, 0.2))  # a port that has just gone may come back
            if answer is not None:
                return answer
        if refused > self._retries and what.startswith("'X,"):
            trouble = (
                "'Command not found', as of an ordinary e-puck without replica firmware (docs/robots/firmware.md),"
            )
        raise LinkError(
            f"the robot at {self._link.port} must answer {what}; got {trouble} in {self._retries + 1} attempts."
        )

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
        text = opened(line)
        fields = (text or "").split(",")
        numbers = whole_numbers(fields[2:])
        if fields[0] == "x" and fields[1] in SIGNALS and numbers is not None and len(numbers) == 2:
            self._signals.append(Signal(fields[1], numbers[0], numbers[1], self._link.clock.now()))
        elif not line.startswith(_EXPECTED):
            self.garbled += 1


def _check_speeds(left: int, right: int) -> None:
    integer("left", left, -MAXIMUM_SPEED, MAXIMUM_SPEED)
    integer("right", right, -MAXIMUM_SPEED, MAXIMUM_SPEED)


def _numbers(line: str, letter: str, counts: Sequence[int]) -> list[int] | None:
    """Return the whole numbers of an answer, None if it is not that answer, whole."""
    head, _, rest = line.partition(",")
    numbers = whole_numbers(rest.split(","))
    return numbers if head == letter and numbers is not None and len(numbers) in counts else None
