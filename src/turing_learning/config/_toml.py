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
    """Return the text of a TOML file and what it says."""
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
    """Return the line (from 1) of a document that sets a dotted key, or opens its table; None if there is none."""
    lines, table = {}, ""
    for number, line in enumerate(text.splitlines(), start=1):
        header = _HEADER.match(line)
        if found := header or _ASSIGNMENT.match(line):
            name = ".".join(part.strip().strip("\"'") for part in found[1].split("."))
            table, name = (name, name) if header else (table, f"{table}.{name}" if table else name)
            lines[name] = number
    return next((lines[name] for name in ancestors(key) if name in lines), None)


def ancestors(key: str) -> Iterator[str]:
    """Yield a dotted key, the table that it is in, and so on."""
    while key:
        yield key
        key = key.rpartition(".")[0]


def to_toml(configuration: Configuration) -> str:
    """Return a resolved configuration as TOML, with every field explicit; reading it gives the same configuration."""
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
    """Return what JSON makes of a value, which TOML reads as well."""
    return f'"{UNBOUNDED}"' if value is None else json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
