"""Text files as tables: lines, cells, and columns by their names."""

import codecs
import csv
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from pathlib import Path

import numpy as np

from .._recording import refusal
from ._times import TIME

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
    units: Mapping[str, str] = field(default_factory=dict)
    """Name in small letters -> unit that a further header line states, as "micron" of "(micron)"."""
    fps: float | None = None  #: Frame rate that a comment above the table states


MOST_COMMENTS = 1000
"""Lines before the names of columns."""
_SEPARATOR_LINE = re.compile(r'"?sep=.?"?[,;\t]*', re.IGNORECASE)
"""What tells Excel the separator, and is no row."""


@dataclass(frozen=True)
class Opening:
    """What stands before the first line of a table."""

    skipped: int  #: Lines that are none of the table: comments, and what tells Excel the separator
    commented: bool  #: Whether the line after them begins with "#", too, and names the columns
    fps: float | None = None  #: Frame rate that a comment states
    unit: str = ""  #: Of positions, as "m", where a comment states it


def opening_of(path: Path) -> Opening:
    """Return what stands before the first line of a table."""
    with path.open("rb") as file:

        def following() -> str:
            return file.readline(LONGEST_LINE).decode("utf-8-sig", errors="replace")

        line = following()
        skipped = 0
        if _SEPARATOR_LINE.fullmatch(line.strip()):
            skipped = 1
            line = following()
        comments: list[str] = []
        while skipped + len(comments) < MOST_COMMENTS:
            # comments of programs have blank lines between them
            if not line.startswith("#") and not (comments and line.isspace()):
                break
            comments.append(line)
            line = following()
    commented = bool(comments) and _names_columns(comments[-1], line)
    text = "".join(comments)
    rate = _RATE_IN_COMMENT.search(text)
    unit = _UNIT_IN_COMMENT.search(text)
    return Opening(
        skipped + len(comments) - commented,
        commented,
        None if rate is None else float(rate[1]),
        "" if unit is None else UNITS_IN_COMMENTS[unit[1].lower()[0]],
    )


_RATE_IN_COMMENT = re.compile(
    r"^# *(?:frame ?rate|fps)\b[^0-9\n]{0,20}([0-9]+(?:\.[0-9]+)?)", re.I | re.M
)
"""The frame rate that PeTrack and JuPedSim write above a table: `# framerate: 16 fps`."""
_UNIT_IN_COMMENT = re.compile(
    r"^# *X, *Y.*\(in (m|metres|meters|cm|centimetres|centimeters)\)", re.I | re.M
)
"""The unit that JuPedSim writes there: `#X,Y,Z: the agents coordinates (in metres)`."""
UNITS_IN_COMMENTS = {"m": "m", "c": "cm"}
"""First letter of its name -> unit."""


def _names_columns(comment: str, row: str) -> bool:
    """Return whether a comment names the columns of the row below it, as `numpy.savetxt` writes it."""
    text = _uncommented(comment)
    separator = separator_of(text)
    with suppress(csv.Error):
        names = [cell.strip() for cell in cells_in(text, separator)]
        cells = [cell.strip().replace(",", ".") for cell in cells_in(row.strip("\r\n"), separator)]
        numbers = [np.isfinite(number_of(cell)) for cell in cells]
        words = not any(np.isfinite(number_of(name)) for name in names)
        return len(names) == len(cells) > 1 and words and any(numbers)
    return False


def _uncommented(line: str) -> str:
    return line.lstrip("#").strip()


def first_lines(path: Path, count: int) -> list[str]:
    """Return the first lines of a table, as far as they are text, without their ends."""
    opening = opening_of(path)
    with path.open("rb") as file:
        raw = [file.readline(LONGEST_LINE) for _ in range(opening.skipped + count)]
    lines = []
    for line in raw[opening.skipped :]:
        text = line.removeprefix(codecs.BOM_UTF8).decode("utf-8", "replace")
        lines.append(text.rstrip("\r\n"))
    if opening.commented:
        lines[0] = _uncommented(lines[0])
    return lines


