"""How far a run is, in one line, on terminals and in notebooks."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from importlib import import_module
from typing import Any

from turing_learning.config import ConfigurationError
from turing_learning.errors import brief, require

from ._run import Observer, Progress

INTERVAL_S = 0.2  # between two pictures
WAITING = "getting ready; the first run of an installation compiles for some seconds"


@contextmanager
def watched(observer: Observer | None, should_stop: Any, progress: bool | None) -> Iterator[Observer | None]:
    """Return an observer that also shows a bar, on standard error or in the cell of a notebook.

    Without a word on `progress` there is one where somebody looks, who has not given an observer or `should_stop`.
    """
    fits = progress is None or isinstance(progress, bool)
    require(fits, "progress", "be True, False or None", brief(progress), error=ConfigurationError)
    shell = sys.modules["IPython"].get_ipython() if "IPython" in sys.modules else None
    notebook = getattr(shell, "kernel", None) is not None
    seen = notebook or (sys.stderr is not None and sys.stderr.isatty())
    if not (progress or (progress is None and seen and observer is None and should_stop is None)):
        yield observer
        return
    following = 0.0
    with nullcontext(_cell()) if notebook else _terminal() as show:

        def observe(state: Progress) -> None:
            nonlocal following
            if observer is not None:
                observer(state)
            if (now := time.monotonic()) >= following or state.completed == state.total:
                following = now + INTERVAL_S
                left = f"{state.seconds_left:.0f} s left" if state.completed < state.total else "done"
                show(state.completed, state.total, f"{state.place}, {left}")

        yield observe


@contextmanager
def _terminal() -> Iterator[Callable[[int, int, str], None]]:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    columns = (BarColumn(), TextColumn("{task.description}"))
    with Bar(*columns, console=Console(stderr=True), auto_refresh=False, transient=True) as bar:
        task = bar.add_task(WAITING, total=None)
        bar.refresh()

        def show(done: int, total: int, text: str) -> None:
            bar.live.transient = False  # a bar stays once there was something to show
            bar.update(task, completed=done, total=total, description=text, refresh=True)

        yield show


def _cell() -> Callable[[int, int, str], None]:
    """Show one line of a cell's output, which is replaced: without the widgets that bars of rich need."""
    handle: Any = import_module("IPython.display").display({"text/plain": WAITING}, raw=True, display_id=True)
    return lambda done, total, text: handle.update(
        {"text/plain": f"[{'#' * (30 * done // total):.<30}] {text}"}, raw=True
    )
