"""What a reader hands over: a recording as the file states it, before the user's scale and frame rate."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from turing_learning.errors import Refusal, RefusedError, Text

YAxis = Literal["up", "down"]


@dataclass(frozen=True, eq=False)
class Recording:
    """Positions in the units and axes of the file.

    Attributes
    ----------
    first_frame
        Number of the first frame in the file; frames follow without a break.
    positions : (F, A, 2)
        x, y; 0 where an individual is absent.
    present : (F, A)
        Whether the file has a position.
    confidence, headings : (F, A)
        The tracker's own confidence; heading (rad) in the axes of the file. None where the file has none.
    fps
        Frame rate, if the file states it.
    unit
        Of positions, "cm" or "px", if the file states it.
    y_axis
        Direction of y by the format's definition; None if the format has none.
    numbered
        Whether rows carry a frame number, so that their order in the file does not matter.
    remarks
        What the reader had to do: rows dropped, individuals left out.
    """

    first_frame: int
    individuals: tuple[str, ...]
    positions: np.ndarray
    present: np.ndarray
    confidence: np.ndarray | None = None
    headings: np.ndarray | None = None
    fps: float | None = None
    unit: str | None = None
    y_axis: YAxis | None = "down"
    numbered: bool = True
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Options:
    """What the user says to a reader."""

    keypoint: str | None = None
    allow_pickle: bool = False
    fps: float | None = None
    y_axis: YAxis | None = None


@dataclass(frozen=True)
class Format:
    """A file format: its name, how it is told from others by its content, and its reader."""

    name: str
    recognizes: Callable[["Glance"], bool]
    read: Callable[[Path, Options], Recording]
    has_keypoints: bool = False


@dataclass(frozen=True)
class Glance:
    """A first look at a file: enough to tell the format.

    Attributes
    ----------
    kind
        "text", "hdf5", "npz" for archives and folders of them, "npy" or "netcdf3".
    lines
        The first lines of a text file.
    names
        Of what is at the top of an HDF5 file, with "pandas_type" if there is a table of pandas; or of the arrays in each archive.
    """

    kind: str
    lines: tuple[str, ...] = ()
    names: tuple[frozenset[str], ...] = ()

    def cells(self, separator: str) -> list[str]:
        """Return the cells of the first line."""
        return [name.strip().strip('"') for name in self.lines[0].split(separator)] if self.lines else []

    def holds(self, *names: str) -> bool:
        """Return whether an HDF5 file has all of these names."""
        return self.kind == "hdf5" and set(names) <= self.names[0]


def refusal(rule: str, received: object, place: object, remedy: Text = "") -> RefusedError:
    """Return the error of a reader: what the file must be, what it is, and where."""
    return RefusedError(Refusal("path", rule, str(received), str(place), remedy))


LARGEST = 1e9
"""Largest frame number, and largest coordinate in pixels or cm."""
MOST_CELLS = 100_000_000
"""Frames times individuals that are opened without asking; two thirds of a day of 10 individuals at 150 fps."""
SPARSEST = 100

Place = Callable[[int], str]


def natural(name: str) -> tuple:
    """Return a sorting key by which fish10 comes after fish9."""
    parts = re.split(r"([0-9]+)", name)
    return [(len(part.lstrip("0")), part) if k % 2 else (0, part) for k, part in enumerate(parts)], name


def check_positions(positions: np.ndarray, place: Place) -> np.ndarray:
    """Return which positions (rows, 2) exist; refuse halves and the absurd."""
    missing = np.isnan(positions)
    _refuse_first(missing[:, 0] != missing[:, 1], place, "have both x and y or neither", positions)
    with np.errstate(invalid="ignore"):
        absurd = (np.abs(positions) > LARGEST).any(axis=1)
    _refuse_first(absurd, place, f"have coordinates within +-{LARGEST:.0e}", positions)
    return ~missing[:, 0]


def _refuse_first(bad: np.ndarray, place: Place, rule: str, values: np.ndarray) -> None:
    if bad.any():
        row = int(np.argmax(bad))
        raise refusal(rule, np.asarray(values[row]).tolist(), place(row))


def assemble(
    frames: np.ndarray,
    names: Sequence[str],
    positions: np.ndarray,
    place: Place,
    *,
    extras: dict[str, np.ndarray] | None = None,
    fps: float | None = None,
    unit: str | None = None,
    y_axis: YAxis | None = "down",
    remarks: tuple[str, ...] = (),
    twice: str = "",
) -> Recording:
    """Sort rows into arrays by frame and individual.

    Frames that are no whole numbers or too far apart, rows without a name, absurd coordinates and contradictions are refused.

    Parameters
    ----------
    frames, names, positions : (rows,), (rows,), (rows, 2)
        Frame number, individual and x, y of each row, in any order; x and y not a number where missing.
    place
        Says where in the file a row is.
    extras
        "confidence", "headings" (rows,).
    twice
        What to do where rows contradict each other.
    """
    extras = extras or {}
    whole = np.isfinite(frames) & (frames >= 0) & (frames <= LARGEST)
    whole &= np.floor(np.where(whole, frames, 0)) == np.where(whole, frames, 0)
    _refuse_first(~whole, place, f"have frame numbers that are whole, from 0 to {LARGEST:.0e}", frames)
    labels = np.asarray(names, dtype=object)
    _refuse_first(labels == "", place, "name the individual in each row", labels)
    numbers = frames.astype(np.int64)
    known = check_positions(positions, place)
    individuals = sorted(set(names), key=natural)
    order_of = {name: k for k, name in enumerate(individuals)}
    who = np.array([order_of[name] for name in names], dtype=np.int64)
    if not known.any():
        raise refusal("hold at least one position", "none", place(0))
    first, count = _extent(numbers, len(individuals), place)
    values = np.column_stack([positions, *extras.values()]) if extras else positions
    kept, repeated = _without_repeats(numbers, who, values, place, twice)
    if repeated:
        remarks += (f"{repeated} rows said the same as another and were dropped",)
    here = kept[known[kept]]
    shape = (count, len(individuals))
    at = (numbers[here] - first, who[here])
    placed = {name: _scatter(column, here, at, shape) for name, column in extras.items()}
    present = np.zeros(shape, dtype=bool)
    present[at] = True
    return Recording(
        first_frame=first,
        individuals=tuple(individuals),
        positions=_scatter(positions, here, at, (*shape, 2)),
        present=present,
        confidence=placed.get("confidence"),
        headings=placed.get("headings"),
        fps=fps,
        unit=unit,
        y_axis=y_axis,
        remarks=remarks,
    )


def _scatter(values: np.ndarray, rows: np.ndarray, at: tuple, shape: tuple) -> np.ndarray:
    result = np.zeros(shape)
    result[at] = values[rows]
    return result


def _extent(frames: np.ndarray, individuals: int, place: Place) -> tuple[int, int]:
    """Return first frame and number of frames."""
    first, last = int(frames.min()), int(frames.max())
    count = last - first + 1
    if count > SPARSEST * len(np.unique(frames)) and count > SPARSEST * 100:
        rule = f"name at least one frame in {SPARSEST} between its first and its last"
        raise refusal(rule, f"frames {first} to {last}", place(int(np.argmax(frames))))
    if count * individuals > MOST_CELLS:
        rule = f"hold at most {MOST_CELLS} frames times individuals"
        raise refusal(rule, f"{count} x {individuals}", place(int(np.argmax(frames))), "Split the recording.")
    return first, count


def _without_repeats(
    frames: np.ndarray, who: np.ndarray, values: np.ndarray, place: Place, remedy: str
) -> tuple[np.ndarray, int]:
    """Return the rows without those that say the same again, in order, and how many did."""
    order = np.lexsort((who, frames))
    again = (np.diff(frames[order]) == 0) & (np.diff(who[order]) == 0)
    one, other = order[:-1][again], order[1:][again]
    differs = ~((values[one] == values[other]) | (np.isnan(values[one]) & np.isnan(values[other]))).all(axis=1)
    if differs.any():
        k = int(np.argmax(differs))
        early, late = sorted((int(one[k]), int(other[k])))
        rule = "give one position for each individual and frame"
        raise refusal(rule, f"another one for frame {frames[early]} than {place(early)}", place(late), remedy)
    return np.delete(order, np.flatnonzero(again) + 1), int(again.sum())
