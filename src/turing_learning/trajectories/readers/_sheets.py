"""Text files as tables: lines, cells, and columns by their names."""

import codecs
import csv
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import islice
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
    origin: str  #: Where the names of columns are
    at: Callable[[int], str]  #: Where a row is
    remark: str = ""  #: What was left out
    units: Mapping[str, str] = field(default_factory=dict)
    """Name in small letters -> unit that a further header line states, as "micron" of "(micron)"."""
    fps: float | None = None  #: Frame rate that a comment above the table states
    decimal_comma: bool = False  #: Whether decimals may follow a comma


UNENDED = "the last line has no line end and is left out: it may be cut off"
"""What is said of a text whose last line may be half a line."""
MOST_COMMENTS = 1000
"""Lines before the names of columns."""
MOST_TITLES = 10
"""Lines with a title before the names of columns."""
_SEPARATOR_LINE = re.compile(r'"?sep=.?"?[,;\t]*', re.IGNORECASE)
"""What tells Excel the separator, and is no row."""
HEAD_BYTES = 1 << 16
"""Bytes at the beginning of a file that show its encoding."""
HEAD_LINES = 4
"""Lines that show what is in a table: names of columns, and units, which TrackMate writes below them."""
UTF16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_UNDECODED = re.compile("[\udc80-\udcff]")
"""What stands for bytes that are none of the encoding."""


def encoding_of(head: bytes) -> str:
    """Return the encoding of a text by its beginning: UTF-16 by its mark, UTF-8, or Windows-1252, which has Latin-1.

    Programs in western languages write degree and micro signs, and names, in Windows-1252. A file in
    UTF-8 with one damaged line is none: other bytes are in its first lines, or in several.
    """
    if head.startswith(UTF16_MARKS):
        return "utf-16"
    foreign = []
    # the last character of the head may be cut off
    for number, line in enumerate(head.rstrip(bytes(range(128, 256))).splitlines()):
        if line.isascii():
            continue
        if _UNDECODED.search(line.decode("utf-8", "surrogateescape")):
            foreign.append(number)
        elif number or not line.removeprefix(codecs.BOM_UTF8).isascii():
            return "utf-8-sig"
    if foreign and (foreign[0] < HEAD_LINES or len(foreign) > 1):
        return "cp1252"
    return "utf-8-sig"


