"""HDF5 files: opened with h5py, refused where damaged."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.trajectories._recording import refusal

MOST_NUMBERS = 1 << 28


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
    except (OSError, RuntimeError, KeyError, TypeError, AttributeError, ValueError) as error:
        if str(path) in str(error) and isinstance(error, ValueError):  # a reader's own refusal
            raise
        raise refusal("be a whole HDF5 file", str(error)[:120], path, "The file may be cut off or damaged.") from None


def dataset(file: Any, name: str, dimensions: int, path: Path) -> np.ndarray:
    """Return a dataset of numbers."""
    found = file.get(name)
    shape = getattr(found, "shape", None)
    if shape is None or len(shape) != dimensions or found.dtype.kind not in "fiu" or 0 in shape:
        received = "none" if shape is None else f"{found.dtype} {shape}"
        raise refusal(f"hold numbers with {dimensions} dimensions, not empty", received, f"{path}, dataset {name}")
    if int(np.prod(shape, dtype=object)) > MOST_NUMBERS:
        raise refusal(f"hold at most {MOST_NUMBERS} numbers", shape, f"{path}, dataset {name}")
    return np.asarray(found, dtype=np.float64)


def texts(file: Any, name: str, path: Path) -> list[str]:
    """Return a dataset of names; empty if there is none."""
    found = file.get(name)
    shape = getattr(found, "shape", (0,))
    if 0 in shape:
        return []
    if len(shape) != 1:
        raise refusal("hold a list of names", shape, f"{path}, dataset {name}")
    return [item.decode("utf-8", errors="replace") if isinstance(item, bytes) else str(item) for item in found[()]]
