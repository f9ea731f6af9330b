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

INTERVAL_S = 0.2  # between two pictures
LINE_EVERY = 100  # generations between two lines, or a tenth as many batches of trials
LAST = 5  # runs in the live view


@contextmanager
def _terminal(console: Console, what: str) -> Iterator[tuple[Live | None, Text]]:
    """Lend what draws on a terminal, None elsewhere, where lines are printed; and what is said before the first step."""
    waiting = Text(
        f"getting ready; the first {what} of an installation compiles for some seconds", style="dim"
    )
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
        self._console, self._live, self._next = console, live, 0.0
        self._seen, self._stopped, self._how = (
            0,
            0,
            "",
        )  # generations since the last picture, and without selection

    def __call__(self, progress: "tl.runs.Progress") -> None:
        """Show a generation if it is time, with an alarm if there was no selection."""
        self._seen += 1
        if (selection := progress.generation.selection) != "active":
            self._stopped, self._how = self._stopped + 1, selection
        last, every = (
            progress.completed == progress.total,
            LINE_EVERY // 10 if progress.trials else LINE_EVERY,
        )
        early = progress.completed % every if self._live is None else time.monotonic() < self._next
        if early and not last:
            return
        alarm = f"SELECTION STOPPED in {self._stopped} of the last {self._seen} generations ({self._how})"
        alarm, self._seen, self._stopped = alarm if self._stopped else "", 0, 0
        rate = (
            ""
            if progress.trials
            else f"{1 / max(progress.seconds_per_generation, 1e-9):.1f} generations/s"
        )
        outlook = "away from the truth" if progress.outlook == "other" else progress.outlook
        outlook = f"models so far: {outlook}" if outlook else ""
        generation, names = progress.generation, progress.parameter_names
        models = {"estimate so far": progress.shown(generation.typical_model)}
        both = {"models": generation.model_fitness, "classifiers": generation.classifier_fitness}
        if self._live is None:
            typical = named_numbers(zip(names, *models.values(), strict=True))
            fitness = ", ".join(f"{name} {np.median(values):.3f}" for name, values in both.items())
            said = (progress.place, rate, typical, f"fitness: {fitness}", outlook, alarm)
            self._console.print("  ".join(filter(None, said)), soft_wrap=True)
            return
        self._next, width = time.monotonic() + INTERVAL_S, self._live.console.width
        models["best model"] = progress.shown(generation.best_model)
        if progress.truth is not None:
            models["truth"] = np.asarray(progress.truth)
        rows = [[name, *map(short_number, model)] for name, model in models.items()]
        bar = ProgressBar(total=progress.total, completed=progress.completed, width=30)
        left = Text(f"{_clock(progress.seconds_left)} left")
        parts: list[Table | Text] = [*tables(["", *names], rows, width)]
        parts.append(_row(Text(progress.place, style="bold"), bar, Text(rate), left))
        rows = [
            [name, f"{np.median(values):.3f}", f"{values.max():.3f}"]
            for name, values in both.items()
        ]
        parts += tables(["fitness", "median", "best"], rows, width)
        if outlook:
            parts.append(Text(outlook, style="dim"))
        self._live.transient = last  # the result's table follows
        self._live.update(_alarmed(parts, alarm), refresh=True)


def _row(*cells: Text | ProgressBar) -> Table:
    grid = Table.grid(padding=(0, 2))
    grid.add_row(*cells)
    return grid


def _alarmed(parts: list[Table | Text], alarm: str) -> Group:
    return Group(*parts, *([Text(f" {alarm} ", style="bold white on red")] if alarm else []))


def _clock(seconds: float) -> str:
    """Return a duration (s) as minutes and seconds, with hours if there are any."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


@contextmanager
def watching_study(
    console: Console, should_stop: Callable[[], bool]
) -> Iterator[Callable[["tl.studies.StudyProgress"], None]]:
    """Show a study inside the block: runs that have ended, on a terminal with a bar, and whether a stop has been asked for."""
    last: list[tl.studies.StudyRun] = []

    with _terminal(console, "study") as (live, waiting):
        if live is None:
            console.print(waiting)

        def show(progress: "tl.studies.StudyProgress") -> None:
            done = progress.done + progress.failed
            if live is None:
                for run in progress.finished:
                    console.print(
                        f"{done}/{progress.total}  {_ended(run)}  {_left(progress)}", soft_wrap=True
                    )
                return
            live.transient = done == progress.total  # the table follows
            last[:] = [*last, *progress.finished][-LAST:]
            live.update(study_picture(progress, last, stopping=should_stop()), refresh=True)

        yield show


def study_picture(
    progress: "tl.studies.StudyProgress", last: "list[tl.studies.StudyRun]", *, stopping: bool
) -> Group:
    """Return the live view of a study."""
    bar = ProgressBar(
        total=max(progress.generations_total, 1), completed=progress.generations, width=30
    )
    done, running = (
        Text(f"{progress.done} of {progress.total} runs", style="bold"),
        Text(f"{progress.running} running"),
    )
    failed = Text(f"{progress.failed} failed", style="bold red" if progress.failed else "dim")
    said, maes = "no run has ended yet", np.array(progress.maes)
    if progress.maes:
        median, largest = f"{np.median(maes):.3f}", short_number(maes.max())
        said = f"MAE of the estimate: median {median}, largest {largest}, {np.count_nonzero(maes < 0.05)} below 0.05"
    grid = _row(done, bar, running, failed, Text(_left(progress)))
    parts: list[Table | Text] = [
        grid,
        Text(said, style="dim"),
        *(Text(_ended(run)) for run in last),
    ]
    return _alarmed(parts, "stopping after the present generation of each run" if stopping else "")


def _ended(run: "tl.studies.StudyRun") -> str:
    if run.reason:
        return f"run {run.number}  seed {run.seed}  failed: {run.reason}"
    mae = "" if run.estimate_mae is None else f"MAE {short_number(run.estimate_mae)}  "
    return f"run {run.number}  seed {run.seed}  {mae}{run.verdict}"


def _left(progress: "tl.studies.StudyProgress") -> str:
    return "" if progress.seconds_left is None else f"{_clock(progress.seconds_left)} left"
