"""Motion of named individuals: samples, the files they come from, and windows of recordings."""

import csv
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np

from turing_learning.arrays import array
from turing_learning.config import ConfigurationError
from turing_learning.errors import check, reject
from turing_learning.trajectories import Trajectories

MOTION_SUFFIXES = (".npy", ".npz", ".csv")
"""Endings of the files that hold samples of named individuals."""

_KEYS = ("individual", "sample", "step")


def checked_motion(name: str, motion: Any, *, where: Callable[[int], str] = str, **sizes: int) -> np.ndarray:
    """Return motion (individuals, samples, T, D) as floats; reject what is not that, of other sizes T or D, or not finite."""
    remedy = "A classifier is calibrated for samples of one length."
    about: dict[str, Any] = {"finite": False, "remedy": remedy, "error": ConfigurationError, **sizes}
    motion = array(name, motion, "individuals samples T D", **about)
    if not np.isfinite(motion).all():
        individual, *rest = (int(k) for k in np.argwhere(~np.isfinite(motion))[0])
        place = "individual {}, sample {}, step {}, signal {}".format(where(individual), *rest)
        reject(name, "be finite", str(motion[individual, *rest]), "Leave such samples out.", place=place)
    return motion


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples of the motion of individuals, in the order in which they were observed."""

    individuals: tuple[str, ...]  #: Names
    #: (individuals, samples, T, D), in the units of the signals that the classifiers were evolved with; in simulated
    #: swarms linear speed (cm/s) and angular speed (rad/s)
    samples: np.ndarray

    def __post_init__(self) -> None:
        shape, error = "individuals samples T D", ConfigurationError
        samples = array("samples", self.samples, shape, finite=False, empty=True, error=error)
        object.__setattr__(self, "individuals", tuple(self.individuals))
        object.__setattr__(self, "samples", samples)
        fits = len(self.individuals) == len(samples)
        rule = f"be one name for each of the {len(samples)} individuals"
        check(fits, "individuals", rule, len(self.individuals))


def holds_motion(path: str | Path) -> bool:
    """Return whether a file can be read and begins as those for `load_motion` do: numbers, archive with ``samples``, heading."""
    path = Path(path)
    with suppress(Exception):  # a damaged file can raise anything
        match path.suffix.lower() if path.is_file() else "":  # nobody may ever write to a pipe
            case ".npy":
                return np.lib.format.open_memmap(path, mode="r").dtype.kind in "fiuc"
            case ".npz":
                with zipfile.ZipFile(path) as archive:
                    return "samples.npy" in archive.namelist()
            case ".csv":
                with path.open(encoding="utf-8-sig", newline="") as file:
                    return bool(_keys([name.strip() for name in next(csv.reader(file), [])]))
    return False


def load_motion(path: str | Path, *, steps: int, signals: int, names: Sequence[str] | None = None) -> Motion:
    """Read motion from a file.

    Parameters
    ----------
    path
        One of

        * ``.npy``: an array (individuals, samples, T, D), or long recordings (individuals, L, D), which are cut
          into samples;
        * ``.npz``: the same as ``samples``, and perhaps names as ``individuals``;
        * ``.csv``: a heading ``individual,sample,step,`` and the names of the signals, then a row for each
          step, in any order; without the column ``sample`` the recordings are cut into samples. Steps and
          samples are consecutive integers.
    steps, signals
        Steps T and signals D of a sample, as the detector needs them.
    names
        Of the D signals: the columns of a table are brought into this order. None takes them as they are.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    check(
        suffix in MOTION_SUFFIXES, "motion", f"be a file that ends with one of {', '.join(MOTION_SUFFIXES)}", str(path)
    )
    regular = path.is_file() or not path.exists() or path.is_dir()
    check(regular, "motion", "be a file", f"{path}, a pipe or device", "Write what comes out of it to a file.")
    try:
        individuals, values = _read_csv(path, names) if suffix == ".csv" else _read_arrays(path)
    except OSError as error:
        reject("motion", "be a file that can be read", f"{path} ({error.strerror or error})")
    if values.ndim == 3:
        length, rule = values.shape[1], f"be at least one sample of {steps} steps long"
        check(1 <= steps <= length, "recordings", rule, f"{length} steps", "Record for longer.")
        count = length // steps
        values = values[:, : count * steps].reshape(len(values), count, steps, values.shape[2])
    if values.ndim == 4:
        fits, rule = len(individuals) == len(values), f"be one name for each of the {len(values)} individuals"
        check(fits, "individuals", rule, len(individuals), place=str(path))
    return Motion(individuals, checked_motion("motion", values, where=individuals.__getitem__, T=steps, D=signals))


