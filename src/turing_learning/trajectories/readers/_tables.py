"""Formats of text files and data frames: a row for each position, or for each frame; key points."""

import json
import math
import re
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import chain, product
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from turing_learning.errors import Setting, Text, brief, refuse, require

from .._recording import (
    Format,
    Options,
    Recording,
    assemble,
    from_array,
    natural,
    refusal,
    refuse_first,
)
from ._columns import choose, named, of_key_point, refuse_corners, refuse_points
from ._layouts import (
    ANIMALTA_ROWS,
    CM_PER_UNIT,
    FASTTRACK,
    IDTRACKER_ROWS,
    LAYOUTS,
    MOVEBANK,
    ROS,
    TOXTRAC,
    TRACKMATE,
    TRACKTOR,
    Layout,
    angles,
    frame_column,
    plain_roles,
)
from ._long import is_long, is_wide, read_long
from ._places import resampled
from ._sheets import (
    MOST_HEADER_LINES,
    Sheet,
    TableText,
    below_header,
    number_of,
    separator_of,
    sheet_of,
    text_sheet,
)
from ._times import (
    LARGEST_TIME,
    TIME,
    check_rate,
    check_times,
    per_second,
    rounded,
    seconds_of,
    stated_rate,
    uneven_seconds,
    unstated,
)

if TYPE_CHECKING:
    import pandas as pd

    from .._recording import Glance


def names_of(glance: "Glance") -> set[str]:
    """Return the names of the columns of a text, in small letters."""
    if glance.lines:
        return {name.lower() for name in glance.cells(separator_of(glance.lines[0]))}
    return set()


def _is_tidy(glance: "Glance") -> bool:
    names = names_of(glance)
    # an index of pandas has no name
    if glance.lines and not glance.cells(separator_of(glance.lines[0]))[0]:
        names.discard("")
    if _is_animalta(glance) or _is_tidy_of_idtracker(names):
        return False
    # a table of a program is read by its own layout, unless somebody renamed its columns to x and y
    if not {"x", "y"} <= names and any(layout.fits(names) for layout in LAYOUTS):
        return False
    other_names = names - {frame_column(names) or "frame", "frame", *TIME}
    if other_names == names:
        return False
    # sorted, because of two columns that may both be x the first one is taken
    listed = sorted(names)
    if is_long(names) or {"x", "y"} <= plain_roles(listed, project=False).keys() or angles(listed):
        return True
    return bool(other_names) and is_wide(other_names) and not _is_csv(glance)


def _long_or_wide(sheet: Sheet, options: Options) -> Recording:
    """Read columns frame or time (s), x, y and, if there are any, id, heading (rad) and confidence; or a wide table."""
    columns = dict(options.columns or {})
    frame = frame_column(sheet.names)
    if frame and columns.keys().isdisjoint(("frame", "time")) and frame not in columns.values():
        options = replace(options, columns={"frame": frame, **columns})
    sheet = of_key_point(sheet, options.keypoint)
    beyond_time = {*columns} - {"frame", "time"}
    names = [name.lower() for name in sheet.names]
    if frame:
        # x1, y1, x2, y2 beside the frame are two individuals, whatever the frame is called
        names[sheet.names.index(frame)] = "frame"
    long = is_long(names) or plain_roles(names, project=False) or angles(names)
    if beyond_time or long:
        return read_long(sheet, options)
    sheet = replace(sheet, names=named(sheet.names, options.columns, sheet.origin))
    rule = (
        "frame or time, and x and y of each individual, as x1, y1, x2, ... or fish_x, fish_y, ..."
    )
    return replace(read_wide(sheet, rule, options, widths=(2, 3)), y_axis=None)


def _format_of(layout: Layout) -> Format:
    """Return the format of tables of a program."""

    def recognizes(glance: "Glance") -> bool:
        return layout.fits(names_of(glance))

    def read(path: Path, options: Options) -> Recording:
        return read_long(sheet_of(path, absent=layout.absent), options, layout)

    return Format(layout.name, recognizes, read, has_columns=True, has_times=True)


TRACKTOR_FORMAT = _format_of(TRACKTOR)
TRACKMATE_FORMAT = _format_of(TRACKMATE)
FASTTRACK_FORMAT = _format_of(FASTTRACK)
TOXTRAC_CSV_FORMAT = _format_of(TOXTRAC)
ROS_FORMAT = _format_of(ROS)
MOVEBANK_FORMAT = _format_of(MOVEBANK)
MOT = ("frame", "id", "bb_left", "bb_top", "bb_width", "bb_height", "confidence", "x", "y", "z")
"""Columns of rows of MOT, which have no header line."""


