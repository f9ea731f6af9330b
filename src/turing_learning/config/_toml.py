"""Read TOML with positions, and write a resolved configuration."""

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from turing_learning.errors import Refusal, brief

from ._configuration import Configuration
from ._sections import ConfigurationError

UNBOUNDED = "unbounded"  # TOML has no null; this stands for the missing side of an arena

_HEADER = re.compile(r"^\s*\[\[?([^\]]+)\]")
_ASSIGNMENT = re.compile(r"^\s*([A-Za-z0-9_\-.\"' ]+?)\s*=")


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Read a TOML file.

    Parameters
    ----------
    path
        The file.

    Returns
    -------
    tuple[str, dict]
        The text and what it says.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:  # ValueError: not UTF-8, or a path with a null character
        reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
        raise ConfigurationError(Refusal("config", "be a readable TOML file", f"{path} ({reason})")) from error
    try:
        return text, tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # ValueError: also an integer of thousands of digits
        found = re.search(r"^(.*) \(at line (\d+), column \d+\)$", str(error), re.DOTALL)
        reason = found[1] if found else str(error).replace(" (at end of document)", "")
        lines = text.splitlines()
        line = int(found[2]) if found else len(lines)
        content = brief(lines[line - 1].strip() if 0 < line <= len(lines) else "")
        remedy = f"The reader says: {reason}."
        raise ConfigurationError(Refusal("config", "be valid TOML", content, f"{path}:{line}", remedy)) from error


def line_of(text: str, key: str) -> int | None:
    """Return the line (from 1) that sets a dotted key, or opens its table; None if there is none.

    Parameters
    ----------
    text
        A TOML document.
    key
        For example "scenario.robot.wheel_noise".
    """
    lines = dict(_positions(text))
    while key:
        if key in lines:
            return lines[key]
        key = key.rpartition(".")[0]
    return None


def _positions(text: str) -> Iterator[tuple[str, int]]:
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = _plain(header[1])
            yield table, number
        elif assignment := _ASSIGNMENT.match(line):
            name = _plain(assignment[1])
            yield (f"{table}.{name}" if table else name), number


def _plain(name: str) -> str:
    return ".".join(part.strip().strip("\"'") for part in name.split("."))


def to_toml(configuration: Configuration) -> str:
    """Write a configuration with every field explicit; reading it back gives the same configuration.

    Parameters
    ----------
    configuration
        A resolved configuration.

    Returns
    -------
    str
        A TOML document.
    """
    data = configuration.model_dump(mode="python")
    return "\n".join(line for name, table in data.items() for line in toml_table(name, table)).rstrip() + "\n"


def toml_table(name: str, values: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a table."""
    yield f"[{name}]"
    yield from (f"{key} = {_value(value)}" for key, value in values.items() if not isinstance(value, Mapping))
    yield ""
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from toml_table(f"{name}.{key}", value)


def _value(value: Any) -> str:
    match value:
        case None:
            return f'"{UNBOUNDED}"'
        case bool():
            return "true" if value else "false"
        case float() | int():
            return repr(value)
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    return "[" + ", ".join(_value(item) for item in value) + "]"
