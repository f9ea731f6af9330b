"""Files of arrays: HDF5, npy and npz of SLEAP, idtracker.ai, TRex and DeepLabCut, and datasets of the movement package."""

import io
import json
import math
import pickle
import struct
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.errors import RefusedError, brief, optional, refuse, require

from .._recording import Format, Options, Recording, assemble, from_array, natural, refusal
from ._columns import choose
from ._sheets import Sheet
from ._tables import Labels, read_points
from ._times import check_rate, per_second, rounded, stated_rate

if TYPE_CHECKING:
    import xarray as xr

MOST_NUMBERS = 1 << 28
FREE_BYTES = 1 << 26
MOST_TIMES = 200
"""A file may unpack to `FREE_BYTES`, or to so many times its own size: recordings do not compress by more, and bombs do."""


def check_unpacked(size: int, path: Path, most_bytes: int = 8 * MOST_NUMBERS) -> None:
    """Refuse what unpacks to more bytes than a recording of the file's size does."""
    most_bytes = min(most_bytes, max(FREE_BYTES, MOST_TIMES * path.stat().st_size))
    if size > most_bytes:
        raise refusal(f"unpack to at most {most_bytes} bytes", size, path)


def refuse_large(path: Path, most_bytes: int) -> None:
    """Refuse a file that is too large to be read as a whole."""
    size = path.stat().st_size
    if size > most_bytes:
        raise refusal(f"have at most {most_bytes} bytes", size, path)


@contextmanager
def whole(format_name: str, path: Path) -> Iterator[None]:
    """Refuse a file as damaged, whatever a library raises over it; a reader's own refusal passes."""
    try:
        yield
    except RefusedError:
        raise
    except Exception as error:  # a damaged file can raise anything
        rule, remedy = f"be a whole {format_name} file", "The file may be cut off or damaged."
        raise refusal(rule, str(error)[:120], path, remedy) from None


@contextmanager
def open_hdf5(path: Path) -> Iterator[Any]:
    """Open a file; whatever HDF5 cannot read is an error that names the file."""
    h5py = optional("h5py", f"h5py, to read {path},", "tracking")
    with whole("HDF5", path), h5py.File(path, "r") as file:
        yield file


def names_in(path: Path) -> frozenset[str]:
    """Return what is at the top of an HDF5 file, with "pandas_type" if there is a table of pandas."""
    with open_hdf5(path) as file:
        import h5py

        names = set(file)
        for name in file:
            # what a link leads to outside of the file is not opened
            inside = isinstance(file.get(name, getlink=True), h5py.HardLink)
            if inside and "pandas_type" in file[name].attrs:
                names.add("pandas_type")
        return frozenset(names)


def member(file: Any, name: str, path: Path) -> Any:
    """Return a member of a file, None if there is none; refuse one that lies in another file, or unpacks to too much."""
    import h5py

    elsewhere = isinstance(file.get(name, getlink=True), h5py.ExternalLink)
    item: Any = None if elsewhere else file.get(name)
    stored = isinstance(item, h5py.Dataset)
    if elsewhere or (stored and (item.external or item.is_virtual)):
        rule = "hold its data itself"
        raise refusal(rule, "a link to another file", f"{path}, {name}", "Copy the data into it.")
    if stored and item.dtype.kind != "O":
        if item.size > MOST_NUMBERS:
            rule = f"hold at most {MOST_NUMBERS} numbers"
            raise refusal(rule, item.shape, f"{path}, dataset {name}")
        check_unpacked(item.size * item.dtype.itemsize, path)
    return item


def dataset(file: Any, name: str, dimensions: int, path: Path) -> np.ndarray:
    """Return a dataset of numbers."""
    item = member(file, name, path)
    shape = getattr(item, "shape", None)
    if shape is None or len(shape) != dimensions or item.dtype.kind not in "fiu" or 0 in shape:
        received = "none" if shape is None else f"{item.dtype} {shape}"
        rule = f"hold numbers with {dimensions} dimensions, not empty"
        raise refusal(rule, received, f"{path}, dataset {name}")
    return np.asarray(item, dtype=np.float64)


