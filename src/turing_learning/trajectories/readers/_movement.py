"""Datasets in the conventions of the `movement` package."""

import math
from typing import TYPE_CHECKING

import numpy as np

from turing_learning.errors import brief, refuse
from turing_learning.trajectories._recording import Recording, YAxis

from ._shared import RATE_DIGITS, check_rate, choose, from_array

if TYPE_CHECKING:
    import xarray as xr


def read_dataset(
    dataset: "xr.Dataset", keypoint: str | None = None, fps: float | None = None, y_axis: YAxis | None = None
) -> Recording:
    """Read `position` (time, space, keypoints, individuals), `confidence`, `heading`; what the user states comes first.

    Source: the documentation of movement, neuroinformatics.dev, "movement datasets".
    """
    if "position" not in dataset or not {"time", "space", "individuals"} <= set(dataset["position"].dims):
        dimensions = ("time", "space", "keypoints", "individuals")
        refuse("dataset", f"have `position` {dimensions}", str(dict(dataset.sizes)))
    if list(dataset["space"].values) != ["x", "y"]:
        refuse("dataset", "have the coordinates x, y in space", str(list(dataset["space"].values)))
    _check_stated(dataset, y_axis)
    rate = _rate(dataset, fps)
    if "keypoints" in dataset.dims:
        points = [str(name) for name in dataset["keypoints"].values]
        dataset = dataset.isel(keypoints=points.index(choose(keypoint, points, "dataset")))
    elif keypoint is not None:
        refuse("keypoint", "be left out for a dataset without key points", brief(keypoint))
    confidence = _plane(dataset, "confidence")
    return from_array(
        dataset["position"].transpose("time", "individuals", "space").values.astype(np.float64),
        tuple(str(name) for name in dataset["individuals"].values),
        "dataset, position",
        confidence=None if confidence is None or np.isnan(confidence).all() else confidence,
        headings=_plane(dataset, "heading"),
        fps=rate,
        first_frame=round(float(dataset["time"].values[0]) * (1.0 if _in_frames(dataset) else rate or fps or 1.0)),
        in_cm=dataset.attrs.get("length_unit") == "cm",
        y_axis=dataset.attrs.get("y_axis"),
    )


def _plane(dataset: "xr.Dataset", name: str) -> np.ndarray | None:
    if name not in dataset:
        return None
    return dataset[name].transpose("time", "individuals").values.astype(np.float64)


def _rate(dataset: "xr.Dataset", fps: float | None) -> float | None:
    """Return the frame rate that the dataset states, by its attribute and by times in seconds; `fps` decides between them."""
    stated = None if dataset.attrs.get("fps") is None else check_rate(dataset.attrs["fps"], "dataset, fps")
    times = dataset["time"].values
    if _in_frames(dataset) or len(times) < 2:
        return stated
    by_times = float(f"{(len(times) - 1) / float(times[-1] - times[0]):.{RATE_DIGITS}g}")
    if stated is not None and math.isclose(stated, by_times, rel_tol=1e-3):
        return stated
    if stated is not None and fps is None:
        refuse(
            "dataset",
            f"have the same frame rate in its times, {by_times:g}, and in its attribute fps",
            f"{stated:g}",
            f"If the times are right, give fps={by_times:g}; if not, mend them.",
        )
    return by_times


def _in_frames(dataset: "xr.Dataset") -> bool:
    """Whether times count frames: they say so, or there are none, or they are one apart and state no unit."""
    unit = dataset.attrs.get("time_unit")
    times = dataset["time"].values
    return unit == "frames" or "time" not in dataset.coords or (unit is None and bool((np.diff(times) == 1).all()))


def _check_stated(dataset: "xr.Dataset", y_axis: YAxis | None) -> None:
    times = np.asarray(dataset["time"].values)
    steps = np.diff(times.astype(np.float64)) if times.dtype.kind in "fiu" else np.full(1, np.nan)
    if not np.allclose(steps, steps[:1], rtol=1e-3, atol=0) or (steps <= 0).any():
        refuse("dataset", "have evenly spaced times as numbers", "others")
    unit = dataset.attrs.get("time_unit")
    if unit not in (None, "seconds", "frames"):
        refuse("time_unit", "be 'seconds' or 'frames' in `dataset`", brief(unit))
    if unit == "frames" and (steps != 1).any():
        refuse(
            "dataset",
            "have times one frame apart, as their unit is frames",
            f"{steps[0]:g}",
            "Number the frames that are there, and give the rate of those as `fps`.",
        )
    stated = dataset.attrs.get("y_axis")
    if stated not in (None, "up", "down") or (None not in (stated, y_axis) and stated != y_axis):
        refuse("y_axis", "be 'up' or 'down', as the dataset states", f"{y_axis!r} and {stated!r}")
