"""The commands of runs and studies: infer, resume, show, simulate, scenarios, study, pool, check, and those of a Slurm cluster."""

import shlex
import sys
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import turing_learning as tl
from turing_learning.errors import integer, refuse, require

from . import _robots
from ._command import Callers, Program
from ._open import opened, system_of
from ._options import (
    Integer,
    Real,
    Recording,
    Settings,
    refuse_beside,
    require_scenario,
    settings_of,
    watched,
)
from ._stopping import FAILED, Interrupted, stopping
from ._tables import plain_console, print_files, print_result, print_study


def infer(
    scenario: str | None = None,
    /,
    *,
    config: Path | None = None,
    preset: str = "default",
    generations: str | None = None,
    trials: str | None = None,
    tolerance: str | None = None,
    seed: str | None = None,
    threads: str | None = None,
    out: Path | None = None,
    force: bool = False,
    passive: str | None = None,
    settings: Settings = None,
    recording: Recording = Recording(),  # noqa: B008 - frozen
    program: Program = Program(),  # noqa: B008 - frozen
    callers: Callers = Callers(),  # noqa: B008 - frozen
) -> None:
    """Infer the behavior of a swarm, or of recorded animals, by Turing Learning, and leave a run folder with a report.

    Ctrl-C stops after the present generation; `turing-learning resume RUN` resumes the run.

    Examples:

      turing-learning infer aggregation
      turing-learning infer aggregation --trials 1000 --out runs/frugal
      turing-learning infer aggregation --generations 200 --seed 7 --out runs/short
      turing-learning infer --config my.toml --set classifiers.hidden=8
      turing-learning infer light-response --passive random
      turing-learning infer --simulate-command "ants {speed} {seed}" --range speed=0:10 --series nests.csv --workers 4
      turing-learning infer --trajectories monday.txt --trajectories tuesday.txt --fps 25 --pixels-per-cm 12.3 --model couzin

    :param scenario: Name of a scenario, see `scenarios`; or in the file.
    :param config: TOML file with any setting, see `turing-learning docs scenarios`.
    :param preset: "default"; "paper" keeps to the text of the paper, "authors" to the group's public code.
    :param generations: Number of generations instead of a budget in trials.
    :param trials: Budget in simulated trials; 3000 unless settings, the preset or the system ask for generations,
        see `turing-learning docs few-trials`.
    :param tolerance: Stop before the trials are spent once the interval of every parameter that can be
        identified is at most this share of its range to either side.
    :param seed: Seed of all random numbers; 1 by default.
    :param threads: Number of threads, or all; the result is the same.
    :param out: Folder of the run; a new one under runs/ by default.
    :param force: Replace a run that is in the folder already.
    :param passive: Of a system with stimuli: classifiers only watch, under random or constant stimuli, the system's own,
        or those of a CSV file, see `turing-learning docs interaction`. By default they choose the stimuli.
    :param settings: Any setting, for example models.parents=20. Repeatable.
    """
    from turing_learning.config import (
        SCENARIOS,
        dotted,
        load_configuration,
        read_toml,
        require_visible_objects,
    )

    length = {"run.generations": generations, "run.trials": trials, "run.tolerance": tolerance}
    overrides, labels = settings_of(settings, {**length, "run.seed": seed, "run.threads": threads})
    if recording.given or program.given:
        rule = "be left out for recorded motion"
        require(scenario is None, "SCENARIO", rule, repr(scenario))
        require(passive is None, "--passive", rule, repr(passive))
        # The seed, which names the folder, may stand in the file.
        stated = {}
        if config is not None:
            _, document = read_toml(config)
            stated = dotted(document)
        stated |= overrides
        run_seed = stated.get("run.seed", 1)
        if program.given:
            rule = "be left out for a program and its series"
            # Ranges are those of the program's parameters.
            replace(recording, range=None).refuse_beside(rule)
            system = program.system(recording.range)
        else:
            integer("run.seed" if seed is None else "--seed", run_seed)
            system = recording.system(run_seed)
        path = out or tl.runs.new_run_path(system["name"], run_seed)
        run = partial(
            tl.infer,
            **system,
            config=config,
            preset=preset,
            settings=overrides,
            out=path,
            force=force,
        )
        with callers.options() as options:
            _execute(partial(run, **options), path)
        return
    callers.refuse_beside("be left out for simulated robots, whose threads are --threads")
    require_scenario(scenario, config, SCENARIOS)
    chosen = scenario if passive is None else watched(scenario, passive)
    configuration = load_configuration(config, preset, overrides, scenario=chosen, labels=labels)
    require_visible_objects(configuration)
    path = out or tl.runs.new_run_path(configuration.scenario.name, configuration.run.seed)
    _execute(partial(tl.runs.start, configuration, path, force=force), path)


