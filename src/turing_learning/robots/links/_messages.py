"""What replicas and the PC say to each other beside the public e-puck protocol: lines with a checksum.

docs/robots/protocol.md describes them for authors of firmware.
"""

import math
from binascii import crc_hqx
from collections.abc import Sequence
from dataclasses import dataclass

PARAMETER_UNIT = 1e-4
"""A model parameter travels as a whole number of these."""
SIGNALS = ("START", "STOP")
LARGEST_SEQUENCE = 65535


@dataclass(frozen=True)
class Model:
    """A model on its way to a replica.

    Attributes
    ----------
    sequence
        Its number, 0 to 65535, by which the replica tells which model it executes.
    parameters
        Wheel speeds as fractions of the maximum, each in [-1, 1], rounded to 0.0001.
    """

    sequence: int
    parameters: tuple[float, ...]

    def __post_init__(self) -> None:
        if not 0 <= self.sequence <= LARGEST_SEQUENCE:
            raise ValueError(f"`sequence` must be in 0 to {LARGEST_SEQUENCE}; got {self.sequence}.")
        if not 1 <= len(self.parameters) <= 16:
            raise ValueError(f"`parameters` must be 1 to 16; got {len(self.parameters)}.")
        if not all(math.isfinite(value) and abs(value) <= 1 for value in self.parameters):
            raise ValueError(f"`parameters` must be in [-1, 1]; got {list(self.parameters)}. Apply tanh before.")


@dataclass(frozen=True)
class Signal:
    """A replica's word that a trial starts or has stopped.

    Attributes
    ----------
    kind
        "START" or "STOP".
    trial
        The replica's count of trials.
    sequence
        The model that it executes, -1 for none.
    received_s
        When it arrived, by the link's clock.
    """

    kind: str
    trial: int
    sequence: int
    received_s: float


@dataclass(frozen=True)
class Status:
    """Where a replica is in its loop.

    Attributes
    ----------
    state
        R1 to R5 of the paper; R0 before the loop has begun.
    in_state_s
        For how long.
    waiting, executing
        Sequence of the model in the buffer and of the one in force, -1 for none.
    battery_ok
        Whether the battery is.
    """

    state: str
    in_state_s: float
    waiting: int
    executing: int
    battery_ok: bool


def sealed(text: str) -> str:
    """Return a line with its checksum: CRC-16 (polynomial 0x1021, start 0xFFFF) of all before the asterisk."""
    return f"{text}*{crc_hqx(text.encode('ascii'), 0xFFFF):04X}"


def opened(line: str) -> str | None:
    """Return a line without its checksum, None if that is wrong or missing."""
    text, star, seal = line.rpartition("*")
    return text if star and text.isascii() and line == sealed(text) and len(seal) == 4 else None


def whole_numbers(fields: Sequence[str]) -> list[int] | None:
    """Return fields as whole numbers, None if one is not."""
    digits = (field.strip().removeprefix("-") for field in fields)
    return [int(field) for field in fields] if all(part.isascii() and part.isdecimal() for part in digits) else None


def write_model(model: Model) -> str:
    """Return the line that carries a model."""
    numbers = (round(value / PARAMETER_UNIT) for value in model.parameters)
    return sealed(",".join(["X", "M", str(model.sequence), *map(str, numbers)]))


def read_model(numbers: Sequence[int]) -> Model | None:
    """Return the model of a message's whole numbers, None if they make none."""
    try:
        return Model(numbers[0], tuple(round(number * PARAMETER_UNIT, 4) for number in numbers[1:]))
    except (IndexError, ValueError):
        return None
