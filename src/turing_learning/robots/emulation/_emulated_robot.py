"""The program of a robot, emulated or real: the protocol's other side, and the loop of the states R1 to R5.

Source: paper, sections 5.1.2 and 5.2. How the robots disperse and avoid walls is only in the paper's
supplement; the rules here are ours (docs/robots/arena.md).
"""

import logging
import math
import re
import struct
import threading
import time
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from typing import Any, Protocol

import numpy as np

from turing_learning.errors import choice
from turing_learning.robots._link import (
    LARGEST_SEQUENCE,
    PARAMETER_UNIT,
    SIGNALS,
    Model,
    opened,
    sealed,
)

GREETING = b'\f\aWELCOME to the SerCom protocol on e-Puck\r\nthe EPFL education robot type "H" for help\r\n'
NOT_FOUND = b"z,Command not found\r\n"
LONGEST_COMMAND = 256
#: Numbers of the public protocol have 16 bits, as on an e-puck
LARGEST_NUMBER = 32767
#: Bytes; the buffer of an e-puck2 (`MAX_BUFF_SIZE` of its dcmi_camera.h)
LARGEST_IMAGE = 38_400
# mode (color), width, height, zoom; also where a larger one is asked for
_USUAL_IMAGE = (1, 40, 40, 8)
#: Bytes that wait to be sent; what goes beyond is lost, as on a line that is full
LARGEST_ANSWER = 65_536
# What `sscanf(",%d")` of the firmware reads
_NUMBER = re.compile(r",[ \t\n\v\f\r]*([+-]?[0-9]+)")
_LOGGER = logging.getLogger(__name__)
_VERSIONS = {"e-puck": "Version 1.2.2", "e-puck2": "Version 2.0"}
_HELP = "A B,# b C D,#,# E F,# G g H I J,#,#,#,# K L,#,# M N O P,#,# Q R S T,# U V W,#,#,# X Y,#,#"
_SENSED = {
    "A": (12, -9, 812),
    "g": (3, -2, 1),
    "M": (890, 874, 901, 512, 498),
    "O": (3400,) * 8,
    "U": (10, 12, 9),
}
"""Readings of sensors that the laboratory does not emulate: acceleration, rotation, floor, light, sound."""
_ANSWERS = {letter: letter.lower() for letter in "BFJLPTW"} | {
    "G": "g IR check : 0x0, address : 0x0, data : 0x0",
    "K": "k, Starting calibration\r\nk, Calibration finished",
}
_COMMANDS = frozenset("AEgMNOQUbCDHIRSVYZ") | _ANSWERS.keys()  # beside X
_BINARY_ARGUMENTS = {"D": 4, "L": 2, "P": 4, "W": 3, "w": 35}
# How many bytes follow a binary command of an e-puck2
_SECOND_ARGUMENTS = {"Y": 2, "\x09": 19, "\x0a": 12, "\x0f": 1, "\x10": 1, "\x11": 1}


#: States and how long they last (s)
LOOP = {"R1": 1.0, "R2": 8.0, "R3": 1.0, "R4": 1.0, "R5": 7.0}
_AFTER = dict(zip(LOOP, (*tuple(LOOP)[1:], "R1"), strict=True))
_SIGNALS = {"R1": "STOP", "R4": "START"}
#: Of the infrared sensors, from the heading
SENSOR_ANGLES = np.radians([-17.0, -47.0, -90.0, -151.0, 151.0, 90.0, 47.0, 17.0])
#: Least infrared reading at which a dispersing robot turns: walls at about 5 cm, black skirts at 1
#: cm
OBSTACLE = 120
#: Infrared reading that only a wall causes, nearer than 2 cm: a black skirt does not, even when it
#: touches
WALL = 400
_AHEAD, _ALONG = math.cos(math.radians(75)), math.cos(math.radians(100))
_ANYWHERE_S = (0.0, 1.25)  # up to once around in place, at full speed
_AWAY_S = (0.2, 0.8)
_TICK = 1e-9
ALONE_S = 2.0
"""A robot stands when its PC was not heard so long (s): one that commands its wheels, has started it, or has said
that it is there. Its loop goes on."""
#: A replica that its PC has asked nothing for so many loops halts, and waits for the remote
#: control
MOST_LOOPS = 5
#: Left and right wheel speed, fractions of the maximum
Wheels = tuple[float, float]
STILL: Wheels = (0.0, 0.0)
FULL_SPEED = 1000  #: Steps per second


