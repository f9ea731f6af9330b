"""The door: any tracker's file, or a table or dataset in memory, to `Trajectories`."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Union, overload

import numpy as np

from turing_learning.errors import (
    RefusedError,
    Setting,
    Text,
    brief,
    choice,
    refuse,
    refusing_as,
    require,
)

from ._recording import (
    LARGEST_COORDINATE,
    Format,
    Glance,
    Options,
    Reading,
    Recording,
    YAxis,
    counted,
    directed,
    refusal,
    share_in_degrees,
)
from ._trajectories import Trajectories
from .readers import _annotations, _arrays, _exports, _tables
from .readers._arrays import names_in, read_dataset
from .readers._sheets import HEAD_BYTES, HEAD_LINES, TableText, separator_of
from .readers._tables import read_frame
from .readers._times import UNSTATED

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Source = Union[str, Path, np.ndarray, "pd.DataFrame", "xr.Dataset"]

_ALL = (
    _tables.IDTRACKER_FORMAT, _arrays.IDTRACKER_H5_FORMAT, _tables.CSV_FORMAT, _arrays.IDTRACKER_NPY_FORMAT,
    _arrays.TREX_FORMAT, _exports.TREX_CSV_FORMAT, _tables.TOXTRAC_FORMAT, _tables.TOXTRAC_CSV_FORMAT,
    _tables.TRACKTOR_FORMAT, _tables.TRACKMATE_FORMAT, _tables.FASTTRACK_FORMAT, _tables.ANIMALTA_FORMAT,
    _arrays.SLEAP_FORMAT, _tables.DEEPLABCUT_FORMAT, _arrays.DEEPLABCUT_H5_FORMAT, _arrays.MOVEMENT_FORMAT,
    _tables.MOT_FORMAT, _tables.SLEAP_CSV_FORMAT, _exports.TRACKMATE_XML_FORMAT, _exports.ETHOVISION_FORMAT,
    _exports.GPX_FORMAT, _tables.ROS_FORMAT, _tables.MOVEBANK_FORMAT, _annotations.VIA_FORMAT, _annotations.COCO_FORMAT,
    _annotations.SLP_FORMAT, _annotations.NWB_FORMAT, _tables.TIDY_FORMAT,
)  # fmt: skip
FORMATS = tuple(file_format.name for file_format in _ALL)
"""Names of the formats that can be read."""


@overload
def load_trajectories(path: Source, **options: Any) -> Trajectories: ...


@overload
def load_trajectories(path: list[Source], **options: Any) -> list[Trajectories]: ...


def load_trajectories(  # type: ignore[misc]  # the options of both are those below
    path: Source | list[Source], *, fps: float | None = None,
    pixels_per_cm: float | Literal["unknown"] | None = None, format: str | None = None,
    y_axis: YAxis | None = None, keypoint: str | None = None, min_confidence: float | None = None,
    columns: Mapping[str, str] | None = None, heading: tuple[str, str] | None = None, resample: float | None = None,
    project: bool = False, allow_pickle: bool = False,
) -> Trajectories | list[Trajectories]:  # fmt: skip
    """Open what a tracker wrote.

    Parameters
    ----------
    path
        A file; for TRex also a folder with a file for each individual, for idtracker.ai that of a session. Or
        positions (F, A, 2), NaN where missing. Or a `DataFrame`: long, with columns
        frame or time (s), x, y and perhaps id, heading and confidence; or wide, with x1, y1, x2, ... or fish_x,
        fish_y, ...; or as DeepLabCut's. Or a `Dataset`, see `from_xarray`. A list of them gives a list.
    fps
        Frame rate (1/s), from 1e-9 to 1e9, needed where the file does not state it.
    pixels_per_cm
        Scale, from 1e-9 to 1e9, needed where the file is not in cm; "unknown" leaves positions in pixels, 1
        is for a file in cm.
    format
        One of `FORMATS`; None finds it from the content.
    y_axis
        Direction in which y grows in the file; None takes the format's, which plain CSV has not. y is turned
        upwards.
    keypoint
        Which point of the body stands for the animal, where a file has several.
    min_confidence
        Positions of which the tracker is less sure count as missing; None takes all.
    columns
        Which column is what, where names do not say it: for example ``{"id": "track"}``. It can be frame, time, id,
        x, y, heading, confidence, or left, top, and right and bottom or width and height of a box.
    heading
        Two points of the body, in files with several: headings lead from the second to the first, as ("nose", "tail").
    resample
        Frame rate (1/s) to which uneven times are brought; between two rows motion is straight. Gaps of more than
        two usual intervals stay.
    project
        Whether to bring longitude and latitude (degrees) into a plane: cm to the east and to the north.
    allow_pickle
        Whether idtracker.ai's npy may be opened; a pickle can run any code it holds.

    Returns
    -------
    Trajectories
        The recording, y upwards, in cm unless the scale is unknown. What may be meant otherwise than it was read
        is logged.

    Raises
    ------
    ValueError
        If the format is not recognized or ambiguous; it is not clear what a column or a time is; a
        scale, rate or direction is not stated, absurd, or stated twice and differently; the file is cut
        off, damaged, contradicts itself, or unpacks to too much (with file and line, or dataset).
    OSError
        If the file cannot be opened.
    ImportError
        If the file needs h5py and it is not installed.
    """
    options = Options(
        fps=fps, pixels_per_cm=pixels_per_cm, y_axis=y_axis, keypoint=keypoint, min_confidence=min_confidence,
        columns=columns, heading=heading, resample=resample, project=project, allow_pickle=allow_pickle,
    )  # fmt: skip
    sources = path if isinstance(path, list) else [path]
    recordings = [load_file(source, options, format) for source in sources]
    for recording in recordings:
        recording.announce()
    return recordings if isinstance(path, list) else recordings[0]


def load_file(
    path: Any, options: Options, format: str | None = None, usual: Mapping[str, Any] | None = None
) -> Trajectories:
    """Return what `load_trajectories` does; `usual` has rate, scale and direction of y for files and options that lack them.

    Under "words" it may say why these are taken.
    """
    file = ""
    if isinstance(path, (str, Path)):
        recording, name, source = _from_file(Path(path), options, format)
        file = str(Path(path).absolute())
    else:
        recording, name, source = _from_memory(path, options, format)
    confidence = recording.confidence
    if confidence is not None and np.isnan(confidence[recording.present]).all():
        recording = replace(recording, confidence=None)  # a column that is empty
    _check_order(recording, source)
    if options.min_confidence is not None:
        recording = _confident(recording, options.min_confidence, source)
    return _finish(recording, name, source, options, usual or {}, file)


def _from_memory(table: Any, options: Options, format: str | None) -> tuple[Recording, str, str]:
    """Return what a DataFrame or Dataset holds, its format and where it comes from."""
    require(format is None, "format", "be left out for data in memory", brief(format))
    if hasattr(table, "iloc"):
        return _with_heading(partial(read_frame, table), options), "pandas", "DataFrame"
    is_dataset = hasattr(table, "data_vars")
    rule = "be a file, a DataFrame, a Dataset, an array of positions, or a list of them"
    require(is_dataset or isinstance(table, np.ndarray), "path", rule, type(table).__name__)
    inapplicable = ["columns", "resample", "project"]
    noun = "a Dataset"
    if not is_dataset:
        inapplicable += ["keypoint", "heading"]
        noun = "an array"
    for name in inapplicable:
        value = getattr(options, name)
        require(not value, name, f"be left out for {noun}", brief(value))
    if not is_dataset:
        return _arrays.read_positions(table, "array"), "array", "array"
    software = str(table.attrs.get("source_software") or "")
    file = str(table.attrs.get("source_file") or "")
    return _with_heading(partial(read_dataset, table), options), software, file


def _from_file(path: Path, options: Options, format: str | None) -> tuple[Recording, str, str]:
    """Return what a file or folder holds, its format and its name."""
    source = str(path)
    if not (path.is_file() or path.is_dir()):
        # says what is missing
        path.stat()
        rule = "be a file"
        raise refusal(rule, "a pipe or device", path, "Write what comes out of it to a file.")
    if path.is_dir() and not _arrays.files_of(path):
        path = _exports.session_file(path) or _exports.toxtrac_file(path) or path
    named = bool(options.columns)
    if format is None:
        chosen = _find(path, named)
    else:
        chosen = _ALL[FORMATS.index(choice("format", format, FORMATS))]
    if path.is_dir() and chosen.name not in _OF_FOLDERS:
        files = len(_exports.csv_files(path))
        remedy = "Give its files: each is a recording of its own."
        rule = "be a file, or a folder of TRex, idtracker.ai or ToxTrac"
        raise refusal(rule, f"a folder of {files} tables", path, remedy)
    allowed = {
        "keypoint": chosen.has_keypoints,
        "heading": chosen.has_keypoints,
        "columns": chosen.has_columns,
        "resample": chosen.has_times,
        "project": chosen.has_times,
    }
    for name, fits in allowed.items():
        value = getattr(options, name)
        if value and not fits:
            refuse(name, f"be left out for format {chosen.name}", brief(value), place=source)
    recording = _with_heading(partial(chosen.read, path), options)
    if source != str(path):
        recording = replace(
            recording, remarks=(*recording.remarks, f"read from {path.relative_to(source)}")
        )
    return recording, chosen.name, source


def _with_heading(read: Callable[[Options], Recording], options: Options) -> Recording:
    """Read, and once more each of the two points of the body that the heading is measured by."""
    recording = read(replace(options, heading=None))
    if options.heading is None:
        return recording
    points = options.heading
    fits = isinstance(points, tuple | list) and len(points) == 2 and points[0] != points[1]
    require(fits, "heading", "be two points of the body, the one in front first", brief(points))
    front = read(replace(options, keypoint=points[0], heading=None))
    back = read(replace(options, keypoint=points[1], heading=None))
    return directed(recording, front, back)


def from_xarray(
    dataset: "xr.Dataset", *, fps: float | None = None, pixels_per_cm: float | Literal["unknown"] | None = None,
    y_axis: YAxis | None = None, keypoint: str | None = None,
) -> Trajectories:  # fmt: skip
    """Return a recording from a dataset in the conventions of `movement`.

    Parameters
    ----------
    dataset
        With `position` (time, space, individuals), perhaps keypoints, and `confidence` and `heading` if there
        are some. NaN is missing.
    fps, pixels_per_cm, y_axis, keypoint
        As in `load_trajectories`; needed where the attributes `fps`, `length_unit` and `y_axis` do not say
        it. Times in seconds state the frame rate, too.
    """
    return load_trajectories(
        dataset, fps=fps, pixels_per_cm=pixels_per_cm, y_axis=y_axis, keypoint=keypoint
    )


_MEANT = {
    "pixels_per_cm": "1 for a file in cm",
    "y_axis": '"down" for positions in images, "up" for the axes of geometry',
}


def _refuse_unstated(stated: Mapping[str, Any], remarks: Sequence[str], source: str) -> None:
    """Refuse a recording of which something is None that has to be stated; name all of it."""
    missing = [name for name, value in stated.items() if value is None]
    if not missing:
        return
    missing_name, *further = missing
    remedy: list[str | Setting] = []
    if missing_name in _MEANT:
        remedy.append(f"Give {_MEANT[missing_name]}.")
    for name in further:
        give = " Give " if remedy else "Give "
        remedy += [give, Setting(name), f", too: {_MEANT[name]}."]
    got = "none, and the file does not state it"
    uneven = [remark for remark in remarks if remark.startswith(UNSTATED)]
    if missing_name == "fps" and uneven:
        got = f"none, and {uneven[0]}"
    refuse(missing_name, "be given", got, tuple(remedy), place=source)


def _finish(
    recording: Recording,
    format: str,
    source: str,
    options: Options,
    usual: Mapping[str, Any],
    file: str,
) -> Trajectories:
    """Bring together what a file and the user state; refuse all that neither does, and what both do, differently.

    `file` is its path, empty of data in memory.
    """
    fps = options.fps
    scale = options.pixels_per_cm
    y_axis = options.y_axis or recording.y_axis or usual.get("y_axis")
    if fps is None and recording.fps is None:
        fps = usual.get("fps")
    if scale is None and recording.unit is None:
        scale = usual.get("pixels_per_cm")
    stated = {
        "fps": fps or recording.fps,
        "pixels_per_cm": scale or recording.unit,
        "y_axis": y_axis,
    }
    _refuse_unstated(stated, recording.remarks, source)
    if fps is not None and recording.fps is not None:
        rule = f"be what the file states, {recording.fps}"
        # rounded times do not tell 29.97 from 30
        same = math.isclose(fps, recording.fps, rel_tol=2e-3)
        require(same, "fps", rule, str(fps), "Leave it out.", place=source)
    in_cm = recording.unit == "cm"
    # 1 is what is said of a file in cm
    if in_cm and scale not in (None, 1):
        refuse("pixels_per_cm", "be left out for a file in cm", brief(scale), place=source)
    in_pixels = not in_cm and scale in ("unknown", None)
    per_cm = 1.0 if in_cm or in_pixels else float(scale)  # type: ignore[arg-type]
    if not in_cm:
        recording = _without_minus_ones(recording)
    present = recording.present
    positions = recording.positions / per_cm
    farthest = float(np.nanmax(np.abs(recording.positions)))
    if farthest / per_cm > LARGEST_COORDINATE:
        rule = f"leave coordinates within +-{LARGEST_COORDINATE:.0e} cm"
        got = f"{per_cm:g}, by which {farthest:g} is"
        refuse("pixels_per_cm", rule, f"{got} {farthest / per_cm:g} cm", place=source)
    confidence = recording.confidence
    if confidence is not None:
        confidence = np.where(present, np.nan_to_num(confidence), 0.0)
    headings = recording.headings
    if headings is not None:
        headings = np.where(present, np.nan_to_num(headings), 0.0)
        degrees = share_in_degrees(present, headings)
        if degrees:
            got = f"{degrees:.0%} of them beyond 2 pi, which may be degrees"
            otherwise = "Convert them, or call their column otherwise to leave them out."
            raise refusal("have headings in rad", got, source, otherwise)
    remarks = recording.remarks
    if y_axis == "down":
        # Not -y, which would make -0.0 of 0.
        positions[..., 1] = 0.0 - positions[..., 1]
        if headings is not None:
            headings = -headings
        remarks += ("y pointed down in the file and was turned upwards",)
    reading = replace(
        _reading(recording, options, scale, y_axis, str(usual.get("words", "as in the run"))),
        path=file,
        options=_said(
            options,
            fps=fps and float(fps),
            scale=None if in_cm or in_pixels else per_cm,
            format=file and format,
        ),
    )
    if recording.y_axis is None:
        reading = reading.followed_by(y_axis=y_axis)
    with refusing_as(RefusedError, place=source):
        return Trajectories(
            positions=np.where(present[..., None], positions, 0.0),
            present=present,
            fps=float(fps or recording.fps),  # type: ignore[arg-type]
            individuals=recording.individuals,
            unit="px" if in_pixels else "cm",
            first_frame=recording.first_frame,
            headings=headings,
            confidence=confidence,
            source=source,
            format=format,
            remarks=remarks,
            choices=(*recording.choices, *_doubts(recording, per_cm)),
            reading=reading,
        )


def _without_minus_ones(recording: Recording) -> Recording:
    """Return a recording in pixels without positions of (-1, -1), which trackers write for missing ones, and says so.

    Individuals that have no others are left out. All stay where others are negative.
    """
    mask = recording.present & (recording.positions == -1).all(axis=2)
    remaining = recording.positions[recording.present & ~mask]
    if not len(remaining) or remaining.min() < 0:
        return recording
    mask &= ~_on_the_way(recording.positions, mask)
    if not mask.any():
        return recording
    cleared = np.where(mask[..., None], np.nan, recording.positions)
    never = mask.any(axis=0) & np.isnan(cleared[..., 0]).all(axis=0)
    which = f"{counted(int(mask.sum()), 'position')} at exactly (-1, -1)"
    choices = [f"taken for missing, as all others are 0 or more: {which}"]
    names = np.array(recording.individuals, dtype=object)
    if never.any():
        choices.append(f"left out, as they have no other positions: {', '.join(names[never])}")
    confidence, headings = recording.confidence, recording.headings
    return replace(
        recording,
        positions=cleared[:, ~never],
        individuals=tuple(names[~never]),
        confidence=None if confidence is None else confidence[:, ~never],
        headings=None if headings is None else headings[:, ~never],
        choices=(*recording.choices, *choices),
    )


def _on_the_way(positions: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return which positions (F, A) of a mask are within a usual step of those in the frames before and after."""
    passed = np.zeros_like(mask)
    known = np.where(mask[..., None], np.nan, positions)
    steps = np.linalg.norm(np.diff(known, axis=0), axis=2)
    for k in np.flatnonzero(mask.any(axis=0)):
        lengths = steps[~np.isnan(steps[:, k]), k]
        if len(lengths):
            away = np.linalg.norm(known[:, k] + 1, axis=1)
            is_usual = away <= np.quantile(lengths, _USUAL_STEPS)
            passed[1:-1, k] = is_usual[:-2] & is_usual[2:]
    return mask & passed


