"""Genuine samples: checked, cut to one length, and split."""

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np

from ..errors import RefusedError, brief, is_integer, nearest, refuse, refusing_as, require
from ..swarm import SCENARIOS, Scenario
from ..trajectories import Signals, Trajectories, Windows, join_windows, origin_of
from ._per_model import column_names, table_values

LARGEST_VALUE = 1e9
"""Largest magnitude of a genuine value."""

SCALE_PERCENTILE = 99.0
"""Of the distances from the median: what a signal is divided by."""
SMALLEST_SCALE = 1e-13
"""A signal that varies less counts as constant, and is not divided: computing leaves as much of numbers of size 1."""
PRECISION = 1e-9
"""A signal counts as constant, too, if it varies by less than this share of its largest magnitude, or by less than
this where that is above 1. Signals of recordings are held to this alone: turns of straight paths are differences of
large numbers."""

HELD_OUT = 0.2
"""Default share of the samples that are held out for testing."""

LEAST_INDIVIDUALS = 5
"""With fewer individuals, those of each are divided by blocks of time, too; with so many recordings, each is one group."""

LiveSource = Callable[[np.random.Generator], Any]


@runtime_checkable
class SplitSamples(Protocol):
    """Samples that are split already, such as the windows of recorded motion: `learning` and `held_out`, each (K, T, D)."""

    learning: np.ndarray
    held_out: np.ndarray


