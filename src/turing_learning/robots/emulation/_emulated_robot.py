"""The emulated robot: the protocol's other side."""

import struct
import threading
import time
from collections.abc import Callable, Generator, Sequence
from typing import Protocol

from turing_learning.errors import choice
from turing_learning.robots.links._messages import (
    GOES,
    HALTED,
    LARGEST_SEQUENCE,
    SIGNALS,
    Model,
    opened,
    read_model,
    sealed,
    whole_numbers,
)

GREETING = b'\f\aWELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n'
NOT_FOUND = b"z,Command not found\r\n"
LONGEST_COMMAND = 256
_HELP = {
    "B,#": "body light",
    "b": "battery",
    "C": "selector",
    "D,#,#": "set wheel speeds",
    "E": "get wheel speeds",
    "F,#": "front light",
    "H": "this help",
    "L,#,#": "ring light",
    "N": "proximity",
    "R": "reset",
    "S": "stop",
    "V": "version",
    "X": "models and signals of Turing Learning",
}
_BINARY_ARGUMENTS = {"D": 4, "L": 2, "P": 4, "W": 3}
Listener = Generator[None, int, None]


class Body(Protocol):
    """The hardware of a robot: what its program moves and reads."""

    def set_speed(self, left: int, right: int) -> None:
        """Turn the wheels (steps per second, -1000 to 1000)."""

    def proximity(self) -> Sequence[int]:
        """Return the eight infrared readings."""

    def battery_ok(self) -> bool:
        """Return whether the battery is above its limit."""


