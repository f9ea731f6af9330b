"""Text files as tables, with the line of whatever is wrong."""

import codecs
import csv
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from turing_learning.trajectories._recording import Place, refusal

LONGEST_LINE = 1 << 22
"""Bytes in a line beyond which a file is no table; a thousand key points need less than a tenth."""
BLOCK = 1 << 24  # bytes that are looked at together


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of a table: numbers (rows, columns), not a number where a cell is empty or says so; texts; and where a row is."""

    numbers: np.ndarray
    texts: tuple[list[str], ...]
    place: Place


@dataclass(frozen=True)
class Sheet:
    """A table by the names of its columns, which are at `place`; `read` is called with the places of `numbers` and `texts`."""

    names: list[str]
    read: Callable[..., Table]
    place: str


def array_sheet(values: np.ndarray, place: str) -> Sheet:
    """Return a table of numbers (rows, columns) without names."""

    def read(numbers: Sequence[int]) -> Table:
        return Table(values[:, list(numbers)].astype(np.float64), (), lambda row: f"{place}, row {row}")

    return Sheet([], read, place)


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
        line = raw.decode("utf-8-sig" if first else "utf-8").rstrip("\r\n")
    except UnicodeDecodeError as error:
        remedy = "It may be in Latin-1 or another encoding: save it as UTF-8."
        raise refusal("be text in UTF-8", f"byte {raw[error.start]:#04x}", place, remedy) from None
    if "\r" in line:
        raise refusal("have line ends of one kind", "a carriage return inside a line", place)
    return line


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


def read_sheet(path: Path, separator: str) -> Sheet:
    """Return a text file whose first line names its columns."""
    names = header(path, 1, separator)[0]

    def read(numbers: Sequence[int], texts: Sequence[int] = ()) -> Table:
        return read_table(path, separator, len(names), skip=1, numbers=numbers, texts=texts)

    return Sheet(names, read, f"{path}:1")


def read_table(
    path: Path, separator: str, width: int, *, skip: int, numbers: Sequence[int], texts: Sequence[int] = ()
) -> Table:
    """Read columns of a text file, by their places, after `skip` header lines; rows have `width` cells, perhaps
    with a separator after the last. Whatever is wrong is refused with file and line.
    """
    import pandas as pd

    def place(row: int) -> str:
        return f"{path}:{skip + 1 + int(row)}"

    most = width if _is_even(path, separator, width, skip) else _check_rows(path, separator, width, skip)
    frame = pd.read_csv(
        path, sep=separator, header=None, names=range(most), index_col=False, usecols=sorted({*numbers, *texts}),
        skiprows=skip, dtype=object, keep_default_na=False, na_filter=False, low_memory=False, encoding="utf-8-sig",
    )  # fmt: skip
    found = np.empty((len(frame), len(numbers)))
    for k, column in enumerate(numbers):
        values = frame[column].tolist()
        try:
            found[:, k] = list(map(float, values))
        except ValueError:  # empty cells, or no numbers
            found[:, k] = list(map(_number, values))
        wrong = np.isinf(found[:, k])
        if "_" in "".join(values):
            wrong |= ["_" in value for value in values]
        if wrong.any():
            row = int(np.argmax(wrong))
            raise refusal("have finite numbers or NaN", repr(values[row].strip()[:40]), place(row))
    return Table(found, tuple([cell.strip() for cell in frame[column]] for column in texts), place)


def _is_even(path: Path, separator: str, width: int, skip: int) -> bool:
    """Return whether a file is plain text, in UTF-8 without quotes and blank lines, with the separators of `width` cells in each.

    Others may be as good: `_check_rows` reads them line by line.
    """
    rest, lines = b"", 0
    with path.open("rb") as file:
        while block := file.read(BLOCK):
            text, end, after = (rest + block).rpartition(b"\n")
            text, rest = text + end, after
            signs = np.frombuffer(text, dtype=np.uint8)
            ends = np.flatnonzero(signs == ord("\n"))
            cuts, seen = (
                np.diff(np.searchsorted(np.flatnonzero(which), ends), prepend=0)
                for which in (signs == ord(separator), (signs > ord(" ")) & (signs < 127))
            )
            lengths = np.diff(ends, prepend=-1)
            known = cuts[max(skip - lines, 0) :] == width - 1
            lines += len(ends)
            if len(rest) > LONGEST_LINE or (lengths > LONGEST_LINE).any() or not (known.all() and seen.all()):
                return False
            if width == 1 or b'"' in text or b"\0" in text or text.count(b"\r") != text.count(b"\r\n"):
                return False
            try:
                text.decode("utf-8")
            except UnicodeDecodeError:
                return False
    return lines > skip and not rest


def _number(cell: str) -> float:
    """Return the number that a cell is, infinite where it is none."""
    try:
        return float(cell)
    except ValueError:
        return np.inf if cell.strip() else np.nan


def _check_rows(path: Path, separator: str, width: int, skip: int) -> int:
    """Return the most cells of a row, an empty last one included; refuse a file without rows, or a row with another number."""
    number, most = 0, width
    for number, line in read_lines(path):
        if number <= skip:
            continue
        row = cells(line, separator, f"{path}:{number}")
        count = len(row) - (len(row) == width + 1 and not row[-1])
        most = max(most, len(row))
        if count != width:
            remedy = "The file may be cut off or damaged."
            raise refusal(f"have {width} cells in each row", count, f"{path}:{number}", remedy)
    if number <= skip:
        raise refusal("have at least one row", "none", path)
    return most
