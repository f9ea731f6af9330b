"""Samples of the system: checked, cut to one length, and split."""

import hashlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol, runtime_checkable

import numpy as np

from ._masked import shown, with_gaps

LARGEST = 1e9
"""Largest magnitude of a genuine value."""

SCALE_PERCENTILE = 99.0
SMALLEST_SCALE = 1e-9
"""A signal that varies less is not divided, and held to be constant."""

HELD_OUT = 0.2
"""Share of the samples that is kept for testing, where nothing else is said."""

LiveSource = Callable[[np.random.Generator], Any]


@runtime_checkable
class SplitSamples(Protocol):
    """Samples that are split already, such as the windows of recorded motion: `learning` and `held_out`, each (K, T, D)."""

    learning: np.ndarray
    held_out: np.ndarray


@dataclass(frozen=True, eq=False)
class Genuine:
    """Genuine samples of a system.

    Attributes
    ----------
    samples : (K, T, D)
        All of them, or the first observation of a live source.
    held_out : (H,) int
        Which of them are kept for testing, ascending.
    live
        Where further samples come from, None for data.
    """

    samples: np.ndarray
    held_out: np.ndarray
    live: LiveSource | None = None

    @property
    def learning(self) -> np.ndarray:
        """Samples (K - H, T, D) that may be learned from."""
        return np.delete(self.samples, self.held_out, axis=0)

    @property
    def testing(self) -> np.ndarray:
        """Samples (H, T, D) that are kept for testing."""
        return self.samples[self.held_out]

    @property
    def digest(self) -> str:
        """SHA-256 of shape and values; empty for a live source, whose samples differ from time to time."""
        if self.live is not None:
            return ""
        return hashlib.sha256(str(self.samples.shape).encode() + np.ascontiguousarray(self.samples).data).hexdigest()

    @property
    def constant(self) -> tuple[int, ...]:
        """Which signals, from 0, have the same value at every step of all samples for learning."""
        values = self.learning.reshape(-1, self.samples.shape[2])
        return tuple(np.flatnonzero(np.ptp(values, axis=0) < SMALLEST_SCALE).tolist())

    def scales(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Return what is subtracted from each signal and what it is divided by, from the samples for learning.

        The median, and the 99th percentile of the distance from it, so that nearly all inputs lie within [-1, 1] and
        a few outliers change nothing; 1 for a signal that does not vary.
        """
        values = self.learning.reshape(-1, self.samples.shape[2])
        center = np.median(values, axis=0)
        spread = np.percentile(np.abs(values - center), SCALE_PERCENTILE, axis=0)
        return tuple(center.tolist()), tuple(np.where(spread < SMALLEST_SCALE, 1.0, spread).tolist())


def read_genuine(
    genuine: Any,
    *,
    length: int | Literal["shortest"] | None = None,
    held_out: float | Sequence[int] | None = None,
    rng: np.random.Generator,
) -> Genuine:
    """Check the samples of a system, cut them to one length, and choose those that are kept for testing.

    Parameters
    ----------
    genuine
        Samples (K, T, D), or K arrays (T, D) whose T may differ; or `SplitSamples`; or a live source, a function
        rng -> (K, T, D).
    length
        None refuses samples of different lengths. "shortest" cuts all of them, at the end, to the shortest; a number
        cuts them to that many steps, and refuses shorter ones.
    held_out
        Share of the samples kept for testing, drawn at random, at least 0 and below 1; or which ones, counted from 0.
        Windows that overlap or follow each other are alike: name whole individuals or blocks of time then. None takes a
        fifth at random, of split samples those held out, and none of a live source.
    rng
        Draws the samples that are kept, and feeds a live source.

    Returns
    -------
    Genuine
        Checked.

    Raises
    ------
    ValueError
        If a value is masked, not finite or beyond 1e9, a shape does not fit, or a setting breaks its rule.
    """
    if callable(genuine):
        if held_out is not None:
            raise ValueError(
                f"`held_out` must be left out for a live source, which is observed anew each time; got {held_out!r}."
            )
        return Genuine(cut_samples(genuine(rng), length), np.empty(0, dtype=np.int64), genuine)
    samples = cut_samples(genuine, length)
    if isinstance(genuine, SplitSamples):
        if held_out is not None:
            raise ValueError(f"`held_out` must be left out for samples that are split already; got {held_out!r}.")
        return Genuine(samples, np.arange(len(genuine.learning), len(samples)))
    return Genuine(samples, _kept(HELD_OUT if held_out is None else held_out, len(samples), rng))


def cut_samples(given: Any, length: int | Literal["shortest"] | None) -> np.ndarray:
    """Return samples (K, T, D) as a new array of floats, checked and cut to one length; see `read_genuine`."""
    if not (length is None or length == "shortest" or (type(length) is int and length >= 1)):
        raise ValueError(f'`length` must be an integer of at least 1, "shortest", or None; got {length!r}.')
    if isinstance(given, SplitSamples):
        given = [*given.learning, *given.held_out]
    _refuse_single_series(given)
    series = [given] if np.isscalar(given) or not isinstance(given, Iterable) else list(given)
    arrays = [_as_series(sample, k) for k, sample in enumerate(series)]
    if not arrays:
        raise ValueError("`genuine` must hold at least one sample; got none.")
    steps = _common_steps([len(array) for array in arrays], length)
    widths = {array.shape[1] for array in arrays}
    if len(widths) > 1:
        raise ValueError(f"`genuine` must have the same signals in all samples; got {sorted(widths)} signals.")
    samples = np.stack([array[:steps] for array in arrays])
    _check_values(samples)
    return samples


def _refuse_single_series(given: Any) -> None:
    """Raise ValueError for one table (T, D), whose rows, or column names, would be taken for samples."""
    shape = getattr(given, "shape", ())
    if isinstance(shape, tuple) and len(shape) == 2:
        raise ValueError(
            f"`genuine` must be samples (K, T, D), or a list of K tables (T, D); got one table of shape {shape}. Give "
            "[table] if it is one sample of several signals, table[..., None] if its rows are samples of one signal."
        )


def _as_series(sample: Any, number: int) -> np.ndarray:
    try:
        array = np.asarray(with_gaps(sample))
    except ValueError:  # rows of different lengths
        array = np.empty(0, dtype=object)
    received = f"{type(sample).__name__}" if array.ndim == 0 else f"shape {array.shape} of {array.dtype}"
    if array.dtype.kind == "c":
        raise ValueError(
            f"`genuine` must be samples (K, T, D) of real numbers; got {received} [sample {number}]. Give real and imaginary part "
            "as two signals, or what you want to compare of them, such as the absolute value."
        )
    advice = "Add an axis for a single signal: samples[..., None]." if array.ndim == 1 else "Give arrays of numbers."
    if array.dtype.kind not in "fiu" or array.ndim != 2 or array.size == 0:
        raise ValueError(
            "`genuine` must be samples (K, T, D) of real numbers, time steps T and signals D at least 1; "
            f"got {received} [sample {number}]. {advice}"
        )
    return array.astype(np.float64)


def _common_steps(lengths: list[int], length: int | Literal["shortest"] | None) -> int:
    shortest, longest = int(np.argmin(lengths)), int(np.argmax(lengths))
    if isinstance(length, int):
        if lengths[shortest] < length:
            raise ValueError(
                f"`length` must be at most that of the shortest sample, {lengths[shortest]}; got {length} "
                f"[sample {shortest}]. Remove that sample, or ask for less."
            )
        return length
    if length is None and lengths[shortest] != lengths[longest]:
        raise ValueError(
            f"`genuine` must have samples of one length; got {lengths[shortest]} steps [sample {shortest}] and "
            f'{lengths[longest]} [sample {longest}]. Cut them with length="shortest" or a number of steps.'
        )
    return lengths[shortest]


def _check_values(samples: np.ndarray) -> None:
    fine = np.abs(samples) <= LARGEST  # so that NaN, too, is refused
    if not fine.all():
        k, t, d = (int(place) for place in np.argwhere(~fine)[0])
        raise ValueError(
            f"`genuine` must be finite and at most {LARGEST:g} in size; got {shown(samples[k, t, d])} "
            f"[sample {k}, step {t}, signal {d}]. Cut the gap out, or change the unit."
        )


def _kept(held_out: float | Sequence[int], count: int, rng: np.random.Generator) -> np.ndarray:
    if isinstance(held_out, float | int):
        if not 0 <= held_out < 1:
            raise ValueError(f"`held_out` must be a share of at least 0 and below 1; got {held_out!r}.")
        return np.sort(rng.permutation(count)[: min(round(held_out * count), count - 1)])
    listed = isinstance(held_out, Iterable) and not isinstance(held_out, str)
    numbers: list[Any] = list(held_out) if listed else [held_out]
    rule = f"`held_out` must be a share, or numbers of samples from 0 to {count - 1}, each once, but not all"
    kept: set[int] = set()
    for place, number in enumerate(k.item() if isinstance(k, np.generic) else k for k in numbers):
        if type(number) is not int or not 0 <= number < count:
            raise ValueError(f"{rule}; got {number!r} [place {place}]. Samples are counted from 0.")
        if number in kept:
            raise ValueError(f"{rule}; got {number} again [place {place}]. Leave it out there.")
        kept.add(number)
    if len(kept) == count:
        raise ValueError(f"{rule}; got all {count}. Leave some to learn from.")
    return np.array(sorted(kept), dtype=np.int64)