def _is_mot(glance: "Glance") -> bool:
    """Whether the first line is ten numbers, the last three -1: boxes without a place in space."""
    row = glance.cells(",")
    numbers = list(map(number_of, row))
    return len(row) == len(MOT) and bool(np.isfinite(numbers).all()) and numbers[7:] == [-1.0] * 3


def read_mot(path: Path, options: Options) -> Recording:
    """Read frame, individual and box (pixels) of rows of MOT; positions are the centers of boxes.

    Source: Milan et al. 2016, MOT16: a benchmark for multi-object tracking, arXiv:1603.00831.
    """
    text = TableText.of(path)
    separator = text.separator
    width = len(text.header(1, separator)[0])
    if width < 6:
        rule = "have the cells frame, id, left, top, width, height in each row"
        raise refusal(rule, f"{width} cells", f"{path}:1")
    names = [*MOT[:6], *(f"column {k}" for k in range(7, width + 1))]
    recording = read_long(text_sheet(text, separator, names, skip=0), options)
    return replace(recording, y_axis="down", unread=())


MOT_FORMAT = Format("mot", _is_mot, read_mot)
TIDY_FORMAT = Format(
    "tidy",
    _is_tidy,
    lambda path, options: _long_or_wide(sheet_of(path), options),
    has_keypoints=True,
    has_columns=True,
    has_times=True,
)


COORDINATES = {"x": 0, "y": 1, "probid": 2, "likelihood": 2, "confidence": 2}


def _is_tidy_of_idtracker(names: Collection[str]) -> bool:
    return set(names) == {"frame", "time", "individual", "x", "y", "probability"}


def _is_csv(glance: "Glance") -> bool:
    names = glance.cells(",")
    if _is_tidy_of_idtracker(names):
        return True
    if names[:1] in (["time"], ["seconds"]):
        names = names[1:]
    return names[:2] == ["x1", "y1"]


def read_csv(path: Path, options: Options) -> Recording:
    """Read time (s), then x and y (pixels) of each individual, or a row for each of them (trajectories_tidy.csv).

    A file attributes.json beside it may state the frame rate.
    """
    beside, fps = path.parent / "attributes.json", None
    if beside.is_file():
        try:
            stated = json.loads(beside.read_text(encoding="utf-8"))
        except (ValueError, RecursionError) as error:
            raise refusal(
                "have a whole attributes.json beside it", str(error)[:80], beside
            ) from None
        rate = stated.get("frames_per_second") if isinstance(stated, dict) else None
        fps = None if rate is None else check_rate(rate, beside)
    sheet = sheet_of(path, ",")
    if "individual" in sheet.names:
        recording = read_long(sheet, options, IDTRACKER_ROWS)
        return replace(recording, fps=fps or recording.fps)
    return read_wide(sheet, "x1, y1, x2, y2, ... after the time", options, fps=fps)


_WIDE = (
    re.compile(r"(?P<what>x|y|probid)(?P<who>[0-9]+)", re.IGNORECASE),
    re.compile(r"(?P<what>x|y)_(?P<who>arena[0-9]+_.+)", re.IGNORECASE),
    re.compile(r"(?P<who>.+)[ _.:](?P<what>x|y|likelihood|confidence)", re.IGNORECASE),
    re.compile(r"(?P<what>x|y)[ _.:](?P<who>(?!min$|max$).+)", re.IGNORECASE),
)
"""Names of columns of an individual: x1, X_Arena0_Ind1, fish_x, x_fish."""


