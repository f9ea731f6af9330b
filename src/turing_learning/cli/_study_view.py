"""What is seen of a study: one display for all runs, and the table at the end."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from turing_learning.report import short_number

from ._live import clock

if TYPE_CHECKING:
    from turing_learning.studies import StudyProgress, StudyResult, StudyRun

LAST = 5  # runs in the live view


@contextmanager
def watching_study(console: Console, should_stop: Callable[[], bool]) -> Iterator[Callable[["StudyProgress"], None]]:
    """Show a study inside the block.

    Parameters
    ----------
    console
        Where; a terminal gets a live view, anything else a line for each run that ends.
    should_stop
        Whether a stop has been asked for, to say so.
    """
    if not console.is_terminal:
        yield StudyLines(console)
        return
    waiting = Text("getting ready; the first study of an installation compiles for some seconds", style="dim")
    with Live(waiting, console=console, auto_refresh=False) as live:
        yield StudyView(live, should_stop)


class StudyLines:
    """A line for each run that ends."""

    def __init__(self, console: Console) -> None:
        self._console = console

    def __call__(self, progress: "StudyProgress") -> None:
        """Print what has ended."""
        for run in progress.finished:
            text = f"{progress.done + progress.failed}/{progress.total}  {_ended(run)}  {_left(progress)}"
            self._console.print(text, soft_wrap=True)


class StudyView:
    """A bar, the numbers of runs, and the runs that ended last."""

    def __init__(self, live: Live, should_stop: Callable[[], bool]) -> None:
        self._live = live
        self._should_stop = should_stop
        self._last: list[StudyRun] = []

    def __call__(self, progress: "StudyProgress") -> None:
        """Draw."""
        self._live.transient = progress.done + progress.failed == progress.total  # the table follows
        self._last = [*self._last, *progress.finished][-LAST:]
        self._live.update(study_picture(progress, self._last, stopping=self._should_stop()), refresh=True)


def study_picture(progress: "StudyProgress", last: "list[StudyRun]", *, stopping: bool) -> Group:
    """Return the live view of a study."""
    grid = Table.grid(padding=(0, 2))
    grid.add_row(
        Text(f"{progress.done} of {progress.total} runs", style="bold"),
        ProgressBar(total=max(progress.generations_total, 1), completed=progress.generations, width=30),
        Text(f"{progress.running} running"),
        Text(f"{progress.failed} failed", style="bold red" if progress.failed else "dim"),
        Text(_left(progress)),
    )
    parts: list[Table | Text] = [grid, Text(_maes(progress), style="dim"), *(Text(_ended(run)) for run in last)]
    if stopping:
        parts.append(Text(" stopping after the present generation of each run ", style="bold white on red"))
    return Group(*parts)


def _maes(progress: "StudyProgress") -> str:
    if not progress.maes:
        return "no run has ended yet"
    maes = np.array(progress.maes)
    good = np.count_nonzero(maes < 0.05)
    return f"MAE of the estimate: median {np.median(maes):.3f}, largest {short_number(maes.max())}, {good} below 0.05"


def _ended(run: "StudyRun") -> str:
    if run.reason:
        return f"run {run.number}  seed {run.seed}  failed: {run.reason}"
    mae = "" if run.estimate_mae is None else f"MAE {short_number(run.estimate_mae)}  "
    return f"run {run.number}  seed {run.seed}  {mae}{run.verdict}"


def _left(progress: "StudyProgress") -> str:
    return "" if progress.seconds_left is None else f"{clock(progress.seconds_left)} left"


def print_study(console: Console, result: "StudyResult") -> None:
    """Print the table of a study, how good the runs are, which failed, and where the files are."""
    console.print(result)
    for name, path in (("report", result.path / "report.html"), ("tables", result.path / "summary.csv")):
        if path.exists():
            console.print(f"{name}: {path}", soft_wrap=True)
    console.print(f"study:  {result.path}", soft_wrap=True)
