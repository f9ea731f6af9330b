"""The commands of studies."""

import shlex
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from turing_learning.errors import refuse

from ._options import Integer, Settings, require_scenario, settings_of
from ._stopping import FAILED, Interrupted, stopping

if TYPE_CHECKING:
    from collections.abc import Callable

    from turing_learning.studies import StudyResult


def study(
    scenario: str | None = None,
    /,
    *,
    runs: Integer = 30,
    first_seed: Integer | None = None,
    config: Path | None = None,
    preset: str = "default",
    generations: str | None = None,
    trials: str | None = None,
    settings: Settings = None,
    workers: Integer | None = None,
    cluster: str | None = None,
    out: Path | None = None,
    write_slurm: Path | None = None,
    force: bool = False,
) -> int | None:
    """Execute many runs, and leave a folder with a table, figures, and a report.

    Ctrl-C stops all runs after their present generation; `turing-learning resume STUDY` resumes them.

    Examples:

      turing-learning study aggregation --runs 30

      turing-learning study random-behaviors --runs 1000 --workers 8

      turing-learning study aggregation --config grid.toml --cluster tcp://10.0.0.1:8786 --out /shared/grid

      turing-learning study aggregation --out /shared/thirty --write-slurm thirty.sh

    Parameters
    ----------
    scenario
        Name of a scenario, see `scenarios`; or random-behaviors; or in the file.
    runs
        Number of runs of each configuration, one seed after the other; 30 by default.
    first_seed
        Seed of the first run; by default that of the file, or 1.
    config
        TOML file with any setting, and a [grid] or [[list]] of settings.
    preset
        "default"; "paper" keeps to the text of the paper, "authors" to their published settings.
    generations
        Number of generations of each run, as in `infer`.
    trials
        Budget of each run in trials; 3000 where nothing says how long the runs are.
    settings
        Any setting, for example models.parents=20. Repeatable.
    workers
        Number of worker processes; one for each processor by default.
    cluster
        A Dask scheduler, for example tcp://10.0.0.1:8786.
    out
        Folder of the study, which is resumed if it is there; a new one by default.
    write_slurm
        Write a job script for Slurm to this file, and run nothing.
    force
        Replace a study that is in the folder already.
    """
    from turing_learning.config import SCENARIOS
    from turing_learning.report import counted
    from turing_learning.studies import (
        BEHAVIORS,
        Hands,
        StudyFolder,
        create_study,
        execute_study,
        new_study_path,
        plan_study,
    )
    from turing_learning.studies import write_slurm as write_script
    from turing_learning.studies._backends import refuse_script

    require_scenario(scenario, config, [*SCENARIOS, BEHAVIORS.name])
    hands = Hands(workers, cluster=cluster)
    values, labels = settings_of(settings, {"run.generations": generations, "run.trials": trials})
    plan = plan_study(
        scenario, runs=runs, first_seed=first_seed, preset=preset, config=config, settings=values, labels=labels
    )
    path = out or new_study_path(plan)
    if write_slurm is None:
        return _execute(lambda **watch: execute_study(plan, path, hands, force=force, **watch), path)
    if hands.cluster is not None or hands.workers is not None:
        rule = "be given without workers and cluster"
        refuse("write-slurm", rule, f"{write_slurm} beside one", "Slurm is the cluster.")
    refuse_script(write_slurm.absolute(), force=force)
    with ExitStack() as stack:
        create_study(plan, StudyFolder(path), stack, force=force)
    submit = write_script(write_slurm, path, len(plan), force=force)
    print(f"{write_slurm}: {counted(len(plan), 'run')} in {path}. Time and memory of a run stand at its head. Submit:")
    print(f"  {submit}")
    return None


def resume(path: Path, workers: int | None, cluster: str | None) -> int | None:
    """Resume a study."""
    from turing_learning.studies import resume_study

    return _execute(lambda **watch: resume_study(path, workers=workers, cluster=cluster, **watch), path)


def show(path: Path) -> None:
    """Print the table of a study."""
    from turing_learning.studies import load_study

    from ._live import print_study
    from ._tables import plain_console

    print_study(plain_console(), load_study(path))


def study_run(study: Path, number: Integer, /) -> int | None:
    """Execute one run of a study, or resume it: the job of a Slurm array.

    Parameters
    ----------
    study
        A study folder.
    number
        Number of the run, from 1.
    """
    from turing_learning.studies import run_one

    ahead = f"resume with: {shlex.join(['turing-learning', 'study-run', str(study), str(number)])}"
    with stopping(ahead) as should_stop:
        run = run_one(study, number, should_stop)
    if run.reason:
        print(f"run {number} failed: {run.reason}", file=sys.stderr)
        return FAILED
    if not run.complete:
        raise Interrupted(f"stopped; {ahead}")
    print(f"run {number}: {run.verdict}")
    return None


def study_collect(study: Path, /) -> None:
    """Make the table, figures and report of the runs of a study that are complete.

    Parameters
    ----------
    study
        A study folder.
    """
    from turing_learning.studies import collect_study

    from ._live import print_study
    from ._tables import plain_console

    print_study(plain_console(), collect_study(study))


def _execute(execute: "Callable[..., StudyResult]", path: Path) -> int | None:
    from turing_learning.report import counted
    from turing_learning.results import resume_command

    from ._live import print_study, watching_study
    from ._tables import plain_console

    console = plain_console()
    ahead = f"resume with: {resume_command(path)}"
    with stopping(ahead) as should_stop, watching_study(console, should_stop) as view:
        result = execute(observer=view, should_stop=should_stop)
    if result.unfinished:
        done = sum(run.complete for run in result.runs)
        raise Interrupted(f"stopped after {done} of {len(result.runs)} runs; {ahead}")
    print_study(console, result)
    if not result.failed:
        return None
    print(f"{counted(len(result.failed), 'run')} failed; try again with: {resume_command(path)}", file=sys.stderr)
    return FAILED
