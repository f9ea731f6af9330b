"""idtracker.ai: trajectories as h5, csv, or npy."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.errors import refuse
from turing_learning.trajectories._recording import LARGEST, Format, Glance, Options, Recording, refusal

from ._shared import check_rate, dataset, from_array, open_hdf5, stated_rate
from ._text import header, read_table

TIMES = ("time", "seconds")


def recognizes_h5(glance: Glance) -> bool:
    """Whether there is a dataset `trajectories`."""
    return "trajectories" in glance.datasets


def recognizes_csv(glance: Glance) -> bool:
    """Whether the header begins x1, y1, with or without a time before."""
    names = [name.strip() for name in glance.lines[0].split(",")] if glance.lines else []
    return names[:2] == ["x1", "y1"] or (names[:1] in [[time] for time in TIMES] and names[1:3] == ["x1", "y1"])


def recognizes_npy(glance: Glance) -> bool:
    """Whether it is an npy file."""
    return glance.npy


def read_h5(path: Path, options: Options) -> Recording:
    """Read `trajectories` (F, A, 2) in pixels; frame rate from the attribute `frames_per_second`.

    Source: Romero-Ferrero et al. 2019, idtracker.ai, Nature Methods 16; its documentation of the output.
    """
    with open_hdf5(path) as file:
        positions = dataset(file, "trajectories", 3, path)
        rate = file.attrs.get("frames_per_second")
        scores = _scores(file, positions, path)
    return _recording(positions, scores, rate, f"{path}, dataset trajectories", path)


def _scores(file: Any, positions: np.ndarray, path: Path) -> np.ndarray | None:
    if "id_probabilities" not in file:
        return None
    scores = dataset(file, "id_probabilities", len(file["id_probabilities"].shape), path)
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


def read_csv(path: Path, options: Options) -> Recording:
    """Read a row for each frame: time (s), then x and y (pixels) of each individual.

    The frame rate is that of attributes.json beside the file, or follows from the times.
    """
    names = header(path, 1, ",")[0]
    timed = names[0] in TIMES
    count = (len(names) - timed) // 2
    expected = [f"{axis}{k + 1}" for k in range(count) for axis in "xy"]
    if sorted(names[timed:]) != sorted(expected):
        raise refusal("have the columns x1, y1, x2, y2, ... after the time", repr(names[-1]), f"{path}:1")
    columns = ([0] if timed else []) + [names.index(name) for name in expected]
    table = read_table(path, ",", len(names), skip=1, numbers=columns)
    positions = table.numbers[:, timed:].reshape(-1, count, 2)
    rate = _time_rate(table.numbers[:, 0], table.place) if timed else None
    return from_array(
        positions, tuple(str(k + 1) for k in range(count)), str(path), fps=_attribute(path) or rate, numbered=timed
    )


def _time_rate(seconds: np.ndarray, place: Any) -> float | None:
    absurd = ~(np.abs(seconds) <= LARGEST)
    if absurd.any():
        row = int(np.argmax(absurd))
        raise refusal(f"have times within +-{LARGEST:.0e} s", seconds[row], place(row))
    backward = np.concatenate([[False], np.diff(seconds) <= 0])
    if backward.any():
        row = int(np.argmax(backward))
        raise refusal("have times that grow from row to row", seconds[row], place(row))
    steps = np.diff(seconds)
    uneven = np.concatenate([[False], np.abs(steps / np.median(steps) - 1) > 0.5]) if len(steps) else backward
    if uneven.any():
        row = int(np.argmax(uneven))
        raise refusal("have evenly spaced times", f"a step of {steps[row - 1]:.6g} s", place(row))
    return stated_rate(seconds, np.arange(len(seconds)))


def _attribute(path: Path) -> float | None:
    """Return the frame rate that attributes.json beside the file states."""
    beside = path.parent / "attributes.json"
    if not beside.is_file():
        return None
    try:
        stated = json.loads(beside.read_text(encoding="utf-8"))
    except ValueError as error:
        raise refusal("have a whole attributes.json beside it", str(error)[:80], beside) from None
    rate = stated.get("frames_per_second") if isinstance(stated, dict) else None
    return None if rate is None else check_rate(rate, beside)


H5_FORMAT = Format("idtracker.ai-h5", recognizes_h5, read_h5)
CSV_FORMAT = Format("idtracker.ai-csv", recognizes_csv, read_csv)
NPY_FORMAT = Format("idtracker.ai-npy", recognizes_npy, read_npy)