def resume(
    run: Path,
    /,
    *,
    threads: Integer | None = None,
    trials: Integer | None = None,
    tolerance: Real | None = None,
    trust: bool = False,
    recording: Recording = Recording(),  # noqa: B008 - frozen
    callers: Callers = Callers(),  # noqa: B008 - frozen
) -> int | None:
    """Resume a run, study or comparison that was stopped or killed; the result is that of one that never stopped.

    A run on recorded motion knows its recording; give --trajectories if the file is elsewhere now.

    Examples:

      turing-learning resume runs/aggregation-20261121-093015-seed1
      turing-learning resume runs/frugal --trials 3000

    :param run: The folder of a run, a study or a comparison.
    :param threads: Of a run: number of threads; all by default. The result does not depend on it.
    :param trials: Of a finished run of trials: its new total number.
    :param tolerance: Beside --trials: as in `infer`; that of the run by default.
    :param trust: Of a run in a laboratory whose laboratory.json you have edited: it names functions that are executed.
    """
    if tl.studies.is_study(run):
        rule = "be left out for a study, whose runs have one thread each"
        refuse_beside(
            rule, threads=threads, trials=trials, tolerance=tolerance, trust=trust or None
        )
        recording.refuse_beside("be left out for a study, which needs nothing but its folder")
        resumed = partial(tl.studies.resume_study, run, **callers.given)
        return _execute_study(resumed, run)
    if tl.comparison.is_comparison(run):
        from ._compare import resume_comparison

        rule = "be left out for a comparison, which needs nothing but its folder"
        recording.refuse_beside(rule, trials=trials, tolerance=tolerance, trust=trust or None)
        resume_comparison(run, threads, callers)
        return None
    if threads is not None:
        integer("threads", threads, 1, place="--threads")
    if tl.runs.is_laboratory_run(run):
        rule = "be left out for a run in a laboratory, which needs nothing but its folder"
        recording.refuse_beside(rule)
        callers.refuse_beside("be left out for a run in a laboratory")
        return _robots.resume_run(run, trust=trust, trials=trials, tolerance=tolerance)
    rule = "be left out for a run that takes place in no laboratory"
    require(not trust, "--trust", rule, "it", place=str(run))
    # A run that is finished is shown again without its recording.
    system: dict[str, Any] = {}
    finished = tl.runs.RunFolder(run).manifest()["state"] == tl.runs.FINISHED
    if recording.given or trials is not None or not finished:
        system = system_of(run, recording, "resume({run}, genuine=..., simulate=...)")
        system.pop("recording", None)
    if tl.runs.RunFolder(run).configuration().system.simulated is not None:
        callers.refuse_beside("be left out for a single run of simulated robots")
    folder = tl.runs.RunFolder(run)
    # what follows may be done again, unless more trials are asked for than were
    stored = folder.is_spent() and trials in (None, folder.configuration().run.trials)
    resumed_run = partial(
        tl.resume, run, **system, threads=threads, trials=trials, tolerance=tolerance
    )
    with callers.options() as options:
        _execute(partial(resumed_run, **options), run, stored=stored)
    return None


