"""Atomic files: a reader sees the old or the new content, never half of it. And what a path means."""

import contextlib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PARTIAL = ".partial"
"""How temporary names end."""


def in_home(path: str | Path) -> Path:
    """Return a path whose leading ~ stands for a home folder, also where no shell has expanded it; an unknown one stays."""
    return Path(os.path.expanduser(path))  # noqa: PTH111 - the other one raises for unknown users


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Give a temporary name to write to; at the end of the block the file is flushed to the disk and gets its name.

    Parameters
    ----------
    path
        Where; the folder must exist. An earlier file of that name is replaced, or left as it was if anything fails.

    Yields
    ------
    Path
        In the same folder, for this process alone; nothing is left there.

    Raises
    ------
    OSError
        If the disk is full or the folder cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}{PARTIAL}")
    try:
        yield temporary
        with temporary.open("rb+") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        with contextlib.suppress(OSError):  # a disk that cannot be written has nothing to remove either
            temporary.unlink(missing_ok=True)
    _flush_folder(path.parent)


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file, atomically; see `whole`."""
    with whole(path) as temporary:
        temporary.write_bytes(content)


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write an object as JSON, atomically; numbers must be finite."""
    write_atomically(path, json_bytes(content))


def json_bytes(content: Any) -> bytes:
    """Return JSON as it is stored; numbers must be finite."""
    return (json.dumps(content, indent=2, allow_nan=False) + "\n").encode()


def remove_partial(folder: Path) -> None:
    """Remove what a killed process left under temporary names, anywhere below a folder that nobody else writes to."""
    for pattern in (f"*{PARTIAL}", ".*.part"):  # those of today and of the history, those of older versions
        for path in list(folder.rglob(pattern)):
            path.unlink(missing_ok=True)


def _flush_folder(folder: Path) -> None:
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