def _said(options: Options, **stated: Any) -> dict[str, Any]:
    """Return what was said of a file, by the options of commands; `stated` are fps, scale and format, if any."""
    columns = [f"{role}={name}" for role, name in (options.columns or {}).items()]
    given_options = stated | {
        "y_axis": options.y_axis,
        "keypoint": options.keypoint,
        "min_confidence": options.min_confidence,
        "column": columns,
        "heading": ",".join(options.heading or ()),
        "resample": options.resample,
        "project": options.project,
    }
    return {name: value for name, value in given_options.items() if value}


def _reading(
    recording: Recording, options: Options, scale: object, y_axis: object, otherwise: str
) -> Reading:
    """Return in words where frame rate, scale and direction of y come from; `otherwise` if nobody states them."""
    fps = otherwise
    if options.resample is not None:
        fps = "made even by resampling"
    elif recording.fps is not None:
        fps = "stated by the file"
    elif options.fps is not None:
        fps = "given"
    pixels_per_cm = "stated by the file, in cm from here on"
    if scale == "unknown":
        pixels_per_cm = "unknown: positions stay in pixels"
    elif scale is not None and recording.unit != "cm":
        pixels_per_cm = f"{scale:g} pixels per cm" if scale != 1 else "the file is in cm, as given"
    direction = f"{y_axis} in the file"
    if options.y_axis is not None:
        direction += ", as given"
    elif recording.y_axis is not None:
        direction += ", by its format"
    else:
        direction += f", {otherwise}"
    return Reading(recording.columns, recording.unread, fps, pixels_per_cm, direction)


