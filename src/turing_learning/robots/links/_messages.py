"""The messages of replicas and PC beyond the public e-puck protocol: lines with a checksum; see docs/robots/protocol.md."""

import math
from binascii import crc_hqx
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from turing_learning.errors import integer, require

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
    """Return a line with its checksum: CRC-16 (polynomial 0x1021, start 0xFFFF) of the text before the asterisk."""
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
