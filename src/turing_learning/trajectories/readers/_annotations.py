"""Annotations of individuals in images, and archives of experiments: VIA, COCO, labels of SLEAP, NWB."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .._recording import Format, Options, Recording, YAxis, assemble, refusal
from ._arrays import dataset, member, open_hdf5, refuse_large, text, texts, whole
from ._columns import choose
from ._layouts import in_unit
from ._long import read_long
from ._sheets import sheet_of
from ._tables import frame_sheet

if TYPE_CHECKING:
    from .._recording import Glance

TRACKS = ("track", "track_id", "tracking_id", "instance_id", "object_id", "individual_id")
"""Attributes that name an individual."""
FRAMES = ("frame", "frame_id", "frame_index", "frame_number")
"""Attributes that number the frame of an image; without them it is the last number in its name."""
MOST_JSON_BYTES = 1 << 28
"""Size of a JSON file. Reading takes 7 to 16 times as much memory, so up to 4 GiB, to which arrays may unpack as well."""
ONE_EACH = "Where an image shows several individuals, the annotations have to name their tracks."


def _attribute(attributes: Mapping[str, Any], names: Sequence[str]) -> Any:
    """Return the first of these attributes that there is, None if there is none."""
    for name in names:
        if attributes.get(name) is not None:
            return attributes[name]
    return None


def _individual_of(attributes: Mapping[str, Any]) -> str:
    """Return the name of the individual, which is the only one where no attribute names it."""
    track = _attribute(attributes, TRACKS)
    return "1" if track is None else str(track)


def _frame_of(attributes: Mapping[str, Any], file_name: str, where: str) -> float:
    """Return the number of the frame that an image shows."""
    stated = _attribute(attributes, FRAMES)
    if stated is not None:
        return float(stated)
    numbers = re.findall("[0-9]+", Path(file_name).stem)
    if not numbers:
        raise refusal("number the frames, as frame_0012.png does", file_name, where)
    return float(numbers[-1])


def _refuse_videos(file_names: Sequence[str], path: Path) -> None:
    """Refuse images of several videos, whose names differ in more than the last number."""
    videos = sorted({re.sub("[0-9]+(?=[^0-9]*$)", "", name) for name in file_names})
    if len(videos) > 1:
        got = f"images of {len(videos)} videos, such as {videos[0]} and {videos[1]}"
        raise refusal("hold one recording", got[:80], path, "Write a file for each of them.")


VIA = ("filename", "file_attributes", "region_shape_attributes", "region_attributes")


def _is_via(glance: "Glance") -> bool:
    first_line = "".join(glance.lines[:1]).lower()
    return all(name in first_line for name in VIA)


def read_via(path: Path, options: Options) -> Recording:
    """Read rectangles, by their centers, points, circles and ellipses (pixels) that VIA exports as CSV.

    The attribute `track` of a region names the individual. Source: Dutta and Zisserman 2019, the VIA
    annotation software, ACM Multimedia.
    """
    sheet = sheet_of(path, ",")
    names = [name.lstrip("#").lower() for name in sheet.names]
    if not set(VIA) <= set(names):
        raise refusal(f"have the columns {', '.join(VIA)}", ", ".join(sheet.names), sheet.origin)
    _, columns = sheet.read([], list(map(names.index, VIA)))
    _refuse_videos(columns[0], path)
    frames = []
    points = []
    individuals = []
    confidence = []
    lines = []
    for row, (file_name, *cells) in enumerate(zip(*columns, strict=True)):
        where = sheet.at(row)
        with whole("VIA", Path(where)):
            image, shape, region = map(json.loads, cells)
            # an image without anybody has a row, too
            if shape:
                points.append(_center(shape, where))
                frames.append(_frame_of(image, file_name, where))
                individuals.append(_individual_of(region))
                confidence.append(float(region.get("confidence", np.nan)))
                lines.append(row)
    if not points:
        raise refusal("hold at least one region", "none", path)
    return assemble(
        np.array(frames),
        individuals,
        np.array(points),
        lambda point: sheet.at(lines[point]),
        extras={"confidence": np.array(confidence)},
        twice=ONE_EACH,
        columns={"frame": "filename", "id": "region_attributes", "x, y": "region_shape_attributes"},
    )


def _center(shape: Mapping[str, Any], where: str) -> tuple[float, float]:
    """Return the center of a region."""
    try:
        if shape["name"] == "rect":
            x = shape["x"] + shape["width"] / 2
            y = shape["y"] + shape["height"] / 2
            return float(x), float(y)
        return float(shape["cx"]), float(shape["cy"])
    except (KeyError, TypeError, ValueError):
        rule = "have rectangles, points, circles or ellipses"
        raise refusal(
            rule, str(shape)[:80], where, "Outlines have no center by themselves."
        ) from None


def _is_json(glance: "Glance") -> bool:
    return glance.container == "json"


def read_coco(path: Path, options: Options) -> Recording:
    """Read a key point (pixels), or the center of the box, of each annotation in COCO's JSON.

    `track_id`, of the annotation or among its attributes, names the individual. Source: Lin et al. 2014,
    Microsoft COCO, ECCV; cocodataset.org, data format.
    """
    refuse_large(path, MOST_JSON_BYTES)
    with whole("JSON", path):
        content = json.loads(path.read_bytes())
    if not (isinstance(content, dict) and {"images", "annotations"} <= content.keys()):
        got = ", ".join(map(str, content))[:80] if isinstance(content, dict) else "a list"
        remedy = "Of other JSON write a table with frame, id, x, y."
        raise refusal("hold images and annotations, as COCO does", got, path, remedy)
    with whole("COCO", path):
        return _coco(content, options, path)


def _coco(content: Mapping[str, Any], options: Options, path: Path) -> Recording:
    images = {image["id"]: image for image in content["images"]}
    videos = {image.get("video_id") for image in images.values()}
    if len(videos) > 1:
        got = f"{len(videos)} by video_id"
        raise refusal("hold one recording", got, path, "Write a file for each of them.")
    _refuse_videos([str(image.get("file_name", "")) for image in images.values()], path)
    frame_of = {}
    for key, image in images.items():
        frame_of[key] = _frame_of(image, image.get("file_name", ""), f"{path}, image {key}")
    names: list[str] = []
    for category in content.get("categories", ()):
        names += category.get("keypoints", ())
    # several categories may have the same points
    names = list(dict.fromkeys(names))
    node = names.index(choose(options.keypoint, names, path)) if names else None
    annotations = content["annotations"]
    frames = []
    points = []
    individuals = []
    for annotation in annotations:
        frames.append(frame_of[annotation["image_id"]])
        points.append(_point_of(annotation, node))
        attributes = annotation.get("attributes", {})
        individuals.append(_individual_of({**attributes, **annotation}))
    if not points:
        raise refusal("hold at least one annotation", "none", path)
    scores = np.array([float(annotation.get("score", np.nan)) for annotation in annotations])
    choices = () if names else ("positions are the centers of the boxes",)
    return assemble(
        np.array(frames),
        individuals,
        np.array(points),
        lambda row: f"{path}, annotation {annotations[row].get('id', row)}",
        extras={"confidence": scores},
        twice=ONE_EACH,
        choices=choices,
    )


def _point_of(annotation: Mapping[str, Any], node: int | None) -> tuple[float, float]:
    """Return a key point, not a number where it is not labeled, or the center of the box."""
    if node is None:
        left, top, width, height = annotation["bbox"]
        return left + width / 2, top + height / 2
    x, y, labeled = annotation["keypoints"][3 * node : 3 * node + 3]
    return (float(x), float(y)) if labeled else (np.nan, np.nan)


OLD_CORNERS = 1.1
"""Version of SLEAP's labels before which the corner of the first pixel, not its center, was at (0, 0)."""