def read_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield number and text of each line of a whole text in UTF-8; blank lines are accepted at its end only.

    What stands before the table is left out.
    """
    opening = opening_of(path)
    blank = 0
    with path.open("rb") as file:
        for number, raw in enumerate(iter(lambda: file.readline(LONGEST_LINE + 1), b""), start=1):
            line = _decoded(raw, path, number)
            if number <= opening.skipped:
                continue
            if opening.commented and number == opening.skipped + 1:
                line = _uncommented(line)
            if not line or line.isspace():
                blank = blank or number
            elif blank:
                remedy = "Remove it, and what stands below it if that is no row."
                where = f"{path}:{blank}"
                raise refusal("have no blank line inside", "an empty line", where, remedy)
            else:
                yield number, line


def refuse_utf16(raw: bytes, source: object) -> None:
    """Refuse a file that begins with the mark of UTF-16, in which lines cannot be told from bytes."""
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise refusal("be text in UTF-8", "UTF-16", source, "Save it as UTF-8.")


def _decoded(raw: bytes, path: Path, number: int) -> str:
    """Return the text of a line, without its end."""
    if not raw.endswith(b"\n"):
        if len(raw) > LONGEST_LINE:
            raise refusal(
                f"have lines of at most {LONGEST_LINE} bytes", "a longer one", f"{path}:{number}"
            )
        remedy = "The file may be cut off; if it is whole, add a line end."
        raise refusal("end with a line end", f"{raw[-20:]!r}", f"{path}:{number}", remedy)
    if number == 1:
        refuse_utf16(raw, f"{path}:1")
        raw = raw.removeprefix(codecs.BOM_UTF8)
    line = raw.rstrip(b"\r\n")
    if b"\0" in line:
        raise refusal("be a text file", "a zero byte", f"{path}:{number}")
    if b"\r" in line:
        raise refusal(
            "have line ends of one kind", "a carriage return inside a line", f"{path}:{number}"
        )
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError as error:
        remedy = "It may be in Latin-1 or another encoding: save it as UTF-8."
        got = f"byte {line[error.start]:#04x}"
        raise refusal("be text in UTF-8", got, f"{path}:{number}", remedy) from None


def cells_of(line: str, separator: str, path: Path, number: int, width: int = 0) -> list[str]:
    """Return the cells of a line, `width` of them if it is given, quotes taken off."""
    try:
        row = cells_in(line, separator)
    except csv.Error as error:
        raise refusal("have complete quotes", str(error), f"{path}:{number}") from None
    if (
        len(row) > (width or 1) and not row[-1].strip()
    ):  # a separator at the end opens no further cell
        row.pop()
    if width and len(row) != width:
        remedy = "The file may be cut off or damaged."
        raise refusal(f"have {width} cells in each row", len(row), f"{path}:{number}", remedy)
    return row


def header(path: Path, lines: int, separator: str) -> list[list[str]]:
    """Return the cells of the first lines."""
    head = islice(read_lines(path), lines)
    rows = [
        [cell.strip() for cell in cells_of(line, separator, path, number)] for number, line in head
    ]
    if len(rows) < lines:
        raise refusal(f"have {lines} header lines", len(rows), path)
    return rows


def text_sheet(
    path: Path, separator: str, names: Sequence[str], *, skip: int = 1, absent: Sequence[str] = ()
) -> Sheet:
    """Return a text file with these columns after `skip` header lines; whatever is wrong is refused with its line.

    Cells that say one of `absent`, or of `MISSING`, in any case, are not a number.
    """
    width = len(names)
    decimal_comma = separator != ","

    def read(
        numbers: Sequence[int], texts: Sequence[int] = ()
    ) -> tuple[np.ndarray, list[list[str]]]:
        blocks: list[np.ndarray] = []
        words: list[list[str]] = [[] for _ in texts]
        lines = islice(read_lines(path), skip, None)
        while block := list(islice(lines, ROWS)):
            cells = list(
                chain.from_iterable(
                    cells_of(line, separator, path, number, width) for number, line in block
                )
            )
            columns = [
                _numbers(cells[k::width], absent, decimal_comma=decimal_comma) for k in numbers
            ]
            blocks.append(np.column_stack(columns) if columns else np.zeros((len(block), 0)))
            for row, column in np.argwhere(np.isinf(blocks[-1])):
                cell = cells[row * width + numbers[column]].strip()
                remedy = "Write decimals with a point." if "," in cell else ""
                raise refusal(
                    "have finite numbers or NaN", repr(cell[:40]), f"{path}:{block[row][0]}", remedy
                )
            for column, k in zip(words, texts, strict=True):
                column += map(str.strip, cells[k::width])
        if not blocks:
            raise refusal("have at least one row", "none", path)
        return np.concatenate(blocks), words

    opening = opening_of(path)
    skipped = opening.skipped
    units = dict.fromkeys("xy", opening.unit) if opening.unit else {}
    return Sheet(
        names,
        read,
        f"{path}:{skipped + 1}",
        lambda row: f"{path}:{skipped + skip + 1 + row}",
        units=units,
        fps=opening.fps,
    )


MISSING = ("nan", "na", "n/a", "none", "null", "-", "--", "missing")
"""What a cell of a row may say where there is no number, and none of a header line."""


def _numbers(cells: list[str], absent: Sequence[str], *, decimal_comma: bool) -> np.ndarray:
    """Return the numbers that cells are, not a number where one is empty or says so, infinite where it is none."""
    if not absent and "_" not in "".join(cells):
        with suppress(ValueError):
            return np.array(list(map(float, cells)))
    # in a column with points a comma is a damage, or separates thousands
    decimal_comma = decimal_comma and not any("." in cell for cell in cells)
    values = []
    for cell in cells:
        word = cell.strip()
        decimals = word.partition(",")[2]
        if decimal_comma and decimals.isdigit():
            word = word.replace(",", ".")
        values.append(np.nan if word.lower() in absent else number_of(word))
    return np.array(values)


def number_of(cell: str) -> float:
    """Return the number that a cell is, not a number where it is empty or says so, infinite where it is none."""
    if cell.lower() in MISSING:
        return np.nan
    with suppress(ValueError):
        return np.inf if "_" in cell else float(cell or "nan")
    return np.inf


def separator_of(line: str) -> str:
    """Return what separates the cells of a header line: a comma, tab, semicolon or bar, or spaces where there is none."""
    separator = max(",\t;|", key=line.count)
    if separator not in line and len(line.split()) > 1:
        return SPACES
    return separator


def first_separator(path: Path) -> str:
    """Return what separates the cells of the first line of a file."""
    return separator_of(first_lines(path, 1)[0])


SPACES = " "
"""Separator of tables whose columns stand below each other, with any number of spaces between them."""


def cells_in(line: str, separator: str) -> list[str]:
    """Return the cells of a line, quotes taken off; a damaged quote is a `csv.Error`."""
    if separator == SPACES:
        line = line.strip()
    if '"' in line:
        spaces = separator == SPACES
        reader = csv.reader([line], delimiter=separator, strict=True, skipinitialspace=spaces)
        return next(reader)
    return line.split() if separator == SPACES else line.split(separator)


def sheet_of(path: Path, separator: str = "", absent: Sequence[str] = ()) -> Sheet:
    """Return a text file whose first line names its columns, and shows what separates them unless that is said."""
    separator = separator or first_separator(path)
    names = header(path, 1, separator)[0]
    if _has_row_names(path, separator, len(names)):
        names = ["", *names]
    extra_lines = _more_header_lines(path, separator, names)
    sheet = text_sheet(path, separator, names, skip=1 + len(extra_lines), absent=absent)
    if extra_lines:
        remark = f"{len(extra_lines)} more header lines are no rows: {extra_lines[-1]}"
        units = _units_in(cells_of(extra_lines[-1], separator, path, 1 + len(extra_lines)), names)
        sheet = replace(sheet, remark=remark, units={**sheet.units, **units})
    return sheet


def _has_row_names(path: Path, separator: str, width: int) -> bool:
    """Return whether rows begin with a quoted name that has no header, as R writes them."""
    for number, line in islice(read_lines(path), 1, 2):
        return line.startswith('"') and len(cells_of(line, separator, path, number)) == width + 1
    return False


def _units_in(cells: Sequence[str], names: Sequence[str]) -> dict[str, str]:
    """Return name in small letters -> unit of the cells that are one in brackets, as "(micron)"."""
    units = {}
    for name, cell in zip(names, cells, strict=False):
        match = re.fullmatch(r"[(\[](.+)[)\]]", cell.strip())
        if match:
            units[name.lower()] = match[1].strip().lower()
    return units


MOST_HEADER_LINES = 3
"""Lines below the first one in which TrackMate says what columns are, and their units."""


def _more_header_lines(path: Path, separator: str, names: Sequence[str]) -> list[str]:
    """Return the lines below the header that say something, and in no cell a number or a missing one."""
    extra_lines: list[str] = []
    if {"frame", *TIME}.isdisjoint(name.lower() for name in names):
        return extra_lines
    for number, line in islice(read_lines(path), 1, 1 + MOST_HEADER_LINES):
        cells = [cell.strip() for cell in cells_of(line, separator, path, number)]
        lacking = len(names) - len(cells)
        words = [cell for cell in cells if cell]
        values = [np.isfinite(number_of(cell)) or cell.lower() in MISSING for cell in words]
        # the last cell may be empty
        if lacking not in (0, 1) or not words or any(values) or cells == list(names):
            break
        extra_lines.append(line)
    return extra_lines