def _doubts(recording: Recording, per_cm: float) -> list[str]:
    """Return in words what a file may hold instead of positions, frames and individuals."""
    points = recording.positions[recording.present]
    doubts = []
    if len(points) >= _FEWEST and per_cm > 1 and points.min() >= 0 and points.max() <= 1:
        doubts.append(
            "all coordinates are from 0 to 1: shares of an image have to be multiplied by its size"
        )
    extent = float(np.ptp(points, axis=0).max() / per_cm)
    if extent > _FARTHEST_CM and per_cm < 1:
        scale = "see whether the scale is in pixels per cm, or in cm per pixel"
        doubts.append(f"positions are up to {extent:.3g} cm apart: {scale}")
    for name, coordinates in zip("xy", np.moveaxis(recording.positions, -1, 0), strict=True):
        steps = np.diff(coordinates, axis=0)
        steps = steps[~np.isnan(steps)]
        if (
            len(steps) >= _FEWEST
            and steps[0] > 0
            and np.allclose(steps, steps[0], rtol=1e-6, atol=0)
        ):
            doubts.append(
                f"{name} grows by {steps[0]:.6g} in every frame, as frame numbers or times do"
            )
    between = np.diff(np.flatnonzero(recording.present.any(axis=1)))
    if len(between) and between.min() > 1 and np.gcd.reduce(between) == 1:
        usual = f"{np.median(between):g} are between most"
        doubts.append(f"no two frames follow each other, {usual}: their numbers may be times")
    alike: dict[object, str] = {}
    for name in recording.individuals:
        namesake = alike.setdefault(_number_of(name), name)
        if namesake != name:
            doubts.append(f"individuals {namesake} and {name} may be one")
    nobody = [name for name in recording.individuals if name.lower() in _NOBODY]
    if nobody and len(recording.individuals) > len(nobody):
        doubts.append(
            f"individuals are called {', '.join(nobody)}: they may be detections of nobody"
        )
    return doubts


