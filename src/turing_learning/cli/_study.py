"""The commands of studies."""

import shlex
import sys
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import turing_learning as tl
from turing_learning.errors import refuse

from ._options import Integer, Settings, require_scenario, settings_of
from ._stopping import FAILED, Interrupted, stopping
from ._tables import plain_console, print_study


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

    :param scenario: Name of a scenario, see `scenarios`; or random-behaviors; or in the file.
    :param runs: Number of runs of each configuration, one seed after the other; 30 by default.
    :param first_seed: Seed of the first run; by default that of the file, or 1.
    :param config: TOML file with any setting, and a [grid] or [[list]] of settings.
    :param preset: "default"; "paper" keeps to the text of the paper, "authors" to their published settings.
    :param generations: Number of generations of each run, as in `infer`.
    :param trials: Budget of each run in trials; 3000 where nothing says how long the runs are.
    :param settings: Any setting, for example models.parents=20. Repeatable.
    :param workers: Number of worker processes; one for each processor by default.
    :param cluster: A Dask scheduler, for example tcp://10.0.0.1:8786.
    :param out: Folder of the study, which is resumed if it is there; a new one by default.
    :param write_slurm: Write a job script for Slurm to this file, and run nothing.
    :param force: Replace a study that is in the folder already.
    """
    from turing_learning.config import SCENARIOS
    from turing_learning.studies._backends import refuse_script

    require_scenario(scenario, config, [*SCENARIOS, tl.studies.BEHAVIORS.name])
    hands = tl.studies.Hands(workers, cluster=cluster)
    values, labels = settings_of(settings, {"run.generations": generations, "run.trials": trials})
    plan = tl.studies.plan_study(
        scenario, runs=runs, first_seed=first_seed, preset=preset, config=config, settings=values, labels=labels
    )
    path = out or tl.studies.new_study_path(plan)
    if write_slurm is None:
        return execute(partial(tl.studies.execute_study, plan, path, hands, force=force), path)
    if hands.cluster is not None or hands.workers is not None:
        rule = "be given without workers and cluster"
        refuse("write-slurm", rule, f"{write_slurm} beside one", "Slurm is the cluster.")
    refuse_script(write_slurm.absolute(), force=force)
    with ExitStack() as stack:
        tl.studies.create_study(plan, tl.studies.StudyFolder(path), stack, force=force)
    submit = tl.studies.write_slurm(write_slurm, path, len(plan), force=force)
    runs_of = tl.report.counted(len(plan), "run")
    print(f"{write_slurm}: {runs_of} in {path}. Time and memory of a run stand at its head. Submit:")
    print(f"  {submit}")
    return None


def study_run(study: Path, number: Integer, /) -> int | None:
    """Execute one run of a study, or resume it: the job of a Slurm array.

    :param study: A study folder.
    :param number: Number of the run, from 1.
    """
    ahead = f"resume with: {shlex.join(['turing-learning', 'study-run', str(study), str(number)])}"
    with stopping(ahead) as should_stop:
        run = tl.studies.run_one(study, number, should_stop)
    if run.reason:
        print(f"run {number} failed: {run.reason}", file=sys.stderr)
        return FAILED
    if not run.complete:
        raise Interrupted(f"stopped; {ahead}")
    print(f"run {number}: {run.verdict}")
    return None


def study_collect(study: Path, /) -> None:
    """Make the table, figures and report of the runs of a study that are complete.

    :param study: A study folder.
    """
    print_study(plain_console(), tl.studies.collect_study(study))


def execute(run: "partial[tl.StudyResult]", path: Path) -> int | None:
    """Execute a study with a live view; print its table, or how to resume."""
    from ._live import watching_study

    console = plain_console()
    ahead = f"resume with: {tl.results.resume_command(path)}"
    with stopping(ahead) as should_stop, watching_study(console, should_stop) as view:
        result = run(observer=view, should_stop=should_stop)
    if result.unfinished:
        done = sum(run.complete for run in result.runs)
        raise Interrupted(f"stopped after {done} of {len(result.runs)} runs; {ahead}")
    print_study(console, result)
    if not result.failed:
        return None
    failed = tl.report.counted(len(result.failed), "run")
    print(f"{failed} failed; try again with: {tl.results.resume_command(path)}", file=sys.stderr)
    return FAILED
