"""Files of SLEAP, idtracker.ai and TRex: HDF5, npy, and npz."""

import json
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from .._recording import Format, Options, Recording, assemble, from_array, natural, refusal
from ._shared import check_rate, check_unpacked, choose, dataset, member, open_hdf5, stated_rate, texts, whole

DIMENSIONS = ["track", "xy", "node", "frame"]


def read_sleap(path: Path, options: Options) -> Recording:
    """Read `tracks` (tracks, 2, nodes, frames), or in the order of its `dims`, in pixels, with `point_scores` as confidence.

    Source: Pereira et al. 2022, SLEAP, Nature Methods 19; its documentation of the analysis format.
    """
    with open_hdf5(path) as file:
        place = f"{path}, dataset tracks"
        tracks, dims = dataset(file, "tracks", 4, path), file["tracks"].attrs.get("dims")
        if dims is not None:
            try:
                order = [str(name).rstrip("s") for name in json.loads(dims)]
                tracks = tracks.transpose([order.index(name) for name in DIMENSIONS])
            except ValueError:
                raise refusal(f"name the dimensions {DIMENSIONS}", dims, f"{place}, dims") from None
        nodes, names = texts(file, "node_names", path), texts(file, "track_names", path)
        names = names or [str(k + 1) for k in range(tracks.shape[0])]
        if tracks.shape[:3] != (len(names), 2, len(nodes)):
            rule = f"have `tracks` of (tracks, 2, nodes, frames) = ({len(names)}, 2, {len(nodes)}, F)"
            raise refusal(rule, tracks.shape, place)
        node, scores = nodes.index(choose(options.keypoint, nodes, path)), None
        if getattr(member(file, "point_scores", path), "shape", None) == (tracks.shape[0], *tracks.shape[2:]):
            scores = dataset(file, "point_scores", 3, path)[:, node].T
    return from_array(tracks[:, :, node].transpose(2, 0, 1), tuple(names), place, confidence=scores)


SLEAP_FORMAT = Format("sleap", lambda glance: glance.holds("tracks", "node_names"), read_sleap, has_keypoints=True)


def read_h5(path: Path, options: Options) -> Recording:
    """Read `trajectories` (F, A, 2) in pixels; frame rate from the attribute `frames_per_second`.

    Source: Romero-Ferrero et al. 2019, idtracker.ai, Nature Methods 16; its documentation of the output.
    """
    with open_hdf5(path) as file:
        positions = dataset(file, "trajectories", 3, path)
        rate = file.attrs.get("frames_per_second")
        found, scores = member(file, "id_probabilities", path), None
        if found is not None:
            scores = dataset(file, "id_probabilities", len(found.shape), path)
            scores = scores.reshape(positions.shape[:2]) if scores.size == positions[..., 0].size else None
    return _recording(positions, scores, rate, f"{path}, dataset trajectories", path)


def read_npy(path: Path, options: Options) -> Recording:
    """Read a pickled dictionary with `trajectories` and `frames_per_second`, if the user allows pickle."""
    if not options.allow_pickle:
        remedy = "Opening it can run any code it holds. Let idtracker.ai write h5 or csv; allow_pickle=True in Python opens it."
        raise refusal("not be a pickle", "an npy file", path, remedy)
    with whole("npy", path):
        content = np.load(path, allow_pickle=True)
        content = content.item() if content.shape == () else {}
    positions = content.get("trajectories") if isinstance(content, dict) else None
    if not isinstance(positions, np.ndarray) or positions.ndim != 3 or positions.dtype.kind not in "fiu":
        raise refusal("hold a dictionary with the array `trajectories` (F, A, 2)", type(content).__name__, path)
    rate = content.get("frames_per_second")
    return _recording(positions.astype(np.float64), None, rate, f"{path}, trajectories", path)


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


def _points(arrays: Iterable[str]) -> dict[str, str]:
    """Return the points of the body that have X and Y, "head" without a suffix, else what is after the #; each with its suffix."""
    found = sorted((name[2:] or HEAD, name[1:]) for name in arrays if name.partition("#")[0] == "X")
    return {point: suffix for point, suffix in found if f"Y{suffix}" in arrays}


def _is_track(arrays: Iterable[str]) -> bool:
    return "frame" in arrays and bool(_points(arrays))