def _number_of(name: str) -> object:
    """Return the number that a name is, or the name in small letters."""
    try:
        return float(name)
    except ValueError:
        return name.lower()


# share of the steps of an individual that are no longer than a usual one
_USUAL_STEPS = 0.95
# across which hardly any animals are tracked
_FARTHEST_CM = 1e4
_NOBODY = (
    "-1",
    "-1.0",
    "-",
    "--",
    "na",
    "n/a",
    "nan",
    "none",
    "null",
    "unknown",
    "unassigned",
    "noise",
)


_GAP, _NUMBER = r'[,;\t "]', r"[-+]?([0-9.]+(e[-+]?[0-9]+)?|nan)"
_NUMBERS = re.compile(f"{_GAP}*{_NUMBER}({_GAP}+{_NUMBER})+{_GAP}*", re.IGNORECASE)


def _find(path: Path, named: bool) -> Format:
    """Return the one format that the content has; a text whose columns are `named` is a table, and may have any names."""
    glance = _look(path)
    fitting = [reader for reader in _ALL if reader.recognizes(glance)]
    # With columns= a table is what the user says, not what its names suggest
    if named and glance.container == "text":
        tables = [reader for reader in fitting if reader.has_columns]
        fitting = [_tables.TIDY_FORMAT]
        if len(tables) == 1:
            fitting = tables
    if len(fitting) == 1:
        return fitting[0]
    if not fitting and glance.lines and _NUMBERS.fullmatch(glance.lines[0]):
        got = f"numbers alone, {glance.lines[0][:60]!r}"
        remedy: Text = (
            "Name its columns there, for example frame,id,x,y; or for boxes of MOT give ",
            Setting("format", "mot"),
            ".",
        )
        raise refusal("begin with a header line", got, f"{path}:1", remedy)
    received = "none of them"
    give: list[str | Setting] = ["Give ", Setting("format"), "."]
    if fitting:
        received = "what fits " + " and ".join(reader.name for reader in fitting)
    else:
        _refuse_encoding(glance, path)
    if glance.lines and not fitting:
        cells = glance.cells(separator_of(glance.lines[0]))
        received = f"a first line of {', '.join(cells[:MOST_NAMED])}"[:MOST_SHOWN]
        names = "Name the columns of a table of your own frame or time (s), x, y, and id where there are several"
        give = [
            f"{names}, or say which is what, for example ",
            Setting("columns", _guessed(cells)),
            "; or give ",
            *give[1:],
        ]
    raise refusal(f"have the content of one of {', '.join(FORMATS)}", received, path, tuple(give))


