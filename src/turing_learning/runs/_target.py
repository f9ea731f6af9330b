"""Where a page or film may be written that somebody asks for."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from turing_learning.config import ConfigurationError
from turing_learning.errors import Setting, require
from turing_learning.store import told


def refuse_target(
    path: Path,
    *,
    name: str,
    suffixes: tuple[str, ...],
    force: bool,
    replaceable: Callable[[Path], bool] = lambda path: False,
) -> None:
    """Raise ConfigurationError unless a file may be written to a path.

    Parameters
    ----------
    path
        Where.
    name
        Of the argument that says so.
    suffixes
        With which it may end.
    force
        Whether any file that exists may be replaced.
    replaceable
        Whether this one may be without it.
    """
    if path.suffix.lower() not in suffixes:
        rule = f"with one of {', '.join(suffixes)}" if len(suffixes) > 1 else f"with {suffixes[0]}"
        raise ConfigurationError(f"`{name}` must end {rule}; got {path}.")
    if not path.absolute().parent.is_dir():
        raise ConfigurationError(
            f"`{name}` must be a file that can be written; got {path} (there is no folder {path.parent}). "
            "Choose another place, or make the folder."
        )
    with writing(path, name):
        if path.is_dir():
            raise ConfigurationError(f"`{name}` must be a file; got {path}, a folder. Choose another name.")
        taken = path.exists() and not force and not replaceable(path)
    remedy = "Choose another name, or replace it with ", Setting("force", True), "."
    require(not taken, name, "be a file that does not exist", str(path), remedy, error=ConfigurationError)


@contextmanager
def writing(path: Path, name: str) -> Iterator[None]:
    """Turn what the operating system says about such a file into one message."""
    with told(ConfigurationError, f"`{name}` must be a file that can be written; got {path}", "Choose another place."):
        yield
