"""Files as the trackers write them, from positions (F, A, 2) in pixels with NaN where missing."""

import json
import pickle
from pathlib import Path

import h5py
import numpy as np

FPS = 25.0


def walk(frames: int = 12, individuals: int = 3, seed: int = 0, missing: float = 0.1) -> np.ndarray:
    """Return positions (F, A, 2) with NaN where missing; everybody is there at first and at last."""
    rng = np.random.default_rng(seed)
    positions = np.round(
        100
        + 200 * rng.random((1, individuals, 2))
        + rng.normal(size=(frames, individuals, 2)).cumsum(0),
        3,
    )
    positions[1:-1][rng.random((frames - 2, individuals)) < missing] = np.nan
    return positions


def _cell(value: float, missing: str = "") -> str:
    return missing if np.isnan(value) else f"{value:.3f}"


def _rows(positions: np.ndarray):
    for frame, individual in np.ndindex(*positions.shape[:2]):
        if not np.isnan(positions[frame, individual, 0]):
            yield frame, individual, *(_cell(value) for value in positions[frame, individual])


def _text(path: Path, lines: list[str]) -> Path:
    path.write_bytes("".join(f"{line}\n" for line in lines).encode())
    return path


def idtracker(folder: Path, positions: np.ndarray) -> Path:
    header = "".join(f"X{k + 1}\tY{k + 1}\tProbId{k + 1}\t" for k in range(positions.shape[1]))
    rows = [
        "\t".join(f"{_cell(x, 'NaN')}\t{_cell(y, 'NaN')}\tNaN" for x, y in frame)
        for frame in positions
    ]
    return _text(folder / "trajectories.txt", [header, *rows])


def idtracker_ai_h5(folder: Path, positions: np.ndarray) -> Path:
    with h5py.File(folder / "trajectories.h5", "w") as file:
        file["trajectories"] = positions
        file["id_probabilities"] = np.full((*positions.shape[:2], 1), 0.9)
        file.attrs["frames_per_second"] = FPS
    return folder / "trajectories.h5"


def idtracker_ai_csv(folder: Path, positions: np.ndarray) -> Path:
    header = ",".join(
        ["time", *(f"{axis}{k + 1}" for k in range(positions.shape[1]) for axis in "xy")]
    )
    rows = [
        ",".join([f"{k / FPS:.3f}", *(_cell(v, "nan") for v in frame.ravel())])
        for k, frame in enumerate(positions)
    ]
    return _text(folder / "trajectories.csv", [header, *rows])


def idtracker_ai_npy(folder: Path, positions: np.ndarray) -> Path:
    np.save(
        folder / "trajectories.npy",
        {"trajectories": positions, "frames_per_second": FPS},
        allow_pickle=True,
    )
    return folder / "trajectories.npy"


def trex(folder: Path, positions: np.ndarray, **more: np.ndarray) -> Path:
    folder = folder / "trex"
    folder.mkdir(exist_ok=True)
    for k in range(positions.shape[1]):
        xy = positions[:, k]
        missing = np.isnan(xy[:, 0])
        centroid = np.where(np.isnan(xy), np.inf, xy)
        arrays = {
            "frame": np.arange(len(xy)),
            "time": np.arange(len(xy)) / FPS,
            "missing": missing.astype(float),
            "X#wcentroid": centroid[:, 0],
            "Y#wcentroid": centroid[:, 1],
            "X": centroid[:, 0] + 1,
            "Y": centroid[:, 1] + 1,
        }
        np.savez(folder / f"video_fish{k}.npz", **(arrays | more))
    return folder


def toxtrac(folder: Path, positions: np.ndarray) -> Path:
    rows = [f"{frame}\t0\t{who + 1}\t{x}\t{y}\t1\t\r" for frame, who, x, y in _rows(positions)]
    return _text(folder / "Tracking_0.txt", rows)


def tracktor(folder: Path, positions: np.ndarray) -> Path:
    rows = [
        f"{k},{frame}.0,{x},{y},{'ABCDEFGH'[who]}"
        for k, (frame, who, x, y) in enumerate(_rows(positions))
    ]
    return _text(folder / "tracked.csv", [",frame,pos_x,pos_y,id", *rows])