def _read_arrays(path: Path) -> tuple[tuple[str, ...], np.ndarray]:
    names = None
    try:
        if path.suffix.lower() == ".npz":
            with path.open("rb") as file, zipfile.ZipFile(file) as members:  # np.load takes other files, too
                most = max(1 << 26, 200 * path.stat().st_size)  # recordings do not compress by more, and bombs do
                size = sum(each.file_size for each in members.infolist())
                check(size <= most, "motion", f"unpack to at most {most} bytes", size, place=str(path))
                file.seek(0)
                with np.load(file, allow_pickle=False) as archive:
                    found = sorted(archive.files)
                    check("samples" in found, "motion", "hold an array `samples`", found, place=str(path))
                    values = archive["samples"]
                    names = archive["individuals"] if "individuals" in found else None
        else:  # mapped, so that a shape that the file is too short for is rejected before any memory is taken
            values = np.array(np.lib.format.open_memmap(path, mode="r"))
    except (ConfigurationError, OSError, MemoryError):
        raise
    except Exception as error:  # a damaged header can raise anything
        reject("motion", "be a file of numbers in NumPy's format", f"{path} ({error})")
    if names is None:
        names = np.arange(1, 1 + (len(values) if values.ndim else 0))
    return tuple(str(name) for name in np.ravel(names)), values


def _read_csv(path: Path, signals: Sequence[str] | None) -> tuple[tuple[str, ...], np.ndarray]:
    def hold(fits: object, rule: str, got: object, line: int | None = None, remedy: str = "") -> None:
        check(fits, "motion", rule, got, remedy, place=str(path) if line is None else f"{path}:{line}")

    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = [(number, row) for number, row in enumerate(csv.reader(file), start=1) if row or number == 1]
    except UnicodeDecodeError as error:
        remedy = "It may be in UTF-16, Latin-1 or another encoding: save it as UTF-8."
        hold(False, "be text in UTF-8", f"byte {error.object[error.start]:#04x}", remedy=remedy)
    except csv.Error as error:
        hold(False, "be a text file with commas", str(error))
    heading = [name.strip() for name in rows[0][1]] if rows else []
    keys = _keys(heading)
    rule = "begin with individual,step or individual,sample,step and the names of signals"
    hold(keys and len(heading) > len(keys), rule, repr(",".join(heading)), 1)
    cells: dict[tuple[str, int, int], list[float]] = {}
    for line, row in rows[1:]:
        hold(len(row) == len(heading), f"have {len(heading)} entries in each row", len(row), line)
        try:
            sample, step = (0, *map(int, row[1 : len(keys)]))[-2:]
            values = [float(value) for value in row[len(keys) :]]
        except ValueError:
            hold(False, "hold numbers", repr(",".join(row)), line)
        name = row[0].strip()
        again = f"individual {name!r}, sample {sample}, step {step} again"
        hold((name, sample, step) not in cells, "hold each step once", again, line)
        cells[name, sample, step] = values
    hold(cells, "hold at least one step", "none")
    columns = heading[len(keys) :]
    names, samples, steps = (list(dict.fromkeys(each)) for each in zip(*cells, strict=True))  # as they appear
    for axis, found in (("sample", samples), ("step", steps)):
        for before, after in pairwise(sorted(found)):
            hold(after == before + 1, f"count each {axis} consecutively", f"{after} after {before}")
    axes = names, sorted(samples), sorted(steps)
    for name, sample, step in (each for each in product(*axes) if each not in cells):
        got = f"no row for individual {name!r}, sample {sample}, step {step}"
        hold(False, "hold the same samples and steps for each individual", got)
    motion = np.array([cells[each] for each in product(*axes)]).reshape(*map(len, axes), len(columns))
    if signals is not None:
        rule = f"have the signals of the run, {', '.join(signals)}, in any order"
        hold(sorted(columns) == sorted(signals), rule, ", ".join(columns), 1, "Name its columns so.")
        motion = motion[..., [columns.index(name) for name in signals]]
    return tuple(names), motion if "sample" in keys else motion[:, 0]


def _keys(heading: list[str]) -> list[str]:
    """Return the columns before the signals; none if a heading does not begin with them."""
    keys = [name for name in _KEYS if name in heading]
    return keys if heading[: len(keys)] == keys and {"individual", "step"} <= set(keys) else []


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """Windows of the motion of individuals, in order of time."""

    individuals: tuple[str, ...]  #: Names (A,)
    #: A arrays (W, T, D), windows of each individual, without gaps and jumps; W differs, and may be 0
    samples: tuple[np.ndarray, ...]
    #: A arrays (W, 2), when each window begins and ends, from the first frame of the recording (s)
    times: tuple[np.ndarray, ...]
    duration_s: float  #: Of the recording (s)
    recording: Trajectories | None = None  #: Where the windows are from; None if that is not known
    #: A arrays (W, T, 16), or none, what each does beside the others at the same times, see `company`; none for one alone
    company: tuple[np.ndarray, ...] = ()
