"""Text files and data frames: lines, cells, columns by their names, and a row for each position, or for each frame."""

import codecs
import csv
import json
import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from turing_learning.errors import Setting, Text, brief, refuse, require

from .._recording import Format, Options, Recording, assemble, from_array, natural, refusal, refuse_first
from ._columns import (
    APART,
    WHO,
    box_columns,
    centers,
    choose_individuals,
    named,
    refuse_corners,
    refuse_detections,
    refuse_points,
    refuse_several,
    refuse_size,
)
from ._times import FARTHEST, TIME, check_rate, check_times, frames_at, per_second, rounded, stated_rate

if TYPE_CHECKING:
    import pandas as pd

    from .._recording import Glance


def choose(keypoint: str | None, names: Sequence[str], place: object) -> str:
    """Return the key point asked for, or the only one there is."""
    if keypoint is None and len(names) == 1:
        return names[0]
    remedy = "Say which point of the body stands for the animal."
    require(keypoint in names, "keypoint", f"be one of {', '.join(names)}", brief(keypoint), remedy, place=str(place))
    return str(keypoint)


LONGEST_LINE = 1 << 22
"""Bytes in a line beyond which a file is no table; a thousand key points need less than a tenth."""
ROWS = 1 << 14  # rows that are turned into numbers together


@dataclass(frozen=True)
class Sheet:
    """A table by the names of its columns."""

    names: Sequence[str]
    #: Columns of `numbers` and of `texts` to (rows, numbers), NaN where a cell is empty or says so, and lists of texts
    read: Callable[..., tuple[np.ndarray, list[list[str]]]]
    place: str  #: Where the names are
    at: Callable[[int], str]  #: Where a row is
    remark: str = ""  #: What was left out