def trackmate(folder: Path, positions: np.ndarray) -> Path:
    names = "LABEL,ID,TRACK_ID,QUALITY,POSITION_X,POSITION_Y,POSITION_Z,POSITION_T,FRAME,RADIUS"
    words = "Label,Spot ID,Track ID,Quality,X,Y,Z,T,Frame,R"
    units = ",,,(quality),(pixel),(pixel),(pixel),(sec),,(pixel)"
    rows = [
        f"ID{k},{k},{who},3.2,{x},{y},0.0,{frame},{frame},4"
        for k, (frame, who, x, y) in enumerate(_rows(positions))
    ]
    return _text(folder / "spots.csv", [names, words, words, units, *rows])


def trackmate_xml(folder: Path, positions: np.ndarray) -> Path:
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<Tracks nTracks="{positions.shape[1]}" spaceUnits="pixel" frameInterval="1.0" timeUnits="sec" '
        'generationDateTime="Thu, 2 Feb 2023 10:11:12" from="TrackMate v7.9.2">',
    ]
    for who in range(positions.shape[1]):
        spots = [(frame, x, y) for frame, whose, x, y in _rows(positions) if whose == who]
        lines.append(f'  <particle nSpots="{len(spots)}">')
        lines += [f'    <detection t="{t}" x="{x}" y="{y}" z="0.0" />' for t, x, y in spots]
        lines.append("  </particle>")
    return _text(folder / "Tracks.xml", [*lines, "</Tracks>"])


def sleap_csv(folder: Path, positions: np.ndarray) -> Path:
    names = "track,frame_idx,instance.score,thorax.x,thorax.y,thorax.score,head.x,head.y,head.score"
    rows = [
        f"track_{who},{frame},0.9,{x},{y},0.8,{float(x) + 1},{y},0.7"
        for frame, who, x, y in _rows(positions)
    ]
    return _text(folder / "video.analysis.csv", [names, *rows])


def mot(folder: Path, positions: np.ndarray) -> Path:
    """Write as SORT does: boxes of 20 x 40 pixels around positions."""
    rows = [
        f"{frame},{who + 1},{float(x) - 10:.3f},{float(y) - 20:.3f},20.000,40.000,1,-1,-1,-1"
        for frame, who, x, y in _rows(positions)
    ]
    return _text(folder / "det.txt", rows)


def fasttrack(folder: Path, positions: np.ndarray) -> Path:
    names = "xHead yHead tHead xTail yTail tTail xBody yBody tBody curvature areaBody perimeterBody imageNumber id"
    rows = []
    for frame, who, x, y in _rows(positions):
        head = f"{float(x) + 1}\t{y}\t0"
        tail = f"{float(x) - 1}\t{y}\t0"
        rows.append(f"{head}\t{tail}\t{x}\t{y}\t0.25\t0\t90\t40\t{frame}\t{who}")
    return _text(folder / "tracking.txt", ["\t".join(names.split()), *rows])


def trex_csv(folder: Path, positions: np.ndarray) -> Path:
    """Write a file for each individual, the fish swapped for names by their numbers."""
    folder = folder / "data"
    folder.mkdir(exist_ok=True)
    for who in range(positions.shape[1]):
        rows = []
        for frame, (x, y) in enumerate(positions[:, who]):
            gone = int(np.isnan(x))
            rows.append(f"{frame},{gone},{_cell(x, 'inf')},{_cell(y, 'inf')},0.5")
        header = "frame,missing,X#wcentroid (cm),Y#wcentroid (cm),SPEED#wcentroid (cm/s)"
        _text(folder / f"video_fish{who}.csv", [header, *rows])
    return folder


