"""TRex: one npz file for each individual."""

import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np

from turing_learning.trajectories._recording import Format, Glance, Options, Recording, assemble, natural, refusal

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


def recognizes(glance: Glance) -> bool:
    """Whether there are arrays `frame`, X and Y, in the file or in files of the folder."""
    return _is_track(glance.arrays) or any(_is_track(arrays) for arrays in glance.folder)


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
    names = _names(list(tracks))
    rates = {rate for *_, rate in individuals if rate is not None}
    if len(rates) > 1:
        raise refusal("state one frame rate for all individuals", sorted(rates), path)
    lengths = [len(frames) for frames, *_ in individuals]
    starts = np.cumsum([0, *lengths])

    def place(row: int) -> str:
        file = int(np.searchsorted(starts, row, side="right")) - 1
        return f"{list(tracks)[file]}, index {row - starts[file]}"

    positions = np.concatenate([xy for _, xy, *_ in individuals])
    headings, remarks = _headings([angle for _, _, angle, _ in individuals], positions)
    other = len(contents) - len(tracks)
    remarks += (f"{other} npz files of the folder hold no track",) if other else ()
    return assemble(
        np.concatenate([frames for frames, *_ in individuals]),
        [name for name, length in zip(names, lengths, strict=True) for _ in range(length)],
        positions,
        place,
        extras={} if headings is None else {"headings": headings},
        fps=rates.pop() if rates else None,
        unit="cm",
        remarks=remarks,
    )


def files_of(folder: Path) -> list[Path]:
    """Return the npz files of a folder; nothing that is no file, such as a pipe, is opened."""
    return sorted(file for file in folder.glob("*.npz") if file.is_file())


def archive_names(path: Path) -> frozenset[str]:
    """Return the names of the arrays in an npz file."""
    return frozenset(name.removesuffix(".npy") for name in _sizes(path))


def _sizes(path: Path) -> dict[str, int]:
    """Return name -> size of the members, whose names are those of the archive's directory and their own; none is damage, too."""
    try:
        with zipfile.ZipFile(path) as archive:
            for item in archive.infolist():
                archive.open(item).close()
            sizes = {item.filename: item.file_size for item in archive.infolist()}
    except _DAMAGE as error:
        raise refusal("be a whole npz file", str(error)[:120], path, "The file may be cut off or damaged.") from None
    if not sizes:
        raise refusal("be a whole npz file", "no arrays in it", path, "The file may be cut off or damaged.")
    return sizes


def load_arrays(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays that make a track from an npz file; no pickle is read."""
    check_unpacked(sum(_sizes(path).values()), path, MOST_BYTES)
    try:
        with np.load(path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files if name.partition("#")[0] in _WANTED}
    except _DAMAGE as error:
        raise refusal("be a whole npz file", str(error)[:120], path, "The file may be cut off or damaged.") from None


def _individual(
    path: Path, arrays: dict[str, np.ndarray], options: Options
) -> tuple[np.ndarray, np.ndarray, np.ndarray | None, float | None]:
    """Return frames, positions (not a number where missing), headings and frame rate."""
    available = points(frozenset(arrays))
    wanted = options.keypoint or (CENTROID if CENTROID in available else None)
    point = choose(wanted, available, path)
    columns = {
        "frame": "frame",
        "x": _key("X", point),
        "y": _key("Y", point),
        "missing": "missing",
        "angle": "ANGLE",
        "time": "time",
    }
    values = {key: _column(arrays, name, path) for key, name in columns.items() if name in arrays}
    lengths = {key: len(column) for key, column in values.items()}
    if len(set(lengths.values())) > 1 or not lengths["frame"]:
        raise refusal("have arrays of one length, not empty", lengths, path)
    positions = np.column_stack([values["x"], values["y"]])
    absent = np.isinf(positions).any(axis=1) | (values.get("missing", np.zeros(1)) != 0)
    positions[absent] = np.nan
    rate = check_rate(arrays["frame_rate"], path) if "frame_rate" in arrays else None
    if rate is None and "time" in values:
        rate = stated_rate(values["time"], values["frame"])
    return values["frame"], positions, values.get("angle"), rate


def _column(arrays: dict[str, np.ndarray], name: str, path: Path) -> np.ndarray:
    column = arrays[name]
    if column.ndim != 1 or column.dtype.kind not in "fiub":
        raise refusal("hold lists of numbers", f"{column.dtype} {column.shape}", f"{path}, array {name}")
    return column.astype(np.float64)


def _names(files: list[Path]) -> list[str]:
    """Return what follows the last underscore of each file's name, or the whole name where that is not enough."""
    short = [file.stem.rpartition("_")[2] for file in files]
    return short if len(set(short)) == len(short) else [file.stem for file in files]


def _headings(angles: list[np.ndarray | None], positions: np.ndarray) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """Return the headings (rows,) if there is one wherever a position is."""
    known = [angle for angle in angles if angle is not None]
    if len(known) < len(angles):
        return None, ()
    headings = np.concatenate(known)
    unknown = ~np.isfinite(headings) & ~np.isnan(positions[:, 0])
    if unknown.any():
        return None, (f"headings are left out: {int(unknown.sum())} positions come without one",)
    return np.where(np.isfinite(headings), headings, 0.0), ()


FORMAT = Format("trex", recognizes, read, has_keypoints=True)
