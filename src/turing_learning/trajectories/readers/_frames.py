"""Data frames of pandas: long, wide, or as DeepLabCut has them."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from turing_learning.errors import refuse
from turing_learning.trajectories._recording import Options, Recording, refusal

from ._columns import TIME, read_long
from ._deeplabcut import read_points
from ._text import Sheet, Table
from ._wide import read_wide

if TYPE_CHECKING:
    import pandas as pd

WIDE = "frame or time, and x and y of each individual, as x1, y1, x2, ... or fish_x, fish_y, ..."


def read_frame(frame: "pd.DataFrame", options: Options) -> Recording:
    """Read a long or a wide table, or one with columns (scorer, individual, body part, coordinate) or (individual, coordinate)."""
    if not len(frame):
        raise refusal("have at least one row", "none", "DataFrame")
    levels = frame.columns.nlevels
    if levels in (3, 4):
        labels = [tuple(map(str, label)) for label in frame.columns]
        return read_points(labels, _sheet(frame.reset_index(names="frame")), options)
    if options.keypoint is not None:
        refuse("keypoint", "be left out for a table without key points", repr(options.keypoint))
    if levels == 2:
        frame = frame.set_axis([f"{who}_{what}" if what else str(who) for who, what in frame.columns], axis=1)
    if any(name is not None for name in frame.index.names):
        frame = frame.reset_index()
    names = {str(name).lower() for name in frame.columns}
    if {"x", "y"} <= names:
        return read_long(_sheet(frame), options)
    if names.isdisjoint(("frame", *TIME)):
        frame = frame.reset_index(names="frame")
    return read_wide(_sheet(frame), WIDE, each=None)


def _sheet(frame: "pd.DataFrame") -> Sheet:
    def read(numbers: Sequence[int], texts: Sequence[int] = ()) -> Table:
        import pandas as pd

        found = np.empty((len(frame), len(numbers)))
        for k, column in enumerate(numbers):
            series = frame.iloc[:, column]
            values = (
                pd.to_numeric(series, errors="coerce")
                if series.dtype.kind in "fiuO"
                else pd.Series(np.nan, series.index)
            )
            found[:, k] = values.to_numpy(dtype=float, na_value=np.nan)
            bad = (np.isnan(found[:, k]) & series.notna().to_numpy()) | np.isinf(found[:, k])
            if bad.any():
                row = int(np.argmax(bad))
                raise refusal("have finite numbers or NaN", repr(series.iloc[row]), place(row))
        names = tuple(["" if pd.isna(cell) else str(cell) for cell in frame.iloc[:, column]] for column in texts)
        return Table(found, names, place)

    def place(row: int) -> str:
        return f"DataFrame, row {row}"

    return Sheet([str(name if not isinstance(name, tuple) else name[0]) for name in frame.columns], read, "DataFrame")
