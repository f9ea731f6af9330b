"""The command that tells which individuals behave abnormally."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ._detect_recording import is_recording, read_recording, refuse_taken, show
from ._numbers import integer, real
from ._recording import PANEL, EveryOption, FormatOption, KeypointOption, YAxisOption
from ._stored import opened

if TYPE_CHECKING:
    from rich.table import Table

    from turing_learning.detection import Detector, Motion, RunClassifiers, Verdict

SAMPLES = 10


def register(app: typer.Typer) -> None:
    """Add the command to the command line."""
    app.command(
        epilog="Examples:\n\n"
        "  turing-learning detect runs/mine motion.csv\n\n"
        "  turing-learning detect runs/mine motion.npy --rule archive --false-alarms 0.001 --json\n\n"
        "  turing-learning detect runs/fish other_trial.txt --fps 25 --scale 12.3 --out other_trial.csv\n\n"
        "  turing-learning detect runs/mine --simulate 2\n\n"
        "  turing-learning detect runs/fish today.npy --genuine normal.npy --abnormal other.npy\n\n"
        "What a file holds is said in docs/detection.md."
    )(detect)


def detect(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder with a full history.")],
    motion: Annotated[
        Path | None,
        typer.Argument(
            metavar="MOTION", help="Motion of individuals: a .npy, .npz or .csv file, or what a tracker wrote."
        ),
    ] = None,
    simulate: Annotated[
        int | None,
        typer.Option(
            "--simulate",
            metavar="N",
            help="Instead of a file: a swarm with N individuals that do something else.",
            parser=integer,
        ),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            "--samples", metavar="S", help="Samples of each simulated individual; 10 by default.", parser=integer
        ),
    ] = None,
    genuine: Annotated[
        Path | None,
        typer.Option(
            "--genuine",
            metavar="FILE",
            help="Motion of normal individuals to calibrate with; simulated, or kept by the run, by default.",
        ),
    ] = None,
    abnormal: Annotated[
        Path | None,
        typer.Option(
            "--abnormal", metavar="FILE", help="Motion of others to calibrate with; as for --genuine by default."
        ),
    ] = None,
    rule: Annotated[
        str,
        typer.Option(
            "--rule",
            metavar="RULE",
            help="fittest, unanimous, single, majority, group, archive, jury, or discriminant.",
        ),
    ] = "discriminant",
    false_alarms: Annotated[
        float,
        typer.Option(
            "--false-alarms",
            metavar="SHARE",
            help="Share of normal individuals that may be called abnormal.",
            parser=real,
        ),
    ] = 0.01,
    seed: Annotated[
        int, typer.Option("--seed", metavar="S", help="Seed of all that is simulated.", parser=integer)
    ] = 0,
    fps: Annotated[
        float | None,
        typer.Option("--fps", metavar="RATE", help="Frames per second.", parser=real, rich_help_panel=PANEL),
    ] = None,
    scale: Annotated[
        float | None,
        typer.Option(
            "--scale", metavar="PIXELS", help="Pixels per cm; 1 for a file in cm.", parser=real, rich_help_panel=PANEL
        ),
    ] = None,
    y_axis: YAxisOption = None,
    format: FormatOption = None,
    keypoint: KeypointOption = None,
    every: EveryOption = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE", help="Table of all windows (.csv), and a picture.", rich_help_panel=PANEL
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", metavar="", help="Print JSON.")] = False,
) -> None:
    """Tell from motion which individuals behave abnormally, by the classifiers of a run."""
    from turing_learning.detection import Detector, plant_abnormal, run_classifiers

    _require_one(motion, simulate, samples)
    told: dict[str, Any] = {
        "fps": fps,
        "scale": scale,
        "y_axis": y_axis,
        "format": format,
        "keypoint": keypoint,
        "every": every,
    }
    recorded = motion is not None and is_recording(motion, told)
    if not recorded:
        _refuse_options(told | {"out": out}, motion)
    refuse_taken(out)
    result = opened(run)
    learned = run_classifiers(result)
    timed = read_recording(motion, learned, **told) if recorded and motion is not None else None
    observed, *calibration = (
        None if path is None else _samples(path, option, learned)
        for path, option in ((None if recorded else motion, "motion"), (genuine, "--genuine"), (abnormal, "--abnormal"))
    )
    if observed is None and timed is None:
        swarm, count = learned.simulated_scenario(), SAMPLES if samples is None else samples
        observed = _sorted(plant_abnormal(swarm, simulate or 0, samples=count, seed=seed))
    given = [None if each is None else each.samples for each in calibration]
    detector = Detector.from_run(
        result, rule=rule, false_alarms=false_alarms, genuine=given[0], abnormal=given[1], seed=seed
    )
    if timed is not None:
        show(detector, timed, detector.timeline(timed), out, as_json)
        return
    assert observed is not None
    verdicts = detector.verdicts(observed)
    if as_json:
        _print_json(detector, observed, verdicts)
    else:
        _print_table(detector, observed, verdicts)


def _samples(path: Path, option: str, learned: "RunClassifiers") -> "Motion":
    """Return the samples in a file; what is refused names the option, and what to do with a recording."""
    from turing_learning.config import ConfigurationError
    from turing_learning.detection import holds_motion, load_motion

    try:
        return load_motion(path, steps=learned.steps, signals=learned.signals, names=learned.names)
    except ConfigurationError as error:
        remedy = ""
        if path.is_file() and not holds_motion(path):
            cut = "give --fps and --scale" if option == "motion" else "cut it into samples, see docs/detection.md"
            remedy = f" If a tracker wrote it, {cut}."
        raise ConfigurationError(f"{error}{remedy}".replace("`motion`", f"`{option}`")) from error


def _require_one(motion: Path | None, simulate: int | None, samples: int | None) -> None:
    from turing_learning.config import ConfigurationError

    if (motion is None) == (simulate is None):
        got = "neither" if motion is None else "both"
        raise ConfigurationError(f"`MOTION` must be given, or --simulate; got {got}.")
    if samples is not None and simulate is None:
        raise ConfigurationError(f"`samples` must be left out beside a file; got {samples} [--samples].")


def _refuse_options(options: dict[str, object], motion: Path | None) -> None:
    """Refuse what is said of a recording where there is none, but samples or a simulated swarm."""
    from turing_learning.config import ConfigurationError

    samples = "" if motion is None else f" {motion} holds samples of the run's signals, in their units."
    for name, value in options.items():
        if value is not None:
            option = name.replace("_", "-")
            raise ConfigurationError(
                f"`{option}` must be left out where there is no recording; got {value} [--{option}].{samples}"
            )


def _sorted(motion: "Motion") -> "Motion":
    """Return agents, then planted ones, each by their numbers."""
    from turing_learning.detection import Motion

    def place(k: int) -> tuple[str, int]:
        kind, _, number = motion.individuals[k].partition(" ")
        return kind, int(number)

    order = sorted(range(len(motion.individuals)), key=place)
    return Motion(tuple(motion.individuals[k] for k in order), motion.samples[order])


def _print_json(detector: "Detector", motion: "Motion", verdicts: "tuple[Verdict, ...]") -> None:
    import json
    from dataclasses import asdict

    content = {
        "rule": detector.rule,
        "false_alarms": None if detector.rule == "unanimous" else detector.false_alarms,
        "classifiers": len(detector.genomes),
        "samples": motion.samples.shape[1],
        "individuals": [asdict(verdict) for verdict in verdicts],
    }
    typer.echo(json.dumps(content, indent=2))


def _print_table(detector: "Detector", motion: "Motion", verdicts: "tuple[Verdict, ...]") -> None:
    from rich.console import Console

    from turing_learning.report import counted

    console = Console()
    console.print(verdict_table(verdicts))
    limit = (
        "all samples judged counterfeit" if detector.rule == "unanimous" else f"p-value up to {detector.false_alarms:g}"
    )
    console.print(
        f"{sum(verdict.abnormal for verdict in verdicts)} of {len(verdicts)} abnormal, by "
        f"{counted(motion.samples.shape[1], 'sample')} each of {detector.steps} steps; rule {detector.rule}, "
        f"{counted(len(detector.genomes), 'classifier')}, {limit}",
        highlight=False,
    )


def verdict_table(verdicts: "tuple[Verdict, ...]") -> "Table":
    """Return the table individual / share of samples judged genuine / score / p-value / verdict / since when."""
    from rich.table import Table
    from rich.text import Text

    table = Table()
    table.add_column("individual")
    for heading in ("judged genuine", "score", "p-value"):
        table.add_column(heading, justify="right")
    table.add_column("verdict")
    table.add_column("since sample", justify="right")
    for verdict in verdicts:
        table.add_row(
            Text(verdict.individual),
            f"{100 * verdict.genuine_share:.0f} %",
            f"{verdict.score:.3f}",
            f"{verdict.p_value:.2g}",
            Text("abnormal", style="bold red") if verdict.abnormal else "normal",
            "-" if verdict.since is None else str(verdict.since),
        )
    return table
