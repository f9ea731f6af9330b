"""What is seen while a run goes on: a live view on a terminal, a line now and then elsewhere."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Protocol

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

from turing_learning.report import short_number
from turing_learning.report._tabular import tables

if TYPE_CHECKING:
    from turing_learning.runs import Progress
    from turing_learning.studies import StudyProgress, StudyResult, StudyRun

INTERVAL_S = 0.2  # between two pictures
LINE_EVERY = 100  # generations between two lines, or a tenth as many batches of trials
AWAY = "away from the truth"

LAST = 5  # runs in the live view


class View(Protocol):
    """What is called for every generation."""

    def __call__(self, progress: "Progress") -> None:
        """Show a generation, or not."""
        ...


@contextmanager
def watching(console: Console) -> Iterator[View]:
    """Show the run inside the block.

    Parameters
    ----------
    console
        Where; a terminal gets a live view, anything else lines.
    """
    if not console.is_terminal:
        yield LineView(console)
        return
    waiting = Text("getting ready; the first run of an installation compiles for some seconds", style="dim")
    with Live(waiting, console=console, auto_refresh=False) as live:
        yield LiveView(live)


class _Stops:
    """Generations since the last picture in which selection stopped."""

    def __init__(self) -> None:
        self._seen = self._stopped = 0
        self._how = ""

    def add(self, selection: str) -> None:
        """Count a generation."""
        self._seen += 1
        if selection != "active":
            self._stopped += 1
            self._how = selection

    def take(self) -> str:
        """Return what to say of the generations since the last call, nothing if selection was active in all."""
        text = f"SELECTION STOPPED in {self._stopped} of the last {self._seen} generations ({self._how})"
        stopped, self._seen, self._stopped = self._stopped, 0, 0
        return text if stopped else ""


class LineView:
    """A line every 100 generations, or 10 batches of trials, and one for the last."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._stops = _Stops()

    def __call__(self, progress: "Progress") -> None:
        """Print a line if it is time."""
        self._stops.add(progress.generation.selection)
        every = LINE_EVERY // 10 if progress.trials else LINE_EVERY
        if progress.completed % every and progress.completed != progress.total:
            return
        text = "  ".join(part for part in (_line(progress), self._stops.take()) if part)
        self._console.print(text, soft_wrap=True)


class LiveView:
    """Tables that are drawn again a few times a second."""

    def __init__(self, live: Live) -> None:
        self._live = live
        self._next = 0.0
        self._stops = _Stops()

    def __call__(self, progress: "Progress") -> None:
        """Draw if it is time."""
        self._stops.add(progress.generation.selection)
        now = time.monotonic()
        if now < self._next and progress.completed != progress.total:
            return
        self._next = now + INTERVAL_S
        self._live.transient = progress.completed == progress.total  # the result's table follows
        self._live.update(picture(progress, self._live.console.width, self._stops.take()), refresh=True)


def _line(progress: "Progress") -> str:
    models = " ".join(
        f"{name} {short_number(value)}"
        for name, value in zip(progress.parameter_names, progress.shown(progress.generation.typical_model), strict=True)
    )
    generation = progress.generation
    fitness = (
        f"fitness: models {_median(generation.model_fitness)}, classifiers {_median(generation.classifier_fitness)}"
    )
    return "  ".join(part for part in (progress.place, _rate(progress), models, fitness, _outlook(progress)) if part)


def _outlook(progress: "Progress") -> str:
    """Say how the recent models miss the truth, where it is known."""
    outlook = progress.outlook
    return "" if outlook is None else f"models so far: {AWAY if outlook == 'other' else outlook}"


def picture(progress: "Progress", width: int, alarm: str = "") -> Group:
    """Return the live view of a generation, with an alarm in red below it."""
    parts: list[Table | Text] = [*_parameters(progress, width), _header(progress), *_fitness(progress, width)]
    if outlook := _outlook(progress):
        parts.append(Text(outlook, style="dim"))
    if alarm:
        parts.append(Text(f" {alarm} ", style="bold white on red"))
    return Group(*parts)


def _header(progress: "Progress") -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_row(
        Text(progress.place, style="bold"),
        ProgressBar(total=progress.total, completed=progress.completed, width=30),
        Text(_rate(progress)),
        Text(f"{clock(progress.seconds_left)} left"),
    )
    return grid


def _parameters(progress: "Progress", width: int) -> Iterator[Table]:
    """Say where the models are: the estimate first."""
    generation = progress.generation
    models = {
        "estimate so far": progress.shown(generation.typical_model),
        "best model": progress.shown(generation.best_model),
    }
    if progress.truth is not None:
        models["truth"] = np.asarray(progress.truth)
    rows = [[name, *map(short_number, model)] for name, model in models.items()]
    return tables(["", *progress.parameter_names], rows, width)


def _fitness(progress: "Progress", width: int) -> Iterator[Table]:
    both = {"models": progress.generation.model_fitness, "classifiers": progress.generation.classifier_fitness}
    rows = [[name, _median(values), f"{values.max():.3f}"] for name, values in both.items()]
    return tables(["fitness", "median", "best"], rows, width)


def _median(values: np.ndarray) -> str:
    return f"{np.median(values):.3f}"


def _rate(progress: "Progress") -> str:
    return "" if progress.trials else f"{1 / max(progress.seconds_per_generation, 1e-9):.1f} generations/s"


def clock(seconds: float) -> str:
    """Return a duration (s) as minutes and seconds, with hours if there are any."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


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
    waiting = Text("getting ready; the first study of an installation compiles for some seconds", style="dim")
    if not console.is_terminal:
        console.print(waiting)
        yield StudyLines(console)
        return
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
