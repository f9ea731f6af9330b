"""The command that tells several runs as one."""

from pathlib import Path
from typing import Annotated

import typer

from ._stored import opened


def register(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command(
        epilog="Examples:\n\n"
        "  turing-learning pool runs/fish-seed1 runs/fish-seed2 runs/fish-seed3 runs/fish-seed4\n\n"
        "  turing-learning pool runs/thirty/runs/*\n\n"
        "The runs differ in their seed alone, as those of a study of one configuration do."
    )(pool)


def pool(runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Run folders, two or more.")]) -> None:
    """Tell several runs of one configuration as one: do they agree, and what do they leave open together?"""
    from turing_learning.config import ConfigurationError
    from turing_learning.runs import pool as pool_runs
    from turing_learning.studies import is_study

    for run in runs:
        if is_study(run):
            raise ConfigurationError(f"`RUN` must be a run folder; got {run}, a study. Its runs are {run / 'runs'}/*.")
    typer.echo(pool_runs([opened(run) for run in runs]))