def is_in_the_way(
    proximity: Sequence[int], threshold: int, least_cosine: float, forward: float = 1.0
) -> bool:
    """Return whether the strongest reading reaches a threshold, at a sensor whose direction, from where the
    robot goes, has a cosine above `least_cosine`; `forward` is negative for a robot that drives backward.
    """
    strongest = int(np.argmax(proximity))
    toward = math.copysign(1.0, forward) * math.cos(SENSOR_ANGLES[strongest])
    return proximity[strongest] >= threshold and toward > least_cosine


def avoid_walls(wheels: Wheels, proximity: Sequence[int]) -> Wheels:
    """Return the wheel speeds, or a turn in place to the same side while a wall is in front of the robot or beside it.

    One that drives straight turns anticlockwise. A robot that turns in place, as the agents do when they see
    another, goes on turning; one that meets a robot goes on, because its skirt is too dark.
    """
    left, right = wheels
    if left + right == 0 or not is_in_the_way(proximity, WALL, _ALONG, left + right):
        return wheels
    return (-1.0, 1.0) if right >= left else (1.0, -1.0)


class Body(Protocol):
    """What a robot's program reads of its hardware."""

    def proximity(self) -> Sequence[int]:
        """Return the eight infrared readings."""

    def battery_ok(self) -> bool:
        """Return whether the battery is above its limit."""


