"""Tables with a column for each of frame or time, individual, x and y: Tracktor, plain ("tidy") CSV, long data frames."""

from pathlib import Path

import numpy as np

from turing_learning.trajectories._recording import (
    LARGEST,
    Format,
    Glance,
    Options,
    Place,
    Recording,
    YAxis,
    assemble,
    refusal,
)

from ._shared import RATE_DIGITS
from ._text import Sheet, read_sheet

TIME = ("time", "time_s", "time (s)", "seconds", "t")
WHO = ("id", "individual", "individuals", "animal", "fish", "identity", "track", "track_id", "trackid", "tracker_id")
"""Names of columns of individuals; without one all rows are of one individual."""
LATE = 0.25
"""Frames by which a time may be beside that of its frame."""


def _separator(line: str) -> str:
    return max(",\t;", key=line.count)


def _names(glance: Glance) -> set[str]:
    return {name.lower() for name in glance.cells(_separator(glance.lines[0]))} if glance.lines else set()


def _is_tidy(glance: Glance) -> bool:
    return {"x", "y"} <= _names(glance) and not _names(glance).isdisjoint(("frame", *TIME))


def read_tracktor(path: Path, options: Options) -> Recording:
    """Read columns frame, pos_x, pos_y (pixels) and, for several individuals, id.

    Source: Sridhar, Roche and Gingins 2019, Tracktor, Methods in Ecology and Evolution 10.
    """
    return read_long(_sheet(path), options, "pos_x", "pos_y", y_axis="down")


def read_tidy(path: Path, options: Options) -> Recording:
    """Read columns frame or time (s), x, y and, if there are any, id, heading (rad) and confidence; others are left alone."""
    return read_long(_sheet(path), options)


def _sheet(path: Path) -> Sheet:
    with path.open("rb") as file:
        return read_sheet(path, _separator(file.readline(1 << 16).decode("utf-8-sig", errors="replace")))


def read_long(sheet: Sheet, options: Options, x: str = "x", y: str = "y", *, y_axis: YAxis | None = None) -> Recording:
    """Read a table with a row for each individual and frame; names of columns are in any case."""
    names = [name.lower() for name in sheet.names]
    when = "frame" if "frame" in names else next((name for name in TIME if name in names), "frame")
    missing = [name for name in (when, x, y) if name not in names]
    if missing:
        raise refusal(f"have the columns frame, {x}, {y}", sheet.names, sheet.place)
    who = ["id"] if "id" in names else [name for name in WHO if name in names]
    if len(who) > 1:
        raise refusal("name the column of its individuals id", f"{' and '.join(who)}", sheet.place, "Rename one.")
    extra = [name for name in ("heading", "confidence") if name in names and y_axis is None]
    wanted = [when, x, y, *extra]
    twice = [name for name in (*wanted, *who) if names.count(name) > 1]
    if twice:
        raise refusal("name each column once", f"{twice[0]!r} twice", sheet.place)
    table = sheet.read(numbers=[names.index(name) for name in wanted], texts=[names.index(name) for name in who])
    frames, positions, fps = table.numbers[:, 0], table.numbers[:, 1:3], None
    if when != "frame":
        frames, fps = frames_at(frames, options.fps, table.place)
    extras: dict[str, np.ndarray] = {}
    for k, name in enumerate(extra):
        extras["headings" if name == "heading" else name] = values = table.numbers[:, 3 + k]
        unknown = np.isnan(values) & ~np.isnan(positions[:, 0])
        if unknown.any():
            raise refusal(f"give `{name}` wherever it gives x and y", "none", table.place(int(np.argmax(unknown))))
    unread = ", ".join(name for name in sheet.names if name and name.lower() not in wanted) if not who else ""
    return assemble(
        frames,
        table.texts[0] if who else ["1"] * len(frames),
        positions,
        table.place,
        extras=extras,
        fps=fps,
        y_axis=y_axis,
        remarks=(f"without a column id all rows are of one individual; columns not read: {unread}",) if unread else (),
        twice=f"If a column that is not read names the individuals, call it id: {unread}." if unread else "",
    )


def frames_at(seconds: np.ndarray, fps: float | None, place: Place) -> tuple[np.ndarray, float | None]:
    """Return frame numbers (rows,) at times (s), and the frame rate that the times state unless it is given as `fps`."""
    absurd = ~(np.abs(seconds) <= LARGEST)
    if absurd.any():
        row = int(np.argmax(absurd))
        raise refusal(f"have times within +-{LARGEST:.0e} s", seconds[row], place(row))
    known = np.unique(seconds)
    since, span = seconds - known[0], float(known[-1] - known[0])
    rates = [fps or 1.0]
    if fps is None and span > 0:
        steps = np.diff(known)  # every frame has somebody, or gaps are whole frames
        rates = [max(1, round(span / step)) / span for step in (span / len(steps), np.median(steps), steps.min())]
    off = [np.abs(since * rate - np.round(since * rate)) for rate in rates]
    rate, away = next(
        ((rate, each > LATE) for rate, each in zip(rates, off, strict=True) if each.max() <= LATE),
        (rates[0], off[0] > LATE),
    )
    if away.any():
        row = int(np.argmax(away))
        rule = f"have times that are whole frames apart, at {rate:.6g} per second"
        raise refusal(rule, f"{seconds[row]:.10g} s", place(row), "Give the frame rate as `fps`, or number the frames.")
    stated = float(f"{rate:.{RATE_DIGITS}g}") if fps is None and span > 0 else None
    return np.round(since * rate) + max(0, round(float(known[0]) * rate)), stated


TRACKTOR_FORMAT = Format("tracktor", lambda glance: {"frame", "pos_x", "pos_y"} <= _names(glance), read_tracktor)
TIDY_FORMAT = Format("tidy", _is_tidy, read_tidy)