def read_wide(
    sheet: Sheet,
    rule: str,
    options: Options,
    *,
    widths: tuple[int, ...] = (2,),
    fps: float | None = None,
) -> Recording:
    """Read `widths` columns of an individual, as x1 or fish_x: x, y, perhaps a confidence; and times (s) or frames."""
    columns, clocks = _wide_columns(sheet, rule, widths)
    individuals = sorted(columns, key=natural)
    width = len(columns[individuals[0]])
    spelled = {}
    wanted: list[int] = []
    for who in individuals:
        numbers_of_columns = [columns[who][coordinate] for coordinate in range(width)]
        spelled[who] = [sheet.names[column] for column in numbers_of_columns[:2]]
        wanted += numbers_of_columns
    refuse_points(spelled, sheet.origin)
    when = clocks.get("frame", clocks.get("time"))
    if options.resample is not None:
        when = clocks.get("time", when)
    timed = when is not None and when == clocks.get("time")
    numbered = [when] if when is not None and not timed else []
    numbers, words = sheet.read(
        [*numbered, *wanted], [clocks[name] for name in clocks if name == "time"]
    )
    values = numbers[:, len(numbered) :].reshape(len(numbers), len(individuals), width)
    units = {sheet.units.get(name.lower(), "") for name in chain.from_iterable(spelled.values())}
    unit = None
    if len(units) == 1 and units <= CM_PER_UNIT.keys():
        values[..., :2] *= CM_PER_UNIT[units.pop()]
        unit = "cm"
    if individuals == ["1", "2"] and width == 2:
        refuse_corners(values, sheet.origin)
    names = {role: sheet.names[column] for role, column in clocks.items()}
    names |= {"x": _first_and_last(spelled, 0), "y": _first_and_last(spelled, 1)}
    remarks: tuple[str, ...] = (sheet.remark,) if sheet.remark else ()
    first_frame, rate = 0, fps
    if timed:
        times, in_seconds = seconds_of(words[0], sheet.at, decimal_comma=sheet.decimal_comma)
        name = "seconds" if in_seconds else sheet.names[when].lower()  # type: ignore[index]
        if options.resample is not None:
            even = _resampled_wide(times, name, individuals, values, sheet, options, names)
            return replace(even, unit=unit)
        first_frame, rate = _timed(times, name, sheet, fps, options.fps)
    elif when is not None:
        first_frame, rate = _timed(numbers[:, 0], "frame", sheet, fps, options.fps)
        if words and rate is None:
            name = sheet.names[clocks["time"]]
            rate = _rate_by_times(words[0], name, sheet, options.fps)
            if rate is None:
                remarks += (unstated(name),)
    if options.resample is not None:
        got = f"{options.resample:g}"
        remedy = "Its frames are even."
        refuse("resample", "be left out for a table without times", got, remedy, place=sheet.origin)
    confidence = None
    if width > 2:
        sure = values[..., 2]
        estimated = int((sure < 0).sum())
        if estimated:
            remarks += (f"{estimated} positions were estimated by idTracker (negative ProbId)",)
        # a confidence is one of all positions, or of none
        if (sure >= 0).all(where=~np.isnan(values[..., 0])):
            confidence = sure
    return from_array(
        values[..., :2],
        tuple(individuals),
        sheet.at,
        confidence=confidence,
        fps=rate,
        first_frame=first_frame,
        numbered=when is not None,
        unit=unit,
        remarks=remarks,
        columns=names,
    )


def _rate_by_times(
    words: Sequence[str], name: str, sheet: Sheet, given_fps: float | None
) -> float | None:
    """Return the frame rate that a column of times states, one for each frame; None if it states none."""
    times, _ = seconds_of(words, sheet.at, decimal_comma=sheet.decimal_comma)
    stated = stated_rate(times, np.arange(len(times)))
    if stated is None or math.isclose(stated, 1):
        return None
    return rounded(stated * per_second(stated, given_fps, sheet.origin, name.lower()))


def _wide_columns(
    sheet: Sheet, rule: str, widths: tuple[int, ...]
) -> tuple[dict[str, dict[int, int]], dict[str, int]]:
    """Return numbers of columns by individual and by what they are, and those of frames and times."""
    columns: dict[str, dict[int, int]] = {}
    clocks: dict[str, int] = {}

    def refuse_column(name: str) -> NoReturn:
        got = f"{len(sheet.names)} columns, {name!r}"
        raise refusal(f"have the columns {rule}", got, sheet.origin)

    for column, name in enumerate(sheet.names):
        if not (name or column):
            continue  # an index of pandas
        matches = filter(None, (pattern.fullmatch(name) for pattern in _WIDE))
        match = next(matches, None)
        role = ""
        if name.lower() == "frame":
            role = "frame"
        elif name.lower() in TIME:
            role = "time"
        if match is None and role and role not in clocks:
            clocks[role] = column
            continue
        coordinate = COORDINATES.get(match["what"].lower()) if match else None
        if (
            match is None
            or coordinate is None
            or coordinate in columns.setdefault(match["who"], {})
        ):
            refuse_column(name)
        columns[match["who"]][coordinate] = column
    width = len(next(iter(columns.values()), ()))
    complete = all(sorted(coordinates) == list(range(width)) for coordinates in columns.values())
    if width not in widths or not complete:
        refuse_column(sheet.names[-1])
    return columns, clocks


