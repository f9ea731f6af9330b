"""What readers share: frame rates, key points, and text in tables."""

import codecs
import csv
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path

import numpy as np

from turing_learning.errors import brief, require

from .._recording import LARGEST, Place, refusal, refuse_first


def rounded(rate: float) -> float:
    """Return a frame rate that times state with five digits: 29.97, or 0.0016667 with a frame every ten minutes."""
    return float(f"{rate:.5g}")


def stated_rate(seconds: np.ndarray, frames: np.ndarray) -> float | None:
    """Return the frame rate that times (s) of frames state, or None if they do not to a tenth of a frame."""
    known = np.abs(seconds) <= LARGEST
    if known.sum() < 2:
        return None
    seconds, frames = seconds[known], frames[known]
    span = seconds[-1] - seconds[0]
    if span <= 0:
        return None
    fps = float((frames[-1] - frames[0]) / span)
    late = (seconds - seconds[0]) * fps - (frames - frames[0])
    return rounded(fps) if np.abs(late).max() < 0.1 else None


def check_rate(value: object, path: object) -> float:
    """Return a frame rate that a file states, if it can be one."""
    stated = np.asarray(value)
    fps = float(stated.ravel()[0]) if stated.size == 1 and stated.dtype.kind in "fiu" else np.nan
    if not (np.isfinite(fps) and fps > 0):
        raise refusal("state a frame rate above 0", repr(value), path)
    return fps


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
    at: Place  #: Where a row is


def check_times(seconds: np.ndarray, sheet: Sheet) -> None:
    """Refuse absurd times (rows,) of a table."""
    refuse_first(~(np.abs(seconds) <= LARGEST), sheet.at, f"have times within +-{LARGEST:.0e} s", seconds)


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
