"""What can go wrong with a run, apart from its configuration."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path


class RunFolderError(ValueError):
    """A folder is refused before anything runs; nothing has been changed."""


class RunStorageError(OSError):
    """A run could not be written any further, for example because the disk is full; it can be resumed."""


@contextmanager
def told(kind: type[Exception], what: str, remedy: str) -> Iterator[None]:
    """Turn what the operating system says inside the block into one message: what must be, why it is not, what to do.

    Parameters
    ----------
    kind
        Of the error that is raised. A `RunStorageError` has its message already, and passes; so does the message of a
        FileExistsError that is ours, not the operating system's.
    what
        For example "`out` must be a folder that can be written; got runs/mine".
    remedy
        A sentence.
    """
    try:
        yield
    except RunStorageError:
        raise
    except OSError as error:
        ours = isinstance(error, FileExistsError) and error.errno is None
        raise kind(str(error) if ours else f"{what} ({error.strerror or error}). {remedy}") from error


def writable(name: str, path: Path) -> AbstractContextManager[None]:
    """Refuse a folder, before anything runs, to which the block cannot write."""
    elsewhere = "Choose another folder, or make room." if name == "out" else "Use a copy elsewhere, or make room."
    return told(RunFolderError, f"`{name}` must be a folder that can be written; got {path}", elsewhere)


def storage(path: Path, ahead: str, name: str = "out") -> AbstractContextManager[None]:
    """Say of a folder that cannot be written any further what to do when there is room."""
    what = f"`{name}` must be a folder with space left; could not write to {path}"
    return told(RunStorageError, what, f"Make room, then {ahead}")


def refuse_future_format(version: int, newest: int, path: Path, noun: str) -> None:
    """Raise RunFolderError if a later version of the package has written the file at `path`."""
    if version > newest:
        raise RunFolderError(
            f"`format_version` must be at most {newest}; got {version} [{path}]. "
            f"Use the version of turing-learning that wrote this {noun}, or a later one."
        )
