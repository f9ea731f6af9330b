"""Motion samples of named individuals, and the files they come from."""

import csv
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from turing_learning.config import ConfigurationError

from ._checks import checked_motion

SUFFIXES = (".npy", ".npz", ".csv")
_KEYS = ("individual", "sample", "step")


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples of the motion of individuals, in the order in which they were observed.

    Attributes
    ----------
    individuals
        Names.
    samples : (individuals, samples, T, D)
        In the units of the signals that the classifiers were evolved with; in simulated swarms linear speed (cm/s) and angular
        speed (rad/s).
    """

    individuals: tuple[str, ...]
    samples: np.ndarray


def cut_recordings(recordings: np.ndarray, steps: int) -> np.ndarray:
    """Cut long recordings into consecutive samples; what is left at the end is not used.

    Parameters
    ----------
    recordings : (individuals, L, D)
        L steps each.
    steps
        Steps T of a sample, from 1 to L.

    Returns
    -------
    (individuals, L // T, T, D)

    Raises
    ------
    ConfigurationError
        If the shape does not fit or the recordings are shorter than one sample.
    """
    recordings = np.asarray(recordings)
    if recordings.ndim != 3:
        raise ConfigurationError(f"`recordings` must have the shape (individuals, L, D); got {recordings.shape}.")
    individuals, length, signals = recordings.shape
    if not 1 <= steps <= length:
        raise ConfigurationError(
            f"`recordings` must be at least one sample of {steps} steps long; got {length} steps. Record for longer."
        )
    count = length // steps
    return recordings[:, : count * steps].reshape(individuals, count, steps, signals)


def holds_motion(path: str | Path) -> bool:
    """Return whether a file begins as those for `load_motion` do: numbers, an archive with ``samples``, or their heading.

    Parameters
    ----------
    path
        Any file; one that cannot be read does not.
    """
    path = Path(path)
    try:
        match path.suffix.lower():
            case ".npy":
                return np.lib.format.open_memmap(path, mode="r").dtype.kind in "fiuc"
            case ".npz":
                with zipfile.ZipFile(path) as archive:
                    return "samples.npy" in archive.namelist()
            case ".csv":
                with path.open(encoding="utf-8-sig", newline="") as file:
                    return bool(_keys(_heading(csv.reader(file))))
    except (OSError, ValueError, zipfile.BadZipFile, csv.Error):
        return False
    return False


def load_motion(path: str | Path, *, steps: int, signals: int, names: Sequence[str] | None = None) -> Motion:
    """Read motion from a file.

    Parameters
    ----------
    path
        One of

        * ``.npy``: an array (individuals, samples, T, D), or long recordings (individuals, L, D), which are cut into samples;
        * ``.npz``: the same as ``samples``, and perhaps names as ``individuals``;
        * ``.csv``: a heading ``individual,sample,step,`` and the names of the signals, then a row for each step, in any order;
          without the column ``sample`` the recordings are cut into samples. Steps and samples are consecutive integers.
    steps, signals
        Steps T and signals D of a sample, as the detector needs them.
    names
        Of the D signals: the columns of a table are brought into this order. None takes them as they are.

    Raises
    ------
    ConfigurationError
        If the file cannot be read, or does not hold that.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise ConfigurationError(f"`motion` must be a file that ends with one of {', '.join(SUFFIXES)}; got {path}.")
    try:
        individuals, values = _read_csv(path, names) if path.suffix.lower() == ".csv" else _read_arrays(path)
    except OSError as error:
        raise ConfigurationError(
            f"`motion` must be a file that can be read; got {path} ({error.strerror or error})."
        ) from error
    if values.ndim == 3:
        values = cut_recordings(values, steps)
    if values.ndim == 4 and len(individuals) != len(values):
        raise ConfigurationError(
            f"`individuals` must be one name for each of the {len(values)} individuals; got {len(individuals)} [{path}]."
        )
    return Motion(
        individuals, checked_motion("motion", values, signals=signals, steps=steps, where=lambda k: individuals[k])
    )


def _read_arrays(path: Path) -> tuple[tuple[str, ...], np.ndarray]:
    try:
        if path.suffix.lower() == ".npz":
            return _read_archive(path)
        # mapped, so that a shape that the file is too short for is refused before any memory is taken
        values = np.array(np.lib.format.open_memmap(path, mode="r"))
    except ConfigurationError:
        raise
    except (ValueError, EOFError, zipfile.BadZipFile) as error:
        raise ConfigurationError(
            f"`motion` must be a file of numbers in NumPy's format; got {path} ({error})."
        ) from error
    return _numbered(values), values


def _read_archive(path: Path) -> tuple[tuple[str, ...], np.ndarray]:
    with path.open("rb") as file, zipfile.ZipFile(file):  # np.load takes other files, too
        file.seek(0)
        with np.load(file, allow_pickle=False) as archive:
            return _from_archive(path, {name: archive[name] for name in archive.files})


def _from_archive(path: Path, arrays: dict[str, np.ndarray]) -> tuple[tuple[str, ...], np.ndarray]:
    if "samples" not in arrays:
        raise ConfigurationError(f"`motion` must hold an array `samples`; got {sorted(arrays)} [{path}].")
    samples = arrays["samples"]
    if "individuals" not in arrays:
        return _numbered(samples), samples
    return tuple(str(name) for name in np.ravel(arrays["individuals"])), samples


def _numbered(values: np.ndarray) -> tuple[str, ...]:
    return tuple(str(k + 1) for k in range(len(values) if values.ndim else 0))


def _read_csv(path: Path, signals: Sequence[str] | None) -> tuple[tuple[str, ...], np.ndarray]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            return _from_rows(path, csv.reader(file), signals)
    except UnicodeDecodeError as error:
        raise ConfigurationError(
            f"`motion` must be text in UTF-8; got byte {error.object[error.start]:#04x} [{path}]. It may be in UTF-16, "
            "Latin-1 or another encoding: save it as UTF-8."
        ) from error
    except csv.Error as error:
        raise ConfigurationError(f"`motion` must be a text file with commas; got {path} ({error}).") from error


def _from_rows(
    path: Path, rows: Iterable[Sequence[str]], signals: Sequence[str] | None
) -> tuple[tuple[str, ...], np.ndarray]:
    lines = iter(rows)
    heading = _heading(lines)
    keys = _keys(heading)
    if not keys or len(heading) == len(keys):
        raise ConfigurationError(
            f"`motion` must begin with individual,step or individual,sample,step and the names of signals; "
            f"got {','.join(heading)!r} [{path}:1]."
        )
    cells: dict[tuple[str, int, int], list[float]] = {}
    for line, row in enumerate(lines, start=2):
        if row:
            _take(cells, row, keys, len(heading), f"{path}:{line}")
    names, values = _assembled(cells, path, cut="sample" not in keys)
    return names, values if signals is None else values[..., _columns(heading[len(keys) :], signals, path)]


def _heading(lines: Iterator[Sequence[str]]) -> list[str]:
    return [name.strip() for name in next(lines, [])]


def _keys(heading: list[str]) -> list[str]:
    """Return the columns before the signals; none if a heading does not begin with them."""
    keys = [name for name in _KEYS if name in heading]
    return keys if heading[: len(keys)] == keys and {"individual", "step"} <= set(keys) else []


def _columns(found: list[str], signals: Sequence[str], path: Path) -> list[int]:
    """Return where each signal is among those found."""
    if sorted(found) != sorted(signals):
        raise ConfigurationError(
            f"`motion` must have the signals of the run, {', '.join(signals)}, in any order; got {', '.join(found)} "
            f"[{path}:1]. Name its columns so."
        )
    return [found.index(name) for name in signals]


def _take(
    cells: dict[tuple[str, int, int], list[float]], row: Sequence[str], keys: list[str], width: int, where: str
) -> None:
    try:
        counts = [int(text) for text in row[1 : len(keys)]]
        values = [float(text) for text in row[len(keys) :]]
    except ValueError as error:
        raise ConfigurationError(f"`motion` must hold numbers; got {','.join(row)!r} [{where}].") from error
    if len(row) != width:
        raise ConfigurationError(f"`motion` must have {width} entries in each row; got {len(row)} [{where}].")
    sample, step = (0, *counts)[-2:]
    place = (row[0].strip(), sample, step)
    if place in cells:
        raise ConfigurationError(
            f"`motion` must hold each step once; got individual {place[0]!r}, sample {sample}, step {step} "
            f"again [{where}]."
        )
    cells[place] = values


def _assembled(
    cells: dict[tuple[str, int, int], list[float]], path: Path, *, cut: bool
) -> tuple[tuple[str, ...], np.ndarray]:
    if not cells:
        raise ConfigurationError(f"`motion` must hold at least one step; got none [{path}].")
    names = tuple(dict.fromkeys(name for name, _, _ in cells))  # in the order in which they appear
    samples, steps = sorted({sample for _, sample, _ in cells}), sorted({step for _, _, step in cells})
    for axis, found in (("sample", samples), ("step", steps)):
        for before, after in pairwise(found):
            if after != before + 1:
                raise ConfigurationError(
                    f"`motion` must count each {axis} consecutively; got {after} after {before} [{path}]."
                )
    for name in names:
        for sample in samples:
            for step in steps:
                if (name, sample, step) not in cells:
                    raise ConfigurationError(
                        f"`motion` must hold the same samples and steps for each individual; got no row for "
                        f"individual {name!r}, sample {sample}, step {step} [{path}]."
                    )
    values = np.array([[[cells[name, s, t] for t in steps] for s in samples] for name in names])
    return names, values[:, 0] if cut else values
