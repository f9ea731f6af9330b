"""The command that says which individuals behave abnormally."""

import json
import os
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from turing_learning.errors import refuse, refusing_as, require

from ._options import Integer, Real, Tracks, titled
from ._runs import opened

if TYPE_CHECKING:
    from turing_learning.detection import (
        Detection,
        Detector,
        Motion,
        RecordedMotion,
        RunClassifiers,
        Standing,
        TimedVerdict,
    )

SAMPLES = 10
ALIKE = "judged-alike"
Files = Annotated[list[Path] | None, Parameter(negative="")]
MOTION_FILES = (".npy", ".npz", ".csv")


def detect(
    run: Path,
    motion: Path | None = None,
    /,
    *,
    simulate: Integer | None = None,
    samples: Integer | None = None,
    genuine: Files = None,
    abnormal: Files = None,
    rule: str = ALIKE,
    false_alarms: Real = 0.01,
    seed: Integer = 0,
    tracks: Tracks = Tracks(),  # noqa: B008 - frozen
    out: Path | None = None,
    force: bool = False,
    as_json: Annotated[bool, Parameter("--json")] = False,
) -> None:
    """Say from motion which individuals behave abnormally, by the classifiers of a run.

    What a file holds is described in `turing-learning docs detection`.

    Examples:

      turing-learning detect runs/mine motion.csv

      turing-learning detect runs/mine motion.npy --rule fittest --false-alarms 0.001 --json

      turing-learning detect runs/fish trial.txt --genuine monday.txt --genuine tuesday.txt --fps 25 --scale 12.3 --out trial.csv

      turing-learning detect runs/mine --simulate 2

    Parameters
    ----------
    run
        A run folder with a full history.
    motion
        Motion of individuals: a .npy, .npz or .csv file, or a file of a tracker.
    simulate
        Instead of a file: a swarm with N individuals that do something else.
    samples
        Samples of each simulated individual; 10 by default.
    genuine
        Motion of normal individuals, a file or several: each is judged by what was learned from the others.
        By default simulated, or stored by the run.
    abnormal
        Motion of individuals that are known to be abnormal, a file or several; by default some are planted or simulated.
    rule
        judged-alike, or one of the rules by votes: fittest, unanimous (the paper's), or discriminant.
    false_alarms
        Share of normal individuals that may be called abnormal; 0.01 by default.
    seed
        Seed of all that is simulated; 0 by default.
    out
        Of a recording: table of all windows (.csv); beside it a picture, and with judged-alike a page.
    force
        Replace files of `--out` that exist.
    as_json
        Print JSON.
    """
    from turing_learning.detection import Detector, RecordedMotion, plant_abnormal, run_classifiers
    from turing_learning.detection import detect as judged_alike

    got = "neither" if motion is None else "both"
    require((motion is None) != (simulate is None), "MOTION", "be given, or --simulate", got)
    if samples is not None and simulate is None:
        refuse("samples", "be left out beside a file", str(samples), place="--samples")
    recorded = motion is not None and _tracks(motion, tracks) is not None
    if not recorded:
        remedy = "" if motion is None else f"{motion} holds samples of the run's signals, in their units."
        for name, value in (tracks.given | ({} if out is None else {"out": out})).items():
            option = f"--{name.replace('_', '-')}"
            refuse(option, "be left out where there is no recording", str(value), remedy)
    if out is not None:
        _refuse_taken(out, force)
    result = opened(run)
    learned = run_classifiers(result)
    given = _given(motion, "motion", tracks if recorded else None, learned) if motion is not None else None
    if given is None:
        swarm, count = learned.simulated_scenario(), SAMPLES if samples is None else samples
        given = _sorted(plant_abnormal(swarm, simulate or 0, samples=count, seed=seed))
    files = {"genuine": genuine or [], "abnormal": abnormal or []}
    if rule == ALIKE:
        calibration = {
            name: [_given(path, f"--{name}", _tracks(path, tracks), learned) for path in paths]
            for name, paths in files.items()
        }
        normal, others = calibration["genuine"], calibration["abnormal"]
        found = judged_alike(learned, given, genuine=normal, abnormal=others, false_alarms=false_alarms, seed=seed)
        _show_alike(found, given, learned.steps, out, as_json)
        return
    for name, paths in files.items():
        require(
            len(paths) <= 1, f"--{name}", f"be given once with the rule {rule}", len(paths), f"Take --rule {ALIKE}."
        )
    known: dict[str, Any] = {
        name: _samples(paths[0], f"--{name}", learned).samples for name, paths in files.items() if paths
    }
    detector = Detector.from_run(result, rule=rule, false_alarms=false_alarms, seed=seed, **known)
    if isinstance(given, RecordedMotion):
        _show_timeline(detector, given, out, as_json)
        return
    verdicts = detector.verdicts(given)
    if as_json:
        limit = None if detector.rule == "unanimous" else detector.false_alarms
        head = {"rule": detector.rule, "false_alarms": limit, "classifiers": len(detector.genomes)}
        head["samples"] = given.samples.shape[1]
        print(json.dumps({**head, "individuals": [asdict(verdict) for verdict in verdicts]}, indent=2))
        return
    from ._tables import plain_console, print_verdicts

    print_verdicts(plain_console(), detector, given, verdicts)