def texts(file: Any, name: str, path: Path) -> list[str]:
    """Return a dataset of names; empty if there is none."""
    dataset = member(file, name, path)
    shape = getattr(dataset, "shape", (0,))
    if 0 in shape:
        return []
    if len(shape) != 1 or shape[0] > FREE_BYTES >> 8:
        raise refusal("hold a list of names", shape, f"{path}, dataset {name}")
    return list(map(text, dataset[()]))


def text(value: Any) -> str:
    """Return a name or attribute as text."""
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else str(value)


DIMENSIONS = ["track", "xy", "node", "frame"]


def read_sleap(path: Path, options: Options) -> Recording:
    """Read `tracks` (tracks, 2, nodes, frames), or in the order of its `dims`, in pixels, with `point_scores` as confidence.

    Source: Pereira et al. 2022, SLEAP, Nature Methods 19; its documentation of the analysis format.
    """
    with open_hdf5(path) as file:
        where = f"{path}, dataset tracks"
        tracks, dims = dataset(file, "tracks", 4, path), file["tracks"].attrs.get("dims")
        if dims is not None:
            try:
                order = [str(name).rstrip("s") for name in json.loads(dims)]
                tracks = tracks.transpose(list(map(order.index, DIMENSIONS)))
            except ValueError:
                raise refusal(f"name the dimensions {DIMENSIONS}", dims, f"{where}, dims") from None
        nodes, names = texts(file, "node_names", path), texts(file, "track_names", path)
        names = names or [str(k + 1) for k in range(tracks.shape[0])]
        if tracks.shape[:3] != (len(names), 2, len(nodes)):
            rule = (
                f"have `tracks` of (tracks, 2, nodes, frames) = ({len(names)}, 2, {len(nodes)}, F)"
            )
            raise refusal(rule, tracks.shape, where)
        node, scores = nodes.index(choose(options.keypoint, nodes, path)), None
        if getattr(member(file, "point_scores", path), "shape", None) == (
            tracks.shape[0],
            *tracks.shape[2:],
        ):
            scores = dataset(file, "point_scores", 3, path)[:, node].T
    return from_array(tracks[:, :, node].transpose(2, 0, 1), tuple(names), where, confidence=scores)


SLEAP_FORMAT = Format(
    "sleap", lambda glance: glance.holds("tracks", "node_names"), read_sleap, has_keypoints=True
)


def read_idtracker_h5(path: Path, options: Options) -> Recording:
    """Read `trajectories` (F, A, 2) in pixels; frame rate from the attribute `frames_per_second`.

    Source: Romero-Ferrero et al. 2019, idtracker.ai, Nature Methods 16; its documentation of the output.
    """
    with open_hdf5(path) as file:
        positions = dataset(file, "trajectories", 3, path)
        rate = file.attrs.get("frames_per_second")
        probabilities, scores = member(file, "id_probabilities", path), None
        if probabilities is not None:
            scores = dataset(file, "id_probabilities", len(probabilities.shape), path)
            if scores.size == positions[..., 0].size:
                scores = scores.reshape(positions.shape[:2])
            else:
                scores = None
    return _recording(positions, scores, rate, f"{path}, dataset trajectories", path)


MATLAB = b"MATLAB 5.0 MAT-file"
"""Beginning of a file of MATLAB that is not HDF5."""
_NUMERIC = (
    "double", "single", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64",
)  # fmt: skip
"""Types of arrays of numbers in files of MATLAB."""
_PLACES = ("trajectories", "positions")
_RATES = ("frames_per_second", "fps", "framerate")


def _begins(path: Path, mark: bytes) -> bool:
    with path.open("rb") as file:
        return file.read(len(mark)) == mark


_LISTED = 14  # An element that consists of others
_COMPRESSED = 15
_TYPES = (1, 2, 3, 4, 5, 6, 7, 9, 12, 13, _LISTED, _COMPRESSED, 16, 17, 18)
_HEADER_BYTES = 128


