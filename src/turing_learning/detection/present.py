"""A detection as rows, a picture and a page: hand the numbers to the rooms that draw."""

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np

from turing_learning.figures import Picture, timeline_figure
from turing_learning.figures.one_run import paths_figure
from turing_learning.report import Listing, Report, report_page, shown

from ._chance import TimedVerdict
from ._motion import Motion, RecordedMotion
from ._ranking import Detection, Standing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_FRAMES = 3000
"""Frames of a path in a page, at most: more make the page large, and no clearer."""
EXTREMES = 2
"""Individuals whose paths are drawn, from either end of the ranking."""


def timed_verdicts(detection: Detection, motion: Motion | RecordedMotion) -> list[TimedVerdict]:
    """Return each individual's verdict with the time that it rests on: in s, or counted in samples."""
    verdicts = []
    for k, standing in enumerate(detection.individuals):
        if isinstance(motion, RecordedMotion):
            times = motion.times[k]
        else:
            times = np.arange(len(standing.shares))[:, None] + [1, 1]
        flagged = np.flatnonzero(standing.flagged)
        spells: tuple[tuple[float, float], ...] = ()
        if len(flagged):
            spells = ((float(times[flagged[0], 0]), float(times[flagged[-1], 1])),)
        verdicts.append(
            TimedVerdict(
                individual=standing.individual,
                windows=standing.windows,
                score=standing.score,
                strength=standing.score,
                threshold=float("nan"),
                abnormal=bool(standing.abnormal),
                spells=spells,
                times=times,
                scores=standing.shares,
                flagged=standing.flagged,
            )
        )
    return verdicts


