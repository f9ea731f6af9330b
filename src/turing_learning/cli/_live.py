"""What is seen while a run goes on: a live view on a terminal, a line now and then elsewhere."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from rich.console import Console, Group
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

import turing_learning as tl
from turing_learning.report import short_number
from turing_learning.report.tabular import tables

from ._tables import named_numbers

PICTURE_INTERVAL_S = 0.2
"""Between two pictures (s)."""
LINE_EVERY = 100
"""Generations between two lines, or a tenth as many batches of trials."""


SHOWN_RUNS = 5
"""Runs of a study in the live view: the latest that have ended."""


@contextmanager
def _terminal(console: Console, unit: str) -> Iterator[tuple[Live | None, Text]]:
    """Lend what draws on a terminal, and what is said before the first step.

    Elsewhere it is None, and lines are printed.
    """
    text = f"getting ready; the first {unit} of an installation compiles for some seconds"
    waiting = Text(text, style="dim")
    if not console.is_terminal:
        yield None, waiting
        return
    with Live(waiting, console=console, auto_refresh=False) as live:
        yield live, waiting


@contextmanager
def watching(console: Console) -> Iterator["RunView"]:
    """Show the run inside the block."""
    with _terminal(console, "run") as (live, _):
        yield RunView(console, live)


class RunView:
    """Tables that are drawn again a few times a second; without a terminal a line now and then, and one for the last step."""

    def __init__(self, console: Console, live: Live | None) -> None:
        self._console = console
        self._live = live
        self._next_picture_s = 0.0
        # Since the last picture: generations, those without selection, and how they were without.
        self._generations = 0
        self._unselected = 0
        self._selection = ""

    def __call__(self, progress: "tl.runs.Progress") -> None:
        """Show a generation if it is time, with an alarm if there was no selection."""
        self._generations += 1
        selection = progress.selection
        if selection != "active":
            self._unselected += 1
            self._selection = selection
        if not self._is_due(progress):
            return
        alarm = ""
        if self._unselected:
            times = f"{self._unselected} of the last {self._generations} generations"
            alarm = f"SELECTION STOPPED in {times} ({self._selection})"
        self._generations = 0
        self._unselected = 0
        if self._live is None:
            self._print_line(progress, alarm)
        else:
            self._next_picture_s = time.monotonic() + PICTURE_INTERVAL_S
            # the result's table follows
            self._live.transient = _is_last(progress)
            picture = _run_picture(progress, alarm, self._live.console.width)
            self._live.update(picture, refresh=True)

    def _is_due(self, progress: "tl.runs.Progress") -> bool:
        if _is_last(progress):
            return True
        if self._live is not None:
            return time.monotonic() >= self._next_picture_s
        every = LINE_EVERY // 10 if progress.trials else LINE_EVERY
        return progress.completed % every == 0

    def _print_line(self, progress: "tl.runs.Progress", alarm: str) -> None:
        scored = progress.scored
        typical = progress.shown(progress.estimate)
        estimate = named_numbers(zip(progress.parameter_names, typical, strict=True))
        models = np.median(scored.model_fitness)
        classifiers = np.median(scored.classifier_fitness)
        fitness = f"fitness: models {models:.3f}, classifiers {classifiers:.3f}"
        texts = (progress.place, _rate(progress), estimate, fitness, _outlook(progress), alarm)
        self._console.print("  ".join(filter(None, texts)), soft_wrap=True)


def _is_last(progress: "tl.runs.Progress") -> bool:
    return progress.completed == progress.total


def _rate(progress: "tl.runs.Progress") -> str:
    if progress.trials:
        return ""
    return f"{1 / max(progress.seconds_per_generation, 1e-9):.1f} generations/s"


def _outlook(progress: "tl.runs.Progress") -> str:
    """Return what is said of the models so far, if anything."""
    if not progress.outlook:
        return ""
    outlook = progress.outlook
    if progress.outlook == "other":
        outlook = "away from the truth"
    return f"models so far: {outlook}"


def _run_picture(progress: "tl.runs.Progress", alarm: str, width: int) -> Group:
    """Return the live view of a run, for a terminal of so many columns."""
    scored = progress.scored
    models = {
        "estimate so far": progress.shown(progress.estimate),
        "best model": progress.shown(scored.best_model),
    }
    if progress.truth is not None:
        models["truth"] = np.asarray(progress.truth)
    rows = [[name, *map(short_number, model)] for name, model in models.items()]
    pieces: list[Table | Text] = list(tables(["", *progress.parameter_names], rows, width))
    bar = ProgressBar(total=progress.total, completed=progress.completed, width=30)
    title = Text(progress.place, style="bold")
    remaining = Text(f"{_clock(progress.seconds_left)} left")
    pieces.append(_row(title, bar, Text(_rate(progress)), remaining))
    rows = []
    for name, fitness in (
        ("models", scored.model_fitness),
        ("classifiers", scored.classifier_fitness),
    ):
        rows.append([name, f"{np.median(fitness):.3f}", f"{fitness.max():.3f}"])
    pieces += tables(["fitness", "median", "best"], rows, width)
    outlook = _outlook(progress)
    if outlook:
        pieces.append(Text(outlook, style="dim"))
    return _alarmed(pieces, alarm)


def _row(*cells: Text | ProgressBar) -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_row(*cells)
    return grid


def _alarmed(pieces: list[Table | Text], alarm: str) -> Group:
    if alarm:
        pieces = [*pieces, Text(f" {alarm} ", style="bold white on red")]
    return Group(*pieces)


def _clock(seconds: float) -> str:
    """Return a duration (s) as minutes and seconds, with hours if there are any."""
    minutes, seconds = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{hours}:{minutes:02d}:{seconds:02d}"
    return f"{minutes}:{seconds:02d}"


@contextmanager
def watching_study(
    console: Console, should_stop: Callable[[], bool]
) -> Iterator[Callable[["tl.studies.StudyProgress"], None]]:
    """Show a study inside the block: runs that have ended, on a terminal with a bar, and whether a stop has been asked for."""
    latest: list[tl.studies.StudyRun] = []

    with _terminal(console, "study") as (live, waiting):
        if live is None:
            console.print(waiting)

        def show(progress: "tl.studies.StudyProgress") -> None:
            done = progress.done + progress.failed
            if live is None:
                for run in progress.finished:
                    line = f"{done}/{progress.total}  {_ended(run)}  {_left(progress)}"
                    console.print(line, soft_wrap=True)
                return
            # the table follows
            live.transient = done == progress.total
            latest[:] = [*latest, *progress.finished][-SHOWN_RUNS:]
            live.update(study_picture(progress, latest, stopping=should_stop()), refresh=True)

        yield show


def study_picture(
    progress: "tl.studies.StudyProgress", latest: "list[tl.studies.StudyRun]", *, stopping: bool
) -> Group:
    """Return the live view of a study, with the runs that ended latest."""
    bar = ProgressBar(
        total=max(progress.generations_total, 1), completed=progress.generations, width=30
    )
    done = Text(f"{progress.done} of {progress.total} runs", style="bold")
    running = Text(f"{progress.running} running")
    failed = Text(f"{progress.failed} failed", style="bold red" if progress.failed else "dim")
    summary = "no run has ended yet"
    if progress.maes:
        maes = np.array(progress.maes)
        largest = short_number(maes.max())
        summary = f"MAE of the estimate: median {np.median(maes):.3f}, largest {largest}, "
        summary += f"{np.count_nonzero(maes < 0.05)} below 0.05"
    pieces: list[Table | Text] = [_row(done, bar, running, failed, Text(_left(progress)))]
    pieces.append(Text(summary, style="dim"))
    pieces += [Text(_ended(run)) for run in latest]
    alarm = ""
    if stopping:
        alarm = "stopping after the present generation of each run"
    return _alarmed(pieces, alarm)


def _ended(run: "tl.studies.StudyRun") -> str:
    if run.reason:
        return f"run {run.number}  seed {run.seed}  failed: {run.reason}"
    mae = ""
    if run.estimate_mae is not None:
        mae = f"MAE {short_number(run.estimate_mae)}  "
    return f"run {run.number}  seed {run.seed}  {mae}{run.verdict}"


def _left(progress: "tl.studies.StudyProgress") -> str:
    if progress.seconds_left is None:
        return ""
    return f"{_clock(progress.seconds_left)} left"