def toxtrac_csv(folder: Path, positions: np.ndarray) -> Path:
    header = "Time (sec)\tArena\tTrack\tPos. X (mm)\tPos. Y (mm)\tLabel"
    rows = [
        f"{frame / FPS:.4f}\t1\t{who + 1}\t{x}\t{y}\t1" for frame, who, x, y in _rows(positions)
    ]
    return _text(folder / "Tracking_RealSpace_1.txt", [header, *rows])


def animalta(folder: Path, positions: np.ndarray) -> Path:
    names = [f"{axis}_Arena0_Ind{who}" for who in range(positions.shape[1]) for axis in "XY"]
    rows = [
        ";".join(
            [str(frame), f"{frame / FPS:.2f}", *(_cell(value, "NA") for value in places.ravel())]
        )
        for frame, places in enumerate(positions)
    ]
    return _text(folder / "Coordinates.csv", [";".join(["Frame", "Time", *names]), *rows])


def ethovision(folder: Path, positions: np.ndarray) -> Path:
    """Write the first individual as EthoVision XT exports it: in UTF-16, with a semicolon, in mm."""
    facts = [
        '"Number of header lines:";"6"',
        '"Experiment";"Novel tank"',
        '"Subject name";"Subject 1"',
        '""',
    ]
    names = (
        '"Trial time";"Recording time";"X center";"Y center";"X nose";"Y nose";"Area";"Result 1"'
    )
    units = '"s";"s";"mm";"mm";"mm";"mm";"mm2";""'
    rows = []
    for frame, (x, y) in enumerate(positions[:, 0] * [1, -1]):
        center = f"{_cell(x, chr(34) + '-' + chr(34))};{_cell(y, chr(34) + '-' + chr(34))}"
        nose = f"{_cell(x + 1, chr(34) + '-' + chr(34))};{_cell(y + 1, chr(34) + '-' + chr(34))}"
        rows.append(f"{frame / FPS:.3f};{frame / FPS:.3f};{center};{nose};12.5;0")
    path = folder / "Raw data-Trial 1.txt"
    path.write_bytes("\r\n".join([*facts, names, units, *rows, ""]).encode("utf-16"))
    return path


def ros_csv(folder: Path, positions: np.ndarray) -> Path:
    """Write the first individual as `rostopic echo -p` does, in m, y to the left, times in ns since 1970."""
    names = "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.child_frame_id"
    pose = "field.pose.pose.{}".format
    names = ",".join(
        [
            names,
            *(pose(f"position.{axis}") for axis in "xyz"),
            *(pose(f"orientation.{axis}") for axis in "xyzw"),
        ]
    )
    rows = []
    for frame, (x, y) in enumerate(positions[:, 0]):
        if not np.isnan(x):
            stamp = 1_700_000_000_000_000_000 + round(frame / FPS * 1e9)
            turn = 0.1 * frame
            quaternion = f"0.0,0.0,{np.sin(turn / 2)},{np.cos(turn / 2)}"
            rows.append(
                f"{stamp},{frame},{stamp},odom,base,{x / 1000:.6f},{-y / 1000:.6f},0.0,{quaternion}"
            )
    return _text(folder / "odometry.csv", [names, *rows])


EAST_M, NORTH_M = 111_319.490793, 110_574.275822
"""Length (m) of a degree of longitude and of latitude at 0, 0 on the ellipsoid of 1984."""


def _degrees(positions: np.ndarray) -> np.ndarray:
    """Return longitudes and latitudes around 0, 0 of positions (F, A, 2), a tenth of a cm for a pixel, y upwards."""
    middle = np.nanmedian(positions.reshape(-1, 2), axis=0)
    return (positions - middle) * [1, -1] / 1000 / [EAST_M, NORTH_M]


def movebank(folder: Path, positions: np.ndarray) -> Path:
    names = "event-id,visible,timestamp,location-long,location-lat,sensor-type,individual-local-identifier,study-name"
    places = _degrees(positions)
    rows = []
    for frame, who, *_ in _rows(positions):
        longitude, latitude = places[frame, who]
        time = f"2024-05-01 12:00:{frame / FPS:06.3f}"
        rows.append(
            f'{frame},true,{time},{longitude:.12f},{latitude:.12f},"gps","crane {who}","Cranes"'
        )
    rows.append('99,false,2024-05-01 12:00:00.000,80.0,80.0,"gps","crane 0","Cranes"')
    return _text(folder / "cranes.csv", [names, *rows])


