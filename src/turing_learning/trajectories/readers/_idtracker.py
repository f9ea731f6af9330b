"""idTracker: trajectories.txt."""

import re
from pathlib import Path

import numpy as np

from turing_learning.trajectories._recording import Format, Glance, Options, Recording, check_positions, refusal

from ._text import Table, header, read_table


def recognizes(glance: Glance) -> bool:
    """Whether the header begins X1, Y1, ProbId1."""
    return bool(glance.lines) and glance.lines[0].split("\t")[:3] == ["X1", "Y1", "ProbId1"]


def read(path: Path, options: Options) -> Recording:
    """Read one row for each frame, three columns for each individual, in pixels.

    ProbId, the probability of the identity, is the confidence where it is a probability; idTracker writes NaN where it
    did not compute one, and negative numbers where it estimated the position during a crossing.

    Source: Perez-Escudero et al. 2014, idTracker, Nature Methods 11.
    """
    names = header(path, 1, "\t")[0]
    count = len(names) // 3
    columns = _columns(names, count, path)
    table = read_table(path, "\t", len(names), skip=1, numbers=[column for three in columns for column in three])
    values = table.numbers.reshape(-1, count, 3)
    present = np.column_stack([_present(table, values[:, k, :2]) for k in range(count)])
    if not present.any():
        raise refusal("hold at least one position", "none", path)
    return Recording(
        first_frame=0,
        individuals=tuple(str(k + 1) for k in range(count)),
        positions=np.where(present[..., None], values[..., :2], 0.0),
        present=present,
        confidence=_confidence(values[..., 2], present),
        numbered=False,
        remarks=_remarks(values[..., 2]),
    )


def _columns(names: list[str], count: int, path: Path) -> list[list[int]]:
    """Return the places of X, Y and ProbId of each individual, in any order of the columns."""
    expected = [[f"{what}{k + 1}" for what in ("X", "Y", "ProbId")] for k in range(count)]
    if sorted(names) != sorted(name for three in expected for name in three):
        odd = next((name for name in names if not re.fullmatch(r"(X|Y|ProbId)[0-9]+", name)), names[-1])
        raise refusal(
            "have the columns X, Y and ProbId for each individual", f"{len(names)} columns, {odd!r}", f"{path}:1"
        )
    return [[names.index(name) for name in three] for three in expected]


def _present(table: Table, positions: np.ndarray) -> np.ndarray:
    return check_positions(positions, table.place)


def _confidence(probability: np.ndarray, present: np.ndarray) -> np.ndarray | None:
    known = present & (probability >= 0)
    return np.where(known, probability, 0.0) if known.all(where=present) else None


def _remarks(probability: np.ndarray) -> tuple[str, ...]:
    estimated = int((probability < 0).sum())
    return (f"{estimated} positions were estimated by idTracker (negative ProbId)",) if estimated else ()


FORMAT = Format("idtracker", recognizes, read)
