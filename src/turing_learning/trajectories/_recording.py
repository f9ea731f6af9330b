"""What a reader hands over: a recording as the file states it, before the user's scale and frame rate."""

from collections.abc import Callable
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
    in_cm
        Whether the file states that positions are in cm; else they are in pixels.
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
    in_cm: bool = False
    y_axis: YAxis | None = "down"
    numbered: bool = True
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Options:
    """What the user says to a reader."""

    keypoint: str | None = None
    allow_pickle: bool = False


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
    lines
        The first lines of a text file.
    arrays
        Names of the arrays in an npz file.
    datasets
        Names at the top of an HDF5 file.
    folder
        Names of the arrays in each npz file of a folder.
    npy
        Whether it is an npy file.
    """

    lines: tuple[str, ...] = ()
    arrays: frozenset[str] = frozenset()
    datasets: frozenset[str] = frozenset()
    folder: tuple[frozenset[str], ...] = ()
    npy: bool = False


def refusal(rule: str, received: object, place: object, remedy: Text = "") -> RefusedError:
    """Return the error of a reader: what the file must be, what it is, and where."""
    return RefusedError(Refusal("path", rule, str(received), str(place), remedy))