MOST_NAMED = 12
MOST_SHOWN = 200
"""Columns, and characters of their names, that a message shows of a table that is not understood."""


def _refuse_encoding(glance: Glance, path: Path) -> None:
    """Refuse a text whose characters or line ends are not those of its like."""
    text = "".join(glance.lines)
    if "\r" in text:
        remedy = "Save it with line ends of Unix or Windows."
        raise refusal("have line ends of one kind", "a carriage return inside a line", path, remedy)
    if "\N{REPLACEMENT CHARACTER}" in text:
        remedy = "Save it as UTF-8."
        raise refusal("be text in UTF-8", "other bytes in its first lines", path, remedy)
    if glance.container == "text" and not text:
        remedy = "If it is text in UTF-16, save it as UTF-8."
        raise refusal("be text, HDF5 or arrays", "no text in its first lines", path, remedy)


def _guessed(cells: list[str]) -> dict[str, str]:
    """Return role -> column of a table, as far as names of columns let guess it, for an example of what to say."""
    guessed: dict[str, str] = {}
    for name in cells:
        if re.search(r"frame|time|step", name, re.IGNORECASE):
            guessed.setdefault("frame" if "frame" in name.lower() else "time", name)
    for name in cells:
        twin = re.sub(r"(?<![a-z])(c?)x(?![a-z])", r"\1y", name, count=1, flags=re.IGNORECASE)
        for cell in cells:
            if twin != name and cell.lower() == twin.lower() and "x" not in guessed:
                guessed |= {"x": name, "y": cell}
    return guessed if "x" in guessed else {"x": "x_cm"}