def _check_elements(path: Path) -> None:
    """Raise a ValueError for a file of MATLAB with an element of no known type, or one that is longer than its file.

    scipy 1.17 looks such a type up beyond the end of its table, which ends the process. Only the 8 bytes before each
    element are read. Compressed elements are not looked into: their checksum guards against damage by chance.
    Source: MathWorks, MAT-File Format, version 5.
    """
    with path.open("rb") as file:
        byte_order = "<" if file.read(_HEADER_BYTES).endswith(b"IM") else ">"
        stretches = [(_HEADER_BYTES, path.stat().st_size)]
        while stretches:
            begin, end = stretches.pop()
            # a few bytes of padding may be left
            while end - begin >= 8:
                file.seek(begin)
                element_type, size = struct.unpack(f"{byte_order}II", file.read(8))
                begin += 8
                if element_type >> 16:
                    # a small element has its bytes where the size of others is
                    element_type &= 0xFFFF
                    size = 0
                if element_type not in _TYPES or size > end - begin:
                    raise ValueError(f"type {element_type}, {size} bytes before byte {begin}")
                if element_type == _LISTED:
                    stretches.append((begin, begin + size))
                begin += size
                if element_type != _COMPRESSED:
                    # others end at a multiple of 8 bytes
                    begin += -size % 8


def read_archive(path: Path) -> Recording:
    """Read the array (F, A, 2) of an npz file or of a file of MATLAB: the only one, or `trajectories` or `positions`.

    Source: idTracker writes `trajectories.mat`; Perez-Escudero et al. 2014, Nature Methods 11.
    """
    with whole("npz or mat", path):
        if _begins(path, MATLAB):
            from scipy.io import loadmat, whosmat

            _check_elements(path)
            stated = whosmat(path)
            check_unpacked(sum(8 * math.prod(shape) for _, shape, _ in stated), path)
            if (TRX, "struct") in {(name, dtype) for name, _, dtype in stated}:
                return _trx(loadmat(path, variable_names=[TRX])[TRX].ravel(), path)
            numeric = [name for name, _, dtype in stated if dtype in _NUMERIC]
            # structures and cells may hold anything
            read = loadmat(path, variable_names=numeric)
            contents = {name: read[name] for name in numeric}
        else:
            check_unpacked(sum(array_sizes(path).values()), path)
            with np.load(path, allow_pickle=False) as archive:
                # other files in a zip come as bytes
                contents = {
                    name: archive[name]
                    for name in archive.files
                    if f"{name}.npy" in archive.zip.namelist()
                }
    if contents.keys() >= set(CTRAX):
        return _ctrax(contents, path)
    solid = {name: item for name, item in contents.items() if item.ndim == 3}
    chosen = [name for name in _PLACES if name in solid] or list(solid)
    if len(chosen) != 1 and "trajectories" not in solid:
        shapes = {name: item.shape for name, item in contents.items()}
        if not shapes:
            raise refusal("be text, HDF5 or arrays", "a compressed file", path, "Unpack it.")
        rule = "hold one array of positions (F, A, 2), or one that is called trajectories"
        raise refusal(rule, brief(shapes), path)
    recording = read_positions(solid[chosen[0]], f"{path}, {chosen[0]}")
    rates = [name for name in _RATES if name in contents]
    return replace(recording, fps=check_rate(contents[rates[0]], path)) if rates else recording


CTRAX = ("x_pos", "y_pos", "identity", "ntargets")
"""Arrays of a file of Ctrax: those of positions one after the other, and how many are in each frame."""


def _ctrax(contents: Mapping[str, np.ndarray], path: Path) -> Recording:
    """Read positions (pixels) of the flies in each frame, and the frame rate by `timestamps` (s), where Ctrax writes them.

    Source: Branson et al. 2009, High-throughput ethomics in large groups of Drosophila, Nature Methods 6.
    """
    x, y, identity, count = (contents[name].ravel() for name in CTRAX)
    lengths = {len(x), len(y), len(identity), int(count.sum())}
    if len(lengths) > 1:
        raise refusal("have as many positions as `ntargets` says", sorted(lengths), path)
    frames = np.repeat(np.arange(len(count), dtype=float), count.astype(int))
    times = contents.get("timestamps", np.zeros(0)).ravel().astype(float)
    rate = stated_rate(times, np.arange(len(count))) if len(times) == len(count) else None
    return assemble(
        frames,
        [f"{who:g}" for who in identity],
        np.column_stack([x, y]).astype(float),
        f"{path}, position {{}}".format,
        fps=rate,
    )


