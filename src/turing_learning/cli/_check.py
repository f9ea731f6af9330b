"""The command that says whether an estimate can be believed."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ._numbers import integer
from ._recording import (
    EveryOption,
    FormatOption,
    FpsOption,
    HoldOutOption,
    KeypointOption,
    ModelOption,
    Recording,
    ScaleOption,
    TrajectoriesOption,
    WindowOption,
    YAxisOption,
    refuse_other_simulator,
)
from ._stored import opened

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from turing_learning.identifiability import Check


def register(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command(
        epilog="Examples:\n\n"
        "  turing-learning check runs/mine\n\n"
        "  turing-learning check runs/fish --trajectories fish.txt --fps 25 --scale 12.3 --model couzin\n\n"
        "What was done is kept in RUN/check; the same command goes on after Ctrl-C. See docs/identifiability.md."
    )(check)


def check(
    context: typer.Context,
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder.")],
    samples: Annotated[
        int | None,
        typer.Option("--samples", metavar="N", help="Samples of each kind; 200 by default.", parser=integer),
    ] = None,
    points: Annotated[
        int | None,
        typer.Option(
            "--points",
            metavar="N",
            help="Values of each parameter in a profile, 6 or more; 8 by default, 0 for none.",
            parser=integer,
        ),
    ] = None,
    recoveries: Annotated[
        int,
        typer.Option("--recoveries", metavar="N", help="Runs whose truth is the estimate, 0 for none.", parser=integer),
    ] = 1,
    recovery_generations: Annotated[
        int | None,
        typer.Option(
            "--recovery-generations", metavar="G", help="Their length; that of the run by default.", parser=integer
        ),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", metavar="S", help="Seed of the check.", parser=integer)] = 0,
    force: Annotated[
        bool, typer.Option("--force", metavar="", help="Look anew, and replace the check that is there.")
    ] = False,
    trajectories: TrajectoriesOption = None,
    fps: FpsOption = None,
    scale: ScaleOption = None,
    model: ModelOption = None,
    window: WindowOption = None,
    y_axis: YAxisOption = None,
    format: FormatOption = None,
    keypoint: KeypointOption = None,
    every: EveryOption = None,
    hold_out_individuals: HoldOutOption = None,
) -> None:
    """Say whether the estimate of a run can be believed: can fresh classifiers tell it from the genuine motion?

    For recorded motion, give the options that the run began with.
    """
    from rich.console import Console

    from turing_learning.identifiability import Effort

    result = opened(run)
    refuse_other_simulator(run, "load_run({run}).check(genuine=..., simulate=...)")
    effort = Effort()
    given = {"samples": samples, "points": points}
    effort = replace(effort, **{name: value for name, value in given.items() if value is not None})
    recording = Recording.of(context)
    system = {}
    if recording.given:
        windows, family, motion = recording.opened(run)
        system = {"genuine": windows, "simulate": family, "recording": motion}
    console = Console(stderr=True)
    found = result.check(
        **system,
        effort=effort,
        recoveries=recoveries,
        recovery_generations=recovery_generations,
        seed=seed,
        force=force,
        stage=lambda text: console.print(text, highlight=False),
    )
    _print(Console(), found, run)


def _print(console: "Console", found: "Check", run: Path) -> None:
    from turing_learning.runs import RunFolder

    console.print(check_table(found))
    console.print(found.verdict, highlight=False, soft_wrap=True)
    report = RunFolder(run).report_path
    if report.exists():
        console.print(f"report: {report}", markup=False, highlight=False, soft_wrap=True)


def check_table(found: "Check") -> "Table":
    """Return the table parameter / interval / left open / missed by / verdict, in shares of the initial range."""
    from rich.table import Table
    from rich.text import Text

    from turing_learning.report import shown

    table = Table(caption="shares of the initial range", caption_justify="left")
    table.add_column("parameter")
    for heading in ("interval", "left open", "missed by"):
        table.add_column(heading, justify="right")
    table.add_column("")
    for each in found.parameters:
        table.add_row(
            each.parameter,
            shown(each.interval_share, "{:.1%}".format),
            shown(each.open_share, "at most {:.0%}".format),
            shown(each.recovery_error, "{:.1%}".format),
            "pinned down" if each.pinned_down else Text("not pinned down", style="bold red"),
        )
    return table
