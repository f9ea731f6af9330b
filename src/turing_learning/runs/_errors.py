"""What can go wrong with a run, apart from its configuration."""

from pathlib import Path


class RunFolderError(ValueError):
    """A folder is refused before anything runs; nothing has been changed."""


class RunStorageError(OSError):
    """A run could not be written any further, for example because the disk is full; it can be resumed."""


def refuse_future_format(version: int, newest: int, path: Path, noun: str) -> None:
    """Raise RunFolderError if a later version of the package has written the file at `path`."""
    if version > newest:
        raise RunFolderError(
            f"`format_version` must be at most {newest}; got {version} [{path}]. "
            f"Use the version of turing-learning that wrote this {noun}, or a later one."
        )
