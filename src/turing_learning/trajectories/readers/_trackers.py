"""Files of SLEAP, idtracker.ai and TRex: HDF5, npy, and npz."""

import json
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.errors import refuse
from turing_learning.trajectories._recording import Format, Options, Recording, assemble, natural, refusal

from ._shared import check_rate, check_unpacked, choose, dataset, from_array, member, open_hdf5, stated_rate, texts

DIMENSIONS = ["track", "xy", "node", "frame"]


def read_sleap(path: Path, options: Options) -> Recording:
    """Read `tracks` (tracks, 2, nodes, frames) in pixels, one node of each track, with `point_scores` as confidence.

    Where the attribute `dims` of `tracks` names the dimensions in another order, that order holds.

    Source: Pereira et al. 2022, SLEAP, Nature Methods 19; its documentation of the analysis format.
    """
    with open_hdf5(path) as file:
        tracks = _ordered(file, path)
        nodes, names = texts(file, "node_names", path), texts(file, "track_names", path)
        names = names or [str(k + 1) for k in range(tracks.shape[0])]
        if tracks.shape[:3] != (len(names), 2, len(nodes)):
            rule = f"have `tracks` of (tracks, 2, nodes, frames) = ({len(names)}, 2, {len(nodes)}, F)"
            raise refusal(rule, tracks.shape, f"{path}, dataset tracks")
        node = nodes.index(choose(options.keypoint, nodes, path))
        scores = _point_scores(file, tracks, node, path)
    if len(set(names)) < len(names):
        raise refusal("name each track once", names, f"{path}, dataset track_names")
    return from_array(tracks[:, :, node].transpose(2, 0, 1), tuple(names), f"{path}, dataset tracks", confidence=scores)


def _ordered(file: Any, path: Path) -> np.ndarray:
    tracks = dataset(file, "tracks", 4, path)
    stated = file["tracks"].attrs.get("dims")
    if stated is None:
        return tracks
    try:
        order = [str(name).rstrip("s") for name in json.loads(stated)]
        return tracks.transpose([order.index(name) for name in DIMENSIONS])
    except ValueError:
        raise refusal(f"name the dimensions {DIMENSIONS}", stated, f"{path}, dataset tracks, dims") from None


def _point_scores(file: Any, tracks: np.ndarray, node: int, path: Path) -> np.ndarray | None:
    if getattr(member(file, "point_scores", path), "shape", None) != (tracks.shape[0], *tracks.shape[2:]):
        return None
    return dataset(file, "point_scores", 3, path)[:, node].T


SLEAP_FORMAT = Format("sleap", lambda glance: glance.holds("tracks", "node_names"), read_sleap, has_keypoints=True)


def read_h5(path: Path, options: Options) -> Recording:
    """Read `trajectories` (F, A, 2) in pixels; frame rate from the attribute `frames_per_second`.

    Source: Romero-Ferrero et al. 2019, idtracker.ai, Nature Methods 16; its documentation of the output.
    """
    with open_hdf5(path) as file:
        positions = dataset(file, "trajectories", 3, path)
        rate = file.attrs.get("frames_per_second")
        scores = _probabilities(file, positions, path)
    return _recording(positions, scores, rate, f"{path}, dataset trajectories", path)


def _probabilities(file: Any, positions: np.ndarray, path: Path) -> np.ndarray | None:
    found = member(file, "id_probabilities", path)
    if found is None:
        return None
    scores = dataset(file, "id_probabilities", len(found.shape), path)
    return scores.reshape(positions.shape[:2]) if scores.size == positions[..., 0].size else None


def read_npy(path: Path, options: Options) -> Recording:
    """Read a pickled dictionary with `trajectories` and `frames_per_second`, if the user allows pickle."""
    if not options.allow_pickle:
        refuse(
            "path",
            "not be a pickle",
            "an npy file",
            "Opening it can run any code it holds. Let idtracker.ai write h5 or csv; allow_pickle=True in Python opens it.",
            place=str(path),
        )
    try:
        content = np.load(path, allow_pickle=True)
        content = content.item() if content.shape == () else {}
    except Exception as error:  # a damaged pickle can raise anything
        raise refusal("be a whole npy file", str(error)[:120], path, "The file may be cut off or damaged.") from None
    positions = content.get("trajectories") if isinstance(content, dict) else None
    if not isinstance(positions, np.ndarray) or positions.ndim != 3 or positions.dtype.kind not in "fiu":
        raise refusal("hold a dictionary with the array `trajectories` (F, A, 2)", type(content).__name__, path)
    return _recording(
        positions.astype(np.float64), None, content.get("frames_per_second"), f"{path}, trajectories", path
    )


def _recording(positions: np.ndarray, scores: np.ndarray | None, rate: object, place: str, path: Path) -> Recording:
    if positions.shape[2] != 2 or 0 in positions.shape:
        raise refusal("hold trajectories of shape (F, A, 2), not empty", positions.shape, place)
    names = tuple(str(k + 1) for k in range(positions.shape[1]))
    fps = None if rate is None else check_rate(rate, path)
    return from_array(positions, names, place, confidence=scores, fps=fps)


H5_FORMAT = Format("idtracker.ai-h5", lambda glance: glance.holds("trajectories"), read_h5)
NPY_FORMAT = Format("idtracker.ai-npy", lambda glance: glance.kind == "npy", read_npy)


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


def read_trex(path: Path, options: Options) -> Recording:
    """Read X, Y (cm) by `frame` of each individual; infinity or `missing` marks frames without a position.

    The weighted centroid (`X#wcentroid`) stands for the animal unless `keypoint` says otherwise. Frame rate
    from `frame_rate`, or from `time` (s). `ANGLE` (rad) is the heading if it is there wherever a position is.

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


TREX_FORMAT = Format(
    "trex", lambda glance: glance.kind == "npz" and any(map(_is_track, glance.names)), read_trex, has_keypoints=True
)
