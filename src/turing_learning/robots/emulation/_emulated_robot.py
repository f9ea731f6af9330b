"""The emulated robot: the protocol's other side."""

import struct
import threading
import time
from collections.abc import Callable, Generator, Sequence
from itertools import takewhile
from typing import Protocol

from turing_learning.errors import choice
from turing_learning.robots._link import (
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
_VERSIONS = {"e-puck": "Version 1.2.2", "e-puck2": "Version 2.0"}
_HELP = "A B,# b C D,#,# E F,# G g H I J,#,#,#,# K L,#,# M N O P,#,# Q R S T,# U V W,#,#,# X Y,#,#"
_SENSED = {"A": (12, -9, 812), "g": (3, -2, 1), "M": (890, 874, 901, 512, 498), "O": (3400,) * 8, "U": (10, 12, 9)}
"""Readings of sensors that the laboratory does not emulate: acceleration, rotation, floor, light, sound."""
_ANSWERS = {letter: letter.lower() for letter in "BFJLPTW"} | {
    "G": "g IR check : 0x0, address : 0x0, data : 0x0",
    "K": "k, Starting calibration\r\nk, Calibration finished",
}
_BINARY_ARGUMENTS = {"D": 4, "L": 2, "P": 4, "W": 3, "w": 35}
_SECOND_ARGUMENTS = {"Y": 2, "\x09": 19, "\x0a": 12, "\x0f": 1, "\x10": 1, "\x11": 1}  # of an e-puck2
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
    binary request that ends with a zero; after an end of line whatever comes next begins a text. Commands act
    on `body`; `selector` is the position of the robot's switch, 0 to 15; a `kind` "e-puck2" answers some
    commands otherwise than an "e-puck".

    Attributes
    ----------
    state, executing, called
        State of the replica's program, "R0" before it begins, see `enter`; the model that it executes; whether the
        PC wants it to begin.
    lights
        State of each of the lights 0 to 7, 8 (body) and 9 (front): 0 off, 1 on.
    """

    def __init__(
        self, body: Body, *, clock: Callable[[], float] = time.monotonic, selector: int = 0, kind: str = "e-puck"
    ) -> None:
        self._body, self._clock, self._selector, self._second = body, clock, selector, kind == "e-puck2"
        self._kind = choice("kind", kind, _VERSIONS)
        self._answer = bytearray()
        self._lock = threading.Lock()
        self._begin()

    def _forget(self) -> None:
        self.lights = [0] * 10
        self._speed: tuple[int, ...] = (0, 0)
        self._steps: tuple[int, ...] = (0, 0)
        self._image: tuple[int, ...] = (1, 40, 40, 8)  # mode (color), width, height, zoom
        self.executing: Model | None = None
        self._waiting: Model | None = None
        self.state, self._entered, self._trial, self.called = "R0", self._clock(), 0, False
        self._alive_at: float | None = None  # when a PC that keeps itself known was heard
        self._asked_at: float | None = None  # when the PC sent anything else

    def _begin(self) -> None:
        self._forget()
        self._listener = self._listen()
        next(self._listener)

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
            elif first:
                while first in b"\r\n":
                    first = yield
                line = bytearray([first])
                while (byte := (yield)) not in b"\r\n":
                    if len(line) < LONGEST_COMMAND:
                        line.append(byte)
                self._answer += self._obey(line.partition(b"\0")[0].decode("latin-1"))

    def _read_binary(self, command: int) -> Listener:
        """Read requests until a zero, then answer all of them at once; unknown ones are ignored."""
        answer, counts = bytearray(), _BINARY_ARGUMENTS | (_SECOND_ARGUMENTS if self._second else {})
        while command:
            letter, arguments = chr((256 - command) % 256), bytearray()
            for _ in range(counts.get(letter, 0)):
                arguments.append((yield))
            answer += self._obey_binary(letter, bytes(arguments))
            if self._second:
                answer += self._obey_second(letter, bytes(arguments))
            command = yield
        self._answer += answer

    def _obey_binary(self, letter: str, arguments: bytes) -> bytes:
        mode, width, height, _ = self._image
        match letter:
            case "D":
                self._drive(*struct.unpack("<hh", arguments))
            case "P":
                self._steps = struct.unpack("<hh", arguments)
            case "L":
                self._light(arguments[0], arguments[1])
            case "A":
                return struct.pack("<3f", 812.0, 37.0, 1.0)
            case "I":
                return bytes([mode, width, height]) + bytes(self._size)
            case "U":
                return b"" if self._second else bytes(601)
            case "t":
                return b"\0"
            case "b":
                return struct.pack("<h", self._charge if self._second else self._body.battery_ok())
            case "M":
                return struct.pack("<4h" if self._second else "<5h", *self._numbers("M")[: 4 if self._second else 5])
            case "a" | "E" | "g" | "N" | "O" | "Q" | "u":
                numbers = self._numbers(letter if letter == "g" else letter.upper())
                return struct.pack(f"<{len(numbers)}h", *numbers)
        return b""

    def _obey_second(self, letter: str, arguments: bytes) -> bytes:
        numbers = {"\x0c": (*_SENSED["U"], 10), "\x0d": (2000,)}  # microphones, distance
        match letter:
            case "\x08":  # all sensors
                moving, near, heard, rest = (
                    b"".join(self._obey_binary(one, b"") + self._obey_second(one, b"") for one in letters)
                    for letters in ("aAg", "tNO", "\x0d\x0c", "Qb")
                )
                floor = self._obey_binary("M", b"")[:6]
                return moving + bytes(12) + near + heard + rest + bytes([0, 0, 0, 0, self._selector]) + floor + bytes(7)
            case "\x09":  # all actuators: behaviors, wheels, lights, colors, sound
                wheels = struct.unpack_from("<hh", arguments, 1)
                if arguments[0] & 4:
                    self._steps = wheels
                else:
                    self._drive(*wheels)
                for k, light in enumerate((0, 2, 4, 6, 8, 9)):
                    self._light(light, arguments[5] >> k & 1)
            case "\x0c" | "\x0d":
                return struct.pack(f"<{len(numbers[letter])}h", *numbers[letter])
            case "Y" | "\x0b" | "\x0e" | "\x0f" | "\x10" | "\x11":
                return b"\0"
        return b""

    def _obey(self, line: str) -> bytes:
        """Return the answer to a line. Lower case means upper case, except where both exist."""
        letter = line[:1] if line[:1] in ("b", "g") else line[:1].upper()
        fields = line.split(",")[1:]
        match letter:
            case "A" | "E" | "g" | "M" | "N" | "O" | "Q" | "U":
                return _line(f"{letter.lower()},{','.join(map(str, self._numbers(letter)))}")
            case "b":
                return _line(f"b,{self._charge} (87%)" if self._second else f"b,{int(self._body.battery_ok())}")
            case "C":
                return _line(f"c,{self._selector}")
            case "D":
                self._drive(*self._scanned(fields, self._speed))
                return _line("d")
            case "H":
                return b"\n" + b"".join(_line(f'"{command}"') for command in _HELP.split())
            case "I":
                return _line(f"i,{','.join(map(str, (*self._image, self._size)))}")
            case "R":
                if self._second:
                    return b""
                self._halt()
                return _line("r") + GREETING
            case "S":
                self._body.set_speed(0, 0)  # what is answered to E stays
                self.lights[:8] = [0] * 8
                return _line("s")
            case "V":
                return _line(f"v,{_VERSIONS[self._kind]} emulated") + _line("HW version: 102")
            case "X":
                return self._converse(line)
            case "Y":
                return _line("y," + ",".join(map(str, self._scanned(fields, (0, 0))))) + _line("y,0")
            case "Z":
                return b""  # no device answers
        if letter not in _ANSWERS:
            return NOT_FOUND
        numbers = whole_numbers(fields[:2])
        if letter in "BF" and numbers:
            self._light(8 if letter == "B" else 9, numbers[0])
        elif letter == "L" and numbers is not None and len(numbers) == 2:
            self._light(numbers[0] if 0 <= numbers[0] < 8 else -1, numbers[1])
        elif letter == "P":
            self._steps = self._scanned(fields, self._steps)
        elif letter == "J":
            self._image = self._scanned(fields, self._image)
        return _line(_ANSWERS[letter])

    def _numbers(self, letter: str) -> Sequence[int]:
        own = {"E": lambda: self._speed, "N": self._body.proximity, "Q": lambda: self._steps}
        return own[letter]() if letter in own else _SENSED[letter]

    @property
    def _charge(self) -> int:
        """Raw reading of an e-puck2's battery."""
        return 1034 if self._body.battery_ok() else 860

    @property
    def _size(self) -> int:
        """Bytes of an image; a color takes two."""
        return self._image[1] * self._image[2] * (2 if self._image[0] else 1)

    def _scanned(self, fields: list[str], before: tuple[int, ...]) -> tuple[int, ...]:
        """Replace the numbers that can be parsed, up to the first that cannot, as the firmware does."""
        numbers = (whole_numbers([field]) for field in fields[: len(before)])
        found = tuple(number[0] for number in takewhile(lambda number: number is not None, numbers) if number)
        return found + before[len(found) :]

    def _drive(self, left: int, right: int) -> None:
        self._speed = (max(-1000, min(left, 1000)), max(-1000, min(right, 1000)))
        self._body.set_speed(*self._speed)

    def _light(self, light: int, action: int) -> None:
        for one in [light] if 0 <= light < 10 else range(8):
            self.lights[one] = 1 - self.lights[one] if action == 2 else int(action == 1)

    def _halt(self) -> None:
        self._drive(0, 0)
        self._forget()

    def _converse(self, line: str) -> bytes:
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
            elapsed, battery = round(1000 * (now - self._entered)), int(self._body.battery_ok())
            models = f"{_sequence(self._waiting)},{_sequence(self.executing)}"
            return _line(sealed(f"x,Q,{self.state},{elapsed},{models},{battery}"))
        numbers = whole_numbers(fields[1:])
        model = read_model(numbers) if fields[:1] == ["M"] and numbers is not None else None
        if model is None:
            return _line(sealed("x,E,message"))
        self._waiting = model
        return _line(sealed(f"x,M,{model.sequence}"))


def _line(text: str) -> bytes:
    return text.encode("ascii") + b"\r\n"


def _sequence(model: Model | None) -> int:
    return -1 if model is None else model.sequence