class EmulatedRobot:
    """Answer bytes as an e-puck with the public protocol does, and take models as a replica.

    It reads byte by byte, as the firmware does, so that noise has the same effect: a byte above 127 begins a
    binary request that ends with a zero.

    Parameters
    ----------
    body
        What the commands act on.
    clock
        Time (s).
    selector
        Position of the robot's switch, 0 to 15.

    Attributes
    ----------
    state
        State of the replica's program, "R0" before it begins; see `enter`.
    executing
        The model that is executed.
    called
        Whether the PC wants it to begin its loop.
    lights
        State of each of the lights 0 to 7, 8 (body) and 9 (front): 0 off, 1 on.
    """

    def __init__(self, body: Body, *, clock: Callable[[], float] = time.monotonic, selector: int = 0) -> None:
        self._body, self._clock, self._selector = body, clock, selector
        self._answer = bytearray()
        self._lock = threading.Lock()
        self._begin()

    def _forget(self) -> None:
        self._speed, self.lights = (0, 0), [0] * 10
        self.executing: Model | None = None
        self._waiting: Model | None = None
        self.state, self._entered, self._trial, self.called = "R0", self._clock(), 0, False
        self._alive_at: float | None = None  # when a PC that keeps itself known was heard
        self._asked_at: float | None = None  # when the PC sent anything else

    def _begin(self) -> None:
        self._forget()
        self._listener = self._listen()
        next(self._listener)

    @property
    def greeting(self) -> bytes:
        """What the robot sends when it is switched on."""
        return GREETING

    def receive(self, data: bytes) -> bytes:
        """Read bytes and return the answers."""
        with self._lock:
            for byte in data:
                self._listener.send(byte)
            answer = bytes(self._answer)
            self._answer.clear()
        return answer

    def restart(self) -> None:
        """Switch off and on: everything is forgotten."""
        with self._lock:
            self._begin()

    def enter(self, state: str) -> None:
        """Enter a state of the replica's program; R3 takes the model from the buffer."""
        with self._lock:
            self.state, self._entered = state, self._clock()
            if state == "R3" and self._waiting is not None:
                self.executing, self._waiting = self._waiting, None

    @property
    def alone_s(self) -> float:
        """Time since a PC that says that it is there was heard; 0 if none has said so."""
        return 0.0 if self._alive_at is None else self._clock() - self._alive_at

    @property
    def unasked_s(self) -> float:
        """Time since the PC asked or commanded something; 0 if it never has."""
        return 0.0 if self._asked_at is None else self._clock() - self._asked_at

    def halt(self) -> None:
        """Stand, leave the loop, forget models."""
        with self._lock:
            self._halt()

    def signal(self, kind: str) -> bytes:
        """Return the signal that a trial starts or has stopped; each start begins another trial."""
        choice("kind", kind, SIGNALS)
        with self._lock:
            if kind == "START":
                self._trial = (self._trial + 1) % (LARGEST_SEQUENCE + 1)
            return _line(sealed(f"x,{kind},{self._trial},{_sequence(self.executing)}"))

    def _listen(self) -> Listener:
        """Read bytes for ever; answers are appended to `_answer`."""
        while True:
            first = yield
            if first >= 128:
                yield from self._read_binary(first)
            elif first not in b"\0\r\n":
                yield from self._read_line(first)

    def _read_line(self, first: int) -> Listener:
        line = bytearray([first])
        while (byte := (yield)) not in b"\r\n":
            if len(line) < LONGEST_COMMAND:
                line.append(byte)
        self._answer += self._obey(line.decode("latin-1"))

    def _read_binary(self, command: int) -> Listener:
        """Read requests until a zero, then answer all of them at once; unknown ones are ignored."""
        answer = bytearray()
        while command:
            letter = chr((256 - command) % 256)
            arguments = bytearray()
            for _ in range(_BINARY_ARGUMENTS.get(letter, 0)):
                arguments.append((yield))
            answer += self._obey_binary(letter, bytes(arguments))
            command = yield
        self._answer += answer

    def _obey_binary(self, letter: str, arguments: bytes) -> bytes:
        if letter == "D":
            self._drive(*struct.unpack("<hh", arguments))
        elif letter == "L":
            self._light(min(arguments[0], 8), arguments[1])
        elif letter == "E":
            return struct.pack("<hh", *self._speed)
        elif letter == "N":
            return struct.pack("<8h", *self._body.proximity())
        elif letter == "b":
            return struct.pack("<h", self._body.battery_ok())
        return b""

    def _obey(self, line: str) -> bytes:
        """Return the answer to a line. Lower case means upper case, except where both exist."""
        letter = line[0] if line[0] in "bg" else line[0].upper()
        answers: dict[str, Callable[[list[str]], bytes]] = {
            "B": lambda fields: self._set_light(8, fields, b"b\r\n"),
            "b": lambda _: _line(f"b,{int(self._body.battery_ok())}"),
            "C": lambda _: _line(f"c,{self._selector}"),
            "D": self._set_speed,
            "E": lambda _: _line(f"e,{self._speed[0]},{self._speed[1]}"),
            "F": lambda fields: self._set_light(9, fields, b"f\r\n"),
            "H": lambda _: b"".join(_line(f'"{command}" {meaning}') for command, meaning in _HELP.items()),
            "L": self._set_ring_light,
            "N": lambda _: _line("n," + ",".join(map(str, self._body.proximity()))),
            "R": self._reset,
            "S": self._stop,
            "V": lambda _: _line("v,Version 1.1.3 emulated"),
            "X": lambda _: self._converse(line),
        }
        return answers[letter](line.split(",")[1:]) if letter in answers else NOT_FOUND

    def _drive(self, left: int, right: int) -> None:
        self._speed = (max(-1000, min(left, 1000)), max(-1000, min(right, 1000)))
        self._body.set_speed(*self._speed)

    def _set_speed(self, fields: list[str]) -> bytes:
        """Set those of the two speeds that can be parsed, as the firmware's scanner does."""
        speeds = list(self._speed)
        for k, field in enumerate(fields[:2]):
            number = whole_numbers([field])
            if number is None:
                break
            speeds[k] = number[0]
        self._drive(*speeds)
        return b"d\r\n"

    def _light(self, light: int, action: int) -> None:
        self.lights[light] = 1 - self.lights[light] if action == 2 else int(action == 1)

    def _set_light(self, light: int, fields: list[str], answer: bytes) -> bytes:
        numbers = whole_numbers(fields[:1])
        if numbers:
            self._light(light, numbers[0])
        return answer

    def _set_ring_light(self, fields: list[str]) -> bytes:
        numbers = whole_numbers(fields[:2])
        if numbers is not None and len(numbers) == 2:
            chosen = range(8) if not 0 <= numbers[0] < 8 else [numbers[0]]
            for light in chosen:
                self._light(light, numbers[1])
        return b"l\r\n"

    def _stop(self, _: list[str]) -> bytes:
        self._drive(0, 0)
        self.lights = [0] * 10
        return b"s\r\n"

    def _halt(self) -> None:
        self._drive(0, 0)
        self._forget()

    def _reset(self, _: list[str]) -> bytes:
        self._halt()
        return self.greeting

    def _converse(self, line: str) -> bytes:
        """Answer a message of the replica's protocol."""
        text = opened(line)
        if text is None:
            return _line(sealed("x,E,checksum"))
        fields = text.split(",")[1:]
        now = self._clock()
        if fields == ["A"]:
            self._alive_at = now
            return b""
        self._asked_at = now
        if self._alive_at is not None:
            self._alive_at = now
        if fields == ["H"]:
            self._halt()
            return _line(HALTED)
        if fields == ["G"]:
            self.called = True
            return _line(GOES)
        if fields == ["Q"]:
            return _line(sealed(self._describe()))
        numbers = whole_numbers(fields[1:])
        model = read_model(numbers) if fields[0] == "M" and numbers is not None else None
        if model is None:
            return _line(sealed("x,E,message"))
        self._waiting = model
        return _line(sealed(f"x,M,{model.sequence}"))

    def _describe(self) -> str:
        elapsed = round(1000 * (self._clock() - self._entered))
        models = f"{_sequence(self._waiting)},{_sequence(self.executing)}"
        return f"x,Q,{self.state},{elapsed},{models},{int(self._body.battery_ok())}"


def _line(text: str) -> bytes:
    return text.encode("ascii") + b"\r\n"


def _sequence(model: Model | None) -> int:
    return -1 if model is None else model.sequence
