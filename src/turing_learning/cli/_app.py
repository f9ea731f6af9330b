"""The commands."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from . import _arena, _check, _detect, _pool, _reproduce, _robots, _study
from ._exit import Interrupted
from ._numbers import integer, real
from ._options import (
    GenerationsOption,
    PresetOption,
    SettingsOption,
    ThreadsOption,
    require_scenario,
    settings_of,
)
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

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from turing_learning.runs import Result

app = typer.Typer(
    help="Infer the rules that individuals follow from nothing but their motion, without a metric.",
    epilog="Begin with: turing-learning infer aggregation",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
)

ForceOption = Annotated[bool, typer.Option("--force", metavar="", help="Replace a run that is in the folder already.")]
RunArgument = Annotated[Path, typer.Argument(metavar="RUN", help="A run folder, or a study folder.")]


def _version(asked: bool) -> None:
    if asked:
        from turing_learning import __version__

        typer.echo(f"turing-learning {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", metavar="", callback=_version, is_eager=True, help="Print the version and exit."),
    ] = False,
) -> None:
    pass


@app.command(
    epilog="Examples:\n\n"
    "  turing-learning infer aggregation\n\n"
    "  turing-learning infer aggregation --generations 200 --seed 7 --out runs/short\n\n"
    "  turing-learning infer --config my.toml --set classifiers.hidden=8\n\n"
    "  turing-learning infer --trajectories fish.txt --fps 25 --scale 12.3 --model couzin\n\n"
    "Ctrl-C stops after the present generation; `turing-learning resume RUN` goes on."
)
def infer(
    context: typer.Context,
    scenario: Annotated[
        str | None, typer.Argument(metavar="SCENARIO", help="Name of a scenario, see `scenarios`; or in the file.")
    ] = None,
    config: Annotated[
        Path | None, typer.Option("--config", metavar="FILE", help="TOML file with any setting, see docs/scenarios.md.")
    ] = None,
    preset: PresetOption = "default",
    generations: GenerationsOption = None,
    seed: Annotated[
        str | None, typer.Option("--seed", metavar="S", help="Seed of all random numbers; 1 by default.")
    ] = None,
    threads: Annotated[
        str | None, typer.Option("--threads", metavar="N", help="Number of threads, or all; the result is the same.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder of the run; a new one under runs/ by default.")
    ] = None,
    force: ForceOption = False,
    settings: SettingsOption = None,
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
    """Infer the behavior of a swarm, or of recorded animals, by Turing Learning, and leave a run folder with a report."""
    from turing_learning.config import ConfigurationError, load_configuration, require_seen
    from turing_learning.runs import infer as infer_run
    from turing_learning.runs import new_run_path, start
    from turing_learning.swarm import SCENARIOS

    options = {"run.generations": generations, "run.seed": seed, "run.threads": threads}
    overrides, labels = settings_of(settings, options)
    recording = Recording.of(context)
    if recording.given:
        if scenario is not None:
            raise ConfigurationError(f"`SCENARIO` must be left out for recorded motion; got {scenario!r}.")
        system = recording.arguments()
        path = out or new_run_path(system["name"], _seed(config, overrides))
        told = {"config": config, "preset": preset, "settings": overrides, "out": path, "force": force}
        _execute(lambda **watch: infer_run(**system | told | watch), path, recording)
        return
    require_scenario(scenario, config, SCENARIOS)
    configuration = load_configuration(config, preset, overrides, scenario=scenario, labels=labels)
    require_seen(configuration)
    path = out or new_run_path(configuration.scenario.name, configuration.run.seed)
    _execute(lambda **watch: start(configuration, path, force=force, **watch), path)


@app.command(epilog="Example: turing-learning resume runs/aggregation-20261121-093015-seed1")
def resume(
    context: typer.Context,
    run: RunArgument,
    threads: Annotated[
        int | None,
        typer.Option(
            "--threads",
            metavar="N",
            help="Of a run: number of threads; all by default. The result does not depend on it.",
            parser=integer,
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers",
            metavar="N",
            help="Of a study: number of worker processes; one for each processor by default.",
            parser=integer,
        ),
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option("--cluster", metavar="ADDRESS", help="Of a study: a Dask scheduler, as tcp://10.0.0.1:8786."),
    ] = None,
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
    """Go on with a run or study that was stopped or killed; the result is as if it never had been.

    For recorded motion, give the options that the run began with.
    """
    from turing_learning.config import ConfigurationError
    from turing_learning.runs import FINISHED, RunFolder, is_laboratory_run
    from turing_learning.runs import resume as resume_run
    from turing_learning.studies import is_study

    options = {"threads": threads} if is_study(run) else {"workers": workers, "cluster": cluster}
    for name, value in options.items():
        if value is not None:
            what = "study, whose runs have one thread each" if is_study(run) else "single run"
            raise ConfigurationError(f"`{name}` must be left out for a {what}; got {value} [--{name}].")
    recording = Recording.of(context)
    if is_study(run):
        recording.refuse_beside("a study")
        _study.resume(run, workers, cluster)
        return
    if threads is not None and threads < 1:
        raise ConfigurationError(f"`threads` must be an integer of at least 1; got {threads} [--threads].")
    if is_laboratory_run(run):
        recording.refuse_beside("a run in a laboratory")
        _robots.go_on(run)
        return
    if recording.given or RunFolder(run).manifest()["state"] != FINISHED:
        refuse_other_simulator(run, "resume({run}, genuine=..., simulate=...)")
    genuine, simulate, _ = recording.opened(run) if recording.given else (None, None, None)
    _execute(
        lambda **watch: resume_run(run, genuine=genuine, simulate=simulate, threads=threads, **watch), run, recording
    )


@app.command(epilog="Example: turing-learning show runs/aggregation-20261121-093015-seed1")
def show(run: RunArgument) -> None:
    """Print what a run or study has inferred so far."""
    from rich.console import Console

    from turing_learning.runs import load_run, read_post_evaluation
    from turing_learning.studies import is_study

    from ._tables import print_post_evaluation, print_result

    if is_study(run):
        _study.show(run)
        return
    console = Console()
    print_result(console, load_run(run), run)
    if again := read_post_evaluation(run):
        print_post_evaluation(console, again)


@app.command(
    epilog="Examples:\n\n"
    "  turing-learning simulate aggregation\n\n"
    "  turing-learning simulate aggregation --robots 50 --duration 300 --out fifty.gif\n\n"
    "  turing-learning simulate aggregation --controller=-0.7,-1,1,-1 --out agents.mp4"
)
def simulate(
    scenario: Annotated[str, typer.Argument(metavar="SCENARIO", help="Name of a scenario, see `scenarios`.")],
    controller: Annotated[
        str | None,
        typer.Option(
            "--controller", metavar="V,V,...", help="Wheel speeds for each sensor state; the agents' by default."
        ),
    ] = None,
    robots: Annotated[
        int | None,
        typer.Option("--robots", metavar="A", help="Number of robots; the scenario's by default.", parser=integer),
    ] = None,
    duration: Annotated[
        float, typer.Option("--duration", metavar="SECONDS", help="Duration of the trial.", parser=real)
    ] = 180.0,
    seed: Annotated[
        int, typer.Option("--seed", metavar="S", help="Seed of initial poses and noise.", parser=integer)
    ] = 1,
    threads: ThreadsOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="Page (.html), GIF (.gif) or film (.mp4); SCENARIO.html by default."
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", metavar="", help="Replace a file that exists.")] = False,
) -> None:
    """Simulate one trial and write it as a page, a GIF, or a film."""
    from turing_learning.runs import refuse_film_path, scenario_named, trial_replay, write_trial

    chosen = scenario_named(scenario)
    path = out or Path(f"{scenario}.html")
    refuse_film_path(path, force=force)
    speeds = None if controller is None else _numbers(controller)
    replay = trial_replay(chosen, speeds, robots=robots, duration_s=duration, seed=seed, threads=threads)
    typer.echo(write_trial(replay, path, force=force))


@app.command()
def scenarios() -> None:
    """List the scenarios."""
    from rich.console import Console

    from turing_learning.swarm import SCENARIOS

    from ._tables import print_scenarios

    print_scenarios(Console(), SCENARIOS)


def _seed(config: Path | None, overrides: "Mapping[str, Any]") -> Any:
    """Return the seed of a run on recorded motion, whose other settings need the recording."""
    from turing_learning.config import dotted, read_toml

    _, document = ("", {}) if config is None else read_toml(config)
    return (dotted(document) | dict(overrides)).get("run.seed", 1)


def _execute(run: "Callable[..., Result]", path: Path, recording: Recording | None = None) -> None:
    """Run with a live view; print the result, or how to go on."""
    from rich.console import Console

    from turing_learning.runs import RunFolder, resume_command

    from ._live import watching
    from ._signals import stop_on_signals
    from ._tables import print_result

    console = Console()
    ahead = f"go on with: {resume_command(path)}{recording.options if recording else ''}"
    try:
        with stop_on_signals() as should_stop, watching(console) as view:
            result = run(observer=view, should_stop=should_stop)
    except KeyboardInterrupt as error:
        begun = RunFolder(path).is_run()
        raise Interrupted(f"interrupted; {ahead}" if begun else "interrupted before the run began") from error
    if not result.complete:
        raise Interrupted(f"stopped after generation {result.generations}; {ahead}")
    print_result(console, result, path)


def _numbers(text: str) -> list[float]:
    from turing_learning.config import ConfigurationError

    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise ConfigurationError(f"`controller` must be numbers with commas between them; got {text!r}.") from error


# The order of registration is that of `--help`: what most users need comes first.
_study.register(app)
_pool.register(app)
_check.register(app)
_detect.register(app)
_reproduce.register(app)
_robots.register(app)
_arena.register(app)
