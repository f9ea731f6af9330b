"""The door: any tracker's file, or a table or dataset in memory, to `Trajectories`."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Union, overload

import numpy as np

from turing_learning.errors import Setting, brief, choice, refuse, require

from ._recording import LARGEST, Format, Glance, Options, Recording, YAxis, refusal
from ._trajectories import Trajectories
from .readers import _poses, _tables, _trackers
from .readers._poses import read_dataset
from .readers._shared import LONGEST_LINE, check_rate, names_in, refuse_utf16
from .readers._tables import read_frame

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

Source = Union[str, Path, "pd.DataFrame", "xr.Dataset"]

_ALL = (
    _tables.IDTRACKER_FORMAT,
    _trackers.H5_FORMAT,
    _tables.CSV_FORMAT,
    _trackers.NPY_FORMAT,
    _trackers.TREX_FORMAT,
    _tables.TOXTRAC_FORMAT,
    _tables.TRACKTOR_FORMAT,
    _trackers.SLEAP_FORMAT,
    _poses.CSV_FORMAT,
    _poses.H5_FORMAT,
    _poses.MOVEMENT_FORMAT,
    _tables.TIDY_FORMAT,
)
FORMATS = tuple(one.name for one in _ALL)
"""Names of the formats that can be read."""


@overload
def load_trajectories(path: Source, **said: Any) -> Trajectories: ...


@overload
def load_trajectories(path: list[Source], **said: Any) -> list[Trajectories]: ...


def load_trajectories(  # type: ignore[misc]  # the options of both are those below
    path: Source | list[Source],
    *,
    fps: float | None = None,
    pixels_per_cm: float | Literal["unknown"] | None = None,
    format: str | None = None,
    y_axis: YAxis | None = None,
    keypoint: str | None = None,
    min_confidence: float | None = None,
    allow_pickle: bool = False,
) -> Trajectories | list[Trajectories]:
    """Open what a tracker wrote.

    Parameters
    ----------
    path
        A file; for TRex also a folder with a file for each individual. Or a `DataFrame`: long, with columns
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
        Direction in which y grows in the file; None takes the format's, which plain CSV has not. y is turned upwards.
    keypoint
        Which point of the body stands for the animal, where a file has several.
    min_confidence
        Positions of which the tracker is less sure count as missing; None takes all.
    allow_pickle
        Whether idtracker.ai's npy may be opened; a pickle can run any code it holds.

    Returns
    -------
    Trajectories
        The recording, y upwards, in cm unless the scale is unknown.

    Raises
    ------
    ValueError
        If the format is not recognized or ambiguous; a scale, rate or direction is not stated, absurd, or
        stated twice and differently; the file is cut off, damaged, contradicts itself, or unpacks to too much
        (with file and line, or dataset).
    OSError
        If the file cannot be opened.
    ImportError
        If the file needs h5py and it is not installed.
    """
    if isinstance(path, list):
        said = {"y_axis": y_axis, "keypoint": keypoint, "min_confidence": min_confidence, "allow_pickle": allow_pickle}
        return [load_trajectories(one, fps=fps, pixels_per_cm=pixels_per_cm, format=format, **said) for one in path]
    _check_options(fps, pixels_per_cm, y_axis, min_confidence)
    options = Options(keypoint, allow_pickle, fps, y_axis)
    if not isinstance(path, (str, Path)):
        kind = "pandas" if hasattr(path, "columns") else "xarray" if hasattr(path, "data_vars") else ""
        require(kind, "path", "be a file, a DataFrame, a Dataset, or a list of them", type(path).__name__)
        require(format is None, "format", "be left out for data in memory", brief(format))
        if kind == "xarray":
            return from_xarray(path, fps=fps, pixels_per_cm=pixels_per_cm, y_axis=y_axis, keypoint=keypoint)
        source, name, recording = "DataFrame", kind, _of_frame(path, options)
    else:
        path, source = Path(path), str(path)
        if not (path.is_file() or path.is_dir()):
            path.stat()  # says what is missing
            raise refusal("be a file", "a pipe or device", path, "Write what comes out of it to a file.")
        chosen = _find(path) if format is None else _ALL[FORMATS.index(choice("format", format, FORMATS))]
        if keypoint is not None and not chosen.has_keypoints:
            refuse("keypoint", f"be left out for format {chosen.name}", brief(keypoint), place=source)
        name, recording = chosen.name, chosen.read(path, options)
    _check_order(recording, source)
    recording = _confident(recording, min_confidence, source)
    return _finish(recording, name, source, fps=fps, pixels_per_cm=pixels_per_cm, y_axis=y_axis)


def _of_frame(frame: Any, options: Options) -> Recording:
    """Read a `DataFrame`, and what `Trajectories.to_pandas` states in its attributes."""
    recording, attributes = read_frame(frame, options), frame.attrs
    fps = check_rate(attributes["fps"], "DataFrame, fps") if "fps" in attributes else recording.fps
    unit, y_axis = attributes.get("unit"), attributes.get("y_axis", recording.y_axis)
    for name, value, known in (("unit", unit, ("cm", "px", None)), ("y_axis", y_axis, ("up", "down", None))):
        require(value in known, name, "be one that is known", brief(value), place="DataFrame, attributes")
    return replace(recording, unit=unit, fps=fps, y_axis=y_axis)


def from_xarray(
    dataset: "xr.Dataset",
    *,
    fps: float | None = None,
    pixels_per_cm: float | Literal["unknown"] | None = None,
    y_axis: YAxis | None = None,
    keypoint: str | None = None,
) -> Trajectories:
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
    recording = read_dataset(dataset, keypoint, fps, y_axis)
    software, file = (str(dataset.attrs.get(f"source_{what}") or "") for what in ("software", "file"))
    return _finish(recording, software, file, fps=fps, pixels_per_cm=pixels_per_cm, y_axis=y_axis)


def _finish(
    recording: Recording,
    format: str,
    source: str,
    *,
    fps: float | None,
    pixels_per_cm: float | Literal["unknown"] | None,
    y_axis: YAxis | None,
) -> Trajectories:
    """Bring what a file states and what the user states together: cm, y upwards, frame rate."""
    _refuse_unstated(recording, fps, pixels_per_cm, y_axis, source)
    scale = _scale(recording, pixels_per_cm, source)
    _check_extent(recording, scale, source)
    flip = (y_axis or recording.y_axis) == "down"
    positions, headings = recording.positions / (scale or 1.0), recording.headings
    if flip:
        positions[..., 1] = 0.0 - positions[..., 1]
        headings = None if headings is None else -headings
    return Trajectories(
        positions=np.where(recording.present[..., None], positions, 0.0),
        present=recording.present,
        fps=_rate(recording, fps, source),
        individuals=recording.individuals,
        unit="cm" if scale else "px",
        first_frame=recording.first_frame,
        headings=headings,
        confidence=recording.confidence,
        source=source,
        format=format,
        remarks=(*recording.remarks, *(["y pointed down in the file and was turned upwards"] if flip else [])),
    )


def _refuse_unstated(
    recording: Recording, fps: float | None, scale: float | str | None, y_axis: YAxis | None, source: str
) -> None:
    """Refuse a recording of which neither file nor user state all that is needed; name all of it at once."""
    missing = {
        "fps": fps is None and recording.fps is None,
        "pixels_per_cm": scale is None and recording.unit is None,
        "y_axis": y_axis is None and recording.y_axis is None,
    }
    first, *others = [name for name, none in missing.items() if none] or [""]
    if not first:
        return
    remedy: list[str | Setting] = [f"Give {_MEANT[first]}." if first in _MEANT else ""]
    for name in others:
        remedy += [" " if remedy[-1] else "", "Give ", Setting(name), f", too: {_MEANT[name]}."]
    refuse(first, "be given", "none, and the file does not state it", tuple(remedy), place=source)


_MEANT = {
    "pixels_per_cm": "1 for a file in cm",
    "y_axis": '"down" for positions in images, "up" for the axes of geometry',
}


def _check_options(fps: object, pixels_per_cm: object, y_axis: object, min_confidence: object) -> None:
    for name, value in (("fps", fps), ("pixels_per_cm", None if pixels_per_cm == "unknown" else pixels_per_cm)):
        if value is not None and not (_is_number(value) and 1 / LARGEST <= value <= LARGEST):  # type: ignore[operator]
            refuse(name, f"be a number from {1 / LARGEST:g} to {LARGEST:g}", brief(value))
    if y_axis not in (None, "up", "down"):
        refuse("y_axis", "be 'up' or 'down'", brief(y_axis))
    if min_confidence is not None and not _is_number(min_confidence):
        refuse("min_confidence", "be a finite number", brief(min_confidence))


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float, np.number)) and not isinstance(value, bool) and math.isfinite(value)


def _find(path: Path) -> Format:
    """Return the one format that the content has."""
    glance = _look(path)
    found = [one for one in _ALL if one.recognizes(glance)]
    if len(found) == 1:
        return found[0]
    if not found and glance.lines and _numbers(glance.lines[0]):
        got = f"numbers alone, {glance.lines[0][:60]!r}"
        remedy = "Name its columns there, for example frame,id,x,y."
        raise refusal("begin with a header line", got, f"{path}:1", remedy)
    received = "what fits " + " and ".join(one.name for one in found) if found else "none of them"
    own = "Name the columns of a table of your own frame or time (s), x, y, and id where there are several; or give "
    ahead = own if glance.lines and not found else "Give "
    raise refusal(f"have the content of one of {', '.join(FORMATS)}", received, path, (ahead, Setting("format"), "."))


def _numbers(line: str) -> bool:
    """Return whether all cells of a line are numbers, two or more."""
    found = [cell.strip(' "') for cell in re.split(r"[,;\t ]", line) if cell.strip(' "')]
    return len(found) > 1 and all(
        re.fullmatch(r"[-+]?([0-9.]+(e[-+]?[0-9]+)?|nan)", cell, re.IGNORECASE) for cell in found
    )


def _look(path: Path) -> Glance:
    if path.is_dir():
        return Glance("npz", names=tuple(_trackers.archive_names(file) for file in _trackers.files_of(path)))
    with path.open("rb") as file:
        head = file.read(1 << 16)
    if not head:
        raise refusal("not be empty", "0 bytes", path)
    if head.startswith(b"\x89HDF\r\n\x1a\n"):
        return Glance("hdf5", names=(names_in(path),))
    if head.startswith(b"PK\x03\x04"):
        return Glance("npz", names=(_trackers.archive_names(path),))
    if head.startswith((b"\x93NUMPY", b"CDF\x01", b"CDF\x02")):
        return Glance("npy" if head.startswith(b"\x93") else "netcdf3")
    refuse_utf16(head, path)
    return Glance("text", lines=_first_lines(path))


def _first_lines(path: Path) -> tuple[str, ...]:
    """Return the first four lines, none if the file is no text; who reads them refuses what is not UTF-8, with its line."""
    with path.open("rb") as file:
        raw = [file.readline(LONGEST_LINE) for _ in range(4)]
    text = [line.decode("utf-8-sig" if k == 0 else "utf-8", "replace").rstrip("\r\n") for k, line in enumerate(raw)]
    return tuple(line for line in text if line) if not any("\0" in line for line in text) else ()


def _confident(recording: Recording, least: float | None, source: str) -> Recording:
    """Return the recording without the positions of which the tracker is less sure."""
    if least is None:
        return recording
    if recording.confidence is None:
        refuse("min_confidence", "be left out", f"{least} for a file without confidence", place=source)
    present = recording.present & (recording.confidence >= least)
    if not present.any():
        raise refusal(
            f"hold a position with confidence {least} or more", f"at most {recording.confidence.max()}", source
        )
    left_out = int(recording.present.sum() - present.sum())
    remark = f"{left_out} positions with a confidence below {least} count as missing"
    return replace(recording, present=present, remarks=(*recording.remarks, remark))


def _rate(recording: Recording, fps: float | None, source: str) -> float:
    if fps is not None and recording.fps is not None and not math.isclose(fps, recording.fps, rel_tol=1e-3):
        refuse("fps", f"be what the file states, {recording.fps}", str(fps), "Leave it out.", place=source)
    return float(fps or recording.fps)  # type: ignore[arg-type]


def _scale(recording: Recording, pixels_per_cm: float | str | None, source: str) -> float | None:
    """Return by what to divide for cm; None for positions that stay in pixels."""
    if recording.unit == "cm":
        if pixels_per_cm is not None:
            refuse("pixels_per_cm", "be left out for a file in cm", brief(pixels_per_cm), place=source)
        return 1.0
    return None if pixels_per_cm in ("unknown", None) else float(pixels_per_cm)


def _check_extent(recording: Recording, scale: float | None, source: str) -> None:
    """Refuse a scale by which coordinates in cm would be as absurd as those in the file may not be."""
    farthest = float(np.abs(recording.positions[recording.present]).max(initial=0.0))
    if scale is not None and farthest / scale > LARGEST:
        refuse(
            "pixels_per_cm",
            f"leave coordinates within +-{LARGEST:.0e} cm",
            f"{scale:g}, by which {farthest:g} is {farthest / scale:g} cm",
            place=str(source),
        )


_FEWEST = 50
_LEAST_CONTINUITY = 0.7


def _check_order(recording: Recording, source: str) -> None:
    """Refuse rows without frame numbers in which neighboring frames are as far apart as distant ones: shuffled rows."""
    if recording.numbered or len(recording.present) < 2 * _FEWEST:
        return
    near, far = _typical(recording, 1), _typical(recording, len(recording.present) // 2)
    if near is not None and far is not None and near > _LEAST_CONTINUITY * far:
        rule = "have its rows in the order of time"
        received = f"a typical step of {near:.3g} between neighboring rows and {far:.3g} between distant ones"
        raise refusal(rule, received, source, "The rows may be shuffled; they carry no frame number.")


def _typical(recording: Recording, lag: int) -> float | None:
    """Return the median distance over `lag` frames, None where too few are known."""
    known = recording.present[lag:] & recording.present[:-lag]
    steps = np.hypot(*np.moveaxis(recording.positions[lag:] - recording.positions[:-lag], -1, 0))[known]
    return float(np.median(steps)) if len(steps) >= _FEWEST else None
