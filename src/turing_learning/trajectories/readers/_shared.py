"""What readers of arrays share: positions (F, A, 2) as they are, one row for each frame, and HDF5 that is not trusted."""

import io
import pickle
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.errors import brief, refuse
from turing_learning.trajectories._recording import LARGEST, Place, Recording, YAxis, check_positions, refusal

RATE_DIGITS = 5
"""Of a frame rate that times state: 29.97, or 0.0016667 with a frame every ten minutes."""
MOST_NUMBERS = 1 << 28
FREE_BYTES = 1 << 26
MOST_TIMES = 200
"""A file may unpack to `FREE_BYTES`, or to so many times its own size: recordings do not compress by more, and bombs do."""


def from_array(
    positions: np.ndarray,
    names: tuple[str, ...],
    place: str | Place,
    *,
    confidence: np.ndarray | None = None,
    headings: np.ndarray | None = None,
    first_frame: int = 0,
    fps: float | None = None,
    unit: str | None = None,
    y_axis: YAxis | None = "down",
    numbered: bool = True,
    remarks: tuple[str, ...] = (),
) -> Recording:
    """Return the recording of positions (F, A, 2), not a number where missing; `place` is that of all, or says where a frame is."""
    frames, count = positions.shape[:2]
    at = place if callable(place) else lambda frame: f"{place}, frame {frame}"
    infinite = np.isinf(positions)
    if infinite.any():
        raise refusal("have finite positions or NaN", "an infinite one", at(int(np.argwhere(infinite)[0][0])))
    present = check_positions(positions.reshape(-1, 2), lambda row: at(row // count)).reshape(frames, count)
    if not present.any():
        raise refusal("hold at least one position", "none", at(0) if callable(place) else place)
    return Recording(
        first_frame=first_frame,
        individuals=names,
        positions=np.where(present[..., None], positions, 0.0),
        present=present,
        confidence=None if confidence is None else np.where(present, np.nan_to_num(confidence), 0.0),
        headings=None if headings is None else np.where(present, np.nan_to_num(headings), 0.0),
        fps=fps,
        unit=unit,
        y_axis=y_axis,
        numbered=numbered,
        remarks=remarks,
    )


def stated_rate(seconds: np.ndarray, frames: np.ndarray) -> float | None:
    """Return the frame rate that times (s) of frames state, or None if they do not to a tenth of a frame."""
    known = np.abs(seconds) <= LARGEST
    if known.sum() < 2:
        return None
    seconds, frames = seconds[known], frames[known]
    span = seconds[-1] - seconds[0]
    if span <= 0:
        return None
    fps = float((frames[-1] - frames[0]) / span)
    late = (seconds - seconds[0]) * fps - (frames - frames[0])
    return float(f"{fps:.{RATE_DIGITS}g}") if np.abs(late).max() < 0.1 else None


def check_rate(value: object, path: object) -> float:
    """Return a frame rate that a file states, if it can be one."""
    stated = np.asarray(value)
    fps = float(stated.ravel()[0]) if stated.size == 1 and stated.dtype.kind in "fiu" else np.nan
    if not (np.isfinite(fps) and fps > 0):
        raise refusal("state a frame rate above 0", repr(value), path)
    return fps


def check_unpacked(size: int, path: Path, most: int = 8 * MOST_NUMBERS) -> None:
    """Refuse what unpacks to more bytes than a recording of the file's size does."""
    most = min(most, max(FREE_BYTES, MOST_TIMES * path.stat().st_size))
    if size > most:
        raise refusal(f"unpack to at most {most} bytes", size, path)


_DAMAGE = (OSError, RuntimeError, KeyError, TypeError, AttributeError, ValueError, OverflowError, MemoryError)
"""What HDF5 raises on damaged files."""


@contextmanager
def open_hdf5(path: Path) -> Iterator[Any]:
    """Open a file; whatever HDF5 cannot read is an error that names the file."""
    try:
        import h5py  # type: ignore[import-untyped, unused-ignore]
    except ImportError:
        raise ImportError(f"h5py is needed to read {path}: pip install 'turing-learning[tracking]'") from None
    try:
        with h5py.File(path, "r") as file:
            yield file
    except _DAMAGE as error:
        if str(path) in str(error) and isinstance(error, ValueError):  # a reader's own refusal
            raise
        raise refusal("be a whole HDF5 file", str(error)[:120], path, "The file may be cut off or damaged.") from None


def names_in(path: Path) -> frozenset[str]:
    """Return what is at the top of an HDF5 file, with "pandas_type" if there is a table of pandas."""
    with open_hdf5(path) as file:
        import h5py

        own = [name for name in file if isinstance(file.get(name, getlink=True), h5py.HardLink)]
        return frozenset([*file, *(["pandas_type"] if any("pandas_type" in file[name].attrs for name in own) else [])])


def member(file: Any, name: str, path: Path) -> Any:
    """Return a member of a file, None if there is none; refuse one that lies in another file, or unpacks to too much."""
    import h5py

    elsewhere = isinstance(file.get(name, getlink=True), h5py.ExternalLink)
    found: Any = None if elsewhere else file.get(name)
    stored = isinstance(found, h5py.Dataset)
    if elsewhere or (stored and (found.external or found.is_virtual)):
        raise refusal("hold its data itself", "a link to another file", f"{path}, {name}", "Copy the data into it.")
    if stored and found.dtype.kind != "O":
        if found.size > MOST_NUMBERS:
            raise refusal(f"hold at most {MOST_NUMBERS} numbers", found.shape, f"{path}, dataset {name}")
        check_unpacked(found.size * found.dtype.itemsize, path)
    return found


def dataset(file: Any, name: str, dimensions: int, path: Path) -> np.ndarray:
    """Return a dataset of numbers."""
    found = member(file, name, path)
    shape = getattr(found, "shape", None)
    if shape is None or len(shape) != dimensions or found.dtype.kind not in "fiu" or 0 in shape:
        received = "none" if shape is None else f"{found.dtype} {shape}"
        raise refusal(f"hold numbers with {dimensions} dimensions, not empty", received, f"{path}, dataset {name}")
    return np.asarray(found, dtype=np.float64)


def texts(file: Any, name: str, path: Path) -> list[str]:
    """Return a dataset of names; empty if there is none."""
    found = member(file, name, path)
    shape = getattr(found, "shape", (0,))
    if 0 in shape:
        return []
    if len(shape) != 1 or shape[0] > FREE_BYTES >> 8:
        raise refusal("hold a list of names", shape, f"{path}, dataset {name}")
    return [text(item) for item in found[()]]


def text(value: Any) -> str:
    """Return a name or attribute as text."""
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else str(value)


def plain_pickle(content: bytes) -> Any:
    """Return lists, tuples and texts from a pickle, in which pandas names columns; one that calls anything is refused."""

    class Plain(pickle.Unpickler):
        def find_class(self, module: str, name: str) -> Any:
            raise pickle.UnpicklingError(f"a pickle that calls {module}.{name}")

    try:
        return Plain(io.BytesIO(content)).load()
    except Exception as error:  # a damaged pickle can raise anything
        raise ValueError(str(error)) from None


def choose(keypoint: str | None, names: Sequence[str], place: object) -> str:
    """Return the key point asked for, or the only one there is."""
    if keypoint is None and len(names) == 1:
        return names[0]
    if keypoint is None or keypoint not in names:
        remedy = "Say which point of the body stands for the animal."
        refuse("keypoint", f"be one of {', '.join(names)}", brief(keypoint), remedy, place=str(place))
    return keypoint
