"""Write files so that a reader sees the old or the new content, never half of it."""

import contextlib
import json
import os
from pathlib import Path
from typing import Any

PARTIAL = ".partial"


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file under a temporary name, flush it to the disk, and give it its name.

    Parameters
    ----------
    path
        Where; the folder must exist.
    content
        What.

    Raises
    ------
    OSError
        If the disk is full or the folder cannot be written; an earlier file of that name is left as it was.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}{PARTIAL}")
    try:
        with temporary.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except BaseException:
        with contextlib.suppress(OSError):  # a disk that cannot be written has nothing to remove either
            temporary.unlink(missing_ok=True)
        raise
    _flush_folder(path.parent)


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write an object as JSON, atomically; numbers must be finite."""
    write_atomically(path, (json.dumps(content, indent=2, allow_nan=False) + "\n").encode())


def remove_partial(folder: Path) -> None:
    """Remove what a killed process left under temporary names, anywhere below a folder that nobody else writes to."""
    for pattern in (f"*{PARTIAL}", ".*.part"):  # those of this module and of the history, those of figures and report
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
