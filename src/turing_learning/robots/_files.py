"""Whether a file may be written."""

from pathlib import Path


def refuse_taken(path: Path, *, name: str, force: bool) -> None:
    """Raise FileExistsError if a file is there, and may not be replaced, by the name of what says where."""
    if path.exists() and not force:
        raise FileExistsError(f"`{name}` must be a new file; got {path}. Choose another, or force=True.")