TRX = "trx"
"""The structure of trajectories of JAABA, one element for each fly."""
_TRX_FIELDS = ("x", "y", "firstframe")
MM_PER_CM = 10


def _trx(flies: np.ndarray, path: Path) -> Recording:
    """Read positions of flies (mm, or pixels) from the elements of `trx`, with headings and the frame rate where they are.

    Source: Kabra et al. 2013, JAABA: interactive machine learning for automatic annotation of animal behavior, Nature
    Methods 10; the fields are those of its `registered_trx.mat`. Frames count from 1 there.
    """
    fields = flies.dtype.names or ()
    if not set(_TRX_FIELDS) <= set(fields):
        rule = f"have `trx` with {', '.join(_TRX_FIELDS)}"
        raise refusal(rule, brief(", ".join(fields)), path)
    metric = {"x_mm", "y_mm"} <= set(fields)
    names = ("x_mm", "y_mm") if metric else ("x", "y")
    frames = []
    places = []
    headings = []
    individuals: list[str] = []
    for number, fly in enumerate(flies, start=1):
        x, y = (np.asarray(fly[name], dtype=float).ravel() for name in names)
        directions = np.full(len(x), np.nan)
        if "theta" in fields:
            directions = np.asarray(fly["theta"], dtype=float).ravel()
        lengths = sorted({len(x), len(y), len(directions)})
        if len(lengths) > 1:
            rule = f"have as many {names[0]}, {names[1]} and theta"
            raise refusal(rule, brief(lengths), f"{path}, trx({number})")
        first = int(np.asarray(fly["firstframe"]).item())
        frames.append(np.arange(first, first + len(x), dtype=float))
        places.append(np.column_stack([x, y]))
        headings.append(directions)
        individuals += [str(number)] * len(x)
    stated: dict[str, Any] = {}
    positions = np.concatenate(places)
    if metric:
        positions /= MM_PER_CM
        stated["unit"] = "cm"
    if "theta" in fields:
        stated["extras"] = {"headings": np.concatenate(headings)}
    if "fps" in fields:
        stated["fps"] = check_rate(flies[0]["fps"], path)
    return assemble(
        np.concatenate(frames), individuals, positions, f"{path}, position {{}}".format, **stated
    )


def read_npy(path: Path, options: Options) -> Recording:
    """Read positions (F, A, 2), or a pickled dictionary with `trajectories` and `frames_per_second`, if that is allowed."""
    if not _begins(path, b"\x93NUMPY"):
        return read_archive(path)
    with path.open("rb") as file:
        plain = not _is_pickled(file, path)
    if plain:
        check_unpacked(path.stat().st_size, path)
        with whole("npy", path):
            positions = np.load(path, allow_pickle=False)
        return read_positions(positions, str(path))
    if not options.allow_pickle:
        remedy = "Opening it can run any code it holds. Let idtracker.ai write h5 or csv; allow_pickle=True in Python opens it."
        raise refusal("not be a pickle", "an npy file", path, remedy)
    with whole("npy", path):
        content = np.load(path, allow_pickle=True)
        content = content.item() if content.shape == () else {}
    positions = content.get("trajectories") if isinstance(content, dict) else None
    if (
        not isinstance(positions, np.ndarray)
        or positions.ndim != 3
        or positions.dtype.kind not in "fiu"
    ):
        rule = "hold a dictionary with the array `trajectories` (F, A, 2)"
        raise refusal(rule, type(content).__name__, path)
    rate = content.get("frames_per_second")
    return _recording(positions.astype(np.float64), None, rate, f"{path}, trajectories", path)


def _is_pickled(file: Any, path: Path) -> bool:
    """Return whether an npy file holds objects, which only pickle reads."""
    from numpy.lib import format as npy

    with whole("npy", path):
        version = npy.read_magic(file)
        read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        return bool(read_header(file)[2].hasobject)