def _first_and_last(spelled: Mapping[str, Sequence[str]], axis: int) -> str:
    """Return the names of the columns of all individuals in a few words."""
    names = [pair[axis] for pair in spelled.values()]
    return names[0] if len(names) == 1 else f"{names[0]} to {names[-1]}"


def _resampled_wide(
    times: np.ndarray, name: str, individuals: Sequence[str], values: np.ndarray, sheet: Sheet, options: Options,
    names: Mapping[str, str],
) -> Recording:  # fmt: skip
    """Return values (rows, A, 2 or 3) at uneven times as a recording at an even rate."""
    seconds = uneven_seconds(times, options.fps, name, sheet.origin, sheet.at)
    count = len(individuals)
    fps = float(options.resample or 0)
    rows = values.reshape(len(times) * count, -1)
    who = list(individuals) * len(times)
    frames, who, points, _ = resampled(
        np.repeat(seconds, count), who, rows[:, :2], {}, fps, sheet.origin
    )
    remark = f"times were made even by resampling at {fps:g} per second"
    at = f"{sheet.origin}, resampled row {{}}".format
    return assemble(frames, who, points, at, fps=fps, remarks=(remark,), columns=names)


def _timed(
    times: np.ndarray, name: str, sheet: Sheet, stated: float | None, fps: float | None
) -> tuple[int, float | None]:
    """Return first frame and frame rate of rows at times, or with frame numbers, that follow without a break.

    The rate is that `stated` elsewhere, or that of the times; the user's, `fps`, says in which unit they are.
    """
    steps = np.diff(times, prepend=np.nan)
    check_times(times, sheet.at, LARGEST_TIME)
    refuse_first(steps <= 0, sheet.at, "have times that grow from row to row", times)
    if name == "frame":
        refuse_first(
            np.abs(steps - 1) > 0, sheet.at, "have frame numbers that follow without a break", times
        )
        refuse_first(times != np.floor(times), sheet.at, "have frame numbers that are whole", times)
        return int(times[0]), stated
    typical = np.median(steps[1:]) if len(steps) > 1 else 1.0
    rule = f"have evenly spaced times, with steps of {typical:.6g} s"
    remedy: Text = (
        "If they are uneven, make them even by ",
        Setting("resample", rounded(1 / typical)),
        ".",
    )
    refuse_first(np.abs(steps / typical - 1) > 0.5, sheet.at, rule, steps, remedy)
    rate = stated_rate(times, np.arange(len(times)))
    if stated or rate is None:
        return 0, stated
    counts = typical == 1 and bool((times == np.floor(times)).all())
    return 0, rounded(rate * per_second(rate, fps, sheet.origin, name, counts=counts))


# In pixels. ProbId is the confidence where it is a probability; idTracker writes NaN where it did not compute one, and
# negative numbers where it estimated the position during a crossing. Source: Perez-Escudero et al. 2014, Nature Methods 11.
IDTRACKER_FORMAT = Format(
    "idtracker",
    lambda glance: glance.cells("\t")[:3] == ["X1", "Y1", "ProbId1"],
    lambda path, options: read_wide(
        sheet_of(path, "\t"), "X1, Y1, ProbId1, X2, ...", options, widths=(3,)
    ),
)
CSV_FORMAT = Format("idtracker.ai-csv", _is_csv, read_csv)


_ANIMALTA = re.compile(r"[xy]_arena[0-9]+_.+")


def _is_animalta(glance: "Glance") -> bool:
    names = names_of(glance) - {"frame", *TIME}
    in_rows = {"arena", "ind"} <= names and ANIMALTA_ROWS.fits(names_of(glance))
    return in_rows or (bool(names) and all(map(_ANIMALTA.fullmatch, names)))


