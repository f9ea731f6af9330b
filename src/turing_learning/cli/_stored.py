"""Runs that commands open."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from turing_learning.runs import Result


def opened(run: Path) -> "Result":
    """Open a run; what is said of it names its folder as it was given, which here is the same to the end."""
    from turing_learning.runs import RunFolder, load_run

    return replace(load_run(run), path=RunFolder(run).path)
