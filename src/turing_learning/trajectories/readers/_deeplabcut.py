"""DeepLabCut: csv, h5 or `DataFrame` of one or several animals."""

from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.trajectories._recording import Format, Glance, Options, Recording, assemble, refusal

from ._shared import check_unpacked, choose, member, open_hdf5, plain_pickle, text
from ._text import Sheet, array_sheet, header, read_table

SINGLE = ["scorer", "bodyparts", "coords"]
SEVERAL = ["scorer", "individuals", "bodyparts", "coords"]
COORDS = ("x", "y", "likelihood")

Labels = list[tuple[str, ...]]
"""Of each column: scorer, perhaps individual, body part and coordinate."""


def _is_csv(glance: Glance) -> bool:
    first = [line.split(",")[0] for line in glance.lines[:4]]
    return first == SEVERAL or first[:3] == SINGLE


def read_csv(path: Path, options: Options) -> Recording:
    """Read x, y (pixels) and likelihood of one key point of each animal; the first column numbers the frames.

    Source: Mathis et al. 2018, Lauer et al. 2022, DeepLabCut, Nature Neuroscience 21, Nature Methods 19.
    """
    rows = header(path, 4, ",")
    several = [row[0] for row in rows] == SEVERAL
    if not several and [row[0] for row in rows[:3]] != SINGLE:
        raise refusal("begin with the header lines scorer, (individuals,) bodyparts, coords", rows[0][0], f"{path}:1")
    skip = 4 if several else 3
    lengths = [len(row) for row in rows[:skip]]
    if len(set(lengths)) > 1:
        raise refusal("have header lines of the same length", lengths, f"{path}:1")
    labels = list(zip(*(row[1:] for row in rows[:skip]), strict=True))

    def read(numbers: list[int]) -> Any:
        return read_table(path, ",", lengths[0], skip=skip, numbers=numbers)

    return read_points(labels, Sheet(["frame"], read, f"{path}:1"), options)


def read_points(labels: Labels, sheet: Sheet, options: Options) -> Recording:
    """Read one key point of each animal from columns with labels, after one that numbers the frames."""
    labels = [label if len(label) > 3 else (label[0], "1", *label[1:]) for label in labels]
    points = list(dict.fromkeys(label[2] for label in labels))
    point, who = (
        choose(options.keypoint, points, sheet.place.rpartition(":")[0] or sheet.place),
        [label[1] for label in labels],
    )
    animals = [name for name in dict.fromkeys(who) if any(label[1:3] == (name, point) for label in labels)]
    columns = []
    for wanted in ((animal, point, what) for animal in animals for what in COORDS):
        found = [k for k, label in enumerate(labels) if label[1:] == wanted]
        if len(found) != 1:
            got = f"{len(found)} columns {wanted}"
            raise refusal("have x, y and likelihood once for each body part", got, sheet.place)
        columns.append(found[0] + 1)
    table = sheet.read(numbers=[0, *columns])
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


def read_h5(path: Path, options: Options) -> Recording:
    """Read the same from HDF5, in both forms in which pandas stores a table; no pickle that calls anything is opened."""
    with open_hdf5(path) as file:
        names = [name for name in file if "pandas_type" in getattr(member(file, name, path), "attrs", ())]
        if len(names) != 1:
            raise refusal("hold one table of pandas", f"{len(names)}", path)
        group = file[names[0]]
        form = {"frame_table": _appendable, "frame": _fixed}.get(text(group.attrs["pandas_type"]))
        if form is None:
            raise refusal("hold a table of pandas", text(group.attrs["pandas_type"]), f"{path}, {names[0]}")
        frames, labels, values = form(group, path)
    sound = (
        values.shape == (len(frames), len(labels)) and len(labels) and {len(label) for label in labels} in ({3}, {4})
    )
    if not (sound and frames.dtype.kind in "iu" and values.dtype.kind == "f"):
        raise refusal(
            "name scorer, (individual,) body part and coordinate of each column", "others", f"{path}, {names[0]}"
        )
    return read_points(labels, array_sheet(np.column_stack([frames, values]), f"{path}, {names[0]}"), options)


def _appendable(group: Any, path: Path) -> tuple[np.ndarray, Labels, np.ndarray]:
    """Return frames, labels and values of a table to which rows can be appended, as DeepLabCut writes it."""
    rows = member(group, "table", path)
    blocks = [name for name in rows.dtype.names or () if name.startswith("values_block_")]
    labels: Labels = []
    for name in blocks:
        labels += [tuple(map(str, label)) for label in plain_pickle(bytes(rows.attrs[f"{name}_kind"]))]
    table = rows[()]
    return table["index"], labels, np.concatenate([table[name].reshape(len(table), -1) for name in blocks], axis=1)


def _fixed(group: Any, path: Path) -> tuple[np.ndarray, Labels, np.ndarray]:
    """Return the same of a table that cannot grow, as movement writes it."""
    labels: Labels = []
    blocks = []
    for block in range(int(group.attrs["nblocks"])):
        columns = []
        for level in range(int(group.attrs[f"block{block}_items_nlevels"])):
            names = [text(name) for name in member(group, f"block{block}_items_level{level}", path)[()]]
            columns.append([names[k] for k in member(group, f"block{block}_items_label{level}", path)[()]])
        labels += list(zip(*columns, strict=True))
        blocks.append(member(group, f"block{block}_values", path)[()])
    check_unpacked(sum(block.nbytes for block in blocks), path)
    return member(group, "axis1", path)[()], labels, np.concatenate(blocks, axis=1)


CSV_FORMAT = Format("deeplabcut", _is_csv, read_csv, has_keypoints=True)
H5_FORMAT = Format("deeplabcut-h5", lambda glance: glance.holds("pandas_type"), read_h5, has_keypoints=True)
