"""Text files: lines, cells and numbers, with the line of whatever is wrong."""

import codecs
import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from turing_learning.trajectories._recording import refusal

LONGEST_LINE = 1 << 22
"""Bytes in a line beyond which a file is no table; a thousand key points need less than a tenth."""
CHUNK = 20_000


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of a text file.

    Attributes
    ----------
    numbers : (rows, columns)
        Not a number where a cell is empty or says so.
    texts
        The text columns, cell by cell.
    """

    path: Path
    first_line: int
    numbers: np.ndarray
    texts: tuple[list[str], ...]

    def place(self, row: int) -> str:
        """Return file:line of a row."""
        return f"{self.path}:{self.first_line + int(row)}"


def read_lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield number and text of each line; blank lines are accepted at the end only."""
    blank = 0
    with path.open("rb") as file:
        for number, raw in enumerate(iter(lambda: file.readline(LONGEST_LINE + 1), b""), start=1):
            line = _decoded(raw, f"{path}:{number}", first=number == 1)
            if not line.strip():
                blank = blank or number
                continue
            if blank:
                raise refusal("have no blank line inside", "an empty line", f"{path}:{blank}")
            yield number, line


def refuse_utf16(raw: bytes, place: object) -> None:
    """Refuse a file that begins with the mark of UTF-16, in which lines cannot be told from bytes."""
    if raw.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise refusal("be text in UTF-8", "UTF-16", place, "Save it as UTF-8.")


def _decoded(raw: bytes, place: str, *, first: bool) -> str:
    if first:
        refuse_utf16(raw, place)
    if len(raw) > LONGEST_LINE:
        raise refusal(f"have lines of at most {LONGEST_LINE} bytes", "a longer one", place)
    if not raw.endswith(b"\n"):
        remedy = "The file may be cut off; if it is whole, add a line end."
        raise refusal("end with a line end", f"{raw[-20:]!r}", place, remedy)
    if b"\0" in raw:
        raise refusal("be a text file", "a zero byte", place)
    try:
        return raw.decode("utf-8-sig" if first else "utf-8").rstrip("\r\n")
    except UnicodeDecodeError as error:
        remedy = "It may be in Latin-1 or another encoding: save it as UTF-8."
        raise refusal("be text in UTF-8", f"byte {raw[error.start]:#04x}", place, remedy) from None


def cells(line: str, separator: str, place: str) -> list[str]:
    """Return the cells of a line, quotes taken off."""
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, strict=True))]
    except csv.Error as error:
        raise refusal("have complete quotes", str(error), place) from None


def header(path: Path, lines: int, separator: str) -> list[list[str]]:
    """Return the cells of the first lines; a separator at the end of a line opens no further cell."""
    rows = []
    for number, line in islice(read_lines(path), lines):
        row = cells(line, separator, f"{path}:{number}")
        rows.append(row if row[-1] else row[:-1])
    if len(rows) < lines:
        raise refusal(f"have {lines} header lines", len(rows), path)
    return rows


def read_table(
    path: Path,
    separator: str,
    width: int,
    *,
    skip: int,
    numbers: Sequence[int],
    texts: Sequence[int] = (),
) -> Table:
    """Read columns of a text file.

    Parameters
    ----------
    width
        Number of cells in each row; a separator may follow the last.
    skip
        Number of header lines.
    numbers, texts
        Places of the columns to be read.

    Raises
    ------
    ValueError
        If a row has another number of cells, a number is none, or there is no row; with file and line.
    """
    chunks: list[np.ndarray] = []
    kept: tuple[list[str], ...] = tuple([] for _ in texts)
    rows: list[list[str]] = []
    first = skip + 1
    for number, line in read_lines(path):
        if number <= skip:
            continue
        rows.append(_row(line, separator, width, f"{path}:{number}"))
        for column, into in zip(texts, kept, strict=True):
            into.append(rows[-1][column])
        if len(rows) == CHUNK:
            chunks.append(_to_numbers(rows, numbers, path, first))
            rows, first = [], number + 1
    if rows:
        chunks.append(_to_numbers(rows, numbers, path, first))
    if not chunks:
        raise refusal("have at least one row", "none", path)
    return Table(path, skip + 1, np.concatenate(chunks), kept)


def _row(line: str, separator: str, width: int, place: str) -> list[str]:
    row = cells(line, separator, place)
    if len(row) == width + 1 and not row[-1]:
        row.pop()
    if len(row) != width:
        raise refusal(f"have {width} cells in each row", len(row), place, "The file may be cut off or damaged.")
    return row


def _to_numbers(rows: list[list[str]], columns: Sequence[int], path: Path, first: int) -> np.ndarray:
    """Return the cells (rows, columns) as floats."""
    result = np.empty((len(rows), len(columns)))
    for k, row in enumerate(rows):
        for i, column in enumerate(columns):
            result[k, i] = _number(row[column], path, first + k)
    return result


def _number(cell: str, path: Path, line: int) -> float:
    if not cell:
        return np.nan
    try:
        value = float(cell)
    except ValueError:
        value = np.inf
    if "_" in cell or np.isinf(value):
        raise refusal("have finite numbers or NaN", repr(cell[:40]), f"{path}:{line}")
    return value