class EmulatedRobot:
    """Answer bytes as an e-puck, or e-puck2, with the public protocol does, take models as a replica, and go through the loop.

    It reads byte by byte, as the firmware does, so that noise has the same effect: a byte above 127 begins a
    binary request that ends with a zero; after an end of line whatever comes next begins a text. The PC wants
    the speeds `wheels` (steps per second), and the loop to begin where `called`. `lights` are 0 to 7, 8 (body)
    and 9 (front), 0 off, 1 on; `selector` is a switch, 0 to 15. `understood` counts commands that made sense.

    An agent has a `controller` (2 n,), wheel speeds for each sensor state; a replica has none. Both `tell` when
    they have to signal START and STOP. `rng` is that of dispersal.
    """

    def __init__(
        self, body: Body, *, clock: Callable[[], float] = time.monotonic, selector: int = 0, kind: str = "e-puck",
        controller: tuple[float, ...] | None = None, tell: Callable[[str], None] = lambda signal: None,
        rng: np.random.Generator | None = None,
    ) -> None:  # fmt: skip
        self._body = body
        self._clock = clock
        self._selector = selector
        self._second = kind == "e-puck2"
        self._kind = choice("kind", kind, _VERSIONS)
        self._controller = controller
        self._tell = tell
        self._rng = rng or np.random.default_rng()
        self._until = 0.0
        self._turn_until = 0.0
        self._side = 1.0
        # Before the next control cycle, for a random part of one
        self._pauses = False
        # In this trial, for want of the PC
        self._stood = False
        self._answer = bytearray()
        self.understood = 0
        self._lock = threading.RLock()
        self.restart()

    def restart(self) -> None:
        """Switch off and on: everything is forgotten."""
        with self._lock:
            self.halt()
            self._listener = self._listen()
            next(self._listener)

    def halt(self) -> None:
        """Stand, leave the loop, forget models and settings."""
        with self._lock:
            self.lights = [0] * 10
            self.wheels: tuple[int, ...] = (0, 0)
            self._speed: tuple[int, ...] = (0, 0)  # what is answered to E
            self._steps: tuple[int, ...] = (0, 0)
            self._image: tuple[int, ...] = _USUAL_IMAGE
            # Number and action; what a command leaves out stays
            self._light_set: tuple[int, ...] = (0, 0)
            self._heard_at = self._clock()
            self.executing: Model | None = None
            self._waiting: Model | None = None
            self.state = "R0"
            self._entered = self._clock()
            self._trial = 0
            self.called = False
            # When the PC was heard on which the loop depends
            self._alive_at = math.inf
            self._asked_at = math.inf  # when it asked anything

    def receive(self, data: bytes) -> bytes:
        """Return the answers to bytes; one that cannot be given, as a sensor fails, is left out."""
        with self._lock:
            for byte in data:
                self._listener.send(byte)
            answer = bytes(self._answer)
            self._answer.clear()
        return answer

    def enter(self, state: str) -> None:
        """Enter a state of the replica's program; R3 takes the model from the buffer."""
        with self._lock:
            self.state = state
            self._entered = self._clock()
            if state == "R3" and self._waiting is not None:
                self.executing = self._waiting
                self._waiting = None

    def start(self, time_s: float) -> None:
        """Begin the loop, anew if it runs: the remote control was pressed."""
        self._stood = False
        self._go_on("R1", time_s)

    def step(self, time_s: float, sight: int, proximity: Sequence[int]) -> Wheels:
        """Return the wheel speeds of a control cycle at a time by the robot's own clock: before the loop, what the PC commands.

        `sight` is the reading I of the line-of-sight sensor, `proximity` (8,) are infrared readings.
        """
        if self.called:
            self.called = False
            self.start(time_s)
        now = self._clock()
        if self.state not in LOOP:
            if now - self._heard_at > ALONE_S:
                self.wheels = (0, 0)
            left, right = self.wheels
            return left / FULL_SPEED, right / FULL_SPEED
        while time_s >= self._until - _TICK:
            self._go_on(_AFTER[self.state], self._until)
        if self._controller is None and now - self._asked_at > MOST_LOOPS * sum(LOOP.values()):
            self.halt()
        if now - self._alive_at > ALONE_S:
            self._stood |= self.state == "R5"
            return STILL
        # Dispersal: turn to a random direction, then drive straight, and turn a while where anything is in the way.
        if self.state == "R2":
            if time_s >= self._turn_until and is_in_the_way(proximity, OBSTACLE, _AHEAD):
                self._turn(time_s, _AWAY_S)
            if time_s < self._turn_until:
                return (-self._side, self._side)
            return (1.0, 1.0)
        table = self._controller or ()
        if not table and self.executing is not None:
            table = self.executing.parameters
        wheels = table[2 * sight : 2 * sight + 2]
        if self.state != "R5" or len(wheels) < 2:
            return STILL
        return avoid_walls((wheels[0], wheels[1]), proximity)

    def _go_on(self, state: str, time_s: float) -> None:
        self.enter(state)
        self._until = time_s + LOOP[state]
        if state == "R2":
            self._turn(time_s, _ANYWHERE_S)
        if state == "R4":
            self._pauses = True
        if state in _SIGNALS and not self._stood:
            self._tell(_SIGNALS[state])
        self._stood &= state == "R5"

    def take_pause(self, interval_s: float) -> float:
        """Return by how much (s) the next control cycle begins later: a random part of one before each trial.

        So the phase of a replica's cycles is another one in each trial, and the agents' on average: the PC could
        tell robots by their phases otherwise, which no model has.
        """
        if not self._pauses:
            return 0.0
        self._pauses = False
        return float(self._rng.uniform(0.0, interval_s))

    def _turn(self, time_s: float, lasting_s: tuple[float, float]) -> None:
        """Turn in place from now on, to either side."""
        self._turn_until = time_s + self._rng.uniform(*lasting_s)
        self._side = float(self._rng.choice((-1.0, 1.0)))

    def signal(self, kind: str) -> bytes:
        """Return the signal that a trial starts or has stopped; each start begins another trial."""
        choice("kind", kind, SIGNALS)
        with self._lock:
            if kind == "START":
                self._trial = (self._trial + 1) % (LARGEST_SEQUENCE + 1)
            return _line(sealed(f"x,{kind},{self._trial},{_sequence(self.executing)}"))

    def _listen(self) -> Generator[None, int, None]:
        """Read bytes for ever; answers are appended to `_answer`, those to binary requests when a zero ends the chain."""
        counts = _BINARY_ARGUMENTS | (_SECOND_ARGUMENTS if self._second else {})
        while True:
            byte_read = yield
            answer = bytearray()
            if 0 < byte_read < 128:
                while byte_read in b"\r\n":
                    byte_read = yield
                line = bytearray([byte_read])
                while (byte := (yield)) not in b"\r\n":
                    if len(line) < LONGEST_COMMAND:
                        line.append(byte)
                text = line.partition(b"\0")[0].decode("latin-1")
                answer += self._executed(self._obey, text)
            else:
                while byte_read:
                    letter = chr(256 - byte_read)
                    arguments = bytearray()
                    for _ in range(counts.get(letter, 0)):
                        arguments.append((yield))
                    reply = self._executed(self._obey_binary, letter, bytes(arguments))
                    if len(answer) + len(reply) <= LARGEST_ANSWER:
                        answer += reply
                    byte_read = yield
            if len(self._answer) + len(answer) <= LARGEST_ANSWER:
                self._answer += answer

    def _executed(self, obey: Callable[..., bytes], *command: Any) -> bytes:
        """Return the answer to a command, nothing if it fails: the next ones must be heard, as one may be a halt."""
        try:
            return obey(*command)
        except Exception as error:
            # Of the body, whatever it is
            _LOGGER.warning("A command was not executed: %s", error)
            return b""

    def _hear(self) -> None:
        self._heard_at = self._clock()
        self.understood += 1

    def _obey_binary(self, letter: str, arguments: bytes = b"") -> bytes:
        """Return the answer to a binary request; unknown ones are ignored. Those from \\x08 on are an e-puck2's alone."""
        match letter:
            case "D":
                self._hear()
                self._drive(*struct.unpack("<hh", arguments))
            case "P":
                self._steps = struct.unpack("<hh", arguments)
            case "L":
                self._light(arguments[0], arguments[1])
            case "A":
                return struct.pack("<3f", 812.0, 37.0, 1.0)
            case "I":
                return bytes(value & 255 for value in self._image[:3]) + bytes(self._size)
            case "U":
                return b"" if self._second else bytes(601)
            case "t":
                return b"\0"
            case "b":
                return struct.pack("<h", self._charge if self._second else self._body.battery_ok())
            case "M":
                return _packed(self._numbers("M")[: 4 if self._second else 5])
            case "a" | "E" | "g" | "N" | "O" | "Q" | "u":
                return _packed(self._numbers(letter if letter == "g" else letter.upper()))
        if not self._second:
            return b""
        match letter:
            case "\x08":  # all sensors
                moving = b"".join(map(self._obey_binary, "aAg"))
                standing = b"".join(map(self._obey_binary, "tNO\x0d\x0cQb"))
                floor = self._obey_binary("M")[:6]
                return (
                    moving
                    + bytes(12)
                    + standing
                    + bytes([0, 0, 0, 0, self._selector])
                    + floor
                    + bytes(7)
                )
            case "\x09":  # all actuators: behaviors, wheels, lights, colors, sound
                self._obey_binary("P" if arguments[0] & 4 else "D", arguments[1:5])
                for k, light in enumerate((0, 2, 4, 6, 8, 9)):
                    self._light(light, arguments[5] >> k & 1)
            case "\x0c":  # microphones
                return _packed((*_SENSED["U"], 10))
            case "\x0d":  # distance
                return _packed((2000,))
            case "Y" | "\x0b" | "\x0e" | "\x0f" | "\x10" | "\x11":
                return b"\0"
        return b""

    def _obey(self, line: str) -> bytes:
        """Return the answer to a line. Lower case means upper case, except where both exist."""
        letter = line[:1] if line[:1] in ("b", "g") else line[:1].upper()
        numbers = line[1:]
        # A known command shows that somebody is there
        if letter in _COMMANDS:
            self._hear()
        match letter:
            case "A" | "E" | "g" | "M" | "N" | "O" | "Q" | "U":
                return _line(f"{letter.lower()},{','.join(map(str, self._numbers(letter)))}")
            case "b":
                # Firmwares of e-puck and e-puck2 answer in other forms
                if self._second:
                    return _line(f"b,{self._charge} (87%)")
                return _line(f"b,{int(self._body.battery_ok())}")
            case "C":
                return _line(f"c,{self._selector}")
            case "D":
                self._drive(*_scanned(numbers, self._speed))
                return _line("d")
            case "H":
                return b"\n" + b"".join(_line(f'"{command}"') for command in _HELP.split())
            case "I":
                return _line(f"i,{','.join(map(str, (*self._image, self._size)))}")
            case "R":
                if self._second:
                    return b""
                self.halt()
                return _line("r") + GREETING
            case "S":
                self.wheels = (0, 0)
                self.lights[:8] = [0] * 8
                return _line("s")
            case "V":
                return _line(f"v,{_VERSIONS[self._kind]} emulated") + _line("HW version: 102")
            case "X":
                answer = self._converse(line)
                return _line(sealed(f"x,{answer}")) if answer else b""
            case "Y":
                return _line("y," + ",".join(map(str, _scanned(numbers, (0, 0))))) + _line("y,0")
            case "Z":
                return b""  # no device answers
        if letter not in _ANSWERS:
            return NOT_FOUND
        light, action = self._light_set
        match letter:
            case "B" | "F":
                (action,) = _scanned(numbers, (action,))
                self._light_set = light, action
                self._light(8 if letter == "B" else 9, action)
            case "L":
                light, action = self._light_set = _scanned(numbers, self._light_set)
                self._light(light if 0 <= light < 8 else -1, action)
            case "P":
                self._steps = _scanned(numbers, self._steps)
            case "J":
                self._image = _scanned(numbers, self._image)
                if not 0 <= self._size <= LARGEST_IMAGE:
                    self._image = (*_USUAL_IMAGE[:3], self._image[3])
        return _line(_ANSWERS[letter])

    def _numbers(self, letter: str) -> Sequence[int]:
        if letter == "E":
            return self._speed
        if letter == "N":
            return self._body.proximity()
        if letter == "Q":
            return self._steps
        return _SENSED[letter]

    @property
    def _charge(self) -> int:
        """Raw reading of an e-puck2's battery."""
        return 1034 if self._body.battery_ok() else 860

    @property
    def _size(self) -> int:
        """Bytes of an image; a color takes two."""
        colored, width, height, *_ = self._image
        return width * height * (2 if colored else 1)

    def _drive(self, left: int, right: int) -> None:
        self._speed = left, right
        self.wheels = (
            max(-FULL_SPEED, min(left, FULL_SPEED)),
            max(-FULL_SPEED, min(right, FULL_SPEED)),
        )

    def _light(self, light: int, action: int) -> None:
        for lamp in [light] if 0 <= light < 10 else range(8):
            self.lights[lamp] = 1 - self.lights[lamp] if action == 2 else int(action == 1)

    def _converse(self, line: str) -> str:
        """Return what a replica answers to a message, without head and checksum; nothing to a PC that is only there."""
        text = opened(line)
        now = self._clock()
        if text is None:
            return "E,checksum"
        self._hear()
        letter, *fields = text.split(",")[1:] or [""]
        if (letter, fields) == ("A", []):
            self._alive_at = now
            return ""
        self._asked_at = now
        # Infinite until a PC has called: a robot alone waits for nobody
        if self._alive_at < math.inf:
            self._alive_at = now
        match letter, _whole_numbers(fields):
            case "H", []:
                self.halt()
                return "H"
            case "G", []:
                self.called = True
                self._alive_at = now
                return "G"
            case "Q", []:
                elapsed = round(1000 * (now - self._entered))
                battery = int(self._body.battery_ok())
                return f"Q,{self.state},{elapsed},{_sequence(self._waiting)},{_sequence(self.executing)},{battery}"
            case "M", [sequence, *parameters]:
                with suppress(ValueError):
                    self._waiting = Model(
                        sequence,
                        tuple(round(parameter * PARAMETER_UNIT, 4) for parameter in parameters),
                    )
                    return f"M,{sequence}"
        return "E,message"


def _scanned(text: str, before: tuple[int, ...]) -> tuple[int, ...]:
    """Return numbers before each of which there is a comma; those after the first that cannot be read stay as before."""
    numbers: list[int] = []
    position = 0
    while len(numbers) < len(before) and (field := _NUMBER.match(text, position)):
        numbers.append(max(-LARGEST_NUMBER, min(int(field[1]), LARGEST_NUMBER)))
        position = field.end()
    return (*numbers, *before[len(numbers) :])


def _whole_numbers(fields: Sequence[str]) -> list[int] | None:
    """Return fields as integers, None if one is none."""
    digits = (field.strip().removeprefix("-") for field in fields)
    if all(digit_text.isascii() and digit_text.isdecimal() for digit_text in digits):
        return list(map(int, fields))
    return None


def _line(text: str) -> bytes:
    return text.encode("ascii") + b"\r\n"


def _packed(numbers: Sequence[int]) -> bytes:
    low_bits = [number & 0xFFFF for number in numbers]
    return struct.pack(f"<{len(low_bits)}H", *low_bits)


def _sequence(model: Model | None) -> int:
    return -1 if model is None else model.sequence