_OF_FOLDERS = ("trex", "trex-csv")
"""Formats with a file for each individual."""
_FOREIGN = (
    (b"\xd0\xcf\x11\xe0", "a workbook", "Save its sheet as CSV (UTF-8)."),
    (b"SQLite format 3", "a database", "FastTrack writes tracking.txt beside it."),
    (b"#ROSBAG", "a bag of ROS", "Write its topic as CSV: rostopic echo -b BAG -p TOPIC."),
    (b"PAR1", "a table in Parquet", "Read it by pandas, and give the DataFrame."),
    (b"\x1f\x8b", "a compressed file", "Unpack it."),
)
"""Beginnings of files that users have, what they are, and what to do."""


def _look(path: Path) -> Glance:
    if path.is_dir():
        archives = _arrays.files_of(path)
        tables = _exports.csv_files(path)
        # A folder of archives may have tables beside them.
        if tables and not archives:
            return _look(tables[0])
        names = tuple(frozenset(_arrays.array_sizes(file)) for file in archives)
        return Glance("npz", names=names)
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if not head:
        raise refusal("not be empty", "0 bytes", path)
    for begin, detail, remedy in _FOREIGN:
        if head.startswith(begin):
            raise refusal("be text, HDF5 or arrays", detail, path, remedy)
    if head.startswith(b"\x89HDF\r\n\x1a\n"):
        return Glance("hdf5", names=(names_in(path),))
    if head.startswith(b"PK\x03\x04"):
        if b"[Content_Types].xml" in head or b"xl/" in head:
            rule = "be text, HDF5 or arrays"
            raise refusal(rule, "a workbook", path, "Save its sheet as CSV (UTF-8).")
        return Glance("npz", names=(frozenset(_arrays.array_sizes(path)),))
    if head.startswith(_arrays.MATLAB):
        return Glance("mat")
    if head.startswith((b"\x93NUMPY", b"CDF\x01", b"CDF\x02")):
        return Glance("npy" if head.startswith(b"\x93") else "netcdf3")
    if re.match(rb"(\xef\xbb\xbf)?\s*[{\[]", head):
        return Glance("json")
    # who reads the lines refuses what is no text, with its line
    lines = []
    for text in TableText.of(path).first_lines(HEAD_LINES):
        if "\0" in text:
            return Glance("text")
        if text:
            lines.append(text)
    return Glance("text", lines=tuple(lines))


