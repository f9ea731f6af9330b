"""The command that says which individuals behave abnormally."""

import json
import os
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

import turing_learning as tl
from turing_learning.errors import RefusedError, refuse, refusing_as, require

from ._open import opened
from ._options import Files, Integer, Real, Tracks, option_of, titled
from ._tables import plain_console, print_table

if TYPE_CHECKING:
    Motion = tl.detection.Motion | tl.detection.RecordedMotion

MOST_SPELLS = 3
"""Spells of abnormal motion in a cell of the table."""
SAMPLES_PER_INDIVIDUAL = 10
"""Of each simulated individual."""
JUDGED_ALIKE = "judged-alike"
"""The rule that ranks individuals; all others vote."""
USUAL_OPTIONS = ("fps", "every", "bridge", "scale", "y_axis")
"""What files and options do not state is as for the recording of the run."""
# What is written beside each other: a table, a picture twice, a page.
_WRITTEN = (".csv", ".png", ".svg", ".html")


def detect(
    run: Path,
    motion: Path | None = None,
    /,
    *,
    simulate: Integer | None = None,
    samples: Integer | None = None,
    genuine: Files = None,
    abnormal: Files = None,
    rule: str = JUDGED_ALIKE,
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
      turing-learning detect runs/fish trial.txt --genuine monday.txt --genuine tuesday.txt --out trial.csv
      turing-learning detect runs/mine --simulate 2

    :param run: A run folder with a full history.
    :param motion: Motion of individuals: a .npy, .npz or .csv file, or a file of a tracker.
    :param simulate: Instead of a file: a swarm with N individuals that do something else.
    :param samples: Samples of each simulated individual; 10 by default.
    :param genuine: Motion of normal individuals, a file or several: each is judged by what was learned from the others.
        By default simulated, stored by the run, or, without a guarantee about false alarms,
        the recordings that it has learned from.
    :param abnormal: Motion of individuals that are known to be abnormal, a file or several;
        by default some are planted or simulated.
    :param rule: judged-alike, or one of the rules by votes: fittest, unanimous (the paper's), or discriminant.
    :param false_alarms: Share of normal individuals that may be called abnormal; 0.01 by default.
    :param seed: Seed of all that is simulated; 0 by default.
    :param out: Of a recording: table of all windows (.csv); beside it a picture, and with judged-alike a page.
    :param force: Replace files of `--out` that exist.
    :param as_json: Print JSON.
    """
    got = "neither" if motion is None else "both"
    require((motion is None) != (simulate is None), "MOTION", "be given, or --simulate", got)
    if samples is not None and simulate is None:
        refuse("samples", "be left out beside a file", str(samples), place="--samples")
    learned_recording = tl.runs.RunFolder(run).recording() or {}
    # What files do not state is as it was when the run read its recording; None of a run on none.
    usual = None
    if learned_recording:
        options = learned_recording.get("options", {})
        usual = {name: options[name] for name in USUAL_OPTIONS if name in options}
    if motion is None:
        tracks.refuse_beside("be left out where there is no recording", out=out)
    elif not _is_recording(motion, tracks, usual):
        remedy = f"{motion} holds samples of the run's signals, in their units."
        tracks.refuse_beside("be left out where there is no recording", remedy, out=out)
    if out is not None:
        _refuse_out(out, force)
    result = opened(run)
    # Whatever could be refused without reading the run was refused above
    learned = tl.detection.run_classifiers(result)
    judged: Motion
    if motion is None:
        judged = _simulated(
            learned, simulate or 0, SAMPLES_PER_INDIVIDUAL if samples is None else samples, seed
        )
    else:
        judged = _read(motion, "motion", tracks, learned, usual)
    files = {"genuine": genuine or [], "abnormal": abnormal or []}
    arguments: dict[str, Any] = {"false_alarms": false_alarms, "seed": seed}
    detection: tl.detection.Detection | None = None
    if rule == JUDGED_ALIKE:
        for name, paths in files.items():
            arguments[name] = [_read(path, f"--{name}", tracks, learned, usual) for path in paths]
        is_recorded = motion is not None and isinstance(judged, tl.detection.RecordedMotion)
        if is_recorded and learned_recording and not genuine:
            assert motion is not None
            arguments["learned"] = _learned_from(
                learned_recording, learned, tracks.smooth, but=motion
            )
        detection = tl.detection.detect(learned, judged, **arguments)
        summary = _ranked(detection, judged, learned.steps)
    else:
        for name, paths in files.items():
            once = f"be given once with the rule {rule}"
            require(len(paths) <= 1, f"--{name}", once, len(paths), f"Take --rule {JUDGED_ALIKE}.")
            for path in paths:
                arguments[name] = _samples(path, f"--{name}", learned).samples
        detector = tl.detection.Detector.from_run(result, rule=rule, **arguments)
        summary = _voted(detector, judged)
    if isinstance(judged, tl.detection.RecordedMotion):
        _add_usual_options(summary, tracks, usual or {})
    if as_json:
        print(json.dumps(summary.content, indent=2))
    else:
        console = plain_console()
        print_table(console, summary.headings, summary.rows)
        for line in summary.lines:
            console.print(line)
    if out is not None and isinstance(judged, tl.detection.RecordedMotion):
        _write(out, judged, summary.timed, detection, as_json)


def _refuse_out(out: Path, force: bool) -> None:
    """Reject a table that cannot be written, or whose pictures and page cannot."""
    from turing_learning.targets import refuse_target

    refuse_target(out, name="out", suffixes=(".csv",), force=force)
    for path in map(out.with_suffix, _WRITTEN[1:]):
        refuse_target(path, name="out", suffixes=(path.suffix,), force=force)
    fits = os.access(out.absolute().parent, os.W_OK)
    require(fits, "out", "be in a folder that can be written", str(out), "Choose another place.")


def _simulated(
    learned: "tl.detection.RunClassifiers", count: int, samples: int, seed: int
) -> "tl.detection.Motion":
    """Return the motion of a simulated swarm: its agents, then `count` individuals that do something else."""
    scenario = learned.simulated_scenario()
    planted = tl.detection.plant_abnormal(scenario, count, samples=samples, seed=seed)

    def by_name_and_number(k: int) -> tuple[str, int]:
        name, _, number = planted.individuals[k].partition(" ")
        return name, int(number)

    order = sorted(range(len(planted.individuals)), key=by_name_and_number)
    individuals = tuple(planted.individuals[k] for k in order)
    return tl.detection.Motion(individuals, planted.samples[order])


def _add_usual_options(summary: "_Summary", tracks: Tracks, usual: Mapping[str, Any]) -> None:
    """Say which options were taken from the recording of the run."""
    taken = dict(usual)
    for name in tracks.given:
        taken.pop(name, None)
    # with a frame rate of its own, a file has its own steps
    if "fps" in tracks.given:
        taken.pop("every", None)
    if taken:
        summary.content["as_in_the_run"] = taken
        words = " ".join(f"{option_of(name)} {value}" for name, value in taken.items())
        summary.lines.append(f"What files do not state is as in the recording of the run: {words}")


def _learned_from(
    recorded: Mapping[str, Any],
    learned: "tl.detection.RunClassifiers",
    smooth: int | None,
    but: Path,
) -> "list[tl.detection.RecordedMotion]":
    """Return the recordings that a run has learned from, but for one that is judged.

    There are none if one is gone or has changed.
    """
    from turing_learning.families import RecordedSystem, read_recording

    motion = []
    with suppress(RefusedError):
        options = RecordedSystem.remembered(recorded).options
        paths = [path for path in options["trajectories"] if path.resolve() != but.resolve()]
        recordings = [read_recording(path, "trajectories", options) for path in paths]
        for recording in recordings:
            motion.append(tl.detection.recorded_motion(recording, learned, smooth_frames=smooth))
        return motion
    return []


def _is_recording(path: Path, tracks: Tracks, usual: Mapping[str, Any] | None) -> bool:
    """Return whether a tracker wrote a file; other files hold samples.

    Of a run on a recording (`usual` is not None) all are that do not begin as samples do.
    """
    from turing_learning.detection import MOTION_SUFFIXES, holds_motion

    return path.suffix.lower() not in MOTION_SUFFIXES or (
        bool(tracks.given or usual is not None) and not holds_motion(path)
    )


def _read(
    path: Path,
    option: str,
    tracks: Tracks,
    learned: "tl.detection.RunClassifiers",
    usual: Mapping[str, Any] | None,
) -> "Motion":
    """Return the motion in a file: windows of a recording that fits the run, or samples."""
    if not _is_recording(path, tracks, usual):
        return _samples(path, option, learned)
    recording = tracks.read(path, option, usual or {})
    recording.announce()
    with refusing_as(RefusedError, place=str(path)):
        motion = tl.detection.recorded_motion(recording, learned, smooth_frames=tracks.smooth)
    _tell_left_out(motion, learned.steps, path)
    return motion


def _tell_left_out(motion: "tl.detection.RecordedMotion", steps: int, path: Path) -> None:
    """Say on stderr which individuals are never there for a whole window."""
    individuals = zip(motion.individuals, motion.samples, strict=True)
    left_out = [name for name, samples in individuals if not len(samples)]
    if left_out:
        who = f"{len(left_out)} of {len(motion.individuals)} individuals"
        why = f"without a window of {steps} steps and are left out"
        print(f"{path}: {who} are {why}: {', '.join(left_out)}", file=sys.stderr)


def _samples(
    path: Path, option: str, learned: "tl.detection.RunClassifiers"
) -> "tl.detection.Motion":
    """Return the samples in a file; what is rejected names the option, and what to do with a recording."""
    from turing_learning.detection import holds_motion

    try:
        return tl.detection.load_motion(
            path, steps=learned.steps, signals=learned.signals, names=learned.names
        )
    except RefusedError as error:
        tracked = path.is_file() and not holds_motion(path)
        remedy = ""
        if tracked:
            remedy = " If a tracker wrote it, give --fps and --pixels-per-cm, or --format where it states them."
        raise RefusedError(f"{error}{remedy}".replace("`motion`", f"`{option}`")) from error


@dataclass
class _Summary:
    """What is printed of a detection: a table and lines below it, or JSON; and when each individual is abnormal."""

    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    lines: list[str]
    content: dict[str, Any]
    timed: "Sequence[tl.detection.TimedVerdict]" = ()


def _ranked(detection: "tl.detection.Detection", motion: "Motion", steps: int) -> _Summary:
    """Say how unlike normal ones individuals are, the most unlike first, and what can be promised."""
    from turing_learning.detection.present import standings, timed_verdicts

    timed = timed_verdicts(detection, motion)
    in_seconds = isinstance(motion, tl.detection.RecordedMotion)
    columns = ("individual", "rank", "score", "p_value", "abnormal", "windows")
    individuals = []
    for individual, verdict in zip(detection.individuals, timed, strict=True):
        when = "spells_s" if in_seconds else "samples"
        individuals.append(_json_row(individual, columns) | {when: verdict.spells})
    rankings = []
    firsts = []
    for ranking in detection.rankings:
        row = {"by": ranking.name} | _json_row(ranking, ("area", "called"))
        row["individuals"] = [_json_row(individual, columns) for individual in ranking.individuals]
        rankings.append(row)
    for ranking in detection.rankings[1:]:
        for individual in ranking.individuals:
            if individual.rank == 1:
                firsts.append(f"{individual.individual} ({ranking.name})")
    content = {
        "rule": JUDGED_ALIKE,
        "by": detection.rankings[0].name,
        "false_alarms": detection.false_alarms,
        "promised": detection.level,
        "steps": steps,
        "normal": {"recordings": detection.recordings, "individuals": detection.normal},
        "remarks": detection.remarks,
        "individuals": individuals,
        "rankings": rankings,
    }
    abnormal = sum(bool(individual.abnormal) for individual in detection.individuals)
    judged = sum(bool(individual.windows) for individual in detection.individuals)
    outcome = "abnormal"
    if detection.verdict == "stands out":
        outcome = "stands out" if abnormal == 1 else "stand out"
    line = f"{abnormal} of {judged} {outcome}, by windows of {steps} steps; "
    line += f"ranked by {detection.rankings[0].name}"
    if firsts:
        line += f"; the other ways put first: {', '.join(firsts)}"
    lines = [line, *detection.remarks]
    headings, rows = standings(detection, timed, seconds=in_seconds)
    return _Summary(headings, rows, lines, content, timed)


def _voted(detector: "tl.detection.Detector", motion: "Motion") -> _Summary:
    """Say which individuals are abnormal by votes; of a recording also when."""
    classifiers = len(detector.genomes)
    content: dict[str, Any] = {
        "rule": detector.rule,
        "false_alarms": detector.false_alarms,
        "classifiers": classifiers,
    }
    by = f"of {detector.steps} steps; rule {detector.rule}, "
    by += tl.report.counted(classifiers, "classifier")
    if isinstance(motion, tl.detection.RecordedMotion):
        return _voted_over_time(detector, motion, content, by)
    verdicts = detector.verdicts(motion)
    rows = []
    for verdict in verdicts:
        row = (
            verdict.individual,
            f"{100 * verdict.genuine_share:.0f} %",
            f"{verdict.score:.3f}",
            f"{verdict.p_value:.2g}",
            "abnormal" if verdict.abnormal else "normal",
            "-" if verdict.since is None else str(verdict.since),
        )
        rows.append(row)
    samples = motion.samples.shape[1]
    content |= {"samples": samples, "individuals": list(map(asdict, verdicts))}
    limit = f"p-value up to {detector.false_alarms:g}"
    if detector.rule == "unanimous":
        content["false_alarms"] = None
        limit = "all samples judged counterfeit"
    abnormal = sum(verdict.abnormal for verdict in verdicts)
    line = f"{abnormal} of {len(verdicts)} abnormal, by {tl.report.counted(samples, 'sample')} each {by}, {limit}"
    headings = ["individual", "judged genuine", "score", "p-value", "verdict", "since sample"]
    return _Summary(headings, rows, [line], content)


def _voted_over_time(
    detector: "tl.detection.Detector",
    motion: "tl.detection.RecordedMotion",
    content: dict[str, Any],
    by: str,
) -> _Summary:
    """Say which individuals of a recording are abnormal, and when."""
    verdicts = detector.timeline(motion)
    rows = list(map(_timed_row, verdicts))
    columns = ("individual", "windows", "score", "strength", "threshold", "abnormal")
    individuals = []
    for verdict in verdicts:
        individuals.append(_json_row(verdict, columns) | {"spells_s": verdict.spells})
    content |= {"steps": detector.steps, "individuals": individuals}
    abnormal = sum(verdict.abnormal for verdict in verdicts)
    line = f"{abnormal} of {len(verdicts)} abnormal, by windows {by}"
    headings = ["individual", "windows", "score", "evidence", "threshold", "verdict", "when (s)"]
    return _Summary(headings, rows, [line], content, verdicts)


def _timed_row(verdict: "tl.detection.TimedVerdict") -> tuple[str, ...]:
    """Return the cells of an individual in the table of a recording."""
    cells = ("-", "-", "-", "no window")
    if verdict.windows:
        cells = (
            f"{verdict.score:.3f}",
            f"{verdict.strength:.2f}",
            f"{verdict.threshold:.2f}",
            "abnormal" if verdict.abnormal else "normal",
        )
    spells = [f"{begin:.1f} to {stop:.1f}" for begin, stop in verdict.spells[:MOST_SPELLS]]
    unshown = len(verdict.spells) - MOST_SPELLS
    if unshown > 0:
        spells.append(f"{unshown} more")
    return (verdict.individual, str(verdict.windows), *cells, ", ".join(spells) or "-")


def _json_row(judged: Any, columns: Sequence[str]) -> dict[str, Any]:
    """Return what JSON holds of an individual, or a ranking: null for NaN."""
    row = {}
    for name in columns:
        value = getattr(judged, name)
        row[name] = None if value != value else value
    return row


def _write(
    out: Path,
    motion: "tl.detection.RecordedMotion",
    verdicts: "Sequence[tl.detection.TimedVerdict]",
    detection: "tl.detection.Detection | None",
    as_json: bool,
) -> None:
    """Write table, picture and page, or, if there is no room for all of it, no new file: the same command may be repeated."""
    from turing_learning._files import write_atomically
    from turing_learning.detection.present import detection_page, timeline_of, window_table
    from turing_learning.store import os_errors_as

    name = out.stem
    if motion.recording:
        name = titled(Path(motion.recording.source))
    flagged = "abnormal"
    unjudged: tuple[str, ...] = ()
    if detection is not None:
        flagged = detection.verdict
        unjudged = detection.too_short
    figure = timeline_of(
        motion, verdicts, votes=detection is None, flagged=flagged, unjudged=unjudged
    )
    paths = list(map(out.with_suffix, _WRITTEN if detection else _WRITTEN[:-1]))
    new_paths = [path for path in paths if not path.exists()]
    trouble = f"`out` must be a file that can be written; could not write to {out}"
    remedy = "Make room, or choose another place, and give the command again."
    with os_errors_as(tl.runs.RunStorageError, trouble, remedy):
        try:
            write_atomically(out, window_table(verdicts).encode())
            tl.figures.save_figure(figure, out.parent, out.stem)
            if detection is not None:
                tl.report.write_page(
                    detection_page(detection, motion, verdicts, figure, name), paths[-1]
                )
        except OSError:
            for path in new_paths:
                with suppress(OSError):
                    path.unlink(missing_ok=True)
            raise
    for path in paths:
        print(path, file=sys.stderr if as_json else sys.stdout)
