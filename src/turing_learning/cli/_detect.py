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

from ._options import Files, Integer, Real, Tracks, titled
from ._runs import opened
from ._tables import plain_console, print_table

if TYPE_CHECKING:
    Motion = tl.detection.Motion | tl.detection.RecordedMotion

MOST_SPELLS = 3  # in a cell
SAMPLES = 10
ALIKE = "judged-alike"
_WRITTEN = (".csv", ".png", ".svg", ".html")  # a table, a picture twice, a page


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
      turing-learning detect runs/fish trial.txt --genuine monday.txt --genuine tuesday.txt --out trial.csv
      turing-learning detect runs/mine --simulate 2

    :param run: A run folder with a full history.
    :param motion: Motion of individuals: a .npy, .npz or .csv file, or a file of a tracker.
    :param simulate: Instead of a file: a swarm with N individuals that do something else.
    :param samples: Samples of each simulated individual; 10 by default.
    :param genuine: Motion of normal individuals, a file or several: each is judged by what was learned from the others.
        By default simulated, stored by the run, or the recordings that it has learned from, which promise nothing.
    :param abnormal: Motion of individuals that are known to be abnormal, a file or several;
        by default some are planted or simulated.
    :param rule: judged-alike, or one of the rules by votes: fittest, unanimous (the paper's), or discriminant.
    :param false_alarms: Share of normal individuals that may be called abnormal; 0.01 by default.
    :param seed: Seed of all that is simulated; 0 by default.
    :param out: Of a recording: table of all windows (.csv); beside it a picture, and with judged-alike a page.
    :param force: Replace files of `--out` that exist.
    :param as_json: Print JSON.
    """
    from turing_learning.targets import refuse_target

    got = "neither" if motion is None else "both"
    require((motion is None) != (simulate is None), "MOTION", "be given, or --simulate", got)
    if samples is not None and simulate is None:
        refuse("samples", "be left out beside a file", str(samples), place="--samples")
    stored = tl.results.RunFolder(run).manifest().get("recording")
    recorded = (
        stored if isinstance(stored, Mapping) else {}
    )  # what the run has learned from, and how it was read
    options = recorded.get("options", {})
    usual = {name: options[name] for name in ("fps", "every", "scale", "y_axis") if name in options}
    if motion is None or not _is_recording(motion, tracks, usual):
        remedy = (
            ""
            if motion is None
            else f"{motion} holds samples of the run's signals, in their units."
        )
        tracks.refuse_beside("be left out where there is no recording", remedy, out=out)
    if out is not None:
        refuse_target(out, name="out", suffixes=(".csv",), force=force)
        for path in map(out.with_suffix, _WRITTEN[1:]):
            refuse_target(path, name="out", suffixes=(path.suffix,), force=force)
        writable = os.access(out.absolute().parent, os.W_OK)
        require(
            writable, "out", "be in a folder that can be written", str(out), "Choose another place."
        )
    result = opened(run)
    learned = tl.detection.run_classifiers(result)
    given: Motion
    if motion is None:  # of a simulated swarm: its agents, then those that do something else
        count, each = simulate or 0, SAMPLES if samples is None else samples
        planted = tl.detection.plant_abnormal(
            learned.simulated_scenario(), count, samples=each, seed=seed
        )
        numbered = [
            (kind, int(number))
            for kind, _, number in (name.partition(" ") for name in planted.individuals)
        ]
        order = sorted(range(len(numbered)), key=numbered.__getitem__)
        given = tl.detection.Motion(
            tuple(planted.individuals[k] for k in order), planted.samples[order]
        )
    else:
        given = _read(motion, "motion", tracks, learned, usual)
    files = {"genuine": genuine or [], "abnormal": abnormal or []}
    chosen: dict[str, Any] = {"false_alarms": false_alarms, "seed": seed}
    found: tl.detection.Detection | None = None
    if rule == ALIKE:
        for name, paths in files.items():
            chosen[name] = [_read(path, f"--{name}", tracks, learned, usual) for path in paths]
        if (
            motion is not None
            and recorded
            and not genuine
            and isinstance(given, tl.detection.RecordedMotion)
        ):
            chosen["learned"] = _learned_from(recorded, learned, tracks.smooth, but=motion)
        found = tl.detection.detect(learned, given, **chosen)
        said = _ranked(found, given, learned.steps)
    else:
        for name, paths in files.items():
            alone, remedy = f"be given once with the rule {rule}", f"Take --rule {ALIKE}."
            require(len(paths) <= 1, f"--{name}", alone, len(paths), remedy)
            for path in paths:
                chosen[name] = _samples(path, f"--{name}", learned).samples
        detector = tl.detection.Detector.from_run(result, rule=rule, **chosen)
        said = _voted(detector, given)
    chosen_rate = ("every",) if "fps" in tracks.given else ()
    taken = {
        name: value for name, value in usual.items() if name not in (*tracks.given, *chosen_rate)
    }
    if taken and isinstance(given, tl.detection.RecordedMotion):
        said.content["as_in_the_run"] = taken
        shown = " ".join(f"--{name.replace('_', '-')} {value}" for name, value in taken.items())
        said.lines.append(f"What files do not state is as in the recording of the run: {shown}")
    if as_json:
        print(json.dumps(said.content, indent=2))
    else:
        console = plain_console()
        print_table(console, said.headings, said.rows)
        for line in said.lines:
            console.print(line)
    if out is not None and isinstance(given, tl.detection.RecordedMotion):
        _write(out, given, said.timed, found, as_json)


def _learned_from(
    recorded: Mapping[str, Any],
    learned: "tl.detection.RunClassifiers",
    smooth: int | None,
    but: Path,
) -> "list[tl.detection.RecordedMotion]":
    """Return the recordings that a run has learned from, but for one that is judged; none if one is gone or has changed."""
    from turing_learning.families import RecordedSystem, read_recording

    with suppress(RefusedError):
        options = RecordedSystem.remembered(recorded).options
        paths = [path for path in options["trajectories"] if path.resolve() != but.resolve()]
        recordings = [read_recording(path, "trajectories", options) for path in paths]
        return [
            tl.detection.recorded_motion(each, learned, smooth_frames=smooth) for each in recordings
        ]
    return []


def _is_recording(path: Path, tracks: Tracks, usual: Mapping[str, Any]) -> bool:
    """Return whether a tracker wrote a file; other files hold samples."""
    from turing_learning.detection import MOTION_SUFFIXES, holds_motion

    return path.suffix.lower() not in MOTION_SUFFIXES or (
        bool(tracks.given or usual) and not holds_motion(path)
    )


def _read(
    path: Path,
    option: str,
    tracks: Tracks,
    learned: "tl.detection.RunClassifiers",
    usual: Mapping[str, Any],
) -> "Motion":
    """Return the motion in a file: windows of a recording that fits the run, or samples."""
    if not _is_recording(path, tracks, usual):
        return _samples(path, option, learned)
    recording = tracks.read(path, option, usual)
    recording.announce()
    with refusing_as(RefusedError, place=str(path)):
        return tl.detection.recorded_motion(recording, learned, smooth_frames=tracks.smooth)


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
        remedy = " If a tracker wrote it, give --fps and --scale." if tracked else ""
        raise RefusedError(f"{error}{remedy}".replace("`motion`", f"`{option}`")) from error


@dataclass
class _Said:
    """What is printed of a detection: a table and lines below it, or JSON; and when each individual is abnormal."""

    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    lines: list[str]
    content: dict[str, Any]
    timed: "Sequence[tl.detection.TimedVerdict]" = ()


def _ranked(found: "tl.detection.Detection", motion: "Motion", steps: int) -> _Said:
    """Say how unlike normal ones individuals are, the most unlike first, and what can be promised."""
    from turing_learning.detection.present import standings, timed_verdicts

    timed, seconds = timed_verdicts(found, motion), isinstance(motion, tl.detection.RecordedMotion)
    called = sum(bool(each.abnormal) for each in found.individuals)
    others = [(ranking, each) for ranking in found.rankings[1:] for each in ranking.individuals]
    ways = [f"{each.individual} ({ranking.name})" for ranking, each in others if each.rank == 1]
    by = (
        f"ranked by {found.rankings[0].name}"
        + f"; the other ways put first: {', '.join(ways)}" * bool(ways)
    )
    names = ("individual", "rank", "score", "p_value", "abnormal", "windows")
    both, when = zip(found.individuals, timed, strict=True), "spells_s" if seconds else "samples"
    content = {
        "rule": ALIKE,
        "by": found.rankings[0].name,
        "false_alarms": found.false_alarms,
        "promised": found.level,
        "steps": steps,
        "normal": {"recordings": found.recordings, "individuals": found.normal},
        "remarks": found.remarks,
        "individuals": [_row(each, names) | {when: one.spells} for each, one in both],
        "rankings": [
            {"by": ranking.name}
            | _row(ranking, ("area", "called"))
            | {"individuals": [_row(each, names) for each in ranking.individuals]}
            for ranking in found.rankings
        ],
    }
    lines = [
        f"{called} of {len(timed)} abnormal, by windows of {steps} steps; {by}",
        *found.remarks,
    ]
    return _Said(*standings(found, timed, seconds=seconds), lines, content, timed)


def _voted(detector: "tl.detection.Detector", motion: "Motion") -> _Said:
    """Say which individuals are abnormal by votes; of a recording also when."""
    timed: Sequence[tl.detection.TimedVerdict] = ()
    rows, counted, classifiers = list[Sequence[str]](), tl.report.counted, len(detector.genomes)
    content: dict[str, Any] = {
        "rule": detector.rule,
        "false_alarms": detector.false_alarms,
        "classifiers": classifiers,
    }
    by = f"of {detector.steps} steps; rule {detector.rule}, {counted(classifiers, 'classifier')}"
    if isinstance(motion, tl.detection.RecordedMotion):
        headings = [
            "individual",
            "windows",
            "score",
            "evidence",
            "threshold",
            "verdict",
            "when (s)",
        ]
        timed = detector.timeline(motion)
        for verdict in timed:
            numbers = (
                f"{verdict.score:.3f}",
                f"{verdict.strength:.2f}",
                f"{verdict.threshold:.2f}",
            )
            cells = (
                (*numbers, "abnormal" if verdict.abnormal else "normal")
                if verdict.windows
                else (*"---", "no window")
            )
            spells = [f"{begin:.1f} to {end:.1f}" for begin, end in verdict.spells[:MOST_SPELLS]]
            spells += [f"{more} more"] if (more := len(verdict.spells) - MOST_SPELLS) > 0 else []
            rows.append(
                (verdict.individual, str(verdict.windows), *cells, ", ".join(spells) or "-")
            )
        names = ("individual", "windows", "score", "strength", "threshold", "abnormal")
        individuals = [_row(each, names) | {"spells_s": each.spells} for each in timed]
        content |= {"steps": detector.steps, "individuals": individuals}
        abnormal, by = [each.abnormal for each in timed], f"windows {by}"
    else:
        headings = ["individual", "judged genuine", "score", "p-value", "verdict", "since sample"]
        verdicts, count, votes = (
            detector.verdicts(motion),
            motion.samples.shape[1],
            detector.rule == "unanimous",
        )
        for each in verdicts:
            cells = (
                f"{100 * each.genuine_share:.0f} %",
                f"{each.score:.3f}",
                f"{each.p_value:.2g}",
            )
            since = "-" if each.since is None else str(each.since)
            rows.append((each.individual, *cells, "abnormal" if each.abnormal else "normal", since))
        content |= {"samples": count, "individuals": [asdict(each) for each in verdicts]}
        content |= {"false_alarms": None} if votes else {}
        limit = (
            "all samples judged counterfeit"
            if votes
            else f"p-value up to {detector.false_alarms:g}"
        )
        abnormal, by = (
            [each.abnormal for each in verdicts],
            f"{counted(count, 'sample')} each {by}, {limit}",
        )
    line = f"{sum(abnormal)} of {len(abnormal)} abnormal, by {by}"
    return _Said(headings, rows, [line], content, timed)


def _row(each: Any, names: Sequence[str]) -> dict[str, Any]:
    """Return what JSON holds of an individual: null for NaN."""
    found = {name: getattr(each, name) for name in names}
    return {name: None if value != value else value for name, value in found.items()}


def _write(
    out: Path,
    motion: "tl.detection.RecordedMotion",
    verdicts: "Sequence[tl.detection.TimedVerdict]",
    found: "tl.detection.Detection | None",
    as_json: bool,
) -> None:
    """Write table, picture and page, or, if there is no room for all of it, no new file: the same command may be repeated."""
    from turing_learning._files import write_atomically
    from turing_learning.detection.present import detection_page, timeline_of, window_table
    from turing_learning.store import os_errors_as

    name = titled(Path(motion.recording.source)) if motion.recording else out.stem
    figure = timeline_of(motion, verdicts, votes=found is None)
    paths = [out.with_suffix(suffix) for suffix in (_WRITTEN if found else _WRITTEN[:-1])]
    fresh = [path for path in paths if not path.exists()]
    what = f"`out` must be a file that can be written; could not write to {out}"
    remedy = "Make room, or choose another place, and give the command again."
    with os_errors_as(tl.results.RunStorageError, what, remedy):
        try:
            write_atomically(out, window_table(verdicts).encode())
            tl.figures.save_figure(figure, out.parent, out.stem)
            if found is not None:
                tl.report.write_page(
                    detection_page(found, motion, verdicts, figure, name), paths[-1]
                )
        except OSError:
            for path in fresh:
                with suppress(OSError):
                    path.unlink(missing_ok=True)
            raise
    for path in paths:
        print(path, file=sys.stderr if as_json else sys.stdout)