def standings(
    detection: Detection, timed: Sequence[TimedVerdict], *, seconds: bool
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return headings and rows of a table, the most unlike individual first.

    Individuals without windows are left out, and so are empty columns.
    """
    when = "when (s)" if seconds else "since sample"
    headings = ("individual", "rank", "windows", "score", "p-value", "verdict", when)
    rows: list[tuple[str, ...]] = []
    judged = [k for k in range(len(timed)) if timed[k].windows]
    for k in _by_rank(detection, judged):
        standing = detection.individuals[k]
        rows.append(
            (
                standing.individual,
                str(standing.rank),
                str(standing.windows),
                shown(standing.score, "{:.2f}".format),
                shown(standing.p_value, "{:.2g}".format),
                _verdict(detection, standing),
                _since(timed[k], seconds),
            )
        )
    columns = []
    for heading, *cells in zip(headings, *rows, strict=True):
        if set(cells) != {"-"}:
            columns.append((heading, *cells))
    filled, *filled_rows = zip(*columns, strict=True)
    return filled, filled_rows


def _by_rank(detection: Detection, individuals: Sequence[int]) -> list[int]:
    return sorted(individuals, key=lambda k: detection.individuals[k].rank)


def _verdict(detection: Detection, standing: Standing) -> str:
    if detection.level is None:
        return "-"
    if standing.abnormal is None:
        return "too short to judge"
    return detection.verdict if standing.abnormal else "normal"


def _since(verdict: TimedVerdict, seconds: bool) -> str:
    if not verdict.spells:
        return "-"
    begin, stop = verdict.spells[0]
    if seconds:
        return f"{begin:.1f} to {stop:.1f}"
    return f"{begin:g}"


def timeline_of(
    motion: RecordedMotion,
    verdicts: Sequence[TimedVerdict],
    *,
    votes: bool,
    flagged: str = "abnormal",
    unjudged: Collection[str] = (),
) -> "Figure":
    """Draw scores over time: shares of votes, from 0 to 1, or of a distance, relative to the largest.

    Flagged windows are called so in the legend; who is unjudged is gray.
    """
    judged = [verdict for verdict in verdicts if verdict.windows]
    scores = [verdict.scores for verdict in judged]
    if not votes:
        # Distances have no limit, and may be negative; votes are shares already.
        largest = max(1e-12, float(np.concatenate(scores).max()))
        scores = [(individual_scores / largest).clip(0, 1) for individual_scores in scores]
    return timeline_figure(
        [verdict.individual for verdict in judged],
        [verdict.times for verdict in judged],
        scores,
        [verdict.flagged for verdict in judged],
        limit=motion.duration_s,
        flagged=flagged,
        unjudged=unjudged,
    )


def window_table(verdicts: Sequence[TimedVerdict]) -> str:
    """Return a row for each window of each individual, as CSV."""
    import pandas as pd

    rows = []
    for verdict in verdicts:
        windows = zip(verdict.times, verdict.scores, verdict.flagged, strict=True)
        for number, ((begin, stop), score, flagged) in enumerate(windows, 1):
            times = (f"{begin:.6g}", f"{stop:.6g}")
            abnormal = int(verdict.abnormal)
            rows.append((verdict.individual, abnormal, number, *times, score, int(flagged)))
    columns = ("individual", "individual_abnormal", "window", "begin_s", "end_s", "score")
    table = pd.DataFrame(rows, columns=[*columns, "abnormal"])
    return str(table.to_csv(index=False, lineterminator="\n"))


def detection_page(
    detection: Detection,
    motion: RecordedMotion,
    timed: Sequence[TimedVerdict],
    timeline: "Figure",
    name: str,
) -> str:
    """Return the page of a detection in the recording of that name: ranking, scores over time, and some paths."""
    by = f"By {detection.rankings[0].name}; the first is the most unlike normal individuals."
    remarks = " ".join(detection.remarks)
    if detection.level is None:
        summary = "Individuals are ranked; nobody is called abnormal."
        note = f"{by} {remarks}"
    else:
        abnormal = sum(bool(standing.abnormal) for standing in detection.individuals)
        judged = sum(bool(standing.windows) for standing in detection.individuals)
        summary = f"{abnormal} of {judged} individuals: {detection.verdict}."
        note = f"{by} {detection.verdict.capitalize()}: a p-value of at most {detection.level:.2g}. {remarks}"
    table = Listing("ranking", "Ranking", *standings(detection, timed, seconds=True), note=note)
    caption = "Higher bars: a window that is more unlike normal ones. "
    caption += "Orange: the stretch by which an individual is abnormal, or stands out."
    pictures = [Picture("scores", "Scores over time", caption, timeline, wide=True)]
    if motion.recording is not None:
        pictures.append(_paths_picture(detection, motion, timed))
    return report_page(
        Report(f"{name}: who is unlike normal individuals?", summary, [table], pictures)
    )


def _paths_picture(
    detection: Detection, motion: RecordedMotion, timed: Sequence[TimedVerdict]
) -> Picture:
    """Draw the most unlike individuals and the most normal ones, in the time that the first verdict rests on."""
    recording = motion.recording
    assert recording is not None
    order = _by_rank(detection, [k for k in range(len(timed)) if timed[k].windows])
    extremes = list(dict.fromkeys(order[:EXTREMES] + order[-EXTREMES:]))
    verdict = timed[extremes[0]]
    begin = verdict.times[0, 0]
    stop = verdict.times[-1, 1]
    if verdict.spells:
        begin, stop = verdict.spells[0]
    last_frame = min(round(stop * recording.fps) + 1, len(recording.positions))
    frames = np.arange(round(begin * recording.fps), last_frame)
    frames = frames[:: max(1, len(frames) // MOST_FRAMES)]
    present = recording.present[frames, :, None]
    positions = np.where(present, recording.positions[frames], np.nan)
    names = []
    paths = []
    abnormal = []
    for k in extremes:
        # Who was away for all of that time has no path in it.
        if np.isfinite(positions[:, k]).any():
            standing = detection.individuals[k]
            names.append(f"{standing.individual} (rank {standing.rank})")
            paths.append(positions[:, k])
            abnormal.append(bool(standing.abnormal))
    caption = f"From {begin:.1f} s to {stop:.1f} s, in cm: the most unlike individuals and the most normal ones."
    return Picture("paths", "Paths", caption, paths_figure(names, paths, abnormal), wide=True)
