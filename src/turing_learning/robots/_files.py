"""Write files that are there whole or not at all."""

import contextlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def refuse_taken(path: Path, *, name: str, force: bool) -> None:
    """Raise FileExistsError if a file is there, and may not be replaced, by the name of what says where."""
    if path.exists() and not force:
        raise FileExistsError(f"`{name}` must be a new file; got {path}. Choose another, or force=True.")


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """Give a temporary name to write to, which becomes `path` at the end of the block, and is removed if that fails."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        with contextlib.suppress(OSError):  # a disk that cannot be written has nothing to remove either
            temporary.unlink(missing_ok=True)
