"""Motion of named individuals: samples, the files they come from, windows of recordings, and what individuals do beside others."""

import csv
import zipfile
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from turing_learning.arrays import array
from turing_learning.config import ConfigurationError
from turing_learning.config._sections import check, reject
from turing_learning.trajectories import Trajectories
from turing_learning.trajectories._signals import filled, smooth, wrap

SUFFIXES = (".npy", ".npz", ".csv")
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
    check(suffix in SUFFIXES, "motion", f"be a file that ends with one of {', '.join(SUFFIXES)}", str(path))
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
    #: A arrays (W, T, 14), or none, what each does beside the others at the same times; none for one alone
    company: tuple[np.ndarray, ...] = ()


LAGS_S = (0.3, 6.0)
STRETCH_S = 30.0
"""In each stretch of about this length an individual may follow somebody else, at another distance in time."""
SIZES = [1, 2, 3, 5]
"""Of what an individual does: turn, acceleration, distances of the nearest other and of the middle of all others."""


def paths_of(recording: Trajectories, smooth_frames: int = 1) -> np.ndarray:
    """Return positions (F, A, 2) with all gaps filled by straight motion."""
    paths = filled(recording.positions, recording.present)
    return paths if smooth_frames == 1 else smooth(paths, np.ones(paths.shape[:2], dtype=bool), smooth_frames)


class Usual(NamedTuple):
    """How all individuals of a recording turn, speed up and keep their distances at the same times."""

    least: np.ndarray  # (4,), added before the logarithm is taken, a hundredth of the medians
    sizes: np.ndarray  # (F - 1, 4), medians over individuals of the logarithms


def usual_motion(paths: np.ndarray, fps: float) -> Usual:
    """Return what is usual in a recording whose paths (F, A, 2) are in cm and without gaps."""
    return _usual([_beside(paths, k, fps) for k in range(paths.shape[1])])


def company(paths: np.ndarray, whose: Sequence[int], fps: float, usual: Usual | None = None) -> list[np.ndarray]:
    """Return what some of two or more individuals do at each step, own motion and others beside it (F - 1, 14).

    Speed, turn, and acceleration, and how many times as large as usual the last two are, as a logarithm; distance and
    bearing of the nearest other; distance of the middle of all others, and whether it is ahead (the cosine); distances
    from the border and from the middle of the space that all move in; how much its velocity is what that of another
    was some time ago (the share of their correlation); and how many times as large as usual both distances of others
    are. What is usual is by default the median of all at the same time. Paths (F, A, 2) are in cm and without gaps.
    """
    moved = {k: _beside(paths, k, fps) for k in (whose if usual else range(paths.shape[1]))}
    least, sizes = usual or _usual(list(moved.values()))
    velocities, found = np.diff(paths, axis=0) * fps, []
    for k in whose:
        followed = _following(velocities[:, k], np.delete(velocities, k, axis=1), fps)
        logs = _logarithms(moved[k], least) - sizes
        found.append(np.column_stack((moved[k][:, :3], logs[:, :2], moved[k][:, 3:], followed, logs[:, 2:])))
    return found


def _beside(paths: np.ndarray, k: int, fps: float) -> np.ndarray:
    """Return the first nine of what `company` tells of an individual (F - 1, 9)."""
    places, velocities = paths[:-1], np.diff(paths, axis=0) * fps
    steps, others = np.arange(len(places)), np.delete(np.arange(paths.shape[1]), k)
    own = velocities[:, k]
    speed = np.hypot(own[:, 0], own[:, 1])
    moving = np.maximum.accumulate(np.where(speed > 1e-9, steps, 0))  # who rests keeps its direction
    course = np.arctan2(own[moving, 1], own[moving, 0])
    way = places[:, others] - places[:, k, None]
    distances = np.hypot(way[..., 0], way[..., 1])
    nearest = distances.argmin(axis=1)
    to, middle = way[steps, nearest], way.mean(axis=1)
    ahead = np.cos(np.arctan2(middle[:, 1], middle[:, 0]) - course)
    low, high = paths.min(axis=(0, 1)), paths.max(axis=(0, 1))
    columns = (
        speed,
        wrap(np.diff(course, prepend=course[0])) * fps,
        np.diff(speed, prepend=speed[0]) * fps,
        distances[steps, nearest],
        wrap(np.arctan2(to[:, 1], to[:, 0]) - course),
        np.hypot(middle[:, 0], middle[:, 1]),
        ahead,
        np.minimum(places[:, k] - low, high - places[:, k]).min(axis=1),
        np.hypot(*(places[:, k] - (low + high) / 2).T),
    )
    return np.stack(columns, axis=1)


def _usual(moved: Sequence[np.ndarray]) -> Usual:
    sizes = np.abs(np.stack(moved)[..., SIZES])
    least = 0.01 * np.median(sizes, axis=(0, 1)) + 1e-9
    return Usual(least, np.median([_logarithms(each, least) for each in moved], axis=0))


def _logarithms(moved: np.ndarray, least: np.ndarray) -> np.ndarray:
    """Return the logarithms of turn, acceleration and two distances (F - 1, 4)."""
    return np.log(np.abs(moved[:, SIZES]) + least)


def _following(own: np.ndarray, others: np.ndarray, fps: float) -> np.ndarray:
    """Return the parts (F,) whose mean is the highest correlation of a velocity (F, 2) with earlier ones of others (F, B, 2)."""
    found, least, most = np.zeros(len(own)), max(1, int(LAGS_S[0] * fps)), int(LAGS_S[1] * fps)
    for stretch in np.array_split(np.arange(len(own)), max(1, round(len(own) / (STRETCH_S * fps)))):
        begin, count = int(stretch[0]), len(stretch)
        early = max(0, begin - most)
        mine, theirs = own[stretch], others[early : begin + count]
        lags = np.arange(least, min(most, begin - early + count // 2) + 1)
        if not len(lags):
            continue
        size = 1 << (count + len(theirs) - 1).bit_length()
        spectrum = np.conj(np.fft.rfft(mine, size, axis=0))[:, None] * np.fft.rfft(theirs, size, axis=0)
        first = begin - early - lags  # in `theirs`; below 0 before the recording
        shared = np.fft.irfft(spectrum.sum(axis=2), size, axis=0)[first]
        sums = np.cumsum(np.concatenate((np.zeros((1, theirs.shape[1])), (theirs**2).sum(axis=2))), axis=0)
        scale = np.sqrt((mine**2).sum() * (sums[first + count] - sums[np.maximum(first, 0)])) + 1e-12
        lag, who = np.unravel_index((shared / scale).argmax(), shared.shape)
        back = first[lag] + np.arange(count)
        before = np.where((back >= 0)[:, None], theirs[np.maximum(back, 0), who], 0.0)
        found[stretch] = count * (mine * before).sum(axis=1) / scale[lag, who]
    return found
