"""What readers share: arrays, rates, HDF5, and text in tables."""

import codecs
import csv
import io
import pickle
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.errors import brief, refuse
from turing_learning.trajectories._recording import LARGEST, Place, Recording, YAxis, check_positions, refusal

RATE_DIGITS = 5
"""Of a frame rate that times state: 29.97, or 0.0016667 with a frame every ten minutes."""
MOST_NUMBERS = 1 << 28
FREE_BYTES = 1 << 26
MOST_TIMES = 200
"""A file may unpack to `FREE_BYTES`, or to so many times its own size: recordings do not compress by more, and bombs do."""


def from_array(
    positions: np.ndarray,
    names: tuple[str, ...],
    place: str | Place,
    *,
    confidence: np.ndarray | None = None,
    headings: np.ndarray | None = None,
    first_frame: int = 0,
    fps: float | None = None,
    unit: str | None = None,
    y_axis: YAxis | None = "down",
    numbered: bool = True,
    remarks: tuple[str, ...] = (),
) -> Recording:
    """Return the recording of positions (F, A, 2), not a number where missing; `place` is that of all, or says where a frame is."""
    frames, count = positions.shape[:2]
    at = place if callable(place) else lambda frame: f"{place}, frame {frame}"
    infinite = np.isinf(positions)
    if infinite.any():
        raise refusal("have finite positions or NaN", "an infinite one", at(int(np.argwhere(infinite)[0][0])))
    present = check_positions(positions.reshape(-1, 2), lambda row: at(row // count)).reshape(frames, count)
    if not present.any():
        raise refusal("hold at least one position", "none", at(0) if callable(place) else place)
    return Recording(
        first_frame=first_frame,
        individuals=names,
        positions=np.where(present[..., None], positions, 0.0),
        present=present,
        confidence=None if confidence is None else np.where(present, np.nan_to_num(confidence), 0.0),
        headings=None if headings is None else np.where(present, np.nan_to_num(headings), 0.0),
        fps=fps,
        unit=unit,
        y_axis=y_axis,
        numbered=numbered,
        remarks=remarks,
    )


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
    return float(f"{fps:.{RATE_DIGITS}g}") if np.abs(late).max() < 0.1 else None


def check_rate(value: object, path: object) -> float:
    """Return a frame rate that a file states, if it can be one."""
    stated = np.asarray(value)
    fps = float(stated.ravel()[0]) if stated.size == 1 and stated.dtype.kind in "fiu" else np.nan
    if not (np.isfinite(fps) and fps > 0):
        raise refusal("state a frame rate above 0", repr(value), path)
    return fps


def check_unpacked(size: int, path: Path, most: int = 8 * MOST_NUMBERS) -> None:
    """Refuse what unpacks to more bytes than a recording of the file's size does."""
    most = min(most, max(FREE_BYTES, MOST_TIMES * path.stat().st_size))
    if size > most:
        raise refusal(f"unpack to at most {most} bytes", size, path)


_DAMAGE = (OSError, RuntimeError, KeyError, TypeError, AttributeError, ValueError, OverflowError, MemoryError)
"""What HDF5 raises on damaged files."""


@contextmanager
def open_hdf5(path: Path) -> Iterator[Any]:
    """Open a file; whatever HDF5 cannot read is an error that names the file."""
    try:
        import h5py  # type: ignore[import-untyped, unused-ignore]
    except ImportError:
        raise ImportError(f"h5py is needed to read {path}: pip install 'turing-learning[tracking]'") from None
    try:
        with h5py.File(path, "r") as file:
            yield file
    except _DAMAGE as error:
        if str(path) in str(error) and isinstance(error, ValueError):  # a reader's own refusal
            raise
        raise refusal("be a whole HDF5 file", str(error)[:120], path, "The file may be cut off or damaged.") from None


def names_in(path: Path) -> frozenset[str]:
    """Return what is at the top of an HDF5 file, with "pandas_type" if there is a table of pandas."""
    with open_hdf5(path) as file:
        import h5py

        own = [name for name in file if isinstance(file.get(name, getlink=True), h5py.HardLink)]
        return frozenset([*file, *(["pandas_type"] if any("pandas_type" in file[name].attrs for name in own) else [])])


def member(file: Any, name: str, path: Path) -> Any:
    """Return a member of a file, None if there is none; refuse one that lies in another file, or unpacks to too much."""
    import h5py

    elsewhere = isinstance(file.get(name, getlink=True), h5py.ExternalLink)
    found: Any = None if elsewhere else file.get(name)
    stored = isinstance(found, h5py.Dataset)
    if elsewhere or (stored and (found.external or found.is_virtual)):
        raise refusal("hold its data itself", "a link to another file", f"{path}, {name}", "Copy the data into it.")
    if stored and found.dtype.kind != "O":
        if found.size > MOST_NUMBERS:
            raise refusal(f"hold at most {MOST_NUMBERS} numbers", found.shape, f"{path}, dataset {name}")
        check_unpacked(found.size * found.dtype.itemsize, path)
    return found


def dataset(file: Any, name: str, dimensions: int, path: Path) -> np.ndarray:
    """Return a dataset of numbers."""
    found = member(file, name, path)
    shape = getattr(found, "shape", None)
    if shape is None or len(shape) != dimensions or found.dtype.kind not in "fiu" or 0 in shape:
        received = "none" if shape is None else f"{found.dtype} {shape}"
        raise refusal(f"hold numbers with {dimensions} dimensions, not empty", received, f"{path}, dataset {name}")
    return np.asarray(found, dtype=np.float64)


def texts(file: Any, name: str, path: Path) -> list[str]:
    """Return a dataset of names; empty if there is none."""
    found = member(file, name, path)
    shape = getattr(found, "shape", (0,))
    if 0 in shape:
        return []
    if len(shape) != 1 or shape[0] > FREE_BYTES >> 8:
        raise refusal("hold a list of names", shape, f"{path}, dataset {name}")
    return [text(item) for item in found[()]]


def text(value: Any) -> str:
    """Return a name or attribute as text."""
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else str(value)


def plain_pickle(content: bytes) -> Any:
    """Return lists, tuples and texts from a pickle, in which pandas names columns; one that calls anything is refused."""

    class Plain(pickle.Unpickler):
        def find_class(self, module: str, name: str) -> Any:
            raise pickle.UnpicklingError(f"a pickle that calls {module}.{name}")

    try:
        return Plain(io.BytesIO(content)).load()
    except Exception as error:  # a damaged pickle can raise anything
        raise ValueError(str(error)) from None


def choose(keypoint: str | None, names: Sequence[str], place: object) -> str:
    """Return the key point asked for, or the only one there is."""
    if keypoint is None and len(names) == 1:
        return names[0]
    if keypoint is None or keypoint not in names:
        remedy = "Say which point of the body stands for the animal."
        refuse("keypoint", f"be one of {', '.join(names)}", brief(keypoint), remedy, place=str(place))
    return keypoint


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
            remedy = "Write decimals with a point." if "," in values[row] else ""
            raise refusal("have finite numbers or NaN", repr(values[row].strip()[:40]), place(row), remedy)
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