@dataclass(frozen=True)
class TableText:
    """A text file with a table, and what stands before the names of its columns."""

    path: Path
    encoding: str
    skipped: int  #: Lines that are none of the table: comments, titles, and what tells Excel the separator
    commented: bool  #: Whether the line after them begins with "#", too, and names the columns
    titles: tuple[str, ...] = ()  #: Titles among these lines
    fps: float | None = None  #: Frame rate that a comment states
    unit: str = ""  #: Of positions, as "m", where a comment states it
    ended: bool = True  #: Whether the last line has a line end

    @classmethod
    def of(cls, path: Path) -> "TableText":
        """Return a file with what stands before its table."""
        with path.open("rb") as file:
            encoding = encoding_of(file.read(HEAD_BYTES))
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - 2))
            tail = file.read()
        ended = tail.endswith(b"\n")
        if encoding == "utf-16":
            ended = size % 2 == 0 and tail in (b"\n\0", b"\0\n")
        lines = _lines(path, encoding)
        line = next(lines, "")
        skipped = 0
        if _SEPARATOR_LINE.fullmatch(line.strip()):
            skipped = 1
            line = next(lines, "")
        comments: list[str] = []
        while skipped + len(comments) < MOST_COMMENTS:
            # comments of programs have blank lines between them
            if not line.startswith("#") and not (comments and line.isspace()):
                break
            comments.append(line)
            line = next(lines, "")
        commented = bool(comments) and _names_columns(comments[-1], line)
        titles: list[str] = []
        if not commented:
            titles = _titles([line, *islice(lines, MOST_TITLES)])
        text = "".join(comments)
        fps = None
        rate = _RATE_IN_COMMENT.search(text)
        if rate:
            fps = float(rate[1])
        unit = ""
        named = _UNIT_IN_COMMENT.search(text)
        if named:
            unit = UNITS_IN_COMMENTS[named[1].lower()[0]]
        return cls(
            path,
            encoding,
            skipped + len(comments) + len(titles) - commented,
            commented,
            tuple(filter(None, titles)),
            fps,
            unit,
            ended,
        )

    def first_lines(self, count: int) -> list[str]:
        """Return the first lines of the table, as far as they are text, without their ends."""
        lines = []
        for line in islice(_lines(self.path, self.encoding), self.skipped, self.skipped + count):
            lines.append(_UNDECODED.sub("\N{REPLACEMENT CHARACTER}", line.rstrip("\r\n")))
        if self.commented:
            lines[0] = _uncommented(lines[0])
        return lines

    @property
    def separator(self) -> str:
        """What separates the cells of the first line."""
        return separator_of(next(iter(self.first_lines(1)), ""))

    def lines(self) -> Iterator[tuple[int, str]]:
        """Yield number and text of each line of the table; blank lines are accepted at its end only.

        A last line without a line end is none: it may be cut off, and "97" what is left of "970".
        """
        blank = 0
        empty: list[tuple[int, str]] = []
        for number, line in enumerate(_lines(self.path, self.encoding), start=1):
            row = self._whole(line, number)
            if number <= self.skipped or not line.endswith("\n"):
                continue
            if self.commented and number == self.skipped + 1:
                row = _uncommented(row)
            if not row or row.isspace():
                blank = blank or number
            elif blank:
                remedy = "Remove it, and what stands below it if that is no row."
                where = f"{self.path}:{blank}"
                raise refusal("have no blank line inside", "an empty line", where, remedy)
            elif not row.strip(" ,;"):
                # a spreadsheet ends with them; between rows they are rows of missing values
                empty.append((number, row))
            else:
                yield from empty
                empty = []
                yield number, row

    def _whole(self, line: str, number: int) -> str:
        """Return a line without its end; refuse one that is cut off, or is no text."""
        where = f"{self.path}:{number}"
        if len(line) > LONGEST_LINE:
            rule = f"have lines of at most {LONGEST_LINE} characters"
            raise refusal(rule, "a longer one", where)
        line = line.rstrip("\r\n")
        if "\0" in line:
            raise refusal("be a text file", "a zero byte", where)
        if "\r" in line:
            got = "a carriage return inside a line"
            raise refusal("have line ends of one kind", got, where)
        foreign = None if line.isascii() else _UNDECODED.search(line)
        if foreign:
            remedy = "It may be damaged, or in another encoding: save it as UTF-8."
            raise refusal(
                "be text in UTF-8", f"byte {ord(foreign[0]) - 0xDC00:#04x}", where, remedy
            )
        if self.encoding == "utf-16" and "\N{REPLACEMENT CHARACTER}" in line:
            raise refusal("be whole text in UTF-16", "half a character", where)
        return line

    def header(self, count: int, separator: str) -> list[list[str]]:
        """Return the cells of the first lines."""
        rows = []
        for number, line in islice(self.lines(), count):
            cells = cells_of(line, separator, self.path, number)
            rows.append([cell.strip() for cell in cells])
        if len(rows) < count:
            raise refusal(f"have {count} header lines", len(rows), self.path)
        return rows


def _lines(path: Path, encoding: str) -> Iterator[str]:
    """Yield the lines of a text with their ends; bytes that are none of the encoding are marked, see `_UNDECODED`."""
    # UTF-16 has no such marks for bytes below 128
    errors = "replace" if encoding == "utf-16" else "surrogateescape"
    with path.open(encoding=encoding, errors=errors, newline="\n") as file:
        yield from iter(lambda: file.readline(LONGEST_LINE + 1), "")


def _titles(lines: Sequence[str]) -> list[str]:
    """Return the lines above the names of columns that have one cell alone, as Imaris writes "Position"."""
    for count, line in enumerate(lines[:-1]):
        if re.search("[,;\t]", line):
            above = lines[:count] if _names_columns(line, lines[count + 1]) else []
            return [title.strip() for title in above]
    return []


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


def _names_columns(header: str, row: str) -> bool:
    """Return whether a line, perhaps a comment as `numpy.savetxt` writes it, names the columns of the row below it."""
    text = _uncommented(header)
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


