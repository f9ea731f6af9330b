"""TRex: one npz file for each individual."""

import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from turing_learning.trajectories._recording import Format, Options, Recording, assemble, natural, refusal

from ._shared import check_rate, check_unpacked, choose, stated_rate

MOST_BYTES = 1 << 32
CENTROID = "wcentroid"
HEAD = "head"
_WANTED = ("X", "Y", "frame", "time", "missing", "ANGLE", "frame_rate")
_DAMAGE = (
    OSError, EOFError, KeyError, ValueError, OverflowError, MemoryError, NotImplementedError, RuntimeError,
    AttributeError, struct.error, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""What zipfile and numpy raise on damaged files."""


def points(arrays: frozenset[str]) -> list[str]:
    """Return the points of the body that have X and Y: "head" without a suffix, else the suffix after #."""
    suffixes = {name.partition("#")[2] for name in arrays if name.partition("#")[0] == "X"}
    return sorted(suffix or HEAD for suffix in suffixes if _key("Y", suffix) in arrays)


def _key(axis: str, point: str) -> str:
    return axis if point in ("", HEAD) else f"{axis}#{point}"


def _is_track(arrays: frozenset[str]) -> bool:
    return "frame" in arrays and bool(points(arrays))


def read(path: Path, options: Options) -> Recording:
    """Read X, Y (cm) by `frame` of each individual; infinity or `missing` marks frames without a position.

    The weighted centroid (`X#wcentroid`) stands for the animal unless `keypoint` says otherwise. Frame rate from
    `frame_rate`, or from `time` (s). `ANGLE` (rad) is the heading if it is there wherever a position is.

    Source: Walter and Couzin 2021, TRex, eLife 10; its documentation of the output.
    """
    files = sorted(files_of(path), key=lambda file: natural(file.name)) if path.is_dir() else [path]
    contents = {file: load_arrays(file) for file in files}
    tracks = {file: arrays for file, arrays in contents.items() if _is_track(frozenset(arrays))}
    if not tracks:
        raise refusal("hold arrays `frame`, X and Y", "none", path)
    individuals = [_individual(file, arrays, options) for file, arrays in tracks.items()]
    short = [file.stem.rpartition("_")[2] for file in tracks]
    names = short if len(set(short)) == len(short) else [file.stem for file in tracks]
    rates = {rate for *_, rate in individuals if rate is not None}
    if len(rates) > 1:
        raise refusal("state one frame rate for all individuals", sorted(rates), path)
    lengths = [len(frames) for frames, *_ in individuals]
    starts = np.cumsum([0, *lengths])

    def place(row: int) -> str:
        file = int(np.searchsorted(starts, row, side="right")) - 1
        return f"{list(tracks)[file]}, index {row - starts[file]}"

    frames, positions = (np.concatenate([each[k] for each in individuals]) for k in (0, 1))
    angles = [angle for _, _, angle, _ in individuals if angle is not None]
    extras: dict[str, np.ndarray] = {}
    remarks: tuple[str, ...] = ()
    if len(angles) == len(individuals):
        headings = np.concatenate(angles)
        unknown = int((~np.isfinite(headings) & ~np.isnan(positions[:, 0])).sum())
        if unknown:
            remarks = (f"headings are left out: {unknown} positions come without one",)
        else:
            extras["headings"] = np.where(np.isfinite(headings), headings, 0.0)
    other = len(contents) - len(tracks)
    remarks += (f"{other} npz files of the folder hold no track",) if other else ()
    who = [name for name, length in zip(names, lengths, strict=True) for _ in range(length)]
    rate = rates.pop() if rates else None
    return assemble(frames, who, positions, place, extras=extras, fps=rate, unit="cm", remarks=remarks)


def files_of(folder: Path) -> list[Path]:
    """Return the npz files of a folder; nothing that is no file, such as a pipe, is opened."""
    return sorted(file for file in folder.glob("*.npz") if file.is_file())


def archive_names(path: Path) -> frozenset[str]:
    """Return the names of the arrays in an npz file."""
    return frozenset(name.removesuffix(".npy") for name in _sizes(path))


@contextmanager
def _opening(path: Path) -> Iterator[None]:
    try:
        yield
    except _DAMAGE as error:
        raise refusal("be a whole npz file", str(error)[:120], path, "The file may be cut off or damaged.") from None


def _sizes(path: Path) -> dict[str, int]:
    """Return name -> size of the members, whose names are those of the archive's directory and their own; none is damage, too."""
    with _opening(path), zipfile.ZipFile(path) as archive:
        for item in archive.infolist():
            archive.open(item).close()
        sizes = {item.filename: item.file_size for item in archive.infolist()}
        if not sizes:
            raise zipfile.BadZipFile("no arrays in it")
        return sizes


def load_arrays(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays that make a track from an npz file; no pickle is read."""
    check_unpacked(sum(_sizes(path).values()), path, MOST_BYTES)
    with _opening(path), np.load(path, allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files if name.partition("#")[0] in _WANTED}


def _individual(
    path: Path, arrays: dict[str, np.ndarray], options: Options
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, float | None]:
    """Return frames, positions (not a number where missing), headings and frame rate."""
    available = points(frozenset(arrays))
    point = choose(options.keypoint or (CENTROID if CENTROID in available else None), available, path)
    columns = {"x": _key("X", point), "y": _key("Y", point), "angle": "ANGLE"}
    columns |= {name: name for name in ("frame", "missing", "time")}
    values = {}
    for key, name in columns.items():
        if name in arrays:
            column = arrays[name]
            if column.ndim != 1 or column.dtype.kind not in "fiub":
                raise refusal("hold lists of numbers", f"{column.dtype} {column.shape}", f"{path}, array {name}")
            values[key] = column.astype(np.float64)
    lengths = {key: len(column) for key, column in values.items()}
    if len(set(lengths.values())) > 1 or not lengths["frame"]:
        raise refusal("have arrays of one length, not empty", lengths, path)
    positions = np.column_stack([values["x"], values["y"]])
    positions[np.isinf(positions).any(axis=1) | (values.get("missing", np.zeros(1)) != 0)] = np.nan
    rate = check_rate(arrays["frame_rate"], path) if "frame_rate" in arrays else None
    if rate is None and "time" in values:
        rate = stated_rate(values["time"], values["frame"])
    return values["frame"], positions, values.get("angle"), rate


FORMAT = Format(
    "trex", lambda glance: glance.kind == "npz" and any(map(_is_track, glance.names)), read, has_keypoints=True
)
