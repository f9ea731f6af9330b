"""Genuine samples: checked, cut to one length, and split."""

import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np

from ..errors import brief, is_integer, nearest, refuse, require
from ..swarm import SCENARIOS, Scenario
from ..trajectories import Signals, Trajectories, Windows, join_windows

LARGEST = 1e9
"""Largest magnitude of a genuine value."""

SCALE_PERCENTILE = 99.0
SMALLEST_SCALE = 1e-9
"""A signal that varies less counts as constant, and is not divided."""

HELD_OUT = 0.2
"""Default share of the samples that are held out for testing."""

LiveSource = Callable[[np.random.Generator], Any]


@runtime_checkable
class SplitSamples(Protocol):
    """Samples that are split already, such as the windows of recorded motion: `learning` and `held_out`, each (K, T, D)."""

    learning: np.ndarray
    held_out: np.ndarray


@dataclass(frozen=True, eq=False)
class Genuine:
    """Genuine samples of a system."""

    samples: np.ndarray  #: (K, T, D): All of them, or the first observation of a live source
    held_out: np.ndarray  #: (H,) int: Which of them are held out for testing, ascending
    live: LiveSource | None = None  #: Where further samples come from, None for data
    #: (F, A, 2): Positions in a recording's beginning, see `Windows.excerpt`
    excerpt: np.ndarray | None = None

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
        """SHA-256 of shape and values.

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
        return tuple(np.flatnonzero(np.ptp(values, axis=0) < SMALLEST_SCALE).tolist())

    def scales(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return what is subtracted from each signal and what it is divided by, from the samples for learning.

        The median, and the 99th percentile of the distance from it, so that nearly all inputs lie
        within [-1, 1] and a few outliers change nothing; 1 for a signal that does not vary.
        """
        return scales_of(self.learning.reshape(-1, self.samples.shape[2]))


