"""The command that searches the controller with which a swarm gathers best."""

import math
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ._exit import Interrupted
from ._numbers import integer, real
from ._options import ThreadsOption

if TYPE_CHECKING:
    from rich.console import Console

    from turing_learning.search import SearchProgress, SearchResult
    from turing_learning.swarm import Scenario

LINES_S = 5.0  # between two lines of progress
SHOWN = 5  # controllers that are printed


def register(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command(
        name="search-controller",
        epilog="Examples:\n\n"
        "  turing-learning search-controller --field-of-view 60\n\n"
        "  turing-learning search-controller --field-of-view 120 --steps 6 --trials 2 --out runs/search-120\n\n"
        "Ctrl-C stops; the same command goes on.",
    )(search_controller)


def search_controller(
    scenario: Annotated[
        str, typer.Option("--scenario", metavar="NAME", help="Robots, objects and sensor, see `scenarios`.")
    ] = "aggregation",
    field_of_view: Annotated[
        float | None,
        typer.Option(
            "--field-of-view",
            metavar="DEG",
            help="Of the sensor, in degrees; by default scenario.sensor.field_of_view, which is in rad.",
            parser=real,
        ),
    ] = None,
    steps: Annotated[
        int, typer.Option("--steps", metavar="N", help="Settings of each wheel speed, from -1 to 1.", parser=integer)
    ] = 21,
    trials: Annotated[
        int, typer.Option("--trials", metavar="R", help="Of each controller in the first round.", parser=integer)
    ] = 1,
    finalists: Annotated[
        int, typer.Option("--finalists", metavar="F", help="Controllers of the last round.", parser=integer)
    ] = 50,
    final_trials: Annotated[
        int, typer.Option("--final-trials", metavar="R", help="Of each finalist.", parser=integer)
    ] = 100,
    duration: Annotated[
        float, typer.Option("--duration", metavar="SECONDS", help="Duration of a trial.", parser=real)
    ] = 180.0,
    seed: Annotated[
        int, typer.Option("--seed", metavar="S", help="Seed of initial poses and noise.", parser=integer)
    ] = 1,
    threads: ThreadsOption = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder of the search; one under runs/ named after it by default."),
    ] = None,
) -> None:
    """Search the reactive controller with which robots, or their objects, gather best, on a grid over all wheel speeds."""
    from rich.console import Console

    from turing_learning.config import ConfigurationError
    from turing_learning.runs import scenario_named
    from turing_learning.search import SearchSettings
    from turing_learning.search import search_controller as search

    from ._signals import stop_on_signals

    chosen = _with_view(scenario_named(scenario), field_of_view)
    settings = SearchSettings(steps, trials, finalists, final_trials, duration, seed)
    if threads is not None and threads < 1:
        raise ConfigurationError(f"`threads` must be an integer of at least 1; got {threads} [--threads].")
    path = out or Path("runs") / _name(chosen, settings.steps, seed)
    console = Console()
    ahead = f"the same command goes on, in {path}"
    try:
        with stop_on_signals() as should_stop:
            result = search(
                chosen, settings, out=path, threads=threads, should_stop=should_stop, observer=_Lines(console)
            )
    except KeyboardInterrupt as error:
        raise Interrupted(f"interrupted; {ahead}") from error
    if result is None:
        raise Interrupted(f"stopped; {ahead}")
    _print(console, result)


def _with_view(scenario: "Scenario", degrees: float | None) -> "Scenario":
    """Return a scenario with another field of view."""
    from dataclasses import replace

    from turing_learning.config import ConfigurationError

    if degrees is None:
        return scenario
    if not 0 <= degrees <= 360:
        raise ConfigurationError(f"`field_of_view` must be from 0 to 360 degrees; got {degrees:g} [--field-of-view].")
    return replace(scenario, sensor=replace(scenario.sensor, field_of_view=math.radians(degrees)))


def _name(scenario: "Scenario", steps: int, seed: int) -> str:
    view = math.degrees(scenario.sensor.field_of_view)
    return f"search-{scenario.name}-view{view:g}-steps{steps}-seed{seed}"


class _Lines:
    """A line every few seconds, and one at the end of every round."""

    def __init__(self, console: "Console") -> None:
        self._console = console
        self._next = 0.0

    def __call__(self, progress: "SearchProgress") -> None:
        """Print a line if it is time."""
        from ._live import clock

        if progress.done < progress.total and time.monotonic() < self._next:
            return
        self._next = time.monotonic() + LINES_S
        self._console.print(
            f"round {progress.round} of {progress.rounds}: {progress.done} of {progress.total} controllers, "
            f"{clock(progress.seconds_left)} left",
            highlight=False,
            soft_wrap=True,
        )


def _print(console: "Console", result: "SearchResult") -> None:
    """Print the best controllers, and where all finalists are."""
    from rich.table import Table

    from turing_learning.models import ReactiveModel

    trials = result.costs.shape[1]
    table = Table(
        title=f"{result.scenario.name}, field of view {math.degrees(result.scenario.sensor.field_of_view):g} degrees",
        caption=f"cost: dispersion, mean over {trials} trials weighted by time; +-: its standard error",
        title_justify="left",
    )
    names = ReactiveModel(result.scenario.sensor.states).parameter_names
    for column in ("rank", *names, "cost", "+-", "at the end"):
        table.add_column(column, justify="right")
    means, errors, ends = result.costs.mean(axis=1), result.standard_errors, result.ends.mean(axis=1)
    for k in range(min(SHOWN, len(means))):
        speeds = (f"{speed:g}" for speed in result.controllers[k])
        table.add_row(str(k + 1), *speeds, f"{means[k]:.1f}", f"{errors[k]:.1f}", f"{ends[k]:.1f}")
    console.print(table)
    console.print(f"best: {','.join(f'{speed:g}' for speed in result.best)}", highlight=False, soft_wrap=True)
    console.print(f"table: {result.path / 'controllers.csv'}", markup=False, highlight=False, soft_wrap=True)
