"""The commands of a laboratory with robots."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ._exit import REFUSED, Interrupted
from ._options import SettingsOption, settings_of

if TYPE_CHECKING:
    from rich.console import Console

    from turing_learning.robots import Equipment, Event, Laboratory
    from turing_learning.runs import Progress, Result

ConfigOption = Annotated[
    Path, typer.Option("--config", metavar="FILE", help="The laboratory's file, see docs/robots/laboratory.md.")
]
EmulatedOption = Annotated[
    bool, typer.Option("--emulated", metavar="", help="Rehearse with emulated robots, as fast as the computer can.")
]
LABORATORY_FILE = Path("lab.toml")

app = typer.Typer(no_args_is_help=True, context_settings={"help_option_names": ["-h", "--help"]})


def register(above: typer.Typer) -> None:
    """Add the commands to the command line."""
    above.add_typer(
        app, name="robots", help="Infer the behavior of real robots: check a laboratory, run it, track videos."
    )


@app.command(epilog="Example: turing-learning robots check --config lab.toml")
def check(config: ConfigOption = LABORATORY_FILE, emulated: EmulatedOption = False) -> None:
    """Look at links, batteries, camera, calibration and markers; nothing moves."""
    from rich.console import Console

    with _opened(_load(config), emulated) as (laboratory, equipment):
        fine = _inspected(Console(), laboratory, equipment)
    if not fine:
        raise typer.Exit(REFUSED)


@app.command(
    epilog="Examples:\n\n"
    "  turing-learning robots run --config lab.toml --out runs/first\n\n"
    "  turing-learning robots run --config lab.toml --emulated --generations 20\n\n"
    "  turing-learning robots run --resume runs/first\n\n"
    "Ctrl-C stops after the present generation, a second one at once; the generation is started again by --resume."
)
def run(
    config: Annotated[
        Path | None,
        typer.Option(
            "--config",
            metavar="FILE",
            help=f"The laboratory's file, see docs/robots/laboratory.md; {LABORATORY_FILE} by default.",
        ),
    ] = None,
    generations: Annotated[
        str | None, typer.Option("--generations", metavar="G", help="Number of generations; 100 by default.")
    ] = None,
    seed: Annotated[str | None, typer.Option("--seed", metavar="S", help="Seed of all random numbers.")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder of the run; a new one under runs/ by default.")
    ] = None,
    force: Annotated[
        bool, typer.Option("--force", metavar="", help="Replace a run that is in the folder already.")
    ] = False,
    resume: Annotated[Path | None, typer.Option("--resume", metavar="RUN", help="Go on with this run instead.")] = None,
    emulated: EmulatedOption = False,
    settings: SettingsOption = None,
) -> None:
    """Infer the behavior of the robots in a laboratory; the operator is asked for help where it is needed."""
    from turing_learning.config import ConfigurationError
    from turing_learning.runs import RunFolder, new_run_path, start_laboratory

    overrides, labels = settings_of(settings, {"run.generations": generations, "run.seed": seed})
    if resume is not None:
        others = {"a file": config is not None, "settings": overrides, "a folder": out is not None, "--force": force}
        if told := [name for name, given in others.items() if given]:
            raise ConfigurationError(
                "`resume` must be given without a file, settings or a folder, which the run has, and without --force; got "
                f"{' and '.join(told)}. Its laboratory may be edited in {RunFolder(resume).laboratory_path}."
            )
        go_on(resume, emulated=emulated)
        return
    loaded = _load(config or LABORATORY_FILE, overrides, labels)
    path = out or new_run_path(loaded.configuration.scenario.name, loaded.configuration.run.seed)
    with _opened(loaded, emulated) as (laboratory, equipment):
        _execute(
            laboratory,
            equipment,
            path,
            lambda **watch: start_laboratory(laboratory, path, equipment=equipment, force=force, **watch),
        )


def go_on(path: Path, *, emulated: bool = False) -> None:
    """Go on with a run in a laboratory; a rehearsal goes on with emulated robots, unasked."""
    from turing_learning.config import ConfigurationError
    from turing_learning.runs import RunFolder, awaits_robots, resume_laboratory, stored_laboratory

    stored = stored_laboratory(path)
    if emulated and not stored.setup.emulated:
        raise ConfigurationError(
            f"`--emulated` must be left out for a run with real robots; got it [{path}]. Rehearse in another folder."
        )
    with _opened(stored, emulated) as (laboratory, equipment):
        _execute(
            laboratory,
            equipment,
            path,
            lambda **watch: resume_laboratory(path, equipment=equipment, **watch),
            needed=awaits_robots(path),
            stored=None if stored.setup.emulated else RunFolder(path).laboratory_path,
        )


@app.command(epilog="Example: turing-learning robots track trial.avi --config lab.toml --out trial.csv")
def track(
    video: Annotated[Path, typer.Argument(metavar="VIDEO", help="A video from the laboratory's camera.")],
    config: ConfigOption = LABORATORY_FILE,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="The table; the video's name with .csv by default.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", metavar="", help="Replace a file that exists.")] = False,
) -> None:
    """Track all robots in a video, write a table that --trajectories reads, and list what went wrong."""
    from turing_learning.config import ConfigurationError
    from turing_learning.robots import Capture, laboratory_tracker, refuse_taken_table, write_table
    from turing_learning.runs import told

    laboratory = _load(config)
    path = out or video.with_suffix(".csv")
    tracker = laboratory_tracker(laboratory.setup)
    try:
        refuse_taken_table(path, force=force)
        with Capture(video) as capture:
            observed = tracker.track(capture)
    except (OSError, ValueError) as error:
        raise ConfigurationError(str(error)) from error
    with told(
        ConfigurationError, f"`out` must be a file that can be written; got {path}", "Choose another, or make room."
    ):
        write_table(observed, path, force=force)
    for fault in observed.faults:
        typer.echo(f"image {fault.frame}: {fault.kind}: {fault.text}")
    seen = observed.present.mean()
    typer.echo(f"{len(observed.poses)} images, {len(observed.labels)} robots, seen in {100 * seen:.2f} %: {path}")


def _load(
    config: Path, overrides: dict[str, object] | None = None, labels: dict[str, str] | None = None
) -> "Laboratory":
    from turing_learning.robots import load_laboratory

    return load_laboratory(config, overrides, labels)


@contextmanager
def _opened(laboratory: "Laboratory", emulated: bool) -> "Iterator[tuple[Laboratory, Equipment]]":
    """Lend the laboratory and its doors; for a rehearsal as it can be emulated, and say what is made up."""
    from turing_learning.robots import as_emulated, real_equipment, rehearse

    if not (emulated or laboratory.setup.emulated):
        yield laboratory, real_equipment(laboratory.setup)
        return
    with as_emulated(laboratory) as rehearsed:
        asked = laboratory.setup.camera.calibration
        if rehearsed.setup.camera.calibration != asked:
            typer.echo(f"rehearsal with a calibration of its own, as there is none yet: {asked}", err=True)
        yield rehearsed, rehearse(rehearsed)


def _inspected(console: "Console", laboratory: "Laboratory", equipment: "Equipment") -> bool:
    """Print what a look at the laboratory shows; return whether a run can begin."""
    from turing_learning.robots import inspect, laboratory_tracker

    fine = True
    tracker = laboratory_tracker(laboratory.setup)
    for finding in inspect(laboratory.setup, laboratory.configuration.scenario, equipment, tracker):
        mark = "good" if finding.fine else "BAD "
        console.print(f"{mark}  {finding.what}: {finding.text}", highlight=False, markup=False, soft_wrap=True)
        fine &= finding.fine
    return fine


def _execute(
    laboratory: "Laboratory",
    equipment: "Equipment",
    path: Path,
    run: "Callable[..., Result]",
    *,
    needed: bool = True,
    stored: Path | None = None,
) -> None:
    """Look at the laboratory, if its robots are needed, run, and print the result, or how to go on.

    Real robots of a run that goes on are where its folder says, in the file `stored`.
    """
    from rich.console import Console

    from turing_learning.runs import read_post_evaluation, resume_command

    from ._signals import stop_on_signals
    from ._tables import print_post_evaluation, print_result

    console = Console()
    if needed and not _inspected(console, laboratory, equipment):
        if stored is not None:
            typer.echo(
                f"The addresses of replicas and camera are those in {stored}, where they may be edited.", err=True
            )
        raise typer.Exit(REFUSED)
    ahead, repeats = f"go on with: {resume_command(path)}", laboratory.setup.evaluation.repeats
    try:
        with stop_on_signals() as should_stop:
            result = run(
                observer=lambda progress: _show(console, progress),
                should_stop=should_stop,
                on_event=lambda event: _tell(console, event, repeats),
            )
    except KeyboardInterrupt as error:
        raise Interrupted(f"interrupted; {ahead}") from error
    if not result.complete:
        raise Interrupted(f"stopped after generation {result.generations}; {ahead}")
    print_result(console, result, path)
    if again := read_post_evaluation(path):
        print_post_evaluation(console, again)
    if repeats and not (again and again.complete):
        raise Interrupted(f"stopped before the last models had been observed again; {ahead}")


def _show(console: "Console", progress: "Progress") -> None:
    from turing_learning.report import short_number

    names = zip(progress.parameter_names, progress.generation.best_model, strict=True)
    models = " ".join(f"{name} {short_number(value)}" for name, value in names)
    text = f"generation {progress.completed}/{progress.total}  {progress.seconds_per_generation:.0f} s each  {models}"
    console.print(text, highlight=False, markup=False, soft_wrap=True)


def _tell(console: "Console", event: "Event", repeats: int) -> None:
    stage, _, number = event.stage.rpartition("-")
    if event.kind != "complete":
        text = f"{event.stage}, attempt {event.attempt}, {event.state}: {event.fault or event.asked}"
    elif stage == "post-evaluation":
        text = f"last models observed again, {number}/{repeats}"
    else:
        return
    console.print(text, highlight=False, markup=False, soft_wrap=True)