def scales_of(values: np.ndarray) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the center and the scale of the values (n, D) of each signal, see `Genuine.scales`."""
    center = np.median(values, axis=0)
    spread = np.percentile(np.abs(values - center), SCALE_PERCENTILE, axis=0)
    return tuple(center.tolist()), tuple(np.where(spread < SMALLEST_SCALE, 1.0, spread).tolist())


def read_genuine(
    genuine: Any, *, length: int | Literal["shortest"] | None = None, held_out: float | Sequence[int] | None = None,
    rng: np.random.Generator,
) -> Genuine:  # fmt: skip
    """Check the samples of a system, cut them to one length, and choose those that are held out for testing.

    They are (K, T, D), or K arrays (T, D), or `SplitSamples`, or a live source, a function rng ->
    (K, T, D). For `length` and `held_out` see `CustomOptions`; `rng` draws the samples that are
    held out, and feeds a live source.
    """
    if callable(genuine):
        rule = "be left out for a live source, which is observed anew each time"
        require(held_out is None, "held_out", rule, brief(held_out))
        return Genuine(cut_samples(genuine(rng), length), np.empty(0, dtype=np.int64), genuine)
    samples = cut_samples(genuine, length)
    if isinstance(genuine, SplitSamples):
        rule = "be left out for samples that are split already"
        require(held_out is None, "held_out", rule, brief(held_out))
        excerpt = getattr(genuine, "excerpt", None)
        return Genuine(samples, np.arange(len(genuine.learning), len(samples)), excerpt=excerpt)
    return Genuine(
        samples, _held_out(HELD_OUT if held_out is None else held_out, len(samples), rng)
    )


def cut_samples(given: Any, length: int | Literal["shortest"] | None) -> np.ndarray:
    """Return samples (K, T, D) as a new array of floats, checked and cut to one length.

    See `read_genuine`.
    """
    known = length is None or length == "shortest" or (type(length) is int and length >= 1)
    require(known, "length", 'be an integer of at least 1, "shortest", or None', brief(length))
    if isinstance(given, SplitSamples):
        given = [*given.learning, *given.held_out]
    shape, rule = getattr(given, "shape", ()), "be samples (K, T, D), or a list of K tables (T, D)"
    remedy = "Give [table] if it is one sample of several signals, table[..., None] if its rows are samples of one signal."
    one = isinstance(shape, tuple) and len(shape) == 2
    require(not one, "genuine", rule, f"one table of shape {shape}", remedy)
    arrays = [_as_series(sample, k) for k, sample in enumerate(given)]
    require(arrays, "genuine", "hold at least one sample", "none")
    lengths = [len(array) for array in arrays]
    shortest, longest = int(np.argmin(lengths)), int(np.argmax(lengths))
    steps, place = lengths[shortest], f"sample {shortest}"
    if isinstance(length, int):
        rule = f"be at most that of the shortest sample, {steps}"
        require(
            steps >= length,
            "length",
            rule,
            length,
            "Remove that sample, or ask for less.",
            place=place,
        )
        steps = length
    got = f"{steps} steps [{place}] and {lengths[longest]} [sample {longest}]"
    remedy = 'Cut them with length="shortest" or a number of steps.'
    same = length is not None or steps == lengths[longest]
    require(same, "genuine", "have samples of one length", got, remedy)
    widths = {array.shape[1] for array in arrays}
    require(
        len(widths) == 1,
        "genuine",
        "have the same signals in all samples",
        f"{sorted(widths)} signals",
    )
    samples = np.stack([array[:steps] for array in arrays])
    for k, t, d in np.argwhere(~(np.abs(samples) <= LARGEST))[
        :1
    ].tolist():  # so that NaN, too, is refused
        rule, place = (
            f"be finite and at most {LARGEST:g} in size",
            f"sample {k}, step {t}, signal {d}",
        )
        refuse(
            "genuine",
            rule,
            shown(samples[k, t, d]),
            "Cut the gap out, or change the unit.",
            place=place,
        )
    return samples


def _as_series(sample: Any, number: int) -> np.ndarray:
    """Return a sample as an array (T, D) of floats."""
    try:
        array = np.asarray(with_gaps(sample))
    except ValueError:  # rows of different lengths
        array = np.empty(0, dtype=object)
    got = f"{type(sample).__name__}" if array.ndim == 0 else f"shape {array.shape} of {array.dtype}"
    rule, place = "be samples (K, T, D) of real numbers", f"sample {number}"
    if array.dtype.kind == "c":
        remedy = "Give real and imaginary part as two signals, or what you want to compare of them, such as the absolute value."
        refuse("genuine", rule, got, remedy, place=place)
    if array.dtype.kind not in "fiu" or array.ndim != 2 or array.size == 0:
        one = "Add an axis for a single signal: samples[..., None]."
        remedy = one if array.ndim == 1 else "Give arrays of numbers."
        refuse(
            "genuine", f"{rule}, time steps T and signals D at least 1", got, remedy, place=place
        )
    return array.astype(np.float64)


def _held_out(given: float | Sequence[int], count: int, rng: np.random.Generator) -> np.ndarray:
    """Return which of so many samples are held out, from a share or from their numbers."""
    if isinstance(given, float | int):
        require(0 <= given < 1, "held_out", "be a share of at least 0 and below 1", given)
        return np.sort(rng.permutation(count)[: min(round(given * count), count - 1)])
    rule = f"be a share, or numbers of samples from 0 to {count - 1}, each once, but not all"
    found: set[int] = set()
    for place, number in enumerate(given):
        fits = is_integer(number) and 0 <= number < count
        require(
            fits,
            "held_out",
            rule,
            brief(number),
            "Samples are counted from 0.",
            place=f"place {place}",
        )
        require(
            number not in found,
            "held_out",
            rule,
            f"{number} again",
            "Leave it out there.",
            place=f"place {place}",
        )
        found.add(int(number))
    require(len(found) < count, "held_out", rule, f"all {count}", "Leave some to learn from.")
    return np.array(sorted(found), dtype=np.int64)


def observed(genuine: Any) -> Any:
    """Return genuine samples as they are given, windows of several recordings joined, and of a scenario or its
    name a source of its agents' motion."""
    listed = isinstance(genuine, list | tuple) and len(genuine) > 0
    if listed and all(isinstance(one, Windows) for one in genuine):
        return join_windows(genuine)
    first, rule = genuine[0] if listed else genuine, "be samples, into which a recording is cut"
    remedy = "Give windows of it, for example of 4 s: genuine=recording.windows(length_s=4.0), where recording is what "
    remedy += "`load_trajectories` returned; of several: genuine=pooled_windows(recordings, length_s=4.0)."
    require(
        not isinstance(first, Trajectories | Signals), "genuine", rule, type(first).__name__, remedy
    )
    if isinstance(genuine, str):
        rule, remedy = (
            "be samples, a scenario or the name of one",
            "A file is read with `load_trajectories`.",
        )
        require(
            genuine in SCENARIOS,
            "genuine",
            rule,
            brief(genuine),
            f"{nearest(genuine, SCENARIOS)} {remedy}",
        )
        genuine = SCENARIOS[genuine]
    if not isinstance(genuine, Scenario):
        return genuine
    from ..swarm import ObservedSwarm

    return ObservedSwarm(genuine)


def with_gaps(given: Any) -> Any:
    """Return an array, or a list of arrays, with NaN where it is masked; anything else as it is."""
    if isinstance(given, list | tuple):
        return [with_gaps(one) for one in given]
    if isinstance(given, np.ma.MaskedArray) and np.ma.is_masked(given):
        return np.ma.filled(given.astype(np.result_type(given.dtype, np.float64)), np.nan)
    return given


def shown(value: float) -> str:
    """Return a value that is refused as text; NaN may have been masked."""
    return "nan (or masked)" if math.isnan(value) else str(value)