def read_trex(path: Path, options: Options) -> Recording:
    """Read X, Y (cm) by `frame` of each individual; infinity or `missing` marks frames without a position.

    The weighted centroid (`X#wcentroid`) stands for the animal unless `keypoint` says otherwise. Frame rate
    from `frame_rate`, or from `time` (s). `ANGLE` (rad) is the heading if it is there wherever a position is.
    Source: Walter and Couzin 2021, TRex, eLife 10; its documentation of the output.
    """
    files = sorted(files_of(path), key=lambda file: natural(file.name)) if path.is_dir() else [path]
    contents = {file: _arrays(file) for file in files}
    tracks = {file: _track(file, arrays, options) for file, arrays in contents.items() if _is_track(arrays)}
    if not tracks:
        raise refusal("hold arrays `frame`, X and Y", "none", path)
    rates = {rate for _, rate in tracks.values() if rate is not None}
    if len(rates) > 1:
        raise refusal("state one frame rate for all individuals", sorted(rates), path)
    short = [file.stem.rpartition("_")[2] for file in tracks]
    names = short if len(set(short)) == len(short) else [file.stem for file in tracks]
    lengths = [len(rows) for rows, _ in tracks.values()]
    starts = np.cumsum([0, *lengths])

    def place(row: int) -> str:
        file = int(np.searchsorted(starts, row, side="right")) - 1
        return f"{list(tracks)[file]}, index {row - starts[file]}"

    rows = np.concatenate([rows for rows, _ in tracks.values()])
    headings = rows[:, 3]
    unknown = int((~np.isfinite(headings) & ~np.isnan(rows[:, 1])).sum())
    remarks: tuple[str, ...] = ()
    if unknown and all("ANGLE" in contents[file] for file in tracks):
        remarks = (f"headings are left out: {unknown} positions come without one",)
    other = len(contents) - len(tracks)
    remarks += (f"{other} npz files of the folder hold no track",) if other else ()
    return assemble(
        rows[:, 0],
        np.repeat(np.array(names, dtype=object), lengths).tolist(),
        rows[:, 1:3],
        place,
        extras={} if unknown else {"headings": np.where(np.isfinite(headings), headings, 0.0)},
        fps=rates.pop() if rates else None,
        unit="cm",
        remarks=remarks,
    )


def files_of(folder: Path) -> list[Path]:
    """Return the npz files of a folder; nothing that is no file, such as a pipe, is opened."""
    return sorted(file for file in folder.glob("*.npz") if file.is_file())


def array_sizes(path: Path) -> dict[str, int]:
    """Return name -> size of the arrays in an npz file; names are those of its directory and their own, and none is damage."""
    with whole("npz", path), zipfile.ZipFile(path) as archive:
        for item in archive.infolist():
            archive.open(item).close()
        sizes = {item.filename.removesuffix(".npy"): item.file_size for item in archive.infolist()}
        if not sizes:
            raise zipfile.BadZipFile("no arrays in it")
        return sizes


def _arrays(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays that make a track from an npz file; no pickle is read."""
    check_unpacked(sum(array_sizes(path).values()), path, MOST_BYTES)
    with whole("npz", path), np.load(path, allow_pickle=False) as archive:
        return {name: archive[name] for name in archive.files if name.partition("#")[0] in _WANTED}


def _track(path: Path, arrays: Mapping[str, np.ndarray], options: Options) -> tuple[np.ndarray, float | None]:
    """Return frame, x, y, not a number where missing, and heading (rows, 4) of an individual, and the frame rate."""
    available = _points(arrays)
    suffix = available[choose(options.keypoint or (CENTROID if CENTROID in available else None), [*available], path)]
    values = {}
    for name in ("frame", f"X{suffix}", f"Y{suffix}", "ANGLE", "missing", "time"):
        if name in arrays:
            column = arrays[name]
            if column.ndim != 1 or column.dtype.kind not in "fiub":
                raise refusal("hold lists of numbers", f"{column.dtype} {column.shape}", f"{path}, array {name}")
            values[name] = column.astype(np.float64)
    lengths = {name: len(column) for name, column in values.items()}
    if len(set(lengths.values())) > 1 or not lengths["frame"]:
        raise refusal("have arrays of one length, not empty", lengths, path)
    unknown = np.full(lengths["frame"], np.nan)
    rows = np.column_stack([*list(values.values())[:3], values.get("ANGLE", unknown)])
    rows[np.isinf(rows[:, 1:3]).any(axis=1) | (values.get("missing", np.zeros(1)) != 0), 1:3] = np.nan
    rate = check_rate(arrays["frame_rate"], path) if "frame_rate" in arrays else None
    if rate is None and "time" in values:
        rate = stated_rate(values["time"], values["frame"])
    return rows, rate


TREX_FORMAT = Format(
    "trex", lambda glance: glance.kind == "npz" and any(map(_is_track, glance.names)), read_trex, has_keypoints=True
)