def _confident(recording: Recording, least_confidence: float, source: str) -> Recording:
    """Return the recording without the positions of which the tracker is less sure."""
    if recording.confidence is None:
        got = f"{least_confidence} for a file without confidence"
        refuse("min_confidence", "be left out", got, place=source)
    sure = np.where(recording.present, np.nan_to_num(recording.confidence), 0.0)
    unsure = recording.present & (sure < least_confidence)
    if (unsure == recording.present).all():
        rule = f"hold a position with confidence {least_confidence} or more"
        raise refusal(rule, f"at most {sure.max()}", source)
    remark = f"{unsure.sum()} positions with a confidence below {least_confidence} count as missing"
    positions = np.where(unsure[..., None], np.nan, recording.positions)
    return replace(recording, positions=positions, remarks=(*recording.remarks, remark))


_FEWEST = 50
_LEAST_CONTINUITY = 0.7


def _check_order(recording: Recording, source: str) -> None:
    """Refuse rows without frame numbers in which neighboring frames are as far apart as distant ones: shuffled rows."""
    frames = len(recording.positions)
    if recording.numbered or frames < 2 * _FEWEST:
        return
    neighboring = _typical_step(recording.positions, 1)
    distant = _typical_step(recording.positions, frames // 2)
    if neighboring > _LEAST_CONTINUITY * distant:
        rule = "have its rows in the order of time"
        received = f"a typical step of {neighboring:.3g} between neighboring rows and {distant:.3g} between distant ones"
        remedy = "The rows may be shuffled; they carry no frame number."
        raise refusal(rule, received, source, remedy)


def _typical_step(positions: np.ndarray, lag: int) -> float:
    """Return the median distance between positions (F, A, 2) that are `lag` rows apart; NaN if few are there."""
    displacements = positions[lag:] - positions[:-lag]
    steps = np.hypot(displacements[..., 0], displacements[..., 1])
    finite = steps[~np.isnan(steps)]
    return float(np.median(finite)) if len(finite) >= _FEWEST else math.nan
