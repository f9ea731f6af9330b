"""Files that a caller names, to be written: what may be written there, and what to say where it cannot."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

from turing_learning.errors import ConfigurationError, Setting, Text, check
from turing_learning.store import os_errors_as


def refuse_target(
    path: Path,
    *,
    name: str,
    suffixes: tuple[str, ...],
    force: bool,
    replaceable: Callable[[Path], bool] = lambda path: False,
) -> None:
    """Reject a path, by the `name` of its argument, unless a file may be written there, or replaced."""
    rule = f"end with {suffixes[0]}"
    if len(suffixes) > 1:
        rule = f"end with one of {', '.join(suffixes)}"
    check(path.suffix.lower() in suffixes, name, rule, str(path))
    has_folder = path.absolute().parent.is_dir()
    got = f"{path} (there is no folder {path.parent})"
    remedy: Text = "Choose another place, or make the folder."
    check(has_folder, name, "be a file that can be written", got, remedy)
    with writing(path, name):
        check(not path.is_dir(), name, "be a file", f"{path}, a folder", "Choose another name.")
        may_write = force or not path.exists() or replaceable(path)
    remedy = ("Choose another name, or replace it with ", Setting("force", True), ".")
    check(may_write, name, "be a file that does not exist", str(path), remedy)


def writing(path: Path, name: str) -> AbstractContextManager[None]:
    """Turn what the operating system says about such a file into one message."""
    trouble = f"`{name}` must be a file that can be written; got {path}"
    return os_errors_as(ConfigurationError, trouble, "Choose another place.")
