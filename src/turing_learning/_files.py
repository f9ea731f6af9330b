"""Write files that are there whole or not at all: a reader sees the old or the new content, never half of it; and where to."""

import contextlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PARTIAL = ".partial"
"""How temporary names end."""


def in_home(path: str | Path) -> Path:
    """Return a path whose leading ~ stands for a home folder, also where no shell has seen to it; one of nobody known is kept."""
    return Path(os.path.expanduser(path))  # noqa: PTH111 - the other one raises for nobody known


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


def _flush_folder(folder: Path) -> None:
    if os.name != "posix":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
