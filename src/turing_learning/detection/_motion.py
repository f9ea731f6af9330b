"""Motion of named individuals: samples, the files they come from, and windows of recordings."""

import csv
import zipfile
from collections.abc import Sequence
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

_KEY_COLUMNS = ("individual", "sample", "step")
ALWAYS_UNPACKED_BYTES = 1 << 26
"""An archive may unpack to so many bytes, however small it is."""
MOST_COMPRESSION = 200
"""Of a larger one: recordings do not compress by more, and zip bombs do."""


def checked_motion(
    name: str, motion: Any, individuals: Sequence[str] | None = None, **sizes: int
) -> np.ndarray:
    """Return motion (individuals, samples, T, D) as floats; reject other shapes and values."""
    remedy = "A classifier is calibrated for samples of one length."
    options: dict[str, Any] = {"remedy": remedy, "error": ConfigurationError} | sizes
    motion = array(name, motion, "individuals samples T D", finite=False, **options)
    # Not by `array`, which cannot name the individual.
    if not np.isfinite(motion).all():
        individual, sample, step, signal = np.argwhere(~np.isfinite(motion))[0]
        label = individual if individuals is None else individuals[individual]
        where = f"individual {label}, sample {sample}, step {step}, signal {signal}"
        value = str(motion[individual, sample, step, signal])
        reject(name, "be finite", value, "Leave such samples out.", place=where)
    return motion


@dataclass(frozen=True, eq=False)
class Motion:
    """Samples of the motion of individuals, in the order in which they were observed."""

    individuals: tuple[str, ...]  #: Names
    #: (individuals, samples, T, D), in the units of the signals that the classifiers were evolved with; in simulated
    #: swarms linear speed (cm/s) and angular speed (rad/s)
    samples: np.ndarray

    def __post_init__(self) -> None:
        shape = "individuals samples T D"
        error = ConfigurationError
        samples = array("samples", self.samples, shape, finite=False, empty=True, error=error)
        object.__setattr__(self, "individuals", tuple(self.individuals))
        object.__setattr__(self, "samples", samples)
        fits = len(self.individuals) == len(samples)
        rule = f"be one name for each of the {len(samples)} individuals"
        check(fits, "individuals", rule, len(self.individuals))


def holds_motion(path: str | Path) -> bool:
    """Return whether a file can be read and begins as those for `load_motion` do."""
    path = Path(path)
    # A damaged file can raise anything.
    with suppress(Exception):
        # Reading a pipe could wait forever.
        match path.suffix.lower() if path.is_file() else "":
            case ".npy":
                return np.lib.format.open_memmap(path, mode="r").dtype.kind in "fiuc"
            case ".npz":
                with zipfile.ZipFile(path) as archive:
                    return "samples.npy" in archive.namelist()
            case ".csv":
                with path.open(encoding="utf-8-sig", newline="") as file:
                    return bool(_key_columns([name.strip() for name in next(csv.reader(file), [])]))
    return False