def read_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield number and text of each line of a whole text in UTF-8; blank lines are accepted at its end only."""
    blank = 0
    with path.open("rb") as file:
        for number, raw in enumerate(iter(lambda: file.readline(LONGEST_LINE + 1), b""), start=1):
            line = _decoded(raw, path, number)
            if not line or line.isspace():
                blank = blank or number
            elif blank:
                raise refusal("have no blank line inside", "an empty line", f"{path}:{blank}")
            else:
                yield number, line


def refuse_utf16(raw: bytes, place: object) -> None:
    """Refuse a file that begins with the mark of UTF-16, in which lines cannot be told from bytes."""
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise refusal("be text in UTF-8", "UTF-16", place, "Save it as UTF-8.")


def _decoded(raw: bytes, path: Path, number: int) -> str:
    """Return the text of a line, without its end."""
    if not raw.endswith(b"\n"):
        if len(raw) > LONGEST_LINE:
            raise refusal(f"have lines of at most {LONGEST_LINE} bytes", "a longer one", f"{path}:{number}")
        remedy = "The file may be cut off; if it is whole, add a line end."
        raise refusal("end with a line end", f"{raw[-20:]!r}", f"{path}:{number}", remedy)
    if number == 1:
        refuse_utf16(raw, f"{path}:1")
        raw = raw.removeprefix(codecs.BOM_UTF8)
    line = raw.rstrip(b"\r\n")
    if b"\0" in line:
        raise refusal("be a text file", "a zero byte", f"{path}:{number}")
    if b"\r" in line:
        raise refusal("have line ends of one kind", "a carriage return inside a line", f"{path}:{number}")
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError as error:
        remedy = "It may be in Latin-1 or another encoding: save it as UTF-8."
        got = f"byte {line[error.start]:#04x}"
        raise refusal("be text in UTF-8", got, f"{path}:{number}", remedy) from None


def _cells(line: str, separator: str, path: Path, number: int, width: int = 0) -> list[str]:
    """Return the cells of a line, `width` of them if it is given, quotes taken off."""
    try:
        row = line.split(separator) if '"' not in line else next(csv.reader([line], delimiter=separator, strict=True))
    except csv.Error as error:
        raise refusal("have complete quotes", str(error), f"{path}:{number}") from None
    if len(row) > (width or 1) and not row[-1].strip():  # a separator at the end opens no further cell
        row.pop()
    if width and len(row) != width:
        remedy = "The file may be cut off or damaged."
        raise refusal(f"have {width} cells in each row", len(row), f"{path}:{number}", remedy)
    return row


def header(path: Path, lines: int, separator: str) -> list[list[str]]:
    """Return the cells of the first lines."""
    first = islice(read_lines(path), lines)
    rows = [[cell.strip() for cell in _cells(line, separator, path, number)] for number, line in first]
    if len(rows) < lines:
        raise refusal(f"have {lines} header lines", len(rows), path)
    return rows


def text_sheet(path: Path, separator: str, names: Sequence[str], *, skip: int = 1) -> Sheet:
    """Return a text file with these columns after `skip` header lines; whatever is wrong is refused with its line."""
    width = len(names)

    def read(numbers: Sequence[int], texts: Sequence[int] = ()) -> tuple[np.ndarray, list[list[str]]]:
        found: list[np.ndarray] = []
        words: list[list[str]] = [[] for _ in texts]
        lines = islice(read_lines(path), skip, None)
        while block := list(islice(lines, ROWS)):
            cells = list(chain.from_iterable(_cells(line, separator, path, number, width) for number, line in block))
            found.append(np.column_stack([_numbers(cells[k::width]) for k in numbers]))
            for row, column in np.argwhere(np.isinf(found[-1])):
                cell = cells[row * width + numbers[column]].strip()
                remedy = "Write decimals with a point." if "," in cell else ""
                raise refusal("have finite numbers or NaN", repr(cell[:40]), f"{path}:{block[row][0]}", remedy)
            for column, k in zip(words, texts, strict=True):
                column += map(str.strip, cells[k::width])
        if not found:
            raise refusal("have at least one row", "none", path)
        return np.concatenate(found), words

    return Sheet(names, read, f"{path}:1", lambda row: f"{path}:{skip + 1 + row}")


def _numbers(cells: list[str]) -> np.ndarray:
    """Return the numbers that cells are, not a number where one is empty, infinite where it is none."""
    if "_" not in "".join(cells):
        with suppress(ValueError):
            return np.array(list(map(float, cells)))
    return np.array([_number(cell.strip()) for cell in cells])


def _number(cell: str) -> float:
    with suppress(ValueError):
        return np.inf if "_" in cell else float(cell or "nan")
    return np.inf


EXTRAS = {"heading": "headings", "confidence": "confidence"}


def _separator(line: str) -> str:
    return max(",\t;", key=line.count)


def _names(glance: "Glance") -> set[str]:
    return {name.lower() for name in glance.cells(_separator(glance.lines[0]))} if glance.lines else set()


def _is_trackmate(glance: "Glance") -> bool:
    return {"frame", "track_id", "position_x", "position_y"} <= _names(glance)


def _is_tidy(glance: "Glance") -> bool:
    names = _names(glance)
    others = names - {"frame", *TIME}
    wide = bool(others) and _is_wide(others) and not _is_csv(glance)
    return others < names and not _is_trackmate(glance) and (_is_long(names) or wide)


def _is_wide(names: Collection[str]) -> bool:
    """Return whether all columns but those of frames and times are of x, y and confidence of somebody."""
    return all(re.fullmatch(r"[xy][0-9]+|(?!pos_).+[ _.:](x|y|likelihood|confidence)", name) for name in names)


def _is_long(names: Collection[str]) -> bool:
    """Return whether a table has a row for each individual, by columns of a position or of a box."""
    wide = _is_wide({*names} - {"frame", *TIME})
    return {"x", "y"} <= set(names) or (bool(box_columns(names)) and not wide)


def _long_or_wide(sheet: Sheet, options: Options) -> Recording:
    """Read columns frame or time (s), x, y and, if there are any, id, heading (rad) and confidence; or a wide table."""
    beyond_time = {*(options.columns or ())} - {"frame", "time"}
    if beyond_time or _is_long([name.lower() for name in sheet.names]):
        return read_long(sheet, options)
    sheet = replace(sheet, names=named(sheet.names, options.columns, sheet.place))
    rule = "frame or time, and x and y of each individual, as x1, y1, x2, ... or fish_x, fish_y, ..."
    return replace(read_wide(sheet, rule, options, each=(2, 3)), y_axis=None)


def _sheet(path: Path, separator: str = "") -> Sheet:
    """Return a text file whose first line names its columns, and shows what separates them unless that is said."""
    with path.open("rb") as file:
        separator = separator or _separator(file.readline(1 << 16).decode("utf-8-sig", errors="replace"))
    names = header(path, 1, separator)[0]
    more = _more_header_lines(path, separator, names)
    sheet = text_sheet(path, separator, names, skip=1 + len(more))
    if more:
        sheet = replace(sheet, remark=f"{len(more)} more header lines are no rows: {more[-1]}")
    return sheet


MOST_HEADER_LINES = 3
"""Lines below the first one in which TrackMate says what columns are, and their units."""
MISSING = ("nan", "na", "n/a", "none", "null", "-", "--", "missing")
"""What a cell of a row may say, and none of a header line."""


def _more_header_lines(path: Path, separator: str, names: Sequence[str]) -> list[str]:
    """Return the lines below the header that say something, and in no cell a number or a missing one."""
    more: list[str] = []
    if {"frame", *TIME}.isdisjoint(name.lower() for name in names):
        return more
    for number, line in islice(read_lines(path), 1, 1 + MOST_HEADER_LINES):
        cells = [cell.strip() for cell in _cells(line, separator, path, number)]
        lacking = len(names) - len(cells)
        words = [cell for cell in cells if cell]
        values = [np.isfinite(_number(cell)) or cell.lower() in MISSING for cell in words]
        # the last cell may be empty
        if lacking not in (0, 1) or not words or any(values) or cells == list(names):
            break
        more.append(line)
    return more


def read_long(sheet: Sheet, options: Options, x: str = "x", y: str = "y", who: Sequence[str] = WHO) -> Recording:
    """Read a table with a row for each individual and frame; names of columns are in any case.

    `who` are names of columns that may name the individuals.
    """
    said = options.columns or {}
    names = [name.lower() for name in named(sheet.names, said, sheet.place, x=x, y=y)]
    when = "frame" if "frame" in names else next((name for name in TIME if name in names), "frame")
    stated = not {"x", "y"}.isdisjoint(said)
    boxed = "left" in said or (x == "x" and _is_long(names) and not stated)
    box = box_columns(names) if boxed else {}
    plain = [name for name in (x, y) if name in names or not box]
    if not {when, *plain} <= set(names):
        raise refusal(f"have the columns frame, {x}, {y}", sheet.names, sheet.place)
    if not (box or stated):
        refuse_size(names, sheet.place)
    who = [name for name in (("id",) if "id" in said else who) if name in names]
    apart = [name for name in APART if name in names and name not in who]
    clock = [name for name in TIME if name in names and when == "frame"][:1]
    depth = [name for name in (x.replace("x", "z"),) if name in names]
    extra = [name for name in EXTRAS if name in names and x != "pos_x"]
    wanted = [when, *plain, *box.values(), *extra]
    numbers, words = _by_name(sheet, names, wanted, [*who, *apart, *clock, *depth])
    frames, fps = numbers[when], None
    if when != "frame":
        frames, fps = frames_at(frames, options.fps, when, sheet.place, sheet.at)
    elif clock:
        fps = _rate_beside(words[clock[0]], frames, options.fps, sheet.place, clock[0])
    positions, choices = _positions(numbers, plain, box, "left" in said)
    for name in depth:
        if len({*words[name]} - {""}) > 1:
            choices.append(f"positions are those in {x} and {y} alone, as if all {name} were the same")
    if len(who) > 1:
        columns = {name: words[name] for name in who}
        name, why = choose_individuals(columns, frames, positions, sheet.place)
        who = [name]
        choices += [why] if why else []
    individuals = words[who[0]] if who else ["1"] * len(frames)
    refuse_several({name: words[name] for name in apart}, frames, individuals, sheet.place)
    for name in extra:
        unknown = np.isnan(numbers[name]) & ~np.isnan(positions[:, 0])
        refuse_first(unknown, sheet.at, f"give `{name}` wherever it gives x and y", "none")
    remarks = [sheet.remark] if sheet.remark else []
    twice: Text = ""
    unread = [name for name in sheet.names if name and name.lower() not in wanted]
    if unread and not who:
        listed = ", ".join(unread)
        remarks.append(f"without a column id all rows are of one individual; columns not read: {listed}")
        example = Setting("columns", {"id": unread[-1]})
        twice = ("If a column that is not read names the individuals, say so: ", example, ".")
    recording = assemble(
        frames,
        individuals,
        positions,
        sheet.at,
        extras={EXTRAS[name]: numbers[name] for name in extra},
        fps=fps,
        y_axis=None if x == "x" else "down",
        remarks=tuple(remarks),
        choices=tuple(choices),
        twice=twice,
    )
    if who and "id" not in said:
        refuse_detections(recording, who[0], sheet.place)
    return recording


def _by_name(
    sheet: Sheet, names: Sequence[str], numbers: Sequence[str], texts: Sequence[str]
) -> tuple[dict[str, np.ndarray], dict[str, list[str]]]:
    """Return columns (rows,) of numbers, and of texts, by their names."""
    for name in (*numbers, *texts):
        if names.count(name) > 1:
            raise refusal("name each column once", f"{name!r} twice", sheet.place)
    values, words = sheet.read([*map(names.index, numbers)], [*map(names.index, texts)])
    return dict(zip(numbers, values.T, strict=True)), dict(zip(texts, words, strict=True))


def _positions(
    columns: Mapping[str, np.ndarray], plain: Sequence[str], box: Mapping[str, str], stated: bool
) -> tuple[np.ndarray, list[str]]:
    """Return positions (rows, 2), and in words if they are others than those in `plain` columns.

    They are the centers of boxes if that is `stated`, or if x and y are fixed, as -1, -1 in tables of
    MOT, or are the corner of the box.
    """
    sides = {side: columns[name] for side, name in box.items()}
    if plain:
        positions = np.column_stack([columns[name] for name in plain])
        if not box:
            return positions, []
        corner = np.column_stack([sides["left"], sides["top"]])
        fixed = (positions == positions[0]).all()
        if not (stated or fixed or np.array_equal(positions, corner, equal_nan=True)):
            return positions, []
    listed = ", ".join(box.values())
    return centers(sides), [f"positions are the centers of the boxes in the columns {listed}"]


def _rate_beside(times: Sequence[str], frames: np.ndarray, fps: float | None, file: object, name: str) -> float | None:
    """Return the frame rate that a column of times beside frame numbers states, if it does."""
    order = np.argsort(frames, kind="stable")
    seconds = np.array([_number(time.strip()) for time in times])[order]
    rate = stated_rate(seconds, frames[order])
    finite = seconds[np.isfinite(seconds)]
    # they may count frames, too
    if rate is None or (rate == 1 and (finite == np.floor(finite)).all()):
        return None
    return rounded(rate * per_second(rate, fps, file, name))


TRACKTOR_FORMAT = Format(  # Sridhar, Roche and Gingins 2019, Methods in Ecology and Evolution 10; in pixels
    "tracktor",
    lambda glance: {"frame", "pos_x", "pos_y"} <= _names(glance),
    lambda path, options: read_long(_sheet(path), options, "pos_x", "pos_y"),
    has_columns=True,
)
TRACKMATE_FORMAT = Format(  # Ershov et al. 2022, TrackMate 7, Nature Methods 19; a table of spots, y of images
    "trackmate",
    _is_trackmate,
    lambda path, options: read_long(_sheet(path), options, "position_x", "position_y", ("track_id",)),
    has_columns=True,
)
TIDY_FORMAT = Format("tidy", _is_tidy, lambda path, options: _long_or_wide(_sheet(path), options), has_columns=True)


COORDINATES = {"x": 0, "y": 1, "probid": 2, "likelihood": 2, "confidence": 2}


def _is_csv(glance: "Glance") -> bool:
    names = glance.cells(",")
    return ["x1", "y1"] in (names[:2], names[1:3] if names[0] in ("time", "seconds") else []) if names else False


def read_csv(path: Path, options: Options) -> Recording:
    """Read time (s), then x and y (pixels) of each individual; attributes.json beside it may state the frame rate."""
    beside, fps = path.parent / "attributes.json", None
    if beside.is_file():
        try:
            stated = json.loads(beside.read_text(encoding="utf-8"))
        except (ValueError, RecursionError) as error:
            raise refusal("have a whole attributes.json beside it", str(error)[:80], beside) from None
        rate = stated.get("frames_per_second") if isinstance(stated, dict) else None
        fps = None if rate is None else check_rate(rate, beside)
    return read_wide(_sheet(path, ","), "x1, y1, x2, y2, ... after the time", options, fps=fps)


def read_wide(
    sheet: Sheet, rule: str, options: Options, *, each: tuple[int, ...] = (2,), fps: float | None = None
) -> Recording:
    """Read `each` columns of an individual, as x1 or fish_x: x, y, perhaps a confidence; and times (s) or frames."""
    found: dict[str, dict[int, int]] = {}
    when = None

    def refuse_column(name: str) -> NoReturn:
        raise refusal(f"have the columns {rule}", f"{len(sheet.names)} columns, {name!r}", sheet.place)

    for place, name in enumerate(sheet.names):
        number = re.fullmatch(r"(?i)(x|y|probid)([0-9]+)", name)
        suffix = re.fullmatch(r"(?i)(.+)[ _.:](x|y|likelihood|confidence)", name)
        if number is None and suffix is None and when is None and name.lower() in ("frame", *TIME):
            when = place
            continue
        who, what = (number[2], number[1]) if number else (suffix[1], suffix[2]) if suffix else ("", "")
        kind = COORDINATES.get(what.lower())
        if kind is None or kind in found.setdefault(who, {}):
            refuse_column(name)
        found[who][kind] = place
    width = len(next(iter(found.values()), ()))
    if width not in each or any(sorted(columns) != list(range(width)) for columns in found.values()):
        refuse_column(sheet.names[-1])
    individuals = sorted(found, key=natural)
    columns = {who: [sheet.names[found[who][0]], sheet.names[found[who][1]]] for who in individuals}
    refuse_points(columns, sheet.place)
    wanted = [found[who][kind] for who in individuals for kind in range(width)]
    numbers, _ = sheet.read([*([] if when is None else [when]), *wanted])
    values = numbers[:, when is not None :].reshape(len(numbers), len(individuals), width)
    if individuals == ["1", "2"] and width == 2:
        refuse_corners(values, sheet.place)
    first, rate = 0, fps
    if when is not None:
        first, rate = _timed(numbers[:, 0], sheet.names[when].lower(), sheet, fps, options.fps)
    sure = values[..., 2] if width > 2 else np.zeros(())
    estimated = int((sure < 0).sum())
    complete = width > 2 and bool((sure >= 0).all(where=~np.isnan(values[..., 0])))
    return from_array(
        values[..., :2],
        tuple(individuals),
        sheet.at,
        confidence=sure if complete else None,
        fps=rate,
        first_frame=first,
        numbered=when is not None,
        remarks=(f"{estimated} positions were estimated by idTracker (negative ProbId)",) if estimated else (),
    )


def _timed(
    times: np.ndarray, name: str, sheet: Sheet, stated: float | None, fps: float | None
) -> tuple[int, float | None]:
    """Return first frame and frame rate of rows at times, or with frame numbers, that follow without a break.

    The rate is that `stated` elsewhere, or that of the times; the user's, `fps`, says in which unit they are.
    """
    steps = np.diff(times, prepend=np.nan)
    check_times(times, sheet.at, FARTHEST)
    refuse_first(steps <= 0, sheet.at, "have times that grow from row to row", times)
    if name == "frame":
        refuse_first(np.abs(steps - 1) > 0, sheet.at, "have frame numbers that follow without a break", times)
        refuse_first(times != np.floor(times), sheet.at, "have frame numbers that are whole", times)
        return int(times[0]), stated
    typical = np.median(steps[1:]) if len(steps) > 1 else 1.0
    rule = f"have evenly spaced times, with steps of {typical:.6g} s"
    refuse_first(np.abs(steps / typical - 1) > 0.5, sheet.at, rule, steps)
    rate = stated_rate(times, np.arange(len(times)))
    if stated or rate is None:
        return 0, stated
    counts = typical == 1 and bool((times == np.floor(times)).all())
    return 0, rounded(rate * per_second(rate, fps, sheet.place, name, counts=counts))


# In pixels. ProbId is the confidence where it is a probability; idTracker writes NaN where it did not compute one, and
# negative numbers where it estimated the position during a crossing. Source: Perez-Escudero et al. 2014, Nature Methods 11.
IDTRACKER_FORMAT = Format(
    "idtracker",
    lambda glance: glance.cells("\t")[:3] == ["X1", "Y1", "ProbId1"],
    lambda path, options: read_wide(_sheet(path, "\t"), "X1, Y1, ProbId1, X2, ...", options, each=(3,)),
)
CSV_FORMAT = Format("idtracker.ai-csv", _is_csv, read_csv)


def _is_toxtrac(glance: "Glance") -> bool:
    """Whether the first line is six numbers between tabs: frame, arena, track, x, y, label."""
    row = glance.cells("\t")
    try:
        numbers = [float(cell) for cell in row[:6]]
    except ValueError:
        return False
    return len(numbers) == 6 and not any(row[6:]) and all(numbers[k].is_integer() for k in (0, 1, 2, 5))


def read_toxtrac(path: Path, options: Options) -> Recording:
    """Read rows of frame, arena, track, x, y, label; a track within an arena is an individual.

    Positions are in pixels from the corner of the arena's region in the image, in Tracking_RealSpace.txt in mm.
    Source: Rodriguez et al. 2018, ToxTrac, Methods in Ecology and Evolution 9.
    """
    sheet = text_sheet(path, "\t", ("frame", "arena", "track", "x", "y", "label"), skip=0)
    numbers, _ = sheet.read(range(6))
    frames, arena, track, x, y, label = numbers.T
    whole = numbers[:, [1, 2, 5]]
    rule = "have whole numbers for arena, track and label (columns 2, 3, 6)"
    refuse_first((np.floor(whole) != whole).any(axis=1), sheet.at, rule, whole)
    several = len(np.unique(arena)) > 1
    names = [f"{int(a)}:{int(t)}" if several else str(int(t)) for a, t in zip(arena, track, strict=True)]
    unlabeled = int((label == 0).sum())
    remarks = (f"{unlabeled} rows have the label 0",) if unlabeled else ()
    return assemble(frames, names, np.column_stack([x, y]), sheet.at, remarks=remarks)


TOXTRAC_FORMAT = Format("toxtrac", _is_toxtrac, read_toxtrac)


SINGLE = ["scorer", "bodyparts", "coords"]
SEVERAL = ["scorer", "individuals", "bodyparts", "coords"]
COORDS = ("x", "y", "likelihood")

Labels = list[tuple[str, ...]]
"""Of each column: scorer, perhaps individual, body part and coordinate."""


def _is_deeplabcut(glance: "Glance") -> bool:
    first = [line.split(",")[0] for line in glance.lines[:4]]
    return first == SEVERAL or first[:3] == SINGLE


def read_deeplabcut(path: Path, options: Options) -> Recording:
    """Read x, y (pixels) and likelihood of one key point of each animal; the first column numbers the frames.

    Source: Mathis et al. 2018, Lauer et al. 2022, DeepLabCut, Nature Neuroscience 21, Nature Methods 19.
    """
    rows = header(path, 4, ",")
    several = [row[0] for row in rows] == SEVERAL
    if not several and [row[0] for row in rows[:3]] != SINGLE:
        raise refusal("begin with the header lines scorer, (individuals,) bodyparts, coords", rows[0][0], f"{path}:1")
    skip = 4 if several else 3
    lengths = [len(row) for row in rows[:skip]]
    if len(set(lengths)) > 1:
        raise refusal("have header lines of the same length", lengths, f"{path}:1")
    labels = list(zip(*(row[1:] for row in rows[:skip]), strict=True))
    return read_points(labels, text_sheet(path, ",", rows[0], skip=skip), options)


def read_points(labels: Labels, sheet: Sheet, options: Options) -> Recording:
    """Read one key point of each animal from columns with labels, after one that numbers the frames."""
    labels = [label if len(label) > 3 else (label[0], "1", *label[1:]) for label in labels]
    points = list(dict.fromkeys(label[2] for label in labels))
    point = choose(options.keypoint, points, sheet.place.rpartition(":")[0] or sheet.place)
    animals = list(dict.fromkeys(label[1] for label in labels if label[2] == point))
    columns = []
    for wanted in ((animal, point, what) for animal in animals for what in COORDS):
        found = [k for k, label in enumerate(labels, start=1) if label[1:] == wanted]
        if len(found) != 1:
            got = f"{len(found)} columns {wanted}"
            raise refusal("have x, y and likelihood once for each body part", got, sheet.place)
        columns += found
    numbers, _ = sheet.read(numbers=[0, *columns])
    count, frames = len(animals), numbers[:, 0]
    values = numbers[:, 1:].reshape(-1, 3)
    left_out = len({label[1] for label in labels}) - count
    return assemble(
        np.repeat(frames, count),
        animals * len(frames),
        values[:, :2],
        lambda row: sheet.at(row // count),
        extras={"confidence": values[:, 2]},
        remarks=(f"{left_out} of the individuals have no key point {point!r}",) if left_out else (),
    )


DEEPLABCUT_FORMAT = Format("deeplabcut", _is_deeplabcut, read_deeplabcut, has_keypoints=True)


def read_frame(frame: "pd.DataFrame", options: Options) -> Recording:
    """Read a long or a wide table, or one with columns (scorer, individual, body part, coordinate) or (individual, coordinate)."""
    if not len(frame):
        raise refusal("have at least one row", "none", "DataFrame")
    stated = {name: frame.attrs[name] for name in ("unit", "y_axis") if name in frame.attrs}  # as `to_pandas` does
    for name, value in stated.items():
        known = {"unit": ("cm", "px", None), "y_axis": ("up", "down", None)}[name]
        require(value in known, name, "be one that is known", brief(value), place="DataFrame, attributes")
    if "fps" in frame.attrs:
        stated["fps"] = check_rate(frame.attrs["fps"], "DataFrame, fps")
        options = replace(options, fps=options.fps or stated["fps"])
    levels = frame.columns.nlevels
    if levels in (3, 4):
        labels = [tuple(map(str, label)) for label in frame.columns]
        sheet = _frame_sheet(frame.reset_index(names="frame", allow_duplicates=True))
        return replace(read_points(labels, sheet, options), **stated)
    if options.keypoint is not None:
        refuse("keypoint", "be left out for a table without key points", repr(options.keypoint))
    if levels == 2:
        frame = frame.set_axis([f"{who}_{what}" if what else str(who) for who, what in frame.columns], axis=1)
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    if {str(name).lower() for name in frame.columns}.isdisjoint(("x", "frame", *TIME)) and not options.columns:
        frame = frame.reset_index(names="frame")
    return replace(_long_or_wide(_frame_sheet(frame), options), **stated)


def _frame_sheet(frame: "pd.DataFrame") -> Sheet:
    import pandas as pd

    def read(numbers: Sequence[int], texts: Sequence[int] = ()) -> tuple[np.ndarray, list[list[str]]]:
        found = np.full((len(frame), len(numbers)), np.nan)
        for k, column in enumerate(numbers):
            series = frame.iloc[:, column]
            if series.dtype.kind in "fiuO":
                found[:, k] = pd.to_numeric(series, errors="coerce").to_numpy(dtype=float, na_value=np.nan)
            bad = (np.isnan(found[:, k]) & series.notna().to_numpy()) | np.isinf(found[:, k])
            for row in np.flatnonzero(bad)[:1]:
                raise refusal("have finite numbers or NaN", repr(series.iloc[row]), f"DataFrame, row {row}")
        return found, [["" if pd.isna(cell) else str(cell) for cell in frame.iloc[:, column]] for column in texts]

    names = [str(name if not isinstance(name, tuple) else name[0]) for name in frame.columns]
    return Sheet(names, read, "DataFrame", "DataFrame, row {}".format)