def read_animalta(path: Path, options: Options) -> Recording:
    """Read what AnimalTA exports: frame and time (s), x and y (pixels) of each individual of each arena.

    Where the number of individuals changes, it writes a row for each, with columns Arena and Ind.
    """
    sheet = sheet_of(path)
    if {"arena", "ind"} <= {name.lower() for name in sheet.names}:
        return read_long(_with_arenas(sheet), options, ANIMALTA_ROWS)
    columns = [name for name in sheet.names if name.lower() not in ("frame", *TIME)]
    rule = "Frame, Time, X_Arena0_Ind0, Y_Arena0_Ind0, ..."
    if not all(_ANIMALTA.fullmatch(name.lower()) for name in columns):
        raise refusal(f"have the columns {rule}", sheet.names, sheet.origin)
    return read_wide(sheet, rule, options)


def _with_arenas(sheet: Sheet) -> Sheet:
    """Return a table of AnimalTA whose individuals are called as in its other table, Arena0_Ind1."""
    lower = [name.lower() for name in sheet.names]
    arena, ind = lower.index("arena"), lower.index("ind")

    def read(
        numbers: Sequence[int], texts: Sequence[int] = ()
    ) -> tuple[np.ndarray, list[list[str]]]:
        values, words = sheet.read(numbers, texts)
        if ind in texts:
            _, (arenas,) = sheet.read([], [arena])
            at = list(texts).index(ind)
            pairs = zip(arenas, words[at], strict=True)
            words[at] = [f"Arena{where}_Ind{who}" for where, who in pairs]
        return values, words

    names = list(sheet.names)
    names[arena] = ""
    return replace(sheet, names=names, read=read)


ANIMALTA_FORMAT = (
    Format(  # Chiara and Kim 2023, AnimalTA, Methods in Ecology and Evolution 14; in pixels
        "animalta", _is_animalta, read_animalta, has_times=True
    )
)


def _is_toxtrac(glance: "Glance") -> bool:
    """Whether the first line is six numbers between tabs: frame, arena, track, x, y, label."""
    row = glance.cells("\t")
    try:
        numbers = list(map(float, row[:6]))
    except ValueError:
        return False
    return (
        len(numbers) == 6
        and not any(row[6:])
        and all(numbers[k].is_integer() for k in (0, 1, 2, 5))
    )


def read_toxtrac(path: Path, options: Options) -> Recording:
    """Read rows of frame, arena, track, x, y, label; a track within an arena is an individual.

    Positions are in pixels from the corner of the arena's region in the image, in Tracking_RealSpace.txt in mm.
    Source: Rodriguez et al. 2018, ToxTrac, Methods in Ecology and Evolution 9.
    """
    names = ("frame", "arena", "track", "x", "y", "label")
    sheet = text_sheet(TableText.of(path), "\t", names, skip=0)
    numbers, _ = sheet.read(range(6))
    frames, arena, track, x, y, label = numbers.T
    integers = numbers[:, [1, 2, 5]]
    rule = "have whole numbers for arena, track and label (columns 2, 3, 6)"
    refuse_first((np.floor(integers) != integers).any(axis=1), sheet.at, rule, integers)
    individuals = [str(int(number)) for number in track]
    if len(np.unique(arena)) > 1:
        # tracks are numbered anew in each arena
        individuals = [f"{int(a)}:{who}" for a, who in zip(arena, individuals, strict=True)]
    unlabeled = int((label == 0).sum())
    remarks = (f"{unlabeled} rows have the label 0",) if unlabeled else ()
    return assemble(frames, individuals, np.column_stack([x, y]), sheet.at, remarks=remarks)


TOXTRAC_FORMAT = Format("toxtrac", _is_toxtrac, read_toxtrac)


SINGLE = ["scorer", "bodyparts", "coords"]
SEVERAL = ["scorer", "individuals", "bodyparts", "coords"]
COORDS = ("x", "y", "likelihood")

Labels = list[tuple[str, ...]]
"""Of each column: scorer, perhaps individual, body part and coordinate."""


def _is_deeplabcut(glance: "Glance") -> bool:
    # a program for spreadsheets may have written it anew, with semicolons
    separator = separator_of(glance.lines[0]) if glance.lines else ","
    headings = [line.split(separator)[0].strip('"') for line in glance.lines[:4]]
    return headings == SEVERAL or headings[:3] == SINGLE