def _tracks(path: Path, tracks: Tracks) -> Tracks | None:
    """Return how a file is read if a tracker wrote it; None if it holds samples."""
    from turing_learning.detection._motion import holds_motion

    return tracks if path.suffix.lower() not in MOTION_FILES or (tracks.given and not holds_motion(path)) else None


def _given(path: Path, option: str, tracks: Tracks | None, learned: "RunClassifiers") -> "Motion | RecordedMotion":
    """Return the motion in a file: windows of a recording, or samples."""
    return _samples(path, option, learned) if tracks is None else _recording(path, option, tracks, learned)


def _samples(path: Path, option: str, learned: "RunClassifiers") -> "Motion":
    """Return the samples in a file; what is rejected names the option, and what to do with a recording."""
    from turing_learning.config import ConfigurationError
    from turing_learning.detection import load_motion
    from turing_learning.detection._motion import holds_motion

    try:
        return load_motion(path, steps=learned.steps, signals=learned.signals, names=learned.names)
    except ConfigurationError as error:
        remedy = ""
        if path.is_file() and not holds_motion(path):
            remedy = " If a tracker wrote it, give --fps and --scale."
        raise ConfigurationError(f"{error}{remedy}".replace("`motion`", f"`{option}`")) from error


def _recording(path: Path, option: str, tracks: Tracks, learned: "RunClassifiers") -> "RecordedMotion":
    """Return the windows of a recording that fits the run."""
    from turing_learning.config import ConfigurationError
    from turing_learning.detection import recorded_motion

    recording = tracks.read(path, option)
    with refusing_as(ConfigurationError, place=str(path)):
        return recorded_motion(recording, learned, smooth_frames=tracks.smooth)


def _sorted(motion: "Motion") -> "Motion":
    """Return agents, then planted ones, each by their numbers."""
    from turing_learning.detection import Motion

    def place(k: int) -> tuple[str, int]:
        kind, _, number = motion.individuals[k].partition(" ")
        return kind, int(number)

    order = sorted(range(len(motion.individuals)), key=place)
    return Motion(tuple(motion.individuals[k] for k in order), motion.samples[order])


def _refuse_taken(out: Path, force: bool) -> None:
    """Reject a table that exists or has no folder, before anything runs."""
    from turing_learning.runs._folder import refuse_target

    refuse_target(out, name="out", suffixes=(".csv",), force=force)
    for path in _written(out)[1:]:
        refuse_target(path, name="out", suffixes=(path.suffix,), force=force)
    writable = os.access(out.absolute().parent, os.W_OK)
    require(writable, "out", "be in a folder that can be written", str(out), "Choose another place.")


def _written(out: Path) -> tuple[Path, ...]:
    return tuple(out.with_suffix(suffix) for suffix in (".csv", ".png", ".svg", ".html"))


