"""A detection as rows, a picture and a page: hand the numbers to the rooms that draw."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from turing_learning.figures import Picture, timeline_figure
from turing_learning.figures.one_run import paths_figure
from turing_learning.report import Listing, Report, report_page, shown

from ._alike import Detection
from ._chance import TimedVerdict
from ._motion import Motion, RecordedMotion

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_FRAMES = 3000  # of a path in a page


def timed_verdicts(found: Detection, motion: Motion | RecordedMotion) -> list[TimedVerdict]:
    """Return what is said of each individual, with the time that the verdict rests on: in s, or counted in samples."""
    timed = []
    for k, each in enumerate(found.individuals):
        places = np.flatnonzero(each.flagged)
        times = motion.times[k] if isinstance(motion, RecordedMotion) else np.arange(len(each.shares))[:, None] + [1, 1]
        spells = ((float(times[places[0], 0]), float(times[places[-1], 1])),) if len(places) else ()
        said = (each.individual, each.windows, each.score, each.score, float("nan"), bool(each.abnormal))
        timed.append(TimedVerdict(*said, spells, times, each.shares, each.flagged))
    return timed


def standings(
    found: Detection, timed: Sequence[TimedVerdict], *, seconds: bool
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return headings and rows of a table, the most unlike individual first, without columns in which nothing is known."""
    when = "when (s)" if seconds else "since sample"
    headings = ("individual", "rank", "windows", "score", "p-value", "verdict", when)
    rows: list[tuple[str, ...]] = []
    for k in sorted(range(len(timed)), key=lambda k: found.individuals[k].rank):
        each, spells = found.individuals[k], timed[k].spells
        since = "-"
        if spells:
            since = f"{spells[0][0]:.1f} to {spells[0][1]:.1f}" if seconds else f"{spells[0][0]:g}"
        verdict = {None: "-", True: "abnormal", False: "normal"}[each.abnormal] if each.windows else "no window"
        numbers = (str(each.windows), shown(each.score, "{:.2f}".format), shown(each.p_value, "{:.2g}".format))
        rows.append((each.individual, str(each.rank), *numbers, verdict, since))
    known = [k for k in range(len(headings)) if any(row[k] != "-" for row in rows)]
    return tuple(headings[k] for k in known), [tuple(row[k] for k in known) for row in rows]


def timeline_of(motion: RecordedMotion, verdicts: Sequence[TimedVerdict], *, votes: bool) -> "Figure":
    """Draw scores over time: shares of votes, from 0 to 1, or of a distance, relative to the largest."""
    judged = [verdict for verdict in verdicts if verdict.windows]
    largest = 1.0 if votes else max(1e-12, *(float(verdict.scores.max()) for verdict in judged))
    return timeline_figure(
        [verdict.individual for verdict in judged],
        [verdict.times for verdict in judged],
        [verdict.scores if votes else (verdict.scores / largest).clip(0, 1) for verdict in judged],
        [verdict.flagged for verdict in judged],
        limit=motion.duration_s,
    )


def window_table(verdicts: Sequence[TimedVerdict]) -> str:
    """Return a row for each window of each individual, as CSV."""
    import pandas as pd

    rows = [
        (each.individual, int(each.abnormal), number, f"{begin:.6g}", f"{end:.6g}", score, int(flagged))
        for each in verdicts
        for number, ((begin, end), score, flagged) in enumerate(
            zip(each.times, each.scores, each.flagged, strict=True), 1
        )
    ]
    columns = ["individual", "individual_abnormal", "window", "begin_s", "end_s", "score", "abnormal"]
    return str(pd.DataFrame(rows, columns=columns).to_csv(index=False, lineterminator="\n"))


def detection_page(
    found: Detection, motion: RecordedMotion, timed: Sequence[TimedVerdict], timeline: "Figure", name: str
) -> str:
    """Return the page of a detection in the recording of that name: ranking, scores over time, and paths of some individuals."""
    limit = "" if found.level is None else f" Abnormal: a p-value of at most {found.level:.2g}."
    note = f"By {found.rankings[0].name}; the first is the most unlike normal individuals.{limit} {' '.join(found.remarks)}"
    table = Listing("ranking", "Ranking", *standings(found, timed, seconds=True), note=note)
    caption = (
        "Higher bars: a window that is more unlike normal ones. Orange: the stretch that makes an individual abnormal."
    )
    drawn = [Picture("scores", "Scores over time", caption, timeline, wide=True)]
    order = sorted((k for k in range(len(timed)) if timed[k].windows), key=lambda k: found.individuals[k].rank)
    ends = list(dict.fromkeys(order[:2] + order[-2:]))
    first = timed[ends[0]]
    begin, end = first.spells[0] if first.spells else (first.times[0, 0], first.times[-1, 1])
    if (recording := motion.recording) is not None:
        frames = np.arange(round(begin * recording.fps), min(round(end * recording.fps) + 1, len(recording.positions)))
        frames = frames[:: max(1, len(frames) // MOST_FRAMES)]
        places = np.where(recording.present[frames, :, None], recording.positions[frames], np.nan)
        there = [k for k in ends if np.isfinite(places[:, k]).any()]
        names = [f"{found.individuals[k].individual} (rank {found.individuals[k].rank})" for k in there]
        unlike = [bool(found.individuals[k].abnormal) for k in there]
        figure = paths_figure(names, [places[:, k] for k in there], unlike)
        caption = f"From {begin:.1f} s to {end:.1f} s, in cm: the most unlike individuals and the most normal ones."
        drawn.append(Picture("paths", "Paths", caption, figure, wide=True))
    many = sum(bool(each.abnormal) for each in found.individuals)
    said = f"{many} of {len(timed)} individuals {'is' if many == 1 else 'are'} abnormal."
    said = "Individuals are ranked; nobody is called abnormal." if found.level is None else said
    return report_page(Report(f"{name}: who is unlike normal individuals?", said, [table], drawn))