def read_deeplabcut(path: Path, options: Options) -> Recording:
    """Read x, y (pixels) and likelihood of one key point of each animal; the first column numbers the frames.

    Source: Mathis et al. 2018, Lauer et al. 2022, DeepLabCut, Nature Neuroscience 21, Nature Methods 19.
    """
    text = TableText.of(path)
    separator = text.separator
    rows = text.header(4, separator)
    several = [row[0] for row in rows] == SEVERAL
    if not several and [row[0] for row in rows[:3]] != SINGLE:
        rule = "begin with the header lines scorer, (individuals,) bodyparts, coords"
        raise refusal(rule, rows[0][0], f"{path}:1")
    skip = 4 if several else 3
    lengths = list(map(len, rows[:skip]))
    if len(set(lengths)) > 1:
        raise refusal("have header lines of the same length", lengths, f"{path}:1")
    labels = list(zip(*(row[1:] for row in rows[:skip]), strict=True))
    sheet = text_sheet(text, separator, rows[0], skip=skip)
    return read_points(labels, _numbered_by_images(sheet), options)


_IMAGE = re.compile(r".*?([0-9]+)\.(png|jpe?g|tiff?|bmp)", re.IGNORECASE)
"""Name of the image of a frame."""


def _numbered_by_images(sheet: Sheet) -> Sheet:
    """Return a table whose first column has numbers where it names images, as labeled-data/video/img0012.png."""

    def read(
        numbers: Sequence[int], texts: Sequence[int] = ()
    ) -> tuple[np.ndarray, list[list[str]]]:
        _, (names,) = sheet.read([], [0])
        images = list(map(_IMAGE.fullmatch, names))
        if not all(images):
            return sheet.read(numbers, texts)
        columns = [column for column in numbers if column != 0]
        values, words = sheet.read(columns, texts)
        frames = np.array([float(image[1]) for image in images if image])
        return np.column_stack([frames, values]), words

    return replace(sheet, read=read)


