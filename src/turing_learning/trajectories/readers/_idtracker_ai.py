"""idtracker.ai: trajectories as h5 or npy."""

from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.errors import refuse
from turing_learning.trajectories._recording import Format, Options, Recording, refusal

from ._shared import check_rate, dataset, from_array, member, open_hdf5


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
    found = member(file, "id_probabilities", path)
    if found is None:
        return None
    scores = dataset(file, "id_probabilities", len(found.shape), path)
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


H5_FORMAT = Format("idtracker.ai-h5", lambda glance: glance.holds("trajectories"), read_h5)
NPY_FORMAT = Format("idtracker.ai-npy", lambda glance: glance.kind == "npy", read_npy)