def text_sheet(
    text: TableText,
    separator: str,
    names: Sequence[str],
    *,
    skip: int = 1,
    absent: Sequence[str] = (),
) -> Sheet:
    """Return a text file with these columns after `skip` header lines; whatever is wrong is refused with its line.

    Cells that say one of `absent`, or of `MISSING`, in any case, are not a number.
    """
    path = text.path
    width = len(names)
    decimal_comma = separator != ","

    def read(
        numbers: Sequence[int], texts: Sequence[int] = ()
    ) -> tuple[np.ndarray, list[list[str]]]:
        blocks: list[np.ndarray] = []
        words: list[list[str]] = [[] for _ in texts]
        lines = islice(text.lines(), skip, None)
        # In blocks, so that a large file needs memory for its numbers alone
        while block := list(islice(lines, ROWS)):
            cells: list[str] = []
            for number, line in block:
                cells += cells_of(line, separator, path, number, width)
            values = np.zeros((len(block), len(numbers)))
            for column, k in enumerate(numbers):
                values[:, column] = _numbers(cells[k::width], absent, decimal_comma=decimal_comma)
            blocks.append(values)
            # Cells that are no numbers were marked as infinite
            for row, column in np.argwhere(np.isinf(values)):
                cell = cells[row * width + numbers[column]].strip()
                remedy = "Write decimals with a point." if "," in cell else ""
                rule = "have finite numbers or NaN"
                raise refusal(rule, repr(cell[:40]), f"{path}:{block[row][0]}", remedy)
            for column_of_words, k in zip(words, texts, strict=True):
                column_of_words += map(str.strip, cells[k::width])
        if not blocks:
            raise refusal("have at least one row", "none", path)
        return np.concatenate(blocks), words

    first_row = text.skipped + skip + 1
    remarks = []
    if text.titles:
        remarks.append(f"lines above the names of columns are no rows: {', '.join(text.titles)}")
    if text.encoding == "cp1252":
        remarks.append("the text is no UTF-8 and was read as Windows-1252")
    if not text.ended:
        remarks.append(UNENDED)
    units = {}
    if text.unit:
        units = {"x": text.unit, "y": text.unit}
    return Sheet(
        names,
        read,
        f"{path}:{text.skipped + 1}",
        lambda row: f"{path}:{first_row + row}",
        remark="; ".join(remarks),
        units=units,
        fps=text.fps,
        decimal_comma=decimal_comma,
    )


MISSING = (
    "nan", "na", "n/a", "none", "null", "-", "--", "\N{EN DASH}", ".", "missing", "#n/a", "#value!", "#div/0!",
)  # fmt: skip
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
        number = number_of(word)
        if word.lower() in absent:
            number = np.nan
        values.append(number)
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
    text = TableText.of(path)
    separator = separator or text.separator
    names = text.header(1, separator)[0]
    if _has_row_names(text, separator, len(names)):
        names = ["", *names]
    extra_lines = _more_header_lines(text, separator, names)
    sheet = text_sheet(text, separator, names, skip=1 + len(extra_lines), absent=absent)
    if extra_lines:
        count = len(extra_lines)
        cells = cells_of(extra_lines[-1], separator, path, 1 + count)
        return below_header(sheet, count, extra_lines[-1], cells)
    return sheet


def below_header(sheet: Sheet, count: int, line: str, cells: Sequence[str]) -> Sheet:
    """Return a table that says how many more header lines it had, and has the units in the last of them."""
    below = f"{count} more header lines are no rows: {line}"
    remark = "; ".join(filter(None, [sheet.remark, below]))
    return replace(sheet, remark=remark, units={**sheet.units, **_units_in(cells, sheet.names)})


def _has_row_names(text: TableText, separator: str, width: int) -> bool:
    """Return whether rows begin with a quoted name that has no header, as R writes them."""
    for number, line in islice(text.lines(), 1, 2):
        return (
            line.startswith('"') and len(cells_of(line, separator, text.path, number)) == width + 1
        )
    return False


def _units_in(cells: Sequence[str], names: Sequence[str]) -> dict[str, str]:
    """Return name in small letters -> unit of the cells below it, perhaps in brackets, as "(micron)"."""
    units = {}
    for name, cell in zip(names, cells, strict=False):
        unit = re.sub(r"^[(\[](.+)[)\]]$", r"\1", cell.strip()).strip()
        if unit:
            units[name.lower()] = unit.lower()
    return units


MOST_HEADER_LINES = 3
"""Lines below the first one in which TrackMate says what columns are, and their units."""


def _more_header_lines(text: TableText, separator: str, names: Sequence[str]) -> list[str]:
    """Return the lines below the header that say something, and in no cell a number or a missing one."""
    extra_lines: list[str] = []
    if {"frame", *TIME}.isdisjoint(name.lower() for name in names):
        return extra_lines
    for number, line in islice(text.lines(), 1, 1 + MOST_HEADER_LINES):
        cells = [cell.strip() for cell in cells_of(line, separator, text.path, number)]
        lacking = len(names) - len(cells)
        words = list(filter(None, cells))
        if separator != ",":
            words = [word.replace(",", ".") for word in words]
        values = [np.isfinite(number_of(cell)) or cell.lower() in MISSING for cell in words]
        # the last cell may be empty
        if lacking not in (0, 1) or not words or any(values) or cells == list(names):
            break
        extra_lines.append(line)
    return extra_lines
