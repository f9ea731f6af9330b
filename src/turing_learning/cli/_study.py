"""The commands of studies."""

import shlex
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ._exit import Interrupted
from ._numbers import integer
from ._options import GenerationsOption, PresetOption, SettingsOption, WorkersOption, require_scenario, settings_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from turing_learning.studies import Plan, StudyResult

ClusterOption = Annotated[
    str | None,
    typer.Option("--cluster", metavar="ADDRESS", help="A Dask scheduler, for example tcp://10.0.0.1:8786."),
]
StudyArgument = Annotated[Path, typer.Argument(metavar="STUDY", help="A study folder.")]


def register(app: typer.Typer) -> None:
    """Add the commands of studies to the command line."""
    app.command(
        epilog="Examples:\n\n"
        "  turing-learning study aggregation --runs 30\n\n"
        "  turing-learning study random-behaviors --runs 1000 --workers 8\n\n"
        "  turing-learning study aggregation --config grid.toml --cluster tcp://10.0.0.1:8786 --out /shared/grid\n\n"
        "  turing-learning study aggregation --out /shared/thirty --write-slurm thirty.sh\n\n"
        "Ctrl-C stops all runs after their present generation; `turing-learning resume STUDY` goes on."
    )(study)
    app.command(hidden=True)(study_run)
    app.command(hidden=True)(study_collect)


def study(
    scenario: Annotated[
        str | None,
        typer.Argument(
            metavar="SCENARIO", help="Name of a scenario, see `scenarios`; or random-behaviors; or in the file."
        ),
    ] = None,
    runs: Annotated[
        int,
        typer.Option(
            "--runs",
            metavar="N",
            help="Number of runs of each configuration, one seed after the other.",
            parser=integer,
        ),
    ] = 30,
    first_seed: Annotated[
        int | None,
        typer.Option(
            "--first-seed",
            metavar="S",
            help="Seed of the first run; by default that of the file, or 1.",
            parser=integer,
        ),
    ] = None,
    config: Annotated[
        Path | None,
        typer.Option(
            "--config", metavar="FILE", help=r"TOML file with any setting, and a \[grid] or \[\[list]] of settings."
        ),
    ] = None,
    preset: PresetOption = "default",
    generations: GenerationsOption = None,
    settings: SettingsOption = None,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="DIR", help="Folder of the study, gone on with if it is there; a new one by default."
        ),
    ] = None,
    write_slurm: Annotated[
        Path | None,
        typer.Option("--write-slurm", metavar="FILE", help="Write a job script for Slurm, and run nothing."),
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", metavar="", help="Replace a study that is in the folder already.")
    ] = False,
) -> None:
    """Execute many runs, and leave a folder with a table, figures, and a report."""
    from turing_learning.studies import BEHAVIORS, Hands, execute_study, new_study_path, plan_study
    from turing_learning.swarm import SCENARIOS

    require_scenario(scenario, config, [*SCENARIOS, BEHAVIORS.name])
    hands = Hands(workers, cluster=cluster)
    values, labels = settings_of(settings, {"run.generations": generations})
    plan = plan_study(
        scenario, runs=runs, first_seed=first_seed, preset=preset, config=config, settings=values, labels=labels
    )
    path = out or new_study_path(plan)
    if write_slurm is not None:
        _write_slurm(plan, path, write_slurm, hands, force=force)
        return
    _execute(lambda **watch: execute_study(plan, path, hands, force=force, **watch), path)


def _write_slurm(plan: "Plan", path: Path, script: Path, hands: Any, *, force: bool) -> None:
    from turing_learning.config import ConfigurationError
    from turing_learning.report import counted
    from turing_learning.studies import StudyFolder, create_study, refuse_script, write_slurm

    if hands.cluster is not None or hands.workers is not None:
        raise ConfigurationError(
            f"`write-slurm` must be given without workers and cluster; got {script} beside one. Slurm is the cluster."
        )
    refuse_script(script.absolute(), force=force)
    with ExitStack() as stack:
        create_study(plan, StudyFolder(path), stack, force=force)
    submit = write_slurm(script, path, len(plan), force=force)
    typer.echo(f"{script}: {counted(len(plan), 'run')} in {path}. Time and memory of a run stand at its head. Submit:")
    typer.echo(f"  {submit}")


def resume(path: Path, workers: int | None, cluster: str | None) -> None:
    """Go on with a study."""
    from turing_learning.studies import resume_study

    _execute(lambda **watch: resume_study(path, workers=workers, cluster=cluster, **watch), path)


def show(path: Path) -> None:
    """Print the table of a study."""
    from rich.console import Console

    from turing_learning.studies import load_study

    from ._study_view import print_study

    print_study(Console(), load_study(path))


def study_run(
    study: StudyArgument,
    number: Annotated[int, typer.Argument(metavar="NUMBER", help="Number of the run, from 1.", parser=integer)],
) -> None:
    """Execute one run of a study, or go on with it: the job of a Slurm array."""
    from turing_learning.studies import run_one

    from ._signals import stop_on_signals

    ahead = f"go on with: {shlex.join(['turing-learning', 'study-run', str(study), str(number)])}"
    try:
        with stop_on_signals() as should_stop:
            run = run_one(study, number, should_stop)
    except KeyboardInterrupt as error:
        raise Interrupted(f"interrupted; {ahead}") from error
    if run.reason:
        typer.echo(f"run {number} failed: {run.reason}", err=True)
        raise typer.Exit(1)
    if not run.complete:
        raise Interrupted(f"stopped; {ahead}")
    typer.echo(f"run {number}: {run.verdict}")


def study_collect(study: StudyArgument) -> None:
    """Make the table, figures and report of the runs of a study that are complete."""
    from rich.console import Console

    from turing_learning.studies import collect_study

    from ._study_view import print_study

    print_study(Console(), collect_study(study))


def _execute(execute: "Callable[..., StudyResult]", path: Path) -> None:
    from rich.console import Console

    from turing_learning.report import counted
    from turing_learning.runs import resume_command

    from ._signals import stop_on_signals
    from ._study_view import print_study, watching_study

    console = Console()
    ahead = f"go on with: {resume_command(path)}"
    try:
        with stop_on_signals() as should_stop, watching_study(console, should_stop) as view:
            result = execute(observer=view, should_stop=should_stop)
    except KeyboardInterrupt as error:
        raise Interrupted(f"interrupted; {ahead}") from error
    if result.unfinished:
        done = sum(run.complete for run in result.runs)
        raise Interrupted(f"stopped after {done} of {len(result.runs)} runs; {ahead}")
    print_study(console, result)
    if result.failed:
        typer.echo(f"{counted(len(result.failed), 'run')} failed; try again with: {resume_command(path)}", err=True)
        raise typer.Exit(1)
