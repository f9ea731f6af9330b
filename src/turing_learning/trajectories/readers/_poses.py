"""HDF5 of DeepLabCut, and files and datasets of the movement package, with several points of each body."""

import io
import math
import pickle
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.errors import brief, refuse, require

from .._recording import Format, Glance, Options, Recording, from_array, refusal
from ._shared import Sheet, check_rate, check_unpacked, choose, member, open_hdf5, rounded, text, texts, whole
from ._tables import Labels, read_points

if TYPE_CHECKING:
    import xarray as xr


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
    place, widths = f"{path}, {names[0]}", {len(label) for label in labels}
    sound = values.shape == (len(frames), len(labels)) and widths in ({3}, {4})
    if not (sound and frames.dtype.kind in "iu" and values.dtype.kind == "f"):
        raise refusal("name scorer, (individual,) body part and coordinate of each column", "others", place)
    values = np.column_stack([frames, values])
    sheet = Sheet([], lambda numbers: (values[:, numbers], []), place, lambda row: f"{place}, row {row}")
    return read_points(labels, sheet, options)


class _Plain(pickle.Unpickler):
    """Opens pickles of lists, tuples and texts, in which pandas names columns, and none that calls anything."""

    def find_class(self, module: str, name: str) -> Any:
        raise pickle.UnpicklingError(f"a pickle that calls {module}.{name}")


def _appendable(group: Any, path: Path) -> tuple[np.ndarray, Labels, np.ndarray]:
    """Return frames, labels and values of a table to which rows can be appended, as DeepLabCut writes it."""
    rows = member(group, "table", path)
    blocks = [name for name in rows.dtype.names or () if name.startswith("values_block_")]
    kinds = [_Plain(io.BytesIO(bytes(rows.attrs[f"{name}_kind"]))).load() for name in blocks]
    labels = [tuple(map(str, label)) for kind in kinds for label in kind]
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
    return member(group, "axis1", path)[()], labels, np.concatenate(blocks, axis=1)


H5_FORMAT = Format("deeplabcut-h5", lambda glance: glance.holds("pandas_type"), read_h5, has_keypoints=True)


def read_movement(path: Path, options: Options) -> Recording:
    """Read what `to_netcdf` of a dataset of movement writes: NetCDF 3, or HDF5, whose dimensions are scales."""
    import xarray as xr

    with path.open("rb") as raw:
        old = raw.read(3) == b"CDF"
    if old:
        with whole("NetCDF", path), xr.open_dataset(path, engine="scipy", decode_times=False) as opened:
            check_unpacked(8 * max(each.size for each in opened.variables.values()), path)
            return read_dataset(opened.load(), options, str(path))
    variables: dict[str, Any] = {}
    coordinates: dict[str, Any] = {}
    with open_hdf5(path) as file:
        for name in ("position", "confidence", "heading"):
            found = member(file, name, path)
            if found is not None:
                if found.dtype.kind not in "fiu":
                    raise refusal("hold numbers", found.dtype, f"{path}, {name}")
                dimensions = [text(scale[0].name).lstrip("/") if len(scale) else "unnamed" for scale in found.dims]
                variables[name] = (dimensions, found[()])
        for name in sorted({name for dimensions, _ in variables.values() for name in dimensions}):
            scale = member(file, name, path)
            if scale is not None and not bytes(scale.attrs.get("NAME", b"")).startswith(b"This is a netCDF dimension"):
                coordinates[name] = scale[()] if scale.dtype.kind in "fiu" else texts(file, name, path)
        stated = {name: _plain(value) for name, value in file.attrs.items() if not name.startswith("_")}
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
    dataset = dataset.rename({name: f"{name}s" for name in ("individual", "keypoint") if name in dataset.dims})
    if "position" not in dataset or not {"time", "space", "individuals"} <= set(dataset["position"].dims):
        dimensions = ("time", "space", "keypoints", "individuals")
        refuse("dataset", f"have `position` {dimensions}", str(dict(dataset.sizes)), place=source)
    space = [str(name) for name in dataset["space"].values]
    require(space == ["x", "y"], "dataset", "have the coordinates x, y in space", str(space), place=source)
    require(0 not in dataset["position"].shape, "dataset", "not be empty", str(dict(dataset.sizes)), place=source)
    stated, y_axis, keypoint = dataset.attrs.get("y_axis"), options.y_axis, options.keypoint
    if stated not in (None, "up", "down") or (None not in (stated, y_axis) and stated != y_axis):
        refuse("y_axis", "be 'up' or 'down', as the dataset states", f"{y_axis!r} and {stated!r}", place=source)
    rate, first_frame = _timing(dataset, options.fps, source)
    if "keypoints" in dataset.dims:
        points = [str(name) for name in dataset["keypoints"].values]
        dataset = dataset.isel(keypoints=points.index(choose(keypoint, points, source or "dataset")))
    elif keypoint is not None:
        refuse("keypoint", "be left out for a dataset without key points", brief(keypoint), place=source)
    confidence, headings = (
        dataset[name].transpose("time", "individuals").values.astype(np.float64) if name in dataset else None
        for name in ("confidence", "heading")
    )
    unit = dataset.attrs.get("length_unit")
    return from_array(
        dataset["position"].transpose("time", "individuals", "space").values.astype(np.float64),
        tuple(str(name) for name in dataset["individuals"].values),
        f"{source or 'dataset'}, position",
        confidence=None if confidence is None or np.isnan(confidence).all() else confidence,
        headings=headings,
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
    known = unit in (None, "seconds", "frames")
    require(known, "time_unit", "be 'seconds' or 'frames' in `dataset`", brief(unit), place=source)
    if unit == "frames" and (steps != 1).any():
        remedy = "Number the frames that are there, and give the rate of those as `fps`."
        refuse("dataset", "have times one frame apart, as their unit is frames", f"{steps[0]:g}", remedy, place=source)
    rate = None if dataset.attrs.get("fps") is None else check_rate(dataset.attrs["fps"], f"{source or 'dataset'}, fps")
    if unit == "frames" or "time" not in dataset.coords or (unit is None and bool((steps == 1).all())):
        return rate, round(float(times[0]))
    if len(times) > 1:
        by_times = rounded((len(times) - 1) / float(times[-1] - times[0]))
        close = rate is not None and math.isclose(rate, by_times, rel_tol=1e-3)
        if rate is not None and not close and fps is None:
            rule = f"have the same frame rate in its times, {by_times:g}, and in its attribute fps"
            remedy = f"If the times are right, give fps={by_times:g}; if not, mend them."
            refuse("dataset", rule, f"{rate:g}", remedy, place=source)
        rate = rate if close else by_times
    return rate, round(float(times[0]) * (rate or fps or 1.0))


def _is_movement(glance: Glance) -> bool:
    return glance.kind == "netcdf3" or glance.holds("position", "space")


MOVEMENT_FORMAT = Format("movement", _is_movement, read_movement, has_keypoints=True)