def load_motion(
    path: str | Path, *, steps: int, signals: int, names: Sequence[str] | None = None
) -> Motion:
    """Read motion from a file.

    Parameters
    ----------
    path
        One of

        * ``.npy``: an array (individuals, samples, T, D), or long recordings (individuals, L, D), which are cut
          into samples;
        * ``.npz``: the same as ``samples``, and perhaps names as ``individuals``;
        * ``.csv``: a heading ``individual,sample,step,`` and the names of the signals, then a row for each
          step, in any order; without the column ``sample`` the recordings are cut into samples.
          Steps and samples are consecutive integers.
    steps, signals
        Steps T and signals D of a sample, as the detector needs them.
    names
        Of the D signals: the columns of a table are brought into this order. None takes them as
        they are.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    rule = f"be a file that ends with one of {', '.join(MOTION_SUFFIXES)}"
    check(suffix in MOTION_SUFFIXES, "motion", rule, str(path))
    # What is missing, or a folder, is refused in words of its own.
    regular = path.is_file() or not path.exists() or path.is_dir()
    remedy = "Write what comes out of it to a file."
    check(regular, "motion", "be a file", f"{path}, a pipe or device", remedy)
    try:
        individuals, values = _read_csv(path, names) if suffix == ".csv" else _read_arrays(path)
    except OSError as error:
        reject("motion", "be a file that can be read", f"{path} ({error.strerror or error})")
    if values.ndim == 3:
        values = _cut_into_samples(values, steps)
    if values.ndim == 4:
        fits = len(individuals) == len(values)
        rule = f"be one name for each of the {len(values)} individuals"
        check(fits, "individuals", rule, len(individuals), place=str(path))
    samples = checked_motion("motion", values, individuals, T=steps, D=signals)
    return Motion(individuals, samples)


def _cut_into_samples(recordings: np.ndarray, steps: int) -> np.ndarray:
    """Cut recordings (individuals, L, D) into samples (individuals, L // T, T, D) of T steps."""
    length = recordings.shape[1]
    rule = f"be at least one sample of {steps} steps long"
    check(1 <= steps <= length, "recordings", rule, f"{length} steps", "Record for longer.")
    count = length // steps
    shape = (len(recordings), count, steps, recordings.shape[2])
    return recordings[:, : count * steps].reshape(shape)


def _read_arrays(path: Path) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the names of the individuals and the samples, or recordings, in a file of NumPy's."""
    names = None
    try:
        if path.suffix.lower() == ".npz":
            names, values = _read_archive(path)
        else:
            # Mapped: a shape that the file is too short for is rejected before any memory is taken.
            values = np.array(np.lib.format.open_memmap(path, mode="r"))
    except (ConfigurationError, OSError, MemoryError):
        raise
    # A damaged header can raise anything.
    except Exception as error:
        reject("motion", "be a file of numbers in NumPy's format", f"{path} ({error})")
    if names is None:
        names = np.arange(1, 1 + (len(values) if values.ndim else 0))
    return tuple(map(str, np.ravel(names))), values


def _read_archive(path: Path) -> tuple[np.ndarray | None, np.ndarray]:
    """Return the names of the individuals, or None, and the samples in an archive."""
    # np.load takes other files, too: zipfile refuses them.
    with path.open("rb") as file, zipfile.ZipFile(file) as members:
        largest = max(ALWAYS_UNPACKED_BYTES, MOST_COMPRESSION * path.stat().st_size)
        size = sum(member.file_size for member in members.infolist())
        rule = f"unpack to at most {largest} bytes"
        check(size <= largest, "motion", rule, size, place=str(path))
        file.seek(0)
        with np.load(file, allow_pickle=False) as archive:
            arrays = sorted(archive.files)
            check("samples" in arrays, "motion", "hold an array `samples`", arrays, place=str(path))
            names = archive["individuals"] if "individuals" in arrays else None
            return names, archive["samples"]


def _read_csv(path: Path, signals: Sequence[str] | None) -> tuple[tuple[str, ...], np.ndarray]:
    """Return the names of the individuals and the samples, or recordings, in a table."""
    heading, keys, cells = _read_cells(path)
    columns = heading[len(keys) :]
    # Individuals stand in the order in which they appear.
    names, samples, steps = (list(dict.fromkeys(values)) for values in zip(*cells, strict=True))
    for axis, numbers in (("sample", samples), ("step", steps)):
        for before, after in pairwise(sorted(numbers)):
            rule = f"count each {axis} consecutively"
            check(after == before + 1, "motion", rule, f"{after} after {before}", place=str(path))
    order = list(product(names, sorted(samples), sorted(steps)))
    for name, sample, step in order:
        if (name, sample, step) not in cells:
            rule = "hold the same samples and steps for each individual"
            got = f"no row for individual {name!r}, sample {sample}, step {step}"
            reject("motion", rule, got, place=str(path))
    shape = (len(names), len(samples), len(steps), len(columns))
    motion = np.array([cells[key] for key in order]).reshape(shape)
    if signals is not None:
        rule = f"have the signals of the run, {', '.join(signals)}, in any order"
        same = sorted(columns) == sorted(signals)
        check(same, "motion", rule, ", ".join(columns), "Name its columns so.", place=f"{path}:1")
        motion = motion[..., list(map(columns.index, signals))]
    if "sample" not in keys:
        # Recordings, which are cut later.
        motion = motion[:, 0]
    return tuple(names), motion


def _read_cells(path: Path) -> tuple[list[str], list[str], dict[tuple[str, int, int], list[float]]]:
    """Return heading, key columns, and the signals by individual, sample and step."""

    def require(
        fits: object, rule: str, got: object, line: int | None = None, remedy: str = ""
    ) -> None:
        location = str(path) if line is None else f"{path}:{line}"
        check(fits, "motion", rule, got, remedy, place=location)

    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            # Blank lines are skipped, but for one in the place of the heading.
            rows = []
            for line, row in enumerate(csv.reader(file), start=1):
                if row or line == 1:
                    rows.append((line, row))
    except UnicodeDecodeError as error:
        remedy = "It may be in UTF-16, Latin-1 or another encoding: save it as UTF-8."
        require(False, "be text in UTF-8", f"byte {error.object[error.start]:#04x}", remedy=remedy)
    except csv.Error as error:
        require(False, "be a text file with commas", str(error))
    heading = [name.strip() for name in rows[0][1]] if rows else []
    keys = _key_columns(heading)
    rule = "begin with individual,step or individual,sample,step and the names of signals"
    require(keys and len(heading) > len(keys), rule, repr(",".join(heading)), 1)
    cells: dict[tuple[str, int, int], list[float]] = {}
    for line, row in rows[1:]:
        rule = f"have {len(heading)} entries in each row"
        require(len(row) == len(heading), rule, len(row), line)
        try:
            # A recording is sample 0 of its individual.
            sample = int(row[1]) if "sample" in keys else 0
            step = int(row[len(keys) - 1])
            values = list(map(float, row[len(keys) :]))
        except ValueError:
            require(False, "hold numbers", repr(",".join(row)), line)
        name = row[0].strip()
        again = f"individual {name!r}, sample {sample}, step {step} again"
        require((name, sample, step) not in cells, "hold each step once", again, line)
        cells[name, sample, step] = values
    require(cells, "hold at least one step", "none")
    return heading, keys, cells


def _key_columns(heading: list[str]) -> list[str]:
    """Return the columns before the signals; none if a heading does not begin with them."""
    keys = [name for name in _KEY_COLUMNS if name in heading]
    if heading[: len(keys)] != keys or not {"individual", "step"} <= set(keys):
        return []
    return keys


@dataclass(frozen=True, eq=False)
class RecordedMotion:
    """Windows of the motion of individuals, in order of time."""

    individuals: tuple[str, ...]  #: Names (A,)
    #: A arrays (W, T, D), windows of each individual, without gaps and jumps; W differs, and may be 0
    samples: tuple[np.ndarray, ...]
    #: A arrays (W, 2), when each window begins and ends, from the first frame of the recording (s)
    times: tuple[np.ndarray, ...]
    duration_s: float  #: Of the recording (s)
    #: Where the windows are from; None if that is not known
    recording: Trajectories | None = None
    #: A arrays (W, T, 16), or none, what each does beside the others at the same times, see `company`; none for one alone
    company: tuple[np.ndarray, ...] = ()
