"""DeepLabCut: csv of one or several animals."""

from pathlib import Path

import numpy as np

from turing_learning.trajectories._recording import Format, Glance, Options, Recording, assemble, refusal

from ._shared import choose
from ._text import header, read_table

SINGLE = ["scorer", "bodyparts", "coords"]
SEVERAL = ["scorer", "individuals", "bodyparts", "coords"]


def recognizes(glance: Glance) -> bool:
    """Whether the header lines begin scorer, (individuals,) bodyparts, coords."""
    first = [line.split(",")[0] for line in glance.lines[:4]]
    return first == SEVERAL or first[:3] == SINGLE


def read(path: Path, options: Options) -> Recording:
    """Read x, y (pixels) and likelihood of one key point of each animal; the first column numbers the frames.

    Source: Mathis et al. 2018, Lauer et al. 2022, DeepLabCut, Nature Neuroscience 21, Nature Methods 19.
    """
    rows = header(path, 4, ",")
    several = [row[0] for row in rows] == SEVERAL
    if not several and [row[0] for row in rows[:3]] != SINGLE:
        raise refusal("begin with the header lines scorer, (individuals,) bodyparts, coords", rows[0][0], f"{path}:1")
    skip = 4 if several else 3
    who, parts, coords = _labels(rows[:skip], path)
    point = choose(options.keypoint, list(dict.fromkeys(parts)), path)
    animals = [name for name in dict.fromkeys(who) if (name, point) in set(zip(who, parts, strict=True))]
    columns = [_column(who, parts, coords, (animal, point, what), path) for animal in animals for what in COORDS]
    table = read_table(path, ",", len(who) + 1, skip=skip, numbers=[0, *columns])
    count, frames = len(animals), table.numbers[:, 0]
    values = table.numbers[:, 1:].reshape(-1, 3)
    left_out = len(set(who)) - count
    return assemble(
        np.repeat(frames, count),
        animals * len(frames),
        values[:, :2],
        lambda row: table.place(row // count),
        extras={"confidence": np.nan_to_num(values[:, 2])},
        remarks=(f"{left_out} of the individuals have no key point {point!r}",) if left_out else (),
    )


COORDS = ("x", "y", "likelihood")


def _labels(rows: list[list[str]], path: Path) -> tuple[list[str], list[str], list[str]]:
    """Return individual, body part and coordinate of each column after the first."""
    if len({len(row) for row in rows}) > 1:
        raise refusal("have header lines of the same length", [len(row) for row in rows], f"{path}:1")
    labels = [row[1:] for row in rows[1:]]
    return tuple(labels if len(labels) == 3 else [["1"] * len(labels[0]), *labels])  # type: ignore[return-value]


def _column(who: list[str], parts: list[str], coords: list[str], wanted: tuple[str, str, str], path: Path) -> int:
    found = [k for k, label in enumerate(zip(who, parts, coords, strict=True)) if label == wanted]
    if len(found) != 1:
        raise refusal("have x, y and likelihood once for each body part", f"{len(found)} columns {wanted}", f"{path}:1")
    return found[0] + 1


FORMAT = Format("deeplabcut", recognizes, read, has_keypoints=True)
