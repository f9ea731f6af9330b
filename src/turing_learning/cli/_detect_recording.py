"""What `detect` does with a recording: who behaves abnormally, and when."""

import contextlib
import csv
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from rich.table import Table

    from turing_learning.detection import Detector, RecordedMotion, RunClassifiers, TimedVerdict

MOTION_FILES = (".npy", ".npz", ".csv")
MOST_SPELLS = 3  # in a cell of the table


def is_recording(path: Path, told: Mapping[str, Any]) -> bool:
    """Return whether a file is what a tracker wrote: by its name no samples, or told of as a recording and holding none."""
    from turing_learning.detection import holds_motion

    if path.suffix.lower() not in MOTION_FILES:
        return True
    return any(value is not None for value in told.values()) and not holds_motion(path)


def read_recording(path: Path, run: "RunClassifiers", *, scale: float | None, **options: Any) -> "RecordedMotion":
    """Return the windows of a recording; `options` are those of `load_trajectories`, and how many frames are kept.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, an option is missing, or the recording does not fit the run.
    """
    from turing_learning.config import ConfigurationError
    from turing_learning.detection import recorded_motion

    from ._recording import read
    from ._wording import in_options

    try:
        recording = read(path, pixels_per_cm=scale, **options)
    except OSError as error:
        reason = error.strerror or str(error)
        raise ConfigurationError(f"`motion` must be a file that can be read; got {path} ({reason}).") from error
    except (ValueError, ImportError) as error:
        raise ConfigurationError(in_options(str(error), file="motion")) from error
    try:
        return recorded_motion(recording, run)
    except ConfigurationError as error:
        raise ConfigurationError(in_options(f"{error} [{path}]", file="motion")) from error


def refuse_taken(out: Path | None) -> None:
    """Refuse a table that exists or has no folder, before anything runs."""
    from turing_learning.config import ConfigurationError

    if out is None:
        return
    if out.suffix.lower() != ".csv":
        raise ConfigurationError(f"`out` must be a file that ends with .csv; got {out}. A picture is put beside it.")
    folder = out.absolute().parent
    if not folder.is_dir():
        raise ConfigurationError(f"`out` must be in an existing folder; got {out}. Make the folder first.")
    if not os.access(folder, os.W_OK):
        raise ConfigurationError(f"`out` must be in a folder that can be written; got {out}. Choose another place.")
    for path in _written(out):
        if path.exists():
            raise ConfigurationError(f"`out` must be a new file; got {out}, and {path} exists. Choose another name.")


def show(
    detector: "Detector", motion: "RecordedMotion", verdicts: "Sequence[TimedVerdict]", out: Path | None, as_json: bool
) -> None:
    """Print verdicts, and write table and picture where that was asked for."""
    if as_json:
        import json

        typer.echo(json.dumps(_content(detector, verdicts), indent=2))
    else:
        _print_table(detector, verdicts)
    if out is not None:
        for path in _write(out, motion, verdicts):
            typer.echo(path, err=as_json)


def _content(detector: "Detector", verdicts: "Sequence[TimedVerdict]") -> dict[str, Any]:
    return {
        "rule": detector.rule,
        "false_alarms": detector.false_alarms,
        "classifiers": len(detector.genomes),
        "steps": detector.steps,
        "individuals": [
            {
                "individual": verdict.individual,
                "windows": verdict.windows,
                "score": verdict.score,
                "strength": verdict.strength,
                "threshold": verdict.threshold,
                "abnormal": verdict.abnormal,
                "spells_s": [list(spell) for spell in verdict.spells],
            }
            for verdict in verdicts
        ],
    }


def _print_table(detector: "Detector", verdicts: "Sequence[TimedVerdict]") -> None:
    from rich.console import Console

    console = Console()
    console.print(timeline_table(verdicts))
    console.print(
        f"{sum(verdict.abnormal for verdict in verdicts)} of {len(verdicts)} abnormal, by windows of {detector.steps} steps; "
        f"rule {detector.rule}, {len(detector.genomes)} classifiers",
        highlight=False,
    )


def timeline_table(verdicts: "Sequence[TimedVerdict]") -> "Table":
    """Return the table individual / windows / mean score / evidence and its threshold / verdict / when."""
    from rich.table import Table
    from rich.text import Text

    table = Table()
    table.add_column("individual")
    for heading in ("windows", "score", "evidence", "threshold"):
        table.add_column(heading, justify="right")
    table.add_column("verdict")
    table.add_column("when (s)")
    for verdict in verdicts:
        judged = verdict.windows > 0
        table.add_row(
            Text(verdict.individual),
            str(verdict.windows),
            f"{verdict.score:.3f}" if judged else "-",
            f"{verdict.strength:.2f}" if judged else "-",
            f"{verdict.threshold:.2f}" if judged else "-",
            Text("abnormal", style="bold red") if verdict.abnormal else "normal" if judged else "no window",
            _when(verdict.spells),
        )
    return table


def _when(spells: Sequence[tuple[float, float]]) -> str:
    shown = [f"{begin:.1f} to {end:.1f}" for begin, end in spells[:MOST_SPELLS]]
    more = len(spells) - MOST_SPELLS
    return ", ".join(shown + ([f"{more} more"] if more > 0 else [])) or "-"


def _written(out: Path) -> tuple[Path, ...]:
    return (out, out.with_suffix(".png"), out.with_suffix(".svg"))


def _write(out: Path, motion: "RecordedMotion", verdicts: "Sequence[TimedVerdict]") -> tuple[Path, ...]:
    """Write table and picture, or, if there is no room for all of it, nothing, so that the same command may be repeated."""
    from turing_learning.figures import save_figure, timeline_figure
    from turing_learning.runs import RunStorageError, told, write_atomically

    judged = [verdict for verdict in verdicts if verdict.windows]
    figure = timeline_figure(
        [verdict.individual for verdict in judged],
        [verdict.times for verdict in judged],
        [verdict.scores for verdict in judged],
        [verdict.flagged for verdict in judged],
        limit=motion.duration_s,
    )
    what = f"`out` must be a file that can be written; could not write to {out}"
    with told(RunStorageError, what, "Make room, or choose another place, and give the command again."):
        try:
            write_atomically(out, _csv(verdicts).encode())
            save_figure(figure, out.parent, out.stem)
        except OSError:
            for path in _written(out):
                with contextlib.suppress(OSError):
                    path.unlink(missing_ok=True)
            raise
    return _written(out)


def _csv(verdicts: "Sequence[TimedVerdict]") -> str:
    """Return a row for each window of each individual."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["individual", "individual_abnormal", "window", "begin_s", "end_s", "score", "abnormal"])
    for verdict in verdicts:
        rows = zip(verdict.times.tolist(), verdict.scores.tolist(), verdict.flagged.tolist(), strict=True)
        for number, ((begin, end), score, flagged) in enumerate(rows, start=1):
            writer.writerow(
                [verdict.individual, int(verdict.abnormal), number, f"{begin:.6g}", f"{end:.6g}", score, int(flagged)]
            )
    return text.getvalue()
