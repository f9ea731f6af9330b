"""The command that repeats the experiments of the paper."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ._exit import Interrupted
from ._options import WorkersOption

if TYPE_CHECKING:
    from collections.abc import Iterable

    from rich.console import Console

    from turing_learning.reproduction import Standing


def register(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command(
        epilog="Examples:\n\n"
        "  turing-learning reproduce\n\n"
        "  turing-learning reproduce 4.5 --fast\n\n"
        "  turing-learning reproduce all --workers 8\n\n"
        "Ctrl-C stops; the same command goes on."
    )(reproduce)


def reproduce(
    experiment: Annotated[
        str | None,
        typer.Argument(
            metavar="EXPERIMENT", help="Section of the paper, or all; without it, the experiments are listed."
        ),
    ] = None,
    fast: Annotated[
        bool, typer.Option("--fast", metavar="", help="A small form, in seconds, which shows that it works.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder of the experiments; experiments/ by default."),
    ] = None,
    workers: WorkersOption = None,
    page: Annotated[
        Path | None,
        typer.Option(
            "--page",
            metavar="FILE",
            help="Write the page of all claims (Markdown) as well, and that of each experiment.",
        ),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", metavar="", help="Let --page replace a file that is no such page.")
    ] = False,
) -> None:
    """Repeat the experiments of the paper, and hold them against what it prints."""
    from rich.console import Console

    from turing_learning.reproduction import default_folder, standings

    console = Console()
    _refuse_page(page, force=force)
    if experiment is None:
        _print_list(console, standings(out, fast=fast))
    else:
        _print_verdicts(console, _conduct(experiment, fast, out, workers))
    if page is not None:
        _write_page(out or default_folder(fast=fast), page, force=force)


def _conduct(experiment: str, fast: bool, out: Path | None, workers: int | None) -> "tuple[Standing, ...]":
    from turing_learning.reproduction import Stopped
    from turing_learning.reproduction import reproduce as conduct

    from ._signals import stop_on_signals

    ahead = "the same command goes on"
    try:
        with stop_on_signals() as should_stop:
            return conduct(experiment, fast=fast, out=out, workers=workers, should_stop=should_stop, say=typer.echo)
    except KeyboardInterrupt as error:
        raise Interrupted(f"interrupted; {ahead}") from error
    except Stopped as error:
        raise Interrupted(f"stopped at {error}; {ahead}") from error


def _refuse_page(page: Path | None, *, force: bool) -> None:
    from turing_learning.config import ConfigurationError
    from turing_learning.reproduction import refuse_page_path

    if page is not None:
        refuse_page_path(page, force=force, name="page")
    elif force:
        raise ConfigurationError(
            "`force` must be given with a page, which it may replace; got it alone. Add --page, or leave --force out."
        )


def _write_page(experiments: Path, path: Path, *, force: bool) -> None:
    from turing_learning.reproduction import write_page
    from turing_learning.runs import RunFolderError, told

    with told(RunFolderError, f"`page` must be a file that can be written; got {path}", "Choose another place."):
        typer.echo(write_page(experiments, path, force=force))


def _print_list(console: "Console", standings: "Iterable[Standing]") -> None:
    """Print a line for each experiment."""
    from rich.table import Table

    table = Table("experiment", "title", "cost", "state")
    for one in standings:
        table.add_row(one.experiment.id, one.experiment.title, one.experiment.cost, one.state)
    console.print(table)


def _print_verdicts(console: "Console", standings: "Iterable[Standing]") -> None:
    """Print agree or differ, claim by claim."""
    from rich.table import Table

    table = Table("claim", "", "verdict", "printed", "came out", show_lines=True)
    for one in standings:
        for verdict in one.results.verdicts if one.results is not None else ():
            style = "green" if verdict.agrees else "bold red"
            table.add_row(
                verdict.claim, verdict.variant, f"[{style}]{verdict.word}[/]", verdict.printed, verdict.outcome
            )
    if table.rows:
        console.print(table)
    for remark in (text for one in standings if one.results is not None for text in one.results.remarks):
        console.print(f"* {remark}", highlight=False)
    for one in standings:
        console.print(f"{one.experiment.id}: {one.state}", highlight=False)
