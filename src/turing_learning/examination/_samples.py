"""Recordings to samples, and which of these belong together."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from math import comb

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from turing_learning.analysis import polarization
from turing_learning.errors import RefusedError, nearest, refuse, refusing_as, require
from turing_learning.trajectories import SIGNALS, Trajectories, Windows

OF_GROUPS = {"polarization": "", "area": "cm2"}
"""Signals of all individuals at a time, beside those of `trajectories.SIGNALS`, and their units."""

WINDOW_S = 5.0
"""Length of a sample (s), by default; shorter where individuals are not there for three times as long."""

FEWEST_STEPS = 8
"""Steps of a sample, at least, by default."""

MOST_SAMPLES = 600
"""Samples of each side; of more some are drawn, as many of each group as possible."""

FEWEST_ARRANGEMENTS = 30
"""Ways to divide groups into two sides, at least, where there are smaller groups, too: a p-value can be below 0.04."""

BLOCKS = 10
"""Blocks of time into which a recording is cut where its individuals are too few to be groups."""

OWN_SIGNALS_REMARK = (
    "Signals of neighbors are left out, as in some recording nobody has company for a whole sample."
)
"""What to know where only speed and turn are seen of recordings that hold several individuals."""

MOSTLY = 0.5
"""Share of the windows with company in which a signal of the group has to be there, to be taken by default."""

FEWEST_COUNTED = 3
"""Individuals of which an area can be said."""


@dataclass(frozen=True, eq=False)
class Side:
    """Samples of some recordings, and where each is from."""

    samples: np.ndarray  #: (K, T, D)
    recording: np.ndarray  #: (K,), number of the recording
    individual: np.ndarray  #: (K,), number of the individual in it
    start: np.ndarray  #: (K,), first step
    block: np.ndarray  #: (K,), number of the block of time in its recording
    paths: np.ndarray | None = None  #: (K, T + 1, 2), positions; None for arrays

    def taken(self, rows: np.ndarray) -> "Side":
        """Return some of the samples."""
        taken = {name: array[rows] for name, array in vars(self).items() if array is not None}
        return Side(**taken)

    def owners(self, grouping: str) -> np.ndarray:
        """Return labels (K,) of the groups: "recordings", "individuals" or "blocks of time"."""
        if grouping == "recordings":
            return self.recording
        unit = self.individual if grouping == "individuals" else self.block
        return self.recording * (1 + int(unit.max())) + unit


@dataclass(frozen=True, eq=False)
class Pair:
    """Samples of both sides, in the same signals."""

    real: Side
    simulated: Side
    names: tuple[str, ...]  #: Of the signals (D,)
    units: dict[str, str]  #: Name -> unit
    interval_s: float  #: Duration of a step (s)
    #: What was done on the way here, in sentences
    remarks: tuple[str, ...] = field(default=())

    @property
    def groupings(self) -> list[str]:
        """Return what may be a group, the largest first: several where it is not known which are alike."""
        choices = []
        for grouping in ("recordings", "individuals", "blocks of time"):
            counts = [len(np.unique(side.owners(grouping))) for side in (self.real, self.simulated)]
            if min(counts) < 2:
                continue
            enough = _enough(*counts)
            if enough and grouping == "recordings":
                return [grouping]
            # individuals share signals of their group: each would be a copy of the others
            shared = grouping == "individuals" and not OF_GROUPS.keys().isdisjoint(self.names)
            if enough and not shared:
                choices.append(grouping)
        return choices or ["blocks of time"]


def pair_of(
    real: Sequence[Trajectories], simulated: Sequence[Trajectories], *, names: Sequence[str] | None,
    window_s: float | None, smooth_frames: int, seed: int,
) -> Pair:  # fmt: skip
    """Cut both sides into samples of the same length, in the same signals."""
    remarks: list[str] = []
    sides = [list(real), list(simulated)]
    every = [*real, *simulated]
    units = sorted({recording.unit for recording in every})
    remedy = "Give the scale of those in px, or of none."
    require(len(units) == 1, "unit", "be the same for all recordings", " and ".join(units), remedy)
    if any(recording.headings is None for recording in every):
        # headings of some alone would tell the sides apart
        for side in sides:
            side[:] = [replace(recording, headings=None) for recording in side]
    sides = [same_rate(side, every, remarks) for side in sides]
    every = [*sides[0], *sides[1]]
    steps = _steps(every, window_s)
    if names is None:
        names = _all_names(every, steps, remarks, of_groups=_enough(len(real), len(simulated)))
    else:
        names = _names(names, every)
    fps = every[0].fps
    remarks.append(f"Samples are windows of {steps} steps ({steps / fps:.3g} s).")
    rng = np.random.default_rng((seed, 2))
    cut = []
    for argument, side in zip(("real", "simulated"), sides, strict=True):
        sides_cut = []
        with refusing_as(RefusedError, name=argument):
            for k, recording in enumerate(side):
                sides_cut.append(_cut(recording, k, names, steps, smooth_frames))
        cut.append(_limited(_joined(sides_cut), rng))
    units_of_signals = {}
    for name in names:
        units_of_signals[name] = (SIGNALS | OF_GROUPS)[name].replace("cm", units[0])
    return Pair(cut[0], cut[1], names, units_of_signals, 1 / fps, tuple(remarks))


def pair_of_arrays(
    real: np.ndarray,
    simulated: np.ndarray,
    groups: tuple[np.ndarray, np.ndarray] | None,
    names: Sequence[str],
    seed: int,
) -> tuple[Pair, tuple[np.ndarray, np.ndarray]]:
    """Return samples (K, T, D) and (L, T, D) as a pair, and the labels of their groups."""
    rng = np.random.default_rng((seed, 2))
    sides = []
    owners = []
    for k, samples in enumerate((real, simulated)):
        if groups is None:
            labels = np.arange(len(samples))
        else:
            labels = np.unique(groups[k], return_inverse=True)[1].ravel()
        where = np.zeros(len(samples), dtype=int)
        side = _limited(Side(samples, labels, where, np.arange(len(samples)), where), rng)
        sides.append(side)
        owners.append(side.recording)
    return Pair(sides[0], sides[1], tuple(names), {}, 0.0), (owners[0], owners[1])


def same_rate(
    side: list[Trajectories], every: Sequence[Trajectories], remarks: list[str]
) -> list[Trajectories]:
    """Return recordings at the lowest rate of all; one that is not a whole multiple of it is rejected."""
    lowest = min(recording.fps for recording in every)
    thinned = []
    for recording in side:
        times = recording.fps / lowest
        # stated rates are rounded: 29.97 and 30 per second are one rate
        fits = abs(times - round(times)) < 0.01 * times
        remedy = "Bring all to one frame rate: speeds and turns of another have other noise."
        rule = f"be a whole multiple of the lowest rate, {lowest:g} per second"
        require(fits, "fps", rule, f"{recording.fps:g}", remedy, place=recording.source)
        if round(times) > 1:
            remarks.append(
                f"{recording.source or 'A recording'}: one frame in {round(times)} is used, as the others have."
            )
            recording = replace(recording.thinned(round(times)), fps=lowest)
        thinned.append(replace(recording, fps=lowest))
    return thinned


def _enough(real: int, simulated: int) -> bool:
    """Return whether so many groups of both sides can be exchanged in enough ways."""
    divisions = comb(real + simulated, real)
    if real == simulated:
        # each division comes twice, with the sides exchanged
        divisions //= 2
    return divisions >= FEWEST_ARRANGEMENTS


def _all_names(
    every: Sequence[Trajectories], steps: int, remarks: list[str], *, of_groups: bool
) -> tuple[str, ...]:
    """Return all signals that every recording has.

    Signals of the whole group are among them only where recordings are groups: all individuals of a recording share them, so
    they would tell any recording from any other. They are left out where they would leave out most windows.
    """
    if not all(_has_company(recording, steps) for recording in every):
        if any(recording.present.sum(axis=1).max() >= 2 for recording in every):
            remarks.append(OWN_SIGNALS_REMARK)
        return "speed", "turn"
    names = list(SIGNALS)
    for name in OF_GROUPS:
        if not of_groups:
            break
        if all(_mostly_there(recording, name, steps) for recording in every):
            names.append(name)
        else:
            remarks.append(f"{name} is left out, as in some recording it is seldom there.")
    return tuple(names)


def _with_company(recording: Trajectories) -> np.ndarray:
    """Return who (F - 1, A) is there in a step, from one frame to the next, beside another individual."""
    present = recording.present[1:] & recording.present[:-1]
    return present & (present.sum(axis=1) >= 2)[:, None]


def _has_company(recording: Trajectories, steps: int) -> bool:
    """Return whether somebody has company in each of so many steps on end."""
    company = _with_company(recording)
    if len(company) < steps:
        return False
    return bool(sliding_window_view(company, steps, axis=0).all(axis=2).any())


def _mostly_there(recording: Trajectories, name: str, steps: int) -> bool:
    """Return whether a signal of the group is there in most windows of so many steps in which anybody has company."""
    company = _with_company(recording).any(axis=1)
    complete = company & np.isfinite(_of_group(recording, name))
    counts = []
    for flags in (complete, company):
        counts.append(np.count_nonzero(sliding_window_view(flags, steps).all(axis=1)))
    return bool(counts[0] >= max(1, MOSTLY * counts[1]))


def _names(names: Sequence[str], every: Sequence[Trajectories]) -> tuple[str, ...]:
    """Return the signals that are asked for."""
    allowed = (*SIGNALS, *OF_GROUPS)
    fewest = min(recording.present.sum(axis=1).max() for recording in every)
    for name in names:
        rule = f"be some of {', '.join(allowed)}"
        require(name in allowed, "signals", rule, repr(name), nearest(name, allowed))
    alone = [name for name in names if name not in ("speed", "turn")]
    rule = "be speed and turn of one individual"
    require(fewest >= 2 or not alone, "signals", rule, ", ".join(alone))
    return tuple(names)


def _steps(every: Sequence[Trajectories], window_s: float | None) -> int:
    fps = every[0].fps
    if window_s is not None:
        steps = round(window_s * fps)
        require(steps >= 2, "window_s", f"be at least two steps of {1 / fps:.4g} s", window_s)
        return steps
    durations = [float(np.median(recording.present.sum(axis=0))) / fps for recording in every]
    length = min(WINDOW_S, min(durations) / 3)
    return max(FEWEST_STEPS, round(length * fps))


def _cut(
    recording: Trajectories, number: int, names: tuple[str, ...], steps: int, smooth_frames: int
) -> Side:
    individual_names = [name for name in names if name in SIGNALS]
    windows = recording.windows(
        steps, signals=individual_names or ["speed"], hold_out=0.0, smooth_frames=smooth_frames
    )
    who, start = windows.learning_index.T
    rows = start[:, None] + np.arange(steps)
    columns = {name: windows.learning[..., k] for k, name in enumerate(individual_names)}
    # Quantities of the whole group are the same for everybody at a moment
    for name in names:
        if name in OF_GROUPS:
            columns[name] = _of_group(recording, name)[rows]
    samples = np.stack([columns[name] for name in names], axis=-1)
    # A distance to the nearest, for example, is not there where somebody is alone
    complete = np.isfinite(samples).all(axis=(1, 2))
    rule = "be there in at least one window"
    require(complete.any(), "signals", rule, ", ".join(names), place=recording.source)
    frames = start[:, None] + np.arange(steps + 1)
    # Blocks are longer than windows, so that most windows lie in one block
    length = max(2 * steps, -(-len(recording.positions) // BLOCKS))
    side = Side(
        samples=samples,
        recording=np.full(len(samples), number),
        individual=who,
        start=start,
        block=start // length,
        paths=recording.positions[frames, who[:, None]],
    )
    return side.taken(np.flatnonzero(complete))


def _of_group(recording: Trajectories, name: str) -> np.ndarray:
    """Return a signal (F - 1,) of all individuals at each step, NaN where too few are there."""
    consecutive = recording.present[1:] & recording.present[:-1]
    values = np.full(len(consecutive), np.nan)
    if name == "polarization":
        moved = np.diff(recording.positions, axis=0)
        directed = (consecutive & (moved != 0).any(axis=-1)).sum(axis=1) >= 2
        values[directed] = polarization(moved[directed], consecutive[directed])
        return values
    count = consecutive.sum(axis=1)
    enough = count >= FEWEST_COUNTED
    weights = consecutive[enough].astype(float) / count[enough, None]
    positions = recording.positions[:-1][enough]
    around = positions - np.einsum("fa,fax->fx", weights, positions)[:, None]
    covariance = np.einsum("fa,fax,fay->fxy", weights, around, around)
    # the ellipse whose axes are twice the standard deviations, as long as those of a disk of evenly spread points
    values[enough] = 4 * np.pi * np.sqrt(np.maximum(np.linalg.det(covariance), 0.0))
    return values


def _joined(sides: Sequence[Side]) -> Side:
    arrays = {}
    for name in vars(sides[0]):
        arrays[name] = np.concatenate([getattr(side, name) for side in sides])
    return Side(**arrays)


def _limited(side: Side, rng: np.random.Generator) -> Side:
    """Return at most `MOST_SAMPLES` samples, drawn evenly from the individuals of each recording."""
    return side.taken(_some(side, rng))


def _some(side: Side, rng: np.random.Generator) -> np.ndarray:
    """Return the rows of `_limited`."""
    count = len(side.samples)
    if count <= MOST_SAMPLES:
        return np.arange(count)
    owners = np.unique(side.owners("individuals"), return_inverse=True)[1].ravel()
    shuffled = rng.permutation(count)
    order = np.argsort(owners[shuffled], kind="stable")
    begins = np.searchsorted(owners[shuffled][order], np.arange(owners.max() + 1))
    # the rank of each sample within its individual, in a random order
    rank = np.empty(count, dtype=int)
    rank[shuffled[order]] = np.arange(count) - begins[owners[shuffled][order]]
    chosen = np.lexsort((rng.random(count), rank))[:MOST_SAMPLES]
    return np.sort(chosen)


def pair_of_windows(windows: Windows, simulated: np.ndarray, seed: int) -> Pair:
    """Return held-out windows and as many simulated samples (K, T, D), which are grouped as the windows are."""
    steps = windows.held_out.shape[1]
    recording = windows.held_out_recording
    who, start = windows.held_out_index.T
    # frames that are held out, counted without those between them
    block = np.empty(len(start), dtype=int)
    begin = 0
    for number, present in enumerate(windows.frames("held out")):
        frames = np.asarray(present.any(axis=1))
        of_recording = recording == number
        length = max(2 * steps, -(-int(frames.sum()) // BLOCKS))
        block[of_recording] = np.cumsum(frames)[start[of_recording] - begin] // length
        begin += len(frames)
    real = Side(
        samples=windows.held_out,
        recording=recording,
        individual=who,
        start=start,
        block=block,
        paths=paths_of(windows.held_out, windows.names, windows.interval_s),
    )
    other = replace(
        real, samples=simulated, paths=paths_of(simulated, windows.names, windows.interval_s)
    )
    rows = _some(real, np.random.default_rng((seed, 2)))
    units = {name: SIGNALS[name] for name in windows.names}
    length_s = steps * windows.interval_s
    remarks = (f"Samples are held-out windows of {steps} steps ({length_s:.3g} s).",)
    return Pair(
        real.taken(rows), other.taken(rows), windows.names, units, windows.interval_s, remarks
    )


def paths_of(samples: np.ndarray, names: Sequence[str], interval_s: float) -> np.ndarray | None:
    """Return the paths (K, T + 1, 2) of samples (K, T, D), which begin at 0 along x; None without speed and turn."""
    if not {"speed", "turn"} <= set(names):
        return None
    speed = samples[..., list(names).index("speed")]
    direction = np.cumsum(samples[..., list(names).index("turn")] * interval_s, axis=1)
    steps = (speed * interval_s)[..., None] * np.stack(
        (np.cos(direction), np.sin(direction)), axis=-1
    )
    start = np.zeros((len(samples), 1, 2))
    return np.concatenate((start, np.cumsum(steps, axis=1)), axis=1)


def recordings_of(value: object, name: str) -> list[Trajectories]:
    """Return one or several recordings as a list."""
    if isinstance(value, Trajectories):
        return [value]
    if (
        isinstance(value, Sequence)
        and value
        and all(isinstance(recording, Trajectories) for recording in value)
    ):
        return list(value)
    return refuse(name, "be an array (K, T, D), a recording, or several", type(value).__name__)