def gpx(folder: Path, positions: np.ndarray) -> Path:
    """Write with gpxpy."""
    from datetime import UTC, datetime, timedelta

    from gpxpy.gpx import GPX, GPXTrack, GPXTrackPoint, GPXTrackSegment

    places = _degrees(positions)
    content = GPX()
    begin = datetime(2024, 5, 1, 12, tzinfo=UTC)
    for who in range(positions.shape[1]):
        track = GPXTrack(name=f"goat {who}")
        segment = GPXTrackSegment()
        for frame in np.flatnonzero(~np.isnan(positions[:, who, 0])).tolist():
            longitude, latitude = places[frame, who]
            point = GPXTrackPoint(latitude, longitude, time=begin + timedelta(seconds=frame / FPS))
            segment.points.append(point)
        track.segments.append(segment)
        content.tracks.append(track)
    (folder / "goats.gpx").write_text(content.to_xml())
    return folder / "goats.gpx"


def sleap(folder: Path, positions: np.ndarray) -> Path:
    nodes = np.stack([positions, positions + 1])
    with h5py.File(folder / "analysis.h5", "w") as file:
        file["tracks"] = nodes.transpose(2, 3, 0, 1)
        file["node_names"] = np.array([b"thorax", b"head"])
        file["track_names"] = np.array([f"track_{k}".encode() for k in range(positions.shape[1])])
        file["point_scores"] = np.full((positions.shape[1], 2, len(positions)), 0.8)
    return folder / "analysis.h5"


def deeplabcut(folder: Path, positions: np.ndarray) -> Path:
    animals = [f"mouse{k + 1}" for k in range(positions.shape[1])]
    columns = [
        (animal, part, what)
        for animal in animals
        for part in ("thorax", "head")
        for what in ("x", "y", "likelihood")
    ]
    header = [
        ",".join([name, *(column[k - 1] if k else "DLC_net" for column in columns)])
        for k, name in enumerate(("scorer", "individuals", "bodyparts", "coords"))
    ]
    rows = []
    for number, frame in enumerate(positions):
        cells = [str(number)]
        for x, y in frame:
            sure = "" if np.isnan(x) else "0.95"
            cells += [_cell(x), _cell(y), sure, _cell(x + 1), _cell(y + 1), sure]
        rows.append(",".join(cells))
    return _text(folder / "videoDLC.csv", [*header, *rows])


def deeplabcut_h5(folder: Path, positions: np.ndarray) -> Path:
    """Write the table of pandas with h5py alone; files that pandas wrote are in data/."""
    labels, columns = [], []
    for k in range(positions.shape[1]):
        sure = np.where(np.isnan(positions[:, k, 0]), np.nan, 0.95)
        for shift, part in enumerate(("thorax", "head")):
            labels += [
                ("DLC_net", f"mouse{k + 1}", part, what) for what in ("x", "y", "likelihood")
            ]
            columns += [*(positions[:, k] + shift).T, sure]
    table = np.zeros(
        len(positions), dtype=[("index", "<i8"), ("values_block_0", "<f8", (len(labels),))]
    )
    table["index"], table["values_block_0"] = np.arange(len(positions)), np.stack(columns, axis=1)
    with h5py.File(folder / "videoDLC.h5", "w") as file:
        file.create_dataset("df_with_missing/table", data=table)
        file["df_with_missing"].attrs["pandas_type"] = np.bytes_(b"frame_table")
        file["df_with_missing/table"].attrs["values_block_0_kind"] = np.bytes_(
            pickle.dumps(labels, protocol=0)
        )
    return folder / "videoDLC.h5"


