"""ToxTrac: Tracking_*.txt."""

from pathlib import Path

import numpy as np

from turing_learning.trajectories._recording import Format, Glance, Options, Recording, assemble, refusal

from ._text import read_table


def recognizes(glance: Glance) -> bool:
    """Whether the first line is six numbers between tabs: frame, arena, track, x, y, label."""
    row = glance.cells("\t")
    try:
        numbers = [float(cell) for cell in row[:6]]
    except ValueError:
        return False
    return len(numbers) == 6 and not any(row[6:]) and all(numbers[k].is_integer() for k in (0, 1, 2, 5))


def read(path: Path, options: Options) -> Recording:
    """Read rows of frame, arena, track, x, y, label; a track within an arena is an individual.

    Positions are in pixels from the corner of the arena's region in the image, in Tracking_RealSpace.txt in mm.

    Source: Rodriguez et al. 2018, ToxTrac, Methods in Ecology and Evolution 9.
    """
    table = read_table(path, "\t", 6, skip=0, numbers=range(6))
    frames, arena, track, x, y, label = table.numbers.T
    whole = np.isfinite([arena, track, label]).all(axis=0) & (
        np.floor([arena, track, label]) == [arena, track, label]
    ).all(axis=0)
    if not whole.all():
        row = int(np.argmin(whole))
        rule = "have whole numbers for arena, track and label (columns 2, 3, 6)"
        raise refusal(rule, table.numbers[row, [1, 2, 5]].tolist(), table.place(row))
    several = len(np.unique(arena)) > 1
    names = [f"{int(a)}:{int(t)}" if several else str(int(t)) for a, t in zip(arena, track, strict=True)]
    unlabeled = int((label == 0).sum())
    remarks = (f"{unlabeled} rows have the label 0",) if unlabeled else ()
    return assemble(frames, names, np.column_stack([x, y]), table.place, remarks=remarks)


FORMAT = Format("toxtrac", recognizes, read)