def read_positions(positions: np.ndarray, where: str) -> Recording:
    """Return positions (F, A, 2), NaN where missing, as a recording; nothing says rate, scale and direction of y."""
    rule = "be numbers of shape (F, A, 2), not empty: frames, individuals, x and y"
    if (
        positions.dtype.kind not in "fiu"
        or positions.ndim != 3
        or positions.shape[2] != 2
        or 0 in positions.shape
    ):
        raise refusal(rule, f"{positions.dtype} {positions.shape}", where)
    refuse_transposed(positions, where)
    names = tuple(str(k + 1) for k in range(positions.shape[1]))
    return from_array(positions.astype(np.float64), names, where, y_axis=None)


CLOSER = 0.2
"""Steps from column to column in steps from row to row, below which columns are frames."""


def refuse_transposed(positions: np.ndarray, where: str) -> None:
    """Refuse positions (A, F, 2) as if they were (F, A, 2): who follows whom is near to it, and comes far in a frame."""
    if not 1 < len(positions) < positions.shape[1]:
        return
    steps = []
    for axis in (0, 1):
        lengths = np.hypot(*np.moveaxis(np.diff(positions.astype(np.float64), axis=axis), -1, 0))
        known_lengths = lengths[np.isfinite(lengths)]
        if not len(known_lengths):
            return
        steps.append(float(np.median(known_lengths)))
    if steps[1] < CLOSER * steps[0]:
        got = f"{positions.shape}, with steps of {steps[0]:.3g} along its first axis and of {steps[1]:.3g} along its second"
        remedy = "If individuals come first, exchange the two: positions.transpose(1, 0, 2)."
        raise refusal("have the shape (F, A, 2), frames before individuals", got, where, remedy)


def _recording(
    positions: np.ndarray, scores: np.ndarray | None, rate: object, where: str, path: Path
) -> Recording:
    if positions.shape[2] != 2 or 0 in positions.shape:
        raise refusal("hold trajectories of shape (F, A, 2), not empty", positions.shape, where)
    names = tuple(str(k + 1) for k in range(positions.shape[1]))
    fps = None if rate is None else check_rate(rate, path)
    return from_array(positions, names, where, confidence=scores, fps=fps)


IDTRACKER_H5_FORMAT = Format(
    "idtracker.ai-h5", lambda glance: glance.holds("trajectories"), read_idtracker_h5
)
IDTRACKER_NPY_FORMAT = Format(
    "idtracker.ai-npy",
    lambda glance: (
        glance.container in ("npy", "mat")
        or (glance.container == "npz" and len(glance.names) == 1 and not _is_track(glance.names[0]))
    ),
    read_npy,
)


MOST_BYTES = 1 << 32
CENTROID = "wcentroid"
HEAD = "head"
_WANTED = ("X", "Y", "frame", "time", "missing", "ANGLE", "frame_rate")


