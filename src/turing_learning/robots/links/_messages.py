"""The messages of replicas and PC beyond the public e-puck protocol: lines with a checksum; see docs/robots/protocol.md."""

import math
from binascii import crc_hqx
from collections.abc import Sequence
from dataclasses import dataclass

from turing_learning.errors import integer, require

PARAMETER_UNIT = 1e-4  #: Models are sent as integer multiples of this
SIGNALS = ("START", "STOP")
LARGEST_SEQUENCE = 65535
ALIVE, HALT, HALTED = "X,A*209D", "X,H*B1B4", "x,H*3772"
"""The PC says that it is there, which has no answer; it halts a replica; the replica has halted."""


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