def read_slp(path: Path, options: Options) -> Recording:
    """Read a key point (pixels) of each tracked instance of SLEAP's own labels, those of the user before predicted ones.

    Source: Pereira et al. 2022, SLEAP, Nature Methods 19; sleap-io, module slp.
    """
    with open_hdf5(path) as file:
        frames = member(file, "frames", path)[()]
        instances = member(file, "instances", path)[()]
        labeled = member(file, "points", path)[()]
        predicted = member(file, "pred_points", path)[()]
        metadata = member(file, "metadata", path).attrs
        content = json.loads(text(metadata["json"]))
        version = float(metadata.get("format_id", 1.0))
        tracks = [json.loads(track)[-1] for track in texts(file, "tracks_json", path)]
        counts = {"videos": len(np.unique(frames["video"])), "skeletons": len(content["skeletons"])}
        for noun, count in counts.items():
            if count != 1:
                remedy = "Export the analysis of one video from SLEAP."
                raise refusal("hold one video and one skeleton", f"several {noun}", path, remedy)
        nodes = [content["nodes"][node["id"]]["name"] for node in content["skeletons"][0]["nodes"]]
        node = nodes.index(choose(options.keypoint, nodes, path))
        by_user = instances["instance_type"] == 0
        tracked = instances["track"] >= 0
        untracked = int((~tracked).sum())
        chosen = tracked if tracks and tracked.any() else np.ones(len(instances), dtype=bool)
        frame_of = dict(zip(frames["frame_id"].tolist(), frames["frame_idx"].tolist(), strict=True))
        numbers = np.array(
            [frame_of[frame] for frame in instances["frame_id"].tolist()], dtype=float
        )
        corrected = set(zip(numbers[by_user], instances["track"][by_user], strict=True))
        rows = []
        for row in np.flatnonzero(chosen):
            # what the user has corrected stands there twice, as it was predicted and as it is
            if by_user[row] or (numbers[row], instances["track"][row]) not in corrected:
                rows.append(row)
        points = np.full((len(rows), 3), np.nan)
        for k, row in enumerate(rows):
            source = labeled if by_user[row] else predicted
            point = source[int(instances["point_id_start"][row]) + node]
            if point["visible"]:
                sure = 1.0 if by_user[row] else point["score"]
                points[k] = point["x"], point["y"], sure
        if version < OLD_CORNERS:
            points[:, :2] -= 0.5
        names = [tracks[instances["track"][row]] if tracked[row] else "1" for row in rows]
    choices: tuple[str, ...] = ()
    if untracked and tracks:
        choices = (f"{untracked} instances are left out: they are of no track",)
    return assemble(
        numbers[rows],
        names,
        points[:, :2],
        lambda k: f"{path}, instance {rows[k]}",
        extras={"confidence": points[:, 2]},
        twice="Without tracks a frame may show one instance: track them in SLEAP.",
        choices=choices,
    )


