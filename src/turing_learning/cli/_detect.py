"""The command that says which individuals behave abnormally."""

import json
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from turing_learning.errors import RefusedError, refuse, refusing_as, require

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
    from turing_learning.detection import Detector, Motion, RecordedMotion, plant_abnormal, run_classifiers
    from turing_learning.detection import detect as judged_alike

    got = "neither" if motion is None else "both"
    require((motion is None) != (simulate is None), "MOTION", "be given, or --simulate", got)
    if samples is not None and simulate is None:
        refuse("samples", "be left out beside a file", str(samples), place="--samples")
    if motion is None or not _is_recording(motion, tracks):
        remedy = "" if motion is None else f"{motion} holds samples of the run's signals, in their units."
        tracks.refuse_beside("be left out where there is no recording", remedy, out=out)
    if out is not None:
        _refuse_taken(out, force)
    result = opened(run)
    learned = run_classifiers(result)
    given: Motion | RecordedMotion
    if motion is not None:
        given = _read(motion, "motion", tracks, learned)
    else:
        count = SAMPLES if samples is None else samples
        planted = plant_abnormal(learned.simulated_scenario(), simulate or 0, samples=count, seed=seed)
        numbered = [(kind, int(number)) for kind, _, number in (name.partition(" ") for name in planted.individuals)]
        order = sorted(range(len(numbered)), key=numbered.__getitem__)  # agents, then planted ones
        given = Motion(tuple(planted.individuals[k] for k in order), planted.samples[order])
    files = {"genuine": genuine or [], "abnormal": abnormal or []}
    if rule == ALIKE:
        known = {name: [_read(path, f"--{name}", tracks, learned) for path in paths] for name, paths in files.items()}
        normal, others = known["genuine"], known["abnormal"]
        found = judged_alike(learned, given, genuine=normal, abnormal=others, false_alarms=false_alarms, seed=seed)
        _show_alike(found, given, learned.steps, out, as_json)
        return
    for name, paths in files.items():
        alone, remedy = f"be given once with the rule {rule}", f"Take --rule {ALIKE}."
        require(len(paths) <= 1, f"--{name}", alone, len(paths), remedy)
    one: dict[str, Any] = {
        name: _samples(each[0], f"--{name}", learned).samples for name, each in files.items() if each
    }
    detector = Detector.from_run(result, rule=rule, false_alarms=false_alarms, seed=seed, **one)
    _show_votes(detector, given, out, as_json)


def _is_recording(path: Path, tracks: Tracks) -> bool:
    """Return whether a tracker wrote a file; other files hold samples."""
    from turing_learning.detection._motion import holds_motion

    return path.suffix.lower() not in MOTION_FILES or (bool(tracks.given) and not holds_motion(path))


def _read(path: Path, option: str, tracks: Tracks, learned: "RunClassifiers") -> "Motion | RecordedMotion":
    """Return the motion in a file: windows of a recording that fits the run, or samples."""
    from turing_learning.detection import recorded_motion

    if not _is_recording(path, tracks):
        return _samples(path, option, learned)
    recording = tracks.read(path, option)
    with refusing_as(RefusedError, place=str(path)):
        return recorded_motion(recording, learned, smooth_frames=tracks.smooth)


def _samples(path: Path, option: str, learned: "RunClassifiers") -> "Motion":
    """Return the samples in a file; what is rejected names the option, and what to do with a recording."""
    from turing_learning.detection import load_motion
    from turing_learning.detection._motion import holds_motion

    try:
        return load_motion(path, steps=learned.steps, signals=learned.signals, names=learned.names)
    except RefusedError as error:
        tracked = path.is_file() and not holds_motion(path)
        remedy = " If a tracker wrote it, give --fps and --scale." if tracked else ""
        raise RefusedError(f"{error}{remedy}".replace("`motion`", f"`{option}`")) from error


def _refuse_taken(out: Path, force: bool) -> None:
    """Reject a table that exists or has no folder, before anything runs."""
    from turing_learning.results._folder import refuse_target

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
    from turing_learning.detection import RecordedMotion
    from turing_learning.detection._present import timed_verdicts

    from ._tables import plain_console, print_standings

    timed, recorded = timed_verdicts(found, motion), isinstance(motion, RecordedMotion)
    if as_json:
        names = ("individual", "rank", "score", "p_value", "abnormal", "windows")
        when = "spells_s" if recorded else "samples"

        def known(value: Any) -> Any:
            return None if value != value else value  # NaN

        def rows(standings: "tuple[Standing, ...]") -> list[dict[str, Any]]:
            return [{name: known(getattr(each, name)) for name in names} for each in standings]

        rankings = [
            {"by": each.name, "area": each.area, "called": known(each.called), "individuals": rows(each.individuals)}
            for each in found.rankings
        ]
        individuals = zip(rows(found.individuals), timed, strict=True)
        content = {
            "rule": ALIKE,
            "by": found.rankings[0].name,
            "false_alarms": found.false_alarms,
            "promised": found.level,
            "steps": steps,
            "normal": {"recordings": found.recordings, "individuals": found.normal},
            "remarks": list(found.remarks),
            "individuals": [{**row, when: [list(spell) for spell in each.spells]} for row, each in individuals],
            "rankings": rankings,
        }
        print(json.dumps(content, indent=2))
    else:
        print_standings(plain_console(), found, timed, seconds=recorded, steps=steps)
    if out is not None and isinstance(motion, RecordedMotion):
        _write(out, motion, timed, found, as_json)


def _show_votes(detector: "Detector", motion: "Motion | RecordedMotion", out: Path | None, as_json: bool) -> None:
    """Print verdicts by votes; of a recording with times, and write table and picture where that was asked for."""
    from turing_learning.detection import RecordedMotion

    from ._tables import plain_console, print_timeline, print_verdicts

    head = {"rule": detector.rule, "false_alarms": detector.false_alarms, "classifiers": len(detector.genomes)}
    if not isinstance(motion, RecordedMotion):
        verdicts = detector.verdicts(motion)
        if as_json:
            head |= {"samples": motion.samples.shape[1]}
            head |= {"false_alarms": None} if detector.rule == "unanimous" else {}
            print(json.dumps({**head, "individuals": [asdict(verdict) for verdict in verdicts]}, indent=2))
        else:
            print_verdicts(plain_console(), detector, motion, verdicts)
        return
    timed = detector.timeline(motion)
    if as_json:
        names = ("individual", "windows", "score", "strength", "threshold", "abnormal")
        rows = [
            {**{name: getattr(each, name) for name in names}, "spells_s": [list(spell) for spell in each.spells]}
            for each in timed
        ]
        print(json.dumps({**head, "steps": detector.steps, "individuals": rows}, indent=2))
    else:
        print_timeline(plain_console(), detector, timed)
    if out is not None:
        _write(out, motion, timed, None, as_json)


def _write(
    out: Path, motion: "RecordedMotion", verdicts: "Sequence[TimedVerdict]", found: "Detection | None", as_json: bool
) -> None:
    """Write table, picture and page, or, if there is no room for all of it, no new file: the same command may be repeated."""
    from turing_learning._files import write_atomically
    from turing_learning.detection._present import detection_page, timeline_of, window_table
    from turing_learning.figures import save_figure
    from turing_learning.report import write_page
    from turing_learning.results import RunStorageError
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
                with suppress(OSError):
                    path.unlink(missing_ok=True)
            raise
    for path in _written(out)[: -1 if found is None else None]:
        print(path, file=sys.stderr if as_json else sys.stdout)