def show(run: Path, /) -> None:
    """Print what a run or study has inferred so far, or which model of a finished comparison is hardest to tell.

    Example: turing-learning show runs/aggregation-20261121-093015-seed1

    :param run: A run folder, or that of a study or comparison.
    """
    if tl.studies.is_study(run):
        print_study(plain_console(), tl.load_study(run))
    elif tl.comparison.is_comparison(run):
        from ._compare import show_comparison

        show_comparison(run)
    else:
        print_result(plain_console(), tl.runs.load_run(run), run)


def scenarios() -> None:
    """List the scenarios."""
    import numpy as np
    from rich.text import Text

    line = partial(plain_console().print, soft_wrap=True)
    for name, scenario in tl.swarm.SCENARIOS.items():
        line(Text(name, style="bold") + f"  {scenario.description}")
        values = []
        names = tl.models.ReactiveModel(scenario.sensor.states).parameter_names
        for parameter, speed in zip(names, scenario.controller, strict=True):
            values.append(f"{parameter} = {speed:g}")
        view = scenario.sensor.field_of_view
        # Elsewhere robots have a line of sight.
        if view > 0 or scenario.representation == "morphology":
            values.append(f"field of view {view:.4g} rad")
        bodies = f"{scenario.agents} agents, {scenario.replicas} replica"
        if scenario.objects.count:
            bodies += f", {scenario.objects.count} objects"
        line(f"    {bodies}; {', '.join(values)}")
    for name, system in tl.interaction.STIMULATED.items():
        line(Text(name, style="bold") + f"  {system.title}")
        stimuli = f"stimuli {', '.join(system.stimulus.names)}"
        line(f"    {stimuli}; {system.shown(np.array(system.true))}")


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
    :param preset: "default"; "paper" keeps to the text of the paper, "authors" to the group's public code.
    :param generations: Number of generations of each run, as in `infer`.
    :param trials: Budget of each run in trials; 3000 unless settings, the preset or the system ask for generations.
    :param settings: Any setting, for example models.parents=20. Repeatable.
    :param workers: Number of worker processes; one for each processor by default.
    :param cluster: A Dask scheduler, for example tcp://10.0.0.1:8786.
    :param out: Folder of the study, which is resumed if it is there; a new one by default.
    :param write_slurm: Write a job script for Slurm to this file, and run nothing.
    :param force: Replace a study that is in the folder already.
    """
    from turing_learning.config import SCENARIOS
    from turing_learning.studies import refuse_script

    require_scenario(scenario, config, [*SCENARIOS, tl.studies.BEHAVIORS.name])
    executors = tl.studies.ExecutorChoice(workers, cluster=cluster)
    values, labels = settings_of(settings, {"run.generations": generations, "run.trials": trials})
    plan = tl.studies.plan_study(
        scenario,
        runs=runs,
        first_seed=first_seed,
        preset=preset,
        config=config,
        settings=values,
        labels=labels,
    )
    path = out or tl.studies.new_study_path(plan)
    if write_slurm is None:
        return _execute_study(
            partial(tl.studies.execute_study, plan, path, executors, force=force), path
        )
    if executors.cluster is not None or executors.workers is not None:
        rule = "be given without workers and cluster"
        refuse("write-slurm", rule, f"{write_slurm} beside one", "Slurm is the cluster.")
    # Before the folder is made, so that nothing is left if the script cannot be written.
    refuse_script(write_slurm.absolute(), force=force)
    with ExitStack() as stack:
        tl.studies.create_study(plan, tl.studies.StudyFolder(path), stack, force=force)
    submit = tl.studies.write_slurm(write_slurm, path, len(plan), force=force)
    runs_of = tl.report.counted(len(plan), "run")
    print(
        f"{write_slurm}: {runs_of} in {path}. Time and memory of a run stand at its head. Submit:"
    )
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


def pool(runs: list[Path], /) -> None:
    """Combine several runs of one configuration: do they agree, and what do they leave open together?

    The runs differ in their seed alone, as those of a study of one configuration do.

    Examples:

      turing-learning pool runs/fish-seed1 runs/fish-seed2 runs/fish-seed3 runs/fish-seed4
      turing-learning pool runs/thirty/runs/*

    :param runs: Run folders, two or more.
    """
    for run in runs:
        if tl.studies.is_study(run):
            refuse("RUN", "be a run folder", f"{run}, a study. Its runs are {run / 'runs'}/*")
    plain_console().print(tl.pool(list(map(opened, runs))))


def check(
    run: Path,
    /,
    *,
    samples: Integer | None = None,
    points: Integer | None = None,
    recoveries: Integer | None = None,
    recovery_generations: Integer | None = None,
    seed: Integer = 0,
    force: bool = False,
    recording: Recording = Recording(),  # noqa: B008 - frozen
    callers: Callers = Callers(),  # noqa: B008 - frozen
) -> None:
    """Say whether the estimate of a run can be believed: can fresh classifiers tell it from the genuine motion?

    A run on recorded motion knows its recording. Results are stored in RUN/check; after Ctrl-C the same
    command resumes. See `turing-learning docs identifiability`.

    Examples:

      turing-learning check runs/mine
      turing-learning check runs/fish --trajectories elsewhere/fish.txt

    :param run: A run folder.
    :param samples: Samples of each kind; 200 by default.
    :param points: Values of each parameter in a profile, 6 or more; 8 by default, 0 for none.
    :param recoveries: Runs whose truth is the estimate, 0 for none; 1 by default, 5 for a run of trials.
    :param recovery_generations: Their length; that of the run by default.
    :param seed: Seed of the check; 0 by default.
    :param force: Check again, and replace the check that is there.
    """
    result = opened(run)
    system = system_of(run, recording, "load_run({run}).check(genuine=..., simulate=...)")
    effort = tl.identifiability.Effort()
    if samples is not None:
        effort = replace(effort, samples=samples)
    if points is not None:
        effort = replace(effort, points=points)
    stages = plain_console(stderr=True)
    console = plain_console()
    try:
        with callers.options() as options:
            done = result.check(
                **system,
                **options,
                recoveries=recoveries,
                recovery_generations=recovery_generations,
                effort=effort,
                seed=seed,
                force=force,
                stage=stages.print,
            )
    except KeyboardInterrupt as error:
        raise Interrupted("interrupted; the same command continues from what is done") from error
    console.print(done)
    print_files(console, report=tl.runs.RunFolder(run).report_path)


def _execute(run: "partial[tl.Result]", path: Path, *, stored: bool = False) -> None:
    """Run with a live view; print the result, or how to resume.

    With `stored` all trials are spent before it begins, so that the first signal ends it.
    """
    from ._live import watching

    console = plain_console()
    ahead = f"resume with: {tl.runs.resume_command(path)}"
    # Known when it is asked: a signal may come before there is a folder to resume from.
    has_begun = tl.runs.RunFolder(path).is_run

    def interrupted() -> str:
        if has_begun():
            return f"interrupted; {ahead}"
        return "interrupted before the run began"

    with stopping(interrupted) as should_stop, watching(console) as view:

        def watch(progress: tl.runs.Progress) -> None:
            view(progress)
            # all trials are stored, and what follows may be done again
            should_stop.at_once = progress.last

        should_stop.at_once = stored
        result = run(observer=watch, should_stop=should_stop)
    if not result.complete:
        raise Interrupted(f"stopped after {result.length}; {ahead}")
    print_result(console, result, path)


def _execute_study(run: "partial[tl.StudyResult]", path: Path) -> int | None:
    """Execute a study with a live view; print its table, or how to resume."""
    from ._live import watching_study

    console = plain_console()
    ahead = f"resume with: {tl.runs.resume_command(path)}"
    with stopping(ahead) as should_stop, watching_study(console, should_stop) as view:
        result = run(observer=view, should_stop=should_stop)
    if result.unfinished:
        done = sum(run.complete for run in result.runs)
        raise Interrupted(f"stopped after {done} of {len(result.runs)} runs; {ahead}")
    print_study(console, result)
    if not result.failed:
        return None
    failed = tl.report.counted(len(result.failed), "run")
    print(f"{failed} failed; try again with: {tl.runs.resume_command(path)}", file=sys.stderr)
    return FAILED