def _points(arrays: Iterable[str]) -> dict[str, str]:
    """Return the points of the body that have X and Y, "head" without a suffix, else what is after the #; each with its suffix."""
    suffixes = {}
    for name in sorted(arrays):
        axis, _, point = name.partition("#")
        suffix = name[1:]
        if axis == "X" and f"Y{suffix}" in arrays:
            suffixes[point or HEAD] = suffix
    # sorted, because messages list them
    return dict(sorted(suffixes.items()))


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
    tracks = {}
    for file, arrays in contents.items():
        if _is_track(arrays):
            tracks[file] = _track(file, arrays, options)
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
    skipped = len(contents) - len(tracks)
    if skipped:
        remarks += (f"{skipped} npz files of the folder hold no track",)
    extras = {}
    if not unknown:
        extras["headings"] = np.where(np.isfinite(headings), headings, 0.0)
    return assemble(
        rows[:, 0],
        np.repeat(np.array(names, dtype=object), lengths).tolist(),
        rows[:, 1:3],
        place,
        extras=extras,
        fps=next(iter(rates), None),
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


def _track(
    path: Path, arrays: Mapping[str, np.ndarray], options: Options
) -> tuple[np.ndarray, float | None]:
    """Return frame, x, y, not a number where missing, and heading (rows, 4) of an individual, and the frame rate."""
    available = _points(arrays)
    wanted = options.keypoint
    if not wanted and CENTROID in available:
        wanted = CENTROID
    suffix = available[choose(wanted, [*available], path)]
    values = {}
    for name in ("frame", f"X{suffix}", f"Y{suffix}", "ANGLE", "missing", "time"):
        if name in arrays:
            column = arrays[name]
            if column.ndim != 1 or column.dtype.kind not in "fiub":
                rule = "hold lists of numbers"
                raise refusal(rule, f"{column.dtype} {column.shape}", f"{path}, array {name}")
            values[name] = column.astype(np.float64)
    lengths = {name: len(column) for name, column in values.items()}
    if len(set(lengths.values())) > 1 or not lengths["frame"]:
        raise refusal("have arrays of one length, not empty", lengths, path)
    unknown = np.full(lengths["frame"], np.nan)
    rows = np.column_stack([*list(values.values())[:3], values.get("ANGLE", unknown)])
    absent = np.isinf(rows[:, 1:3]).any(axis=1) | (values.get("missing", np.zeros(1)) != 0)
    rows[absent, 1:3] = np.nan
    rate = check_rate(arrays["frame_rate"], path) if "frame_rate" in arrays else None
    if rate is None and "time" in values:
        rate = stated_rate(values["time"], values["frame"])
        rate = None if rate is None else rounded(rate * per_second(rate, options.fps, path))
    return rows, rate


TREX_FORMAT = Format(
    "trex",
    lambda glance: glance.container == "npz" and any(map(_is_track, glance.names)),
    read_trex,
    has_keypoints=True,
)


_OF_POINTS = "name scorer, (individual,) body part and coordinate of each column"
BY_PANDAS = "If it is whole, read it by pandas.read_hdf, and give the DataFrame."


def read_deeplabcut_h5(path: Path, options: Options) -> Recording:
    """Read what DeepLabCut writes to HDF5, in both forms of a table of pandas; no pickle that calls anything is opened."""
    with open_hdf5(path) as file:
        names = []
        for name in file:
            if "pandas_type" in getattr(member(file, name, path), "attrs", ()):
                names.append(name)
        if len(names) != 1:
            raise refusal("hold one table of pandas", f"{len(names)}", path, BY_PANDAS)
        group = file[names[0]]
        form = {"frame_table": _appendable, "frame": _fixed}.get(text(group.attrs["pandas_type"]))
        if form is None:
            rule = "hold a table of pandas"
            raise refusal(rule, text(group.attrs["pandas_type"]), f"{path}, {names[0]}", BY_PANDAS)
        where = f"{path}, {names[0]}"
        try:
            frames, labels, values = form(group, path)
        except (AttributeError, KeyError, TypeError):
            # what pandas writes of other tables has other parts
            raise refusal(_OF_POINTS, "others", where, BY_PANDAS) from None
    widths = set(map(len, labels))
    sound = values.shape == (len(frames), len(labels)) and widths in ({3}, {4})
    if not (sound and frames.dtype.kind in "iu" and values.dtype.kind == "f"):
        raise refusal(_OF_POINTS, "others", where, BY_PANDAS)
    values = np.column_stack([frames, values])
    sheet = Sheet(
        [], lambda numbers: (values[:, numbers], []), where, lambda row: f"{where}, row {row}"
    )
    return read_points(labels, sheet, options)


class _Plain(pickle.Unpickler):
    """Opens pickles of lists, tuples and texts, in which pandas names columns, and none that calls anything."""

    def find_class(self, module: str, name: str) -> Any:
        raise pickle.UnpicklingError(f"a pickle that calls {module}.{name}")


def _appendable(group: Any, path: Path) -> tuple[np.ndarray, Labels, np.ndarray]:
    """Return frames, labels and values of a table to which rows can be appended, as DeepLabCut writes it."""
    rows = member(group, "table", path)
    blocks = [name for name in rows.dtype.names or () if name.startswith("values_block_")]
    table = rows[()]
    labels: Labels = []
    values = []
    for name in blocks:
        index = _Plain(io.BytesIO(bytes(rows.attrs[f"{name}_kind"]))).load()
        labels += [tuple(map(str, label)) for label in index]
        values.append(table[name].reshape(len(table), -1))
    return table["index"], labels, np.concatenate(values, axis=1)


def _fixed(group: Any, path: Path) -> tuple[np.ndarray, Labels, np.ndarray]:
    """Return the same of a table that cannot grow, as movement writes it."""
    labels: Labels = []
    blocks = []
    for block in range(int(group.attrs["nblocks"])):
        columns = []
        for level in range(int(group.attrs[f"block{block}_items_nlevels"])):
            names = list(map(text, member(group, f"block{block}_items_level{level}", path)[()]))
            numbers = member(group, f"block{block}_items_label{level}", path)[()]
            columns.append([names[number] for number in numbers])
        labels += list(zip(*columns, strict=True))
        blocks.append(member(group, f"block{block}_values", path)[()])
    return member(group, "axis1", path)[()], labels, np.concatenate(blocks, axis=1)


DEEPLABCUT_H5_FORMAT = Format(
    "deeplabcut-h5",
    lambda glance: glance.holds("pandas_type"),
    read_deeplabcut_h5,
    has_keypoints=True,
)


_NO_COORDINATES = b"This is a netCDF dimension"


def read_movement(path: Path, options: Options) -> Recording:
    """Read what `to_netcdf` of a dataset of movement writes: NetCDF 3, or HDF5, whose dimensions are scales."""
    import xarray as xr

    with path.open("rb") as raw:
        old = raw.read(3) == b"CDF"
    if old:
        with (
            whole("NetCDF", path),
            xr.open_dataset(path, engine="scipy", decode_times=False) as opened,
        ):
            check_unpacked(8 * max(variable.size for variable in opened.variables.values()), path)
            return read_dataset(opened.load(), options, str(path))
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {}
    with open_hdf5(path) as file:
        for name in ("position", "confidence", "heading"):
            item = member(file, name, path)
            if item is not None:
                if item.dtype.kind not in "fiu":
                    raise refusal("hold numbers", item.dtype, f"{path}, {name}")
                dimensions = []
                for scale in item.dims:
                    dimensions.append(text(scale[0].name).lstrip("/") if len(scale) else "unnamed")
                variables[name] = (dimensions, item[()])
        names = {name for dimensions, _ in variables.values() for name in dimensions}
        for name in sorted(names):
            scale = member(file, name, path)
            # NetCDF writes so where a dimension has a length and no coordinates
            if scale is None or bytes(scale.attrs.get("NAME", b"")).startswith(_NO_COORDINATES):
                continue
            if scale.dtype.kind in "fiu":
                coordinates[name] = scale[()]
            else:
                coordinates[name] = texts(file, name, path)
        stated = {}
        for name, value in file.attrs.items():
            # those of the library begin with an underscore
            if not name.startswith("_"):
                stated[name] = _plain(value)
        dataset = xr.Dataset(variables, coordinates, stated)
    return read_dataset(dataset, options, str(path))


def _plain(value: Any) -> Any:
    """Return an attribute as a number or a text."""
    if isinstance(value, (bytes, str)):
        return text(value)
    return value.ravel()[0] if np.size(value) == 1 and hasattr(value, "ravel") else value


def read_dataset(dataset: "xr.Dataset", options: Options, source: str = "") -> Recording:
    """Read `position` (time, space, keypoints, individuals), `confidence`, `heading`; dimensions may be in the singular.

    Source: the documentation of movement, neuroinformatics.dev, "movement datasets".
    """
    dataset = dataset.rename(
        {name: f"{name}s" for name in ("individual", "keypoint") if name in dataset.dims}
    )
    if "position" not in dataset or not {"time", "space", "individuals"} <= set(
        dataset["position"].dims
    ):
        dimensions = ("time", "space", "keypoints", "individuals")
        refuse("dataset", f"have `position` {dimensions}", str(dict(dataset.sizes)), place=source)
    space = list(map(str, dataset["space"].values))
    rule = "have the coordinates x, y in space"
    require(space == ["x", "y"], "dataset", rule, str(space), place=source)
    require(
        0 not in dataset["position"].shape,
        "dataset",
        "not be empty",
        str(dict(dataset.sizes)),
        place=source,
    )
    stated, y_axis, keypoint = dataset.attrs.get("y_axis"), options.y_axis, options.keypoint
    if stated not in (None, "up", "down") or (None not in (stated, y_axis) and stated != y_axis):
        rule = "be 'up' or 'down', as the dataset states"
        refuse("y_axis", rule, f"{y_axis!r} and {stated!r}", place=source)
    # A group has one position each: that of the key point that is asked for
    rate, first_frame = _timing(dataset, options.fps, source)
    if "keypoints" in dataset.dims:
        points = list(map(str, dataset["keypoints"].values))
        dataset = dataset.isel(
            keypoints=points.index(choose(keypoint, points, source or "dataset"))
        )
    elif keypoint is not None:
        rule = "be left out for a dataset without key points"
        refuse("keypoint", rule, brief(keypoint), place=source)
    beside: dict[str, np.ndarray] = {}
    for name in ("confidence", "heading"):
        if name in dataset:
            values = dataset[name].transpose("time", "individuals").values
            beside[name] = values.astype(np.float64)
    unit = dataset.attrs.get("length_unit")
    return from_array(
        dataset["position"].transpose("time", "individuals", "space").values.astype(np.float64),
        tuple(map(str, dataset["individuals"].values)),
        f"{source or 'dataset'}, position",
        confidence=beside.get("confidence"),
        headings=beside.get("heading"),
        fps=rate,
        first_frame=first_frame,
        unit=unit if unit in ("cm", "px") else None,
        y_axis=stated,
    )


def _timing(dataset: "xr.Dataset", fps: float | None, source: str) -> tuple[float | None, int]:
    """Return frame rate and first frame of a dataset, by its attribute and by times in seconds; `fps` decides between them.

    Times count frames if they say so, or if there are none, or if they are one apart and state no unit.
    """
    times = np.asarray(dataset["time"].values)
    steps = np.diff(times.astype(np.float64)) if times.dtype.kind in "fiu" else np.full(1, np.nan)
    if not np.allclose(steps, steps[:1], rtol=1e-3, atol=0) or (steps <= 0).any():
        refuse("dataset", "have evenly spaced times as numbers", "others", place=source)
    unit = dataset.attrs.get("time_unit")
    recognized = unit in (None, "seconds", "frames")
    rule = "be 'seconds' or 'frames' in `dataset`"
    require(recognized, "time_unit", rule, brief(unit), place=source)
    if unit == "frames" and (steps != 1).any():
        remedy = "Number the frames that are there, and give the rate of those as `fps`."
        rule = "have times one frame apart, as their unit is frames"
        refuse("dataset", rule, f"{steps[0]:g}", remedy, place=source)
    if dataset.attrs.get("fps") is None:
        rate = None
    else:
        rate = check_rate(dataset.attrs["fps"], f"{source or 'dataset'}, fps")
    if (
        unit == "frames"
        or "time" not in dataset.coords
        or (unit is None and bool((steps == 1).all()))
    ):
        return rate, round(float(times[0]))
    if len(times) > 1:
        by_times = rounded((len(times) - 1) / float(times[-1] - times[0]))
        if unit is None and rate is None:
            by_times = rounded(by_times * per_second(by_times, fps, source or "dataset"))
        close = rate is not None and math.isclose(rate, by_times, rel_tol=1e-3)
        if rate is not None and not close and fps is None:
            rule = f"have the same frame rate in its times, {by_times:g}, and in its attribute fps"
            remedy = f"If the times are right, give fps={by_times:g}; if not, mend them."
            refuse("dataset", rule, f"{rate:g}", remedy, place=source)
        rate = rate if close else by_times
    return rate, round(float(times[0]) * (rate or fps or 1.0))


MOVEMENT_FORMAT = Format(
    "movement",
    lambda glance: glance.container == "netcdf3" or glance.holds("position", "space"),
    read_movement,
    has_keypoints=True,
)