def read_points(labels: Labels, sheet: Sheet, options: Options) -> Recording:
    """Read one key point of each animal from columns with labels, after one that numbers the frames."""
    if set(map(len, labels)) == {3}:
        # of a single animal, whom no label names
        labels = [(scorer, "1", *label) for scorer, *label in labels]
    points = list(dict.fromkeys(label[2] for label in labels))
    point = choose(options.keypoint, points, sheet.origin.rpartition(":")[0] or sheet.origin)
    animals = list(dict.fromkeys(label[1] for label in labels if label[2] == point))
    columns = []
    for animal, coordinate in product(animals, COORDS):
        wanted = (animal, point, coordinate)
        matching = [k for k, label in enumerate(labels, start=1) if label[1:] == wanted]
        if len(matching) != 1:
            got = f"{len(matching)} columns {wanted}"
            raise refusal("have x, y and likelihood once for each body part", got, sheet.origin)
        columns += matching
    numbers, _ = sheet.read(numbers=[0, *columns])
    count, frames = len(animals), numbers[:, 0]
    values = numbers[:, 1:].reshape(-1, 3)
    left_out = len({label[1] for label in labels}) - count
    remarks: tuple[str, ...] = ()
    if left_out:
        remarks = (f"{left_out} of the individuals have no key point {point!r}",)
    return assemble(
        np.repeat(frames, count),
        animals * len(frames),
        values[:, :2],
        lambda row: sheet.at(row // count),
        extras={"confidence": values[:, 2]},
        remarks=remarks,
    )


def _is_sleap_csv(glance: "Glance") -> bool:
    names = names_of(glance)
    return {"track", "frame_idx"} <= names and any(name.endswith(".x") for name in names)


def read_sleap_csv(path: Path, options: Options) -> Recording:
    """Read a key point (pixels) of each instance: track, frame_idx, instance.score, nose.x, nose.y, nose.score, ...

    Source: documentation of SLEAP and sleap-io, analysis CSV.
    """
    sheet = sheet_of(path)
    points = [name[:-2] for name in sheet.names if name.endswith(".x")]
    lower = re.escape(choose(options.keypoint, points, path).lower())
    roles = {"frame": ["frame_idx"], "confidence": [f"{lower}.score"]}
    roles |= {axis: [f"{lower}.{axis}"] for axis in ("x", "y")}
    _, (tracks,) = sheet.read([], [sheet.names.index("track")])
    # what was not tracked is a single animal, or contradicts itself
    who = ("track",) if any(tracks) else ()
    return read_long(
        sheet, options, Layout("sleap-csv", roles, who=who, y_axis="down", untracked=True)
    )


SLEAP_CSV_FORMAT = Format("sleap-csv", _is_sleap_csv, read_sleap_csv, has_keypoints=True)
DEEPLABCUT_FORMAT = Format("deeplabcut", _is_deeplabcut, read_deeplabcut, has_keypoints=True)


def read_frame(frame: "pd.DataFrame", options: Options) -> Recording:
    """Read a long or a wide table, or one with columns (scorer, individual, body part, coordinate) or (individual, coordinate)."""
    if not len(frame):
        raise refusal("have at least one row", "none", "DataFrame")
    # As `to_pandas` does
    stated = {name: frame.attrs[name] for name in ("unit", "y_axis") if name in frame.attrs}
    for name, value in stated.items():
        allowed = {"unit": ("cm", "px", None), "y_axis": ("up", "down", None)}[name]
        rule = "be one that is known"
        require(value in allowed, name, rule, brief(value), place="DataFrame, attributes")
    if "fps" in frame.attrs:
        stated["fps"] = check_rate(frame.attrs["fps"], "DataFrame, fps")
        options = replace(options, fps=options.fps or stated["fps"])
    levels = frame.columns.nlevels
    if levels in (3, 4):
        labels = [tuple(map(str, label)) for label in frame.columns]
        sheet = frame_sheet(frame.reset_index(names="frame", allow_duplicates=True))
        return replace(read_points(labels, sheet, options), **stated)
    if levels == 2:
        names_of_columns = []
        for who, coordinate in frame.columns:
            # a column of times has no second name
            joined = f"{who}_{coordinate}" if coordinate else str(who)
            names_of_columns.append(joined)
        frame = frame.set_axis(names_of_columns, axis=1)
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    names = {str(name).lower() for name in frame.columns}
    if TRACKMATE.fits(names) and "track_id" in names and not options.columns:
        return replace(read_long(_trackmate_sheet(frame), options, TRACKMATE), **stated)
    numbered = not names.isdisjoint(("x", "frame", *TIME)) or frame_column(names)
    if not numbered and not options.columns:
        frame = frame.reset_index(names="frame")
    return replace(_long_or_wide(frame_sheet(frame), options), **stated)


def _trackmate_sheet(frame: "pd.DataFrame") -> Sheet:
    """Return a data frame of TrackMate's spots as a table, without the header lines that came in as rows."""
    import pandas as pd

    lower = [str(name).lower() for name in frame.columns]
    lines = 0
    for cell in frame.iloc[:MOST_HEADER_LINES, lower.index("position_x")]:
        if not isinstance(cell, str) or np.isfinite(number_of(cell)):
            break
        lines += 1
    tracks = frame.columns[lower.index("track_id")]
    # Spots of no track make numbers of tracks 8.0
    with suppress(TypeError, ValueError):
        frame = frame.astype({tracks: "Int64"})
    sheet = frame_sheet(frame.iloc[lines:])
    if not lines:
        return sheet
    cells = ["" if pd.isna(cell) else str(cell) for cell in frame.iloc[lines - 1]]
    return below_header(sheet, lines, ",".join(cells), cells)


def frame_sheet(frame: "pd.DataFrame", source: str = "DataFrame") -> Sheet:
    """Return a data frame as a table; `source` is where it is from."""
    import pandas as pd

    def read(
        numbers: Sequence[int], texts: Sequence[int] = ()
    ) -> tuple[np.ndarray, list[list[str]]]:
        values = np.full((len(frame), len(numbers)), np.nan)
        for k, column in enumerate(numbers):
            series = frame.iloc[:, column]
            if series.dtype.kind in "fiuO":
                values[:, k] = pd.to_numeric(series, errors="coerce").to_numpy(
                    dtype=float, na_value=np.nan
                )
            bad = (np.isnan(values[:, k]) & series.notna().to_numpy()) | np.isinf(values[:, k])
            for row in np.flatnonzero(bad)[:1]:
                rule = "have finite numbers or NaN"
                raise refusal(rule, repr(series.iloc[row]), f"{source}, row {row}")
        words = []
        for column in texts:
            words.append(["" if pd.isna(cell) else str(cell) for cell in frame.iloc[:, column]])
        return values, words

    # after `reset_index` of a table with several lines of names a name is one of several texts
    names = [str(name[0] if isinstance(name, tuple) else name) for name in frame.columns]
    return Sheet(names, read, source, f"{source}, row {{}}".format)
