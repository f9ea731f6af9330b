"""Write files so that a reader sees the old or the new content, never half of it."""

import json
from pathlib import Path
from typing import Any

from turing_learning._files import PARTIAL, whole


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
    with whole(path) as temporary:
        temporary.write_bytes(content)


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write an object as JSON, atomically; numbers must be finite."""
    write_atomically(path, (json.dumps(content, indent=2, allow_nan=False) + "\n").encode())


def remove_partial(folder: Path) -> None:
    """Remove what a killed process left under temporary names, anywhere below a folder that nobody else writes to."""
    for pattern in (f"*{PARTIAL}", ".*.part"):  # those of today and of the history, those of older versions
        for path in list(folder.rglob(pattern)):
            path.unlink(missing_ok=True)
