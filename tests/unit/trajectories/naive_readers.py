"""Plain twins of the text readers: every row by itself into a dictionary (frame, individual) -> (x, y) in pixels."""

import csv
import math


def read(name, content):
    # a last line without a line end may be half a line
    lines = decoded(content).split("\n")[:-1]
    while lines and not lines[-1].strip(" ,;\r"):
        lines.pop()
    rows = [
        [cell.strip() for cell in _cells(line, SEPARATORS[name](lines[0]))]
        for line in lines
        if line.strip()
    ]
    return {key: xy for key, xy in READERS[name](rows) if not math.isnan(xy[0])}


def decoded(content):
    """Return a text in UTF-16 with its mark, in UTF-8, or else in Windows-1252."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252")


def _cells(line, separator):
    return (
        next(csv.reader([line.rstrip("\r")], delimiter=separator))
        if '"' in line
        else line.split(separator)
    )


def _is_number(cell):
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


def _xy(x, y):
    return float(_plain(x)), float(_plain(y))


def _plain(cell):
    """Return a cell, "nan" where it says that a number is missing."""
    absent = ("", "na", "n/a", "none", "null", "-", "--", "\u2013", ".", "missing")
    return "nan" if cell.lower() in absent else cell


def _idtracker(rows):
    names = rows[0]
    for frame, row in enumerate(rows[1:]):
        cell = dict(zip(names, row, strict=False))
        for k in range(len(names) // 3):
            yield (frame, str(k + 1)), _xy(cell[f"X{k + 1}"], cell[f"Y{k + 1}"])


def _idtracker_ai(rows):
    names = rows[0]
    for frame, row in enumerate(rows[1:]):
        cell = dict(zip(names, row, strict=False))
        for k in range(len(names) // 2):
            yield (frame, str(k + 1)), _xy(cell[f"x{k + 1}"], cell[f"y{k + 1}"])


def _toxtrac(rows):
    arenas = {float(row[1]) for row in rows}
    for row in rows:
        arena, track = int(float(row[1])), int(float(row[2]))
        yield (
            (float(row[0]), f"{arena}:{track}" if len(arenas) > 1 else str(track)),
            _xy(row[3], row[4]),
        )


def _named(x, y, who="id", words=0, frame="frame", untracked=False):
    def read_rows(rows):
        names = [name.lower() for name in rows[0]]
        # as many header lines as there are: damage may have cut some away
        header = 1
        while header <= words and not any(map(_is_number, rows[header])):
            header += 1
        for row in rows[header:]:
            cell = dict(zip(names, row, strict=False))
            individual = cell.get(who, cell.get("track_id", "1") if who == "id" else "1")
            if untracked and individual.lower() in ("", "none", "nan", "na"):
                continue
            yield (float(cell[frame]), individual), _xy(cell[x], cell[y])

    return read_rows


def _mot(rows):
    for row in rows:
        left, top, width, height = map(float, row[2:6])
        yield (float(row[0]), row[1]), (left + width / 2, top + height / 2)


def _animalta(rows):
    names = [name.lower() for name in rows[0]]
    for row in rows[1:]:
        cell = dict(zip(names, row, strict=False))
        for name, spelled in zip(names, rows[0], strict=False):
            if name.startswith("x_"):
                x, y = (cell[axis + name[1:]] for axis in "xy")
                frame = float(cell["frame"])
                yield (
                    (frame, spelled[2:]),
                    tuple(float(_plain(v).replace(",", ".")) for v in (x, y)),
                )


def _deeplabcut(rows):
    if rows[1][0] == "individuals":
        who, parts, coords, data = rows[1], rows[2], rows[3], rows[4:]
    else:
        who, parts, coords, data = ["1"] * len(rows[1]), rows[1], rows[2], rows[3:]
    for row in data:
        cell = {}
        for name, part, coord, value in zip(who[1:], parts[1:], coords[1:], row[1:], strict=False):
            cell[name, part, coord] = value
        for name in dict.fromkeys(who[1:]):
            if (name, "thorax", "x") in cell:
                yield (
                    (float(row[0]), name),
                    _xy(cell[name, "thorax", "x"], cell[name, "thorax", "y"]),
                )


def _most(line):
    return max(",\t;", key=line.count)


READERS = {
    "idtracker": _idtracker,
    "idtracker.ai-csv": _idtracker_ai,
    "toxtrac": _toxtrac,
    "tracktor": _named("pos_x", "pos_y"),
    "trackmate": _named("position_x", "position_y", "track_id", words=3, untracked=True),
    "fasttrack": _named("xbody", "ybody", frame="imagenumber"),
    "sleap-csv": _named("thorax.x", "thorax.y", "track", frame="frame_idx", untracked=True),
    "animalta": _animalta,
    "mot": _mot,
    "tidy": _named("x", "y"),
    "deeplabcut": _deeplabcut,
}
SEPARATORS = {
    "idtracker": lambda line: "\t",
    "idtracker.ai-csv": lambda line: ",",
    "toxtrac": lambda line: "\t",
    "tracktor": _most,
    "trackmate": _most,
    "fasttrack": _most,
    "sleap-csv": _most,
    "animalta": _most,
    "mot": lambda line: ",",
    "tidy": _most,
    "deeplabcut": lambda line: ",",
}
