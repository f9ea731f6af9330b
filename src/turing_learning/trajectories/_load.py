"""The door: any tracker's file to `Trajectories`."""

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from turing_learning.errors import Setting, brief, choice, refuse

from ._recording import LARGEST, Format, Glance, Options, Recording, YAxis, refusal
from ._trajectories import Trajectories
from .readers import _columns, _deeplabcut, _idtracker, _idtracker_ai, _sleap, _toxtrac, _trex
from .readers._movement import read_dataset
from .readers._text import LONGEST_LINE, refuse_utf16

if TYPE_CHECKING:
    import xarray as xr

_ALL = (
    _idtracker.FORMAT,
    _idtracker_ai.H5_FORMAT,
    _idtracker_ai.CSV_FORMAT,
    _idtracker_ai.NPY_FORMAT,
    _trex.FORMAT,
    _toxtrac.FORMAT,
    _columns.TRACKTOR_FORMAT,
    _sleap.FORMAT,
    _deeplabcut.FORMAT,
    _columns.TIDY_FORMAT,
)
FORMATS = tuple(one.name for one in _ALL)
"""Names of the formats that can be read."""


def load_trajectories(
    path: str | Path,
    *,
    fps: float | None = None,
    pixels_per_cm: float | Literal["unknown"] | None = None,
    format: str | None = None,
    y_axis: YAxis | None = None,
    keypoint: str | None = None,
    min_confidence: float | None = None,
    allow_pickle: bool = False,
) -> Trajectories:
    """Open what a tracker wrote.

    Parameters
    ----------
    path
        A file; for TRex also a folder with a file for each individual.
    fps
        Frame rate (1/s), from 1e-9 to 1e9, needed where the file does not state it.
    pixels_per_cm
        Scale, from 1e-9 to 1e9, needed where the file is not in cm; "unknown" leaves positions in pixels, 1 is for a file
        in cm.
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
        If the format is not recognized or ambiguous; a scale, rate or direction is not stated, absurd, or stated
        twice and differently; the file is cut off, damaged or contradicts itself (with file and line, or dataset).
    OSError
        If the file cannot be opened.
    ImportError
        If the file needs h5py and it is not installed.
    """
    path = Path(path)
    _check_options(fps, pixels_per_cm, y_axis, min_confidence)
    chosen = _named(format) if format is not None else _find(path)
    if keypoint is not None and not chosen.has_keypoints:
        refuse("keypoint", f"be left out for format {chosen.name}", brief(keypoint), place=str(path))
    recording = chosen.read(path, Options(keypoint, allow_pickle))
    _check_order(recording, path)
    recording = _confident(recording, min_confidence, path)
    return _finish(recording, chosen.name, str(path), fps=fps, pixels_per_cm=pixels_per_cm, y_axis=y_axis)


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
        With `position` (time, space, individuals), perhaps keypoints, and `confidence` and `heading` if there are some.
        NaN is missing.
    fps, pixels_per_cm, y_axis
        As in `load_trajectories`; needed where the attributes `fps`, `length_unit` and `y_axis` do not say it. Times in
        seconds state the frame rate, too.
    keypoint
        Which point stands for the animal, where there are several.

    Raises
    ------
    ValueError
        If dimensions are missing, or something is not stated, or stated twice and differently.
    """
    recording = read_dataset(dataset, keypoint, fps, y_axis)
    stay = "unknown" if dataset.attrs.get("length_unit") == "px" and pixels_per_cm is None else pixels_per_cm
    software, file = (str(dataset.attrs.get(f"source_{what}") or "") for what in ("software", "file"))
    return _finish(recording, software, file, fps=fps, pixels_per_cm=stay, y_axis=y_axis)


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
    scale = _scale(recording, pixels_per_cm, source)
    _check_extent(recording, scale, source)
    flip = _direction(recording, y_axis, source) == "down"
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


def _named(name: str) -> Format:
    by_name = {one.name: one for one in _ALL}
    return by_name[choice("format", name, FORMATS)]


def _find(path: Path) -> Format:
    """Return the one format that the content has."""
    glance = _look(path)
    found = [one for one in _ALL if one.recognizes(glance)]
    if len(found) == 1:
        return found[0]
    received = "what fits " + " and ".join(one.name for one in found) if found else "none of them"
    raise refusal(f"have the content of one of {', '.join(FORMATS)}", received, path, ("Give ", Setting("format"), "."))


def _look(path: Path) -> Glance:
    if path.is_dir():
        return Glance(folder=tuple(_trex.archive_names(file) for file in sorted(path.glob("*.npz"))))
    with path.open("rb") as file:
        head = file.read(1 << 16)
    if not head:
        raise refusal("not be empty", "0 bytes", path)
    if head.startswith(b"\x89HDF\r\n\x1a\n"):
        from .readers._shared import open_hdf5

        with open_hdf5(path) as content:
            return Glance(datasets=frozenset(content))
    if head.startswith(b"PK\x03\x04"):
        return Glance(arrays=_trex.archive_names(path))
    if head.startswith(b"\x93NUMPY"):
        return Glance(npy=True)
    refuse_utf16(head, path)
    return Glance(lines=_first_lines(path))


def _first_lines(path: Path) -> tuple[str, ...]:
    """Return the first four lines, none if the file is no text; who reads them refuses what is not UTF-8, with its line."""
    with path.open("rb") as file:
        raw = [file.readline(LONGEST_LINE) for _ in range(4)]
    text = [line.decode("utf-8-sig" if k == 0 else "utf-8", "replace").rstrip("\r\n") for k, line in enumerate(raw)]
    return tuple(line for line in text if line) if not any("\0" in line for line in text) else ()


def _confident(recording: Recording, least: float | None, path: Path) -> Recording:
    """Return the recording without the positions of which the tracker is less sure."""
    if least is None:
        return recording
    if recording.confidence is None:
        refuse("min_confidence", "be left out", f"{least} for a file without confidence", place=str(path))
    present = recording.present & (recording.confidence >= least)
    if not present.any():
        raise refusal(f"hold a position with confidence {least} or more", f"at most {recording.confidence.max()}", path)
    left_out = int(recording.present.sum() - present.sum())
    remark = f"{left_out} positions with a confidence below {least} count as missing"
    return replace(recording, present=present, remarks=(*recording.remarks, remark))


def _rate(recording: Recording, fps: float | None, source: str) -> float:
    if fps is None and recording.fps is None:
        refuse("fps", "be given", "none, and the file does not state it", place=str(source))
    if fps is not None and recording.fps is not None and not math.isclose(fps, recording.fps, rel_tol=1e-3):
        refuse("fps", f"be what the file states, {recording.fps}", str(fps), "Leave it out.", place=str(source))
    return float(fps or recording.fps)  # type: ignore[arg-type]


def _scale(recording: Recording, pixels_per_cm: float | str | None, source: str) -> float | None:
    """Return by what to divide for cm; None for positions that stay in pixels."""
    if recording.in_cm:
        if pixels_per_cm is not None:
            refuse("pixels_per_cm", "be left out for a file in cm", brief(pixels_per_cm), place=str(source))
        return 1.0
    if pixels_per_cm is None:
        refuse(
            "pixels_per_cm",
            "be given",
            "none, and the file does not state it",
            'Give 1 for a file in cm, "unknown" to stay in pixels.',
            place=str(source),
        )
    return None if pixels_per_cm == "unknown" else float(pixels_per_cm)


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


def _direction(recording: Recording, y_axis: YAxis | None, source: str) -> YAxis:
    direction = y_axis or recording.y_axis
    if direction is None:
        refuse(
            "y_axis",
            "be given",
            "none, and the file does not state it",
            'Say "down" for positions in images, "up" for the axes of geometry.',
            place=str(source),
        )
    return direction


_FEWEST = 50
_LEAST_CONTINUITY = 0.7


def _check_order(recording: Recording, path: Path) -> None:
    """Refuse rows without frame numbers in which neighboring frames are as far apart as distant ones: shuffled rows."""
    if recording.numbered or len(recording.present) < 2 * _FEWEST:
        return
    near, far = _typical(recording, 1), _typical(recording, len(recording.present) // 2)
    if near is not None and far is not None and near > _LEAST_CONTINUITY * far:
        rule = "have its rows in the order of time"
        received = f"a typical step of {near:.3g} between neighboring rows and {far:.3g} between distant ones"
        raise refusal(rule, received, path, "The rows may be shuffled; they carry no frame number.")


def _typical(recording: Recording, lag: int) -> float | None:
    """Return the median distance over `lag` frames, None where too few are known."""
    known = recording.present[lag:] & recording.present[:-lag]
    steps = np.hypot(*np.moveaxis(recording.positions[lag:] - recording.positions[:-lag], -1, 0))[known]
    return float(np.median(steps)) if len(steps) >= _FEWEST else None