def movement(folder: Path, positions: np.ndarray) -> Path:
    import xarray as xr

    points = np.stack([positions, positions + 1], axis=2)
    dimensions = ("time", "individuals", "keypoints", "space")
    individuals = [f"id_{k}" for k in range(positions.shape[1])]
    names = {"space": ["x", "y"], "keypoints": ["thorax", "head"], "individuals": individuals}
    dataset = xr.Dataset(
        {"position": (dimensions, points)}, {"time": np.arange(len(positions)) / FPS, **names}
    )
    dataset.assign_attrs(fps=FPS, time_unit="seconds").to_netcdf(
        folder / "poses.nc", engine="scipy"
    )
    return folder / "poses.nc"


def via(folder: Path, positions: np.ndarray) -> Path:
    columns = (
        "filename,file_size,file_attributes,region_count,region_id,"
        "region_shape_attributes,region_attributes"
    )
    lines = [columns]
    for frame, who, x, y in _rows(positions):
        point = f'"{{""name"":""point"",""cx"":{x},""cy"":{y}}}"'
        lines.append(f'v_{frame:04d}.png,0,"{{}}",1,{who},{point},"{{""track"":{who}}}"')
    return _text(folder / "via.csv", lines)


def coco(folder: Path, positions: np.ndarray) -> Path:
    annotations = [
        {
            "id": k,
            "image_id": frame + 1,
            "track_id": who,
            "bbox": [float(x) - 2, float(y) - 1, 4, 2],
        }
        for k, (frame, who, x, y) in enumerate(_rows(positions))
    ]
    images = [{"id": k + 1, "file_name": f"v_{k:04d}.png"} for k in range(len(positions))]
    content = {"images": images, "annotations": annotations, "categories": [{"id": 1}]}
    (folder / "coco.json").write_text(json.dumps(content))
    return folder / "coco.json"


def slp(folder: Path, positions: np.ndarray) -> Path:
    count, individuals = positions.shape[:2]
    frames = np.zeros(count, [("frame_id", "u8"), ("video", "u4"), ("frame_idx", "u8")])
    frames["frame_id"] = frames["frame_idx"] = np.arange(count)
    rows = list(_rows(positions))
    instances = np.zeros(
        len(rows),
        [("instance_type", "u1"), ("frame_id", "u8"), ("track", "i4"), ("point_id_start", "u8")],
    )
    point = [("x", "f8"), ("y", "f8"), ("visible", "?"), ("score", "f8")]
    points = np.zeros(2 * len(rows), point)
    for k, (frame, who, x, y) in enumerate(rows):
        instances[k] = 1, frame, who, 2 * k
        points[2 * k + 1] = float(x), float(y), True, 0.9
    content = {
        "skeletons": [{"nodes": [{"id": 1}, {"id": 0}]}],
        "nodes": [{"name": "thorax"}, {"name": "head"}],
    }
    with h5py.File(folder / "labels.slp", "w") as file:
        file["frames"], file["instances"] = frames, instances
        file["points"], file["pred_points"] = points[:0], points
        file["tracks_json"] = [json.dumps([0, f"fish{k}"]) for k in range(individuals)]
        file.create_group("metadata").attrs.update({"json": json.dumps(content), "format_id": 1.2})
    return folder / "labels.slp"


def nwb(folder: Path, positions: np.ndarray) -> Path:
    with h5py.File(folder / "session.nwb", "w") as file:
        file["session_start_time"] = "2026-01-01T00:00:00Z"
        for who in range(positions.shape[1]):
            series = file.create_group(f"processing/behavior/fish{who}/thorax")
            series.attrs["neurodata_type"] = "PoseEstimationSeries"
            series["data"] = positions[:, who]
            series["data"].attrs.update({"unit": "pixels", "conversion": 1.0})
            series["starting_time"] = 0.0
            series["starting_time"].attrs["rate"] = FPS
    return folder / "session.nwb"


def tidy(folder: Path, positions: np.ndarray) -> Path:
    rows = [f"{frame},fish{who + 1},{x},{y}" for frame, who, x, y in _rows(positions)]
    return _text(folder / "fish.csv", ["frame,id,x,y", *rows])