def _show_alike(
    found: "Detection", motion: "Motion | RecordedMotion", steps: int, out: Path | None, as_json: bool
) -> None:
    """Print who is unlike normal individuals, and write table and picture where that was asked for."""
    import sys

    from turing_learning.detection import RecordedMotion
    from turing_learning.detection._present import timed_verdicts

    from ._tables import plain_console, print_standings

    timed = timed_verdicts(found, motion)
    when = "spells_s" if isinstance(motion, RecordedMotion) else "samples"
    if as_json:
        names = ("individual", "rank", "score", "p_value", "abnormal", "windows")

        def rows(standings: "tuple[Standing, ...]") -> list[dict[str, object]]:
            values = ({name: getattr(each, name) for name in names} for each in standings)
            return [{name: None if value != value else value for name, value in row.items()} for row in values]

        first = found.rankings[0]
        content = {
            "rule": ALIKE,
            "by": first.name,
            "false_alarms": found.false_alarms,
            "promised": found.level,
            "steps": steps,
            "normal": {"recordings": found.recordings, "individuals": found.normal},
            "remarks": list(found.remarks),
            "individuals": [
                {**row, when: [list(spell) for spell in each.spells]}
                for row, each in zip(rows(found.individuals), timed, strict=True)
            ],
            "rankings": [
                {
                    "by": each.name,
                    "area": each.area,
                    "called": None if each.called != each.called else each.called,
                    "individuals": rows(each.individuals),
                }
                for each in found.rankings
            ],
        }
        print(json.dumps(content, indent=2))
    else:
        print_standings(plain_console(), found, timed, seconds=when == "spells_s", steps=steps)
    if out is not None and isinstance(motion, RecordedMotion):
        _write(out, motion, timed, found)
        for path in _written(out):
            print(path, file=sys.stderr if as_json else sys.stdout)


def _show_timeline(detector: "Detector", motion: "RecordedMotion", out: Path | None, as_json: bool) -> None:
    """Print verdicts on a recording, and write table and picture where that was asked for."""
    import sys

    from ._tables import plain_console, print_timeline

    verdicts = detector.timeline(motion)
    if as_json:
        names = ("individual", "windows", "score", "strength", "threshold", "abnormal")
        rows = [
            {**{name: getattr(verdict, name) for name in names}, "spells_s": [list(spell) for spell in verdict.spells]}
            for verdict in verdicts
        ]
        head = {"rule": detector.rule, "false_alarms": detector.false_alarms, "classifiers": len(detector.genomes)}
        print(json.dumps({**head, "steps": detector.steps, "individuals": rows}, indent=2))
    else:
        print_timeline(plain_console(), detector, verdicts)
    if out is not None:
        _write(out, motion, verdicts)
        for path in _written(out)[:-1]:
            print(path, file=sys.stderr if as_json else sys.stdout)


def _write(
    out: Path, motion: "RecordedMotion", verdicts: "Sequence[TimedVerdict]", found: "Detection | None" = None
) -> None:
    """Write table, picture and page, or, if there is no room for all of it, no new file: the same command may be repeated."""
    from turing_learning._files import write_atomically
    from turing_learning.detection._present import detection_page, timeline_of, window_table
    from turing_learning.figures import save_figure
    from turing_learning.report import write_page
    from turing_learning.runs import RunStorageError
    from turing_learning.store import told

    name = titled(Path(motion.recording.source)) if motion.recording else out.stem
    figure = timeline_of(motion, verdicts, votes=found is None)
    fresh = [path for path in _written(out) if not path.exists()]
    what = f"`out` must be a file that can be written; could not write to {out}"
    with told(RunStorageError, what, "Make room, or choose another place, and give the command again."):
        try:
            write_atomically(out, window_table(verdicts).encode())
            save_figure(figure, out.parent, out.stem)
            if found is not None:
                write_page(detection_page(found, motion, verdicts, figure, name), out.with_suffix(".html"))
        except OSError:
            for path in fresh:
                try:
                    path.unlink(missing_ok=True)
                except OSError:
                    continue
            raise