@dataclass(frozen=True, eq=False)
class Genuine:
    """Genuine samples of a system."""

    #: (K, T, D): All of them, or the first observation of a live source
    samples: np.ndarray
    #: (H,) int: Which of them are held out for testing, ascending
    held_out: np.ndarray
    #: Where further samples come from, None for data
    live: LiveSource | None = None
    #: (F, A, 2): Positions in a recording's beginning, see `Windows.excerpt`
    excerpt: np.ndarray | None = None
    names: tuple[str, ...] = ()  #: Of the columns that they were read from; empty of arrays
    origin: str = ""  #: Of windows: SHA-256 of what they were computed from, see `origin_of`
    #: (H,): Which held-out samples belong together; None: each stands alone
    groups: np.ndarray | None = None
    grouping: str = "samples"  #: What such a group is, in a word

    @property
    def learning(self) -> np.ndarray:
        """Samples (K - H, T, D) that may be learned from."""
        return np.delete(self.samples, self.held_out, axis=0)

    @property
    def testing(self) -> np.ndarray:
        """Samples (H, T, D) that are held out for testing."""
        return self.samples[self.held_out]

    @property
    def digest(self) -> str:
        """SHA-256 of shape and values, to the last digit.

        Empty for a live source, whose samples differ from time to time.
        """
        if self.live is not None:
            return ""
        return hashlib.sha256(
            str(self.samples.shape).encode() + np.ascontiguousarray(self.samples).data
        ).hexdigest()

    @property
    def constant(self) -> tuple[int, ...]:
        """Which signals, from 0, have the same value at every step of all samples for learning."""
        values = self.learning.reshape(-1, self.samples.shape[2])
        limits = constant_below(values, recorded=bool(self.origin))
        return tuple(np.flatnonzero(np.ptp(values, axis=0) < limits).tolist())

    def scales(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return what is subtracted from each signal and what it is divided by, from the samples for learning.

        The median, and the 99th percentile of the distance from it, so that nearly all inputs lie
        within [-1, 1] and a few outliers change nothing; 1 for a signal that does not vary.
        """
        return scales_of(
            self.learning.reshape(-1, self.samples.shape[2]), recorded=bool(self.origin)
        )


def scales_of(values: np.ndarray, *, recorded: bool) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the center and the scale of the values (n, D) of each signal, see `Genuine.scales`."""
    center = np.median(values, axis=0)
    scale = np.percentile(np.abs(values - center), SCALE_PERCENTILE, axis=0)
    scale = np.where(scale < constant_below(values, recorded=recorded), 1.0, scale)
    return tuple(center.tolist()), tuple(scale.tolist())


def constant_below(values: np.ndarray, *, recorded: bool) -> np.ndarray:
    """Return the variation (D,) below which each signal counts as constant, given its values (n, D)."""
    largest = np.abs(values).max(axis=0)
    if recorded:
        return np.full(len(largest), PRECISION)
    return np.maximum(PRECISION * np.minimum(largest, 1.0), SMALLEST_SCALE)


def read_genuine(
    genuine: Any,
    *,
    length: int | Literal["shortest"] | None = None,
    held_out: float | Sequence[int] | None = None,
    columns: Sequence[str] = (),
    rng: np.random.Generator,
) -> Genuine:
    """Check the samples of a system, cut them to one length, and choose those that are held out for testing.

    They are (K, T, D), or K arrays (T, D) or tables, or `SplitSamples`, or a live source, a function
    rng -> (K, T, D). `columns` are those of tables, all of the first one by default, also of a live source. For `length` and
    `held_out` see `CustomOptions`; `rng` draws the samples that are held out, and feeds a live source.
    """
    if callable(genuine):
        rule = "be left out for a live source, which is observed anew each time"
        require(held_out is None, "held_out", rule, brief(held_out))
        observation = genuine(rng)
        names = tuple(columns) or names_of(observation)
        samples = cut_samples(observation, length, names)
        return Genuine(samples, np.empty(0, dtype=np.int64), genuine, names=names)
    names = names_of(genuine, columns)
    samples = cut_samples(genuine, length, names)
    if isinstance(genuine, SplitSamples):
        rule = "be left out for samples that are split already"
        require(held_out is None, "held_out", rule, brief(held_out))
        split = np.arange(len(genuine.learning), len(samples))
        data = recorded_samples(genuine, samples, split)
        if isinstance(genuine, Windows):
            data = replace(data, origin=origin_of(genuine))
        return data
    if held_out is None:
        held_out = HELD_OUT
    return Genuine(samples, _held_out(held_out, len(samples), rng), names=names)


def recorded_samples(
    genuine: Any, samples: np.ndarray, held_out: np.ndarray, names: tuple[str, ...] = ()
) -> Genuine:
    """Return samples (K, T, D) with what windows, if `genuine` are such, know of a recording."""
    groups, grouping = held_out_groups(genuine)
    excerpt = getattr(genuine, "excerpt", None)
    return Genuine(
        samples, held_out, excerpt=excerpt, names=names, groups=groups, grouping=grouping
    )


def held_out_groups(genuine: Any) -> tuple[np.ndarray | None, str]:
    """Return which held-out samples belong together, by labels (H,), and what such a group is.

    Windows of recorded motion know it. Of other samples each stands alone: None.
    """
    index = getattr(genuine, "held_out_index", None)
    if index is None or not len(index):
        return None, "samples"
    recordings = np.asarray(getattr(genuine, "held_out_recording", ()))
    if len(np.unique(recordings)) >= LEAST_INDIVIDUALS:
        return recordings, "recordings"
    # Individuals that nobody has learned from are independent even if they are few.
    individuals = index[:, 0]
    apart = not np.isin(individuals, genuine.learning_index[:, 0]).any()
    if apart or len(np.unique(individuals)) >= LEAST_INDIVIDUALS:
        return individuals, "individuals"
    blocks = np.searchsorted([begin for begin, _, _ in genuine.blocks], index[:, 1], side="right")
    pairs = np.stack((individuals, blocks), axis=1)
    return np.unique(pairs, axis=0, return_inverse=True)[1].ravel(), "individuals in blocks of time"


def names_of(samples: Any, columns: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the columns of samples that are tables: those asked for, or all of the first; none of arrays."""
    if isinstance(samples, list | tuple) and len(samples) > 0:
        names = column_names(samples[0])
        if names:
            return tuple(columns) or names
    return ()


def unnamed(count: int) -> tuple[str, ...]:
    """Return names of D signals that have none: signal0, signal1, ..."""
    return tuple(f"signal{d}" for d in range(count))


def table_names(signals: Sequence[str]) -> tuple[str, ...]:
    """Return the columns by which tables of these signals are read; none of signals without names."""
    if tuple(signals) == unnamed(len(signals)):
        return ()
    return tuple(signals)


def cut_samples(
    samples: Any, length: int | Literal["shortest"] | None, names: tuple[str, ...] = ()
) -> np.ndarray:
    """Return samples (K, T, D) as a new array of floats, checked and cut to one length.

    See `read_genuine`; tables are read by the names of their columns.
    """
    fits = length is None or length == "shortest" or (type(length) is int and length >= 1)
    require(fits, "length", 'be an integer of at least 1, "shortest", or None', brief(length))
    if isinstance(samples, SplitSamples):
        samples = [*samples.learning, *samples.held_out]
    shape = getattr(samples, "shape", ())
    is_table = isinstance(shape, tuple) and len(shape) == 2
    rule = "be samples (K, T, D), or a list of K tables (T, D)"
    remedy = "Give [table] if it is one sample of several signals, table[..., None] if its rows are samples of one signal."
    require(not is_table, "genuine", rule, f"one table of shape {shape}", remedy)
    series = [_as_series(sample, k, names) for k, sample in enumerate(samples)]
    require(series, "genuine", "hold at least one sample", "none")
    steps = _common_length(list(map(len, series)), length)
    widths = {values.shape[1] for values in series}
    rule = "have the same signals in all samples"
    require(len(widths) == 1, "genuine", rule, f"{sorted(widths)} signals")
    cut = np.stack([values[:steps] for values in series])
    # Not "> LARGEST_VALUE", so that NaN, too, is refused.
    for k, t, d in np.argwhere(~(np.abs(cut) <= LARGEST_VALUE))[:1].tolist():
        rule = f"be finite and at most {LARGEST_VALUE:g} in size"
        remedy = "Cut the gap out, or change the unit."
        where = f"sample {k}, step {t}, signal {d}"
        refuse("genuine", rule, value_text(cut[k, t, d]), remedy, place=where)
    return cut


def _common_length(lengths: Sequence[int], length: int | Literal["shortest"] | None) -> int:
    """Return the number of steps to which samples of these lengths are cut."""
    shortest = int(np.argmin(lengths))
    longest = int(np.argmax(lengths))
    steps = lengths[shortest]
    where = f"sample {shortest}"
    if isinstance(length, int):
        rule = f"be at most that of the shortest sample, {steps}"
        remedy = "Remove that sample, or ask for less."
        require(steps >= length, "length", rule, length, remedy, place=where)
        return length
    fits = length is not None or steps == lengths[longest]
    got = f"{steps} steps [{where}] and {lengths[longest]} [sample {longest}]"
    remedy = 'Cut them with length="shortest" or a number of steps.'
    require(fits, "genuine", "have samples of one length", got, remedy)
    return steps


def _as_series(sample: Any, number: int, names: tuple[str, ...]) -> np.ndarray:
    """Return a sample as an array (T, D) of floats."""
    if column_names(sample):
        with refusing_as(RefusedError, name="genuine", place=f"sample {number}"):
            sample = table_values(sample, names)
    try:
        values = np.asarray(with_gaps(sample))
    except ValueError:
        # Rows of different lengths
        values = np.empty(0, dtype=object)
    where = f"sample {number}"
    rule = "be samples (K, T, D) of real numbers"
    if values.ndim:
        got = f"shape {values.shape} of {values.dtype}"
    else:
        got = type(sample).__name__
    if values.dtype.kind == "c":
        remedy = "Give real and imaginary part as two signals, or what you want to compare of them, such as the absolute value."
        refuse("genuine", rule, got, remedy, place=where)
    if values.dtype.kind not in "fiu" or values.ndim != 2 or values.size == 0:
        rule += ", time steps T and signals D at least 1"
        remedy = "Give arrays of numbers."
        if values.ndim == 1:
            remedy = "Add an axis for a single signal: samples[..., None]."
        refuse("genuine", rule, got, remedy, place=where)
    return values.astype(np.float64)


def _held_out(selection: float | Sequence[int], count: int, rng: np.random.Generator) -> np.ndarray:
    """Return which of so many samples are held out, from a share or from their numbers."""
    if isinstance(selection, float | int):
        fits = 0 <= selection < 1
        require(fits, "held_out", "be a share of at least 0 and below 1", selection)
        number = min(round(selection * count), count - 1)
        return np.sort(rng.permutation(count)[:number])
    rule = f"be a share, or numbers of samples from 0 to {count - 1}, each once, but not all"
    chosen: set[int] = set()
    for k, number in enumerate(selection):
        where = f"place {k}"
        fits = is_integer(number) and 0 <= number < count
        remedy = "Samples are counted from 0."
        require(fits, "held_out", rule, brief(number), remedy, place=where)
        fits = number not in chosen
        require(fits, "held_out", rule, f"{number} again", "Leave it out there.", place=where)
        chosen.add(int(number))
    require(len(chosen) < count, "held_out", rule, f"all {count}", "Leave some to learn from.")
    return np.array(sorted(chosen), dtype=np.int64)


def observed(genuine: Any) -> Any:
    """Return genuine samples as they are given.

    Windows of several recordings are joined; a scenario or its name becomes a source of its agents'
    motion.
    """
    sample = genuine
    if isinstance(genuine, list | tuple) and len(genuine) > 0:
        if all(isinstance(windows, Windows) for windows in genuine):
            return join_windows(genuine)
        sample = genuine[0]
    rule = "be samples, into which a recording is cut"
    remedy = "Give windows of it, for example of 4 s: genuine=recording.windows(length_s=4.0), where recording is what "
    remedy += "`load_trajectories` returned; of several: genuine=pooled_windows(recordings, length_s=4.0)."
    fits = not isinstance(sample, Trajectories | Signals)
    require(fits, "genuine", rule, type(sample).__name__, remedy)
    if isinstance(genuine, str):
        rule = "be samples, a scenario or the name of one"
        remedy = f"{nearest(genuine, SCENARIOS)} A file is read with `load_trajectories`."
        require(genuine in SCENARIOS, "genuine", rule, brief(genuine), remedy)
        genuine = SCENARIOS[genuine]
    if not isinstance(genuine, Scenario):
        return genuine
    from ..swarm import ObservedSwarm

    return ObservedSwarm(genuine)


def with_gaps(values: Any) -> Any:
    """Return an array, or a list of arrays, with NaN where it is masked; anything else as it is."""
    if isinstance(values, list | tuple):
        return list(map(with_gaps, values))
    if isinstance(values, np.ma.MaskedArray) and np.ma.is_masked(values):
        return np.ma.filled(values.astype(np.result_type(values.dtype, np.float64)), np.nan)
    return values


def value_text(value: float) -> str:
    """Return a value that is refused as text; NaN may have been masked."""
    if math.isnan(value):
        return "nan (or masked)"
    return str(value)
