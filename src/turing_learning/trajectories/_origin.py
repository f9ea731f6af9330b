"""What windows were computed from, as a digest that every processor finds."""

import hashlib
import json

import numpy as np

from turing_learning.errors import RefusedError

from ._trajectories import Trajectories, pooled_windows
from ._windows import Windows

MEASUREMENT = 1
"""Number of the way from positions to windows; another one whenever windows of the same positions change."""

HEADING_DIGITS = 6
"""Digits of headings (rad) that count. Those between two points of the body are arctangents, whose last
digits differ between processors; one in 10^9 lies so near to a rounding border that they matter."""


def origin_of(windows: Windows) -> str:
    """Return the SHA-256 of what windows were cut from, and how; empty where that does not lead to them.

    Signals have other last digits on other processors, which have functions of their own for angles.
    Positions have not, since a file states them and scales divide them. So the digest is of the recordings, of the
    arguments of `pooled_windows`, and of where in the recordings the windows are. Windows that are no more
    what `pooled_windows` makes of their recordings have none.
    """
    if not (windows.sources and windows.cut):
        return ""
    try:
        again = pooled_windows(windows.sources, **windows.cut)
    except RefusedError:
        return ""
    arrays = []
    for name in ("learning", "held_out", "learning_index", "held_out_index"):
        if not np.array_equal(getattr(again, name), getattr(windows, name)):
            return ""
        if name.endswith("_index"):
            arrays.append(getattr(windows, name))
    described = []
    for recording in windows.sources:
        described.append([recording.individuals, recording.unit, recording.fps])
        arrays += _observed(recording)
    shapes = [array.shape for array in arrays]
    words = [MEASUREMENT, windows.headings, dict(windows.cut), described, shapes]
    digest = hashlib.sha256(json.dumps(words, sort_keys=True, default=str).encode())
    for array in arrays:
        digest.update(np.ascontiguousarray(array).data)
    return digest.hexdigest()


def _observed(recording: Trajectories) -> list[np.ndarray]:
    """Return the arrays of a recording by which windows are computed."""
    arrays = [recording.positions, recording.present]
    if recording.headings is not None:
        # adding 0 makes 0 of -0
        arrays.append(np.round(recording.headings, HEADING_DIGITS) + 0.0)
    return arrays