WRITERS = {
    "idtracker": idtracker,
    "idtracker.ai-h5": idtracker_ai_h5,
    "idtracker.ai-csv": idtracker_ai_csv,
    "idtracker.ai-npy": idtracker_ai_npy,
    "trex": trex,
    "trex-csv": trex_csv,
    "toxtrac": toxtrac,
    "toxtrac-csv": toxtrac_csv,
    "fasttrack": fasttrack,
    "animalta": animalta,
    "ethovision": ethovision,
    "gpx": gpx,
    "ros-csv": ros_csv,
    "movebank": movebank,
    "tracktor": tracktor,
    "trackmate": trackmate,
    "trackmate-xml": trackmate_xml,
    "mot": mot,
    "sleap": sleap,
    "sleap-csv": sleap_csv,
    "deeplabcut": deeplabcut,
    "deeplabcut-h5": deeplabcut_h5,
    "movement": movement,
    "via": via,
    "coco": coco,
    "sleap-slp": slp,
    "nwb": nwb,
    "tidy": tidy,
}

SAID = {
    "idtracker": {"fps": FPS, "pixels_per_cm": 10},
    "idtracker.ai-h5": {"pixels_per_cm": 10},
    "idtracker.ai-csv": {"pixels_per_cm": 10},
    "idtracker.ai-npy": {"pixels_per_cm": 10, "allow_pickle": True},
    "trex": {},
    "trex-csv": {"fps": FPS},
    "toxtrac": {"fps": FPS, "pixels_per_cm": 10},
    "toxtrac-csv": {},
    "fasttrack": {"fps": FPS, "pixels_per_cm": 10},
    "animalta": {"pixels_per_cm": 10},
    "ethovision": {},
    "gpx": {"project": True},
    "ros-csv": {},
    "movebank": {"project": True},
    "tracktor": {"fps": FPS, "pixels_per_cm": 10},
    "trackmate": {"fps": FPS, "pixels_per_cm": 10},
    "trackmate-xml": {"fps": FPS, "pixels_per_cm": 10},
    "mot": {"fps": FPS, "pixels_per_cm": 10},
    "sleap": {"fps": FPS, "pixels_per_cm": 10, "keypoint": "thorax"},
    "sleap-csv": {"fps": FPS, "pixels_per_cm": 10, "keypoint": "thorax"},
    "deeplabcut": {"fps": FPS, "pixels_per_cm": 10, "keypoint": "thorax"},
    "deeplabcut-h5": {"fps": FPS, "pixels_per_cm": 10, "keypoint": "thorax"},
    "movement": {"pixels_per_cm": 10, "keypoint": "thorax", "y_axis": "down"},
    "via": {"fps": FPS, "pixels_per_cm": 10},
    "coco": {"fps": FPS, "pixels_per_cm": 10},
    "sleap-slp": {"fps": FPS, "pixels_per_cm": 10, "keypoint": "thorax"},
    "nwb": {"pixels_per_cm": 10},
    "tidy": {"fps": FPS, "pixels_per_cm": 10, "y_axis": "down"},
}
"""What the user has to say for each format, and no more."""


IN_CM = ("trex", "trex-csv")
"""Formats that state cm, in which a pixel is a cm."""
ALONE = ("ethovision", "ros-csv")
"""Formats of one individual."""
PROJECTED = ("gpx", "movebank")
"""Formats in degrees, whose origin is the median of the positions."""
UPWARDS = (*PROJECTED, *ALONE)
"""Formats whose y points upwards."""


def expected(name: str, positions: np.ndarray) -> np.ndarray:
    """Return positions (F, A, 2) in cm, y upwards, 0 where missing."""
    if name in ALONE:
        positions = positions[:, :1]
    if name in PROJECTED:
        positions = positions - np.nanmedian(positions.reshape(-1, 2), axis=0)
    return np.nan_to_num(positions) * np.array([1, -1]) / (1 if name in IN_CM else 10)


def write_attributes(folder: Path, text: str | None = None) -> None:
    (folder / "attributes.json").write_text(text or json.dumps({"frames_per_second": FPS}))
