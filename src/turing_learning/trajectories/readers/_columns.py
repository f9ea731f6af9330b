"""Tables with one named column for each of frame, individual, x and y: Tracktor and plain ("tidy") CSV."""

from pathlib import Path

import numpy as np

from turing_learning.trajectories._recording import Format, Glance, Options, Recording, YAxis, assemble, refusal

from ._text import header, read_table

TRACKTOR = {"frame": "frame", "x": "pos_x", "y": "pos_y", "id": "id"}
TIDY = {"frame": "frame", "x": "x", "y": "y", "id": "id", "headings": "heading", "confidence": "confidence"}

WHO = {"id", "individual", "individuals", "animal", "fish", "identity", "track", "track_id", "trackid", "tracker_id"}
"""Names, in lower case, that columns of individuals have; without `id` as it is, all of them would become one individual."""


def _separator(line: str) -> str:
    return max(",\t;", key=line.count)


def _names(glance: Glance) -> list[str]:
    return (
        [name.strip().strip('"') for name in glance.lines[0].split(_separator(glance.lines[0]))] if glance.lines else []
    )


def recognizes_tracktor(glance: Glance) -> bool:
    """Whether the header names frame, pos_x and pos_y."""
    return {"frame", "pos_x", "pos_y"} <= set(_names(glance))


def recognizes_tidy(glance: Glance) -> bool:
    """Whether the header names frame, x and y."""
    return {"frame", "x", "y"} <= set(_names(glance))


def read_tracktor(path: Path, options: Options) -> Recording:
    """Read columns frame, pos_x, pos_y (pixels) and, for several individuals, id.

    Source: Sridhar, Roche and Gingins 2019, Tracktor, Methods in Ecology and Evolution 10.
    """
    return _read(path, TRACKTOR, y_axis="down")


def read_tidy(path: Path, options: Options) -> Recording:
    """Read columns frame, x, y and, if there are any, id, heading (rad) and confidence; others are left alone."""
    return _read(path, TIDY, y_axis=None)


def _read(path: Path, wanted: dict[str, str], *, y_axis: YAxis | None) -> Recording:
    with path.open("rb") as file:
        separator = _separator(file.readline(1 << 16).decode("utf-8-sig", errors="replace"))
    names = header(path, 1, separator)[0]
    twice = [name for name in wanted.values() if names.count(name) > 1]
    if twice:
        raise refusal("name each column once", f"{twice[0]!r} twice", f"{path}:1")
    missing = [wanted[key] for key in ("frame", "x", "y") if wanted[key] not in names]
    if missing:
        raise refusal(f"have the columns {wanted['frame']}, {wanted['x']}, {wanted['y']}", names, f"{path}:1")
    other = [name for name in names if name.lower() in WHO]
    if wanted["id"] not in names and other:
        rule = f"name the column of its individuals {wanted['id']}"
        raise refusal(rule, f"{other[0]!r}", f"{path}:1", "Rename it, or remove it if there is one individual only.")
    unread = (
        ", ".join(name for name in names if name and name not in wanted.values()) if wanted["id"] not in names else ""
    )
    extra = [key for key in ("headings", "confidence") if wanted.get(key) in names]
    columns = [names.index(wanted[key]) for key in ("frame", "x", "y", *extra)]
    texts = [names.index(wanted["id"])] if wanted["id"] in names else []
    table = read_table(path, separator, len(names), skip=1, numbers=columns, texts=texts)
    who = table.texts[0] if texts else ["1"] * len(table.numbers)
    extras = {key: table.numbers[:, 3 + k] for k, key in enumerate(extra)}
    for key, values in extras.items():
        unknown = np.isnan(values) & ~np.isnan(table.numbers[:, 1])
        if unknown.any():
            row = int(np.argmax(unknown))
            raise refusal(f"give `{wanted[key]}` wherever it gives x and y", "none", table.place(row))
    return assemble(
        table.numbers[:, 0],
        who,
        table.numbers[:, 1:3],
        table.place,
        extras=extras,
        y_axis=y_axis,
        remarks=(f"without a column id all rows are of one individual; columns not read: {unread}",) if unread else (),
        twice=f"If a column that is not read names the individuals, call it id: {unread}." if unread else "",
    )


TRACKTOR_FORMAT = Format("tracktor", recognizes_tracktor, read_tracktor)
TIDY_FORMAT = Format("tidy", recognizes_tidy, read_tidy)