SERIES = ("PoseEstimationSeries", "SpatialSeries")
"""Types of NWB that hold positions."""


def read_nwb(path: Path, options: Options) -> Recording:
    """Read poses of ndx-pose, an individual for each PoseEstimation, or else the positions of a SpatialSeries.

    Source: Rübel et al. 2022, the Neurodata Without Borders ecosystem, eLife 11; ndx-pose.
    """
    import pandas as pd

    with open_hdf5(path) as file:
        series: dict[str, dict[str, Any]] = {neurodata_type: {} for neurodata_type in SERIES}

        def collect(name: str, item: Any) -> None:
            neurodata_type = text(item.attrs.get("neurodata_type", ""))
            data = item.get("data") if neurodata_type in SERIES else None
            if data is not None and len(data.shape) == 2:
                series[neurodata_type][name] = item

        file.visititems(collect)
        poses = series[SERIES[0]] or series[SERIES[1]]
        if not poses:
            remedy = "Export what the tracker wrote as CSV."
            raise refusal("hold PoseEstimationSeries or SpatialSeries", "none", path, remedy)
        points = list(dict.fromkeys(name.rpartition("/")[2] for name in poses))
        point = choose(options.keypoint, points, path)
        chosen = {name: item for name, item in poses.items() if name.rpartition("/")[2] == point}
        units = {text(item["data"].attrs.get("unit", "")).lower() for item in chosen.values()}
        if len(units) > 1:
            raise refusal("have positions in one unit", ", ".join(sorted(units)), path)
        tables = [_series(name, item, path) for name, item in chosen.items()]
    unit = units.pop()
    sheet = frame_sheet(pd.concat(tables, ignore_index=True), str(path))
    # what a person says of columns is for tables
    recording = read_long(sheet, replace(options, columns=None, keypoint=None))
    # poses are of images, other series in the axes of an experiment
    y_axis: YAxis | None = "down" if series[SERIES[0]] else None
    return replace(in_unit(recording, unit), y_axis=y_axis, columns={"x, y": ", ".join(chosen)})


def _series(name: str, item: Any, path: Path) -> Any:
    """Return time (s), id, x, y and confidence of a series as a table."""
    import pandas as pd

    values = dataset(item, "data", 2, path)
    if values.shape[1] not in (2, 3):
        raise refusal("have x and y in a series", f"{values.shape}", f"{path}, {name}")
    attributes = item["data"].attrs
    scale = float(attributes.get("conversion", 1.0))
    points = values * scale + float(attributes.get("offset", 0.0))
    start = member(item, "starting_time", path)
    if start is None:
        times = dataset(item, "timestamps", 1, path)
        # a program that knows no rate counts frames here
        clock = "time"
    else:
        times = float(start[()]) + np.arange(len(points)) / float(start.attrs["rate"])
        clock = "time (s)"
    if len(times) != len(points):
        raise refusal("have a time for each position", f"{len(times)} times", f"{path}, {name}")
    columns = {clock: times, "id": name.split("/")[-2], "x": points[:, 0], "y": points[:, 1]}
    if points.shape[1] == 3:
        columns["z"] = points[:, 2]
    if member(item, "confidence", path) is not None:
        columns["confidence"] = dataset(item, "confidence", 1, path)
    return pd.DataFrame(columns)


VIA_FORMAT = Format("via", _is_via, read_via)
COCO_FORMAT = Format("coco", _is_json, read_coco, has_keypoints=True)
SLP_FORMAT = Format(
    "sleap-slp",
    lambda glance: glance.holds("frames", "instances", "pred_points"),
    read_slp,
    has_keypoints=True,
)
NWB_FORMAT = Format(
    "nwb",
    lambda glance: glance.holds("processing", "session_start_time"),
    read_nwb,
    has_keypoints=True,
    has_times=True,
)
