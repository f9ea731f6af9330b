"""What gives one set of samples away: signals, statistics, time scales, and single windows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # its parts come when they are used: scipy.stats alone takes half a second

from ._examiners import Kernel, Ridge
from ._panel import (
    CLEAR_ACCURACY,
    Views,
    folds_of,
    in_deviations,
    right_answers,
    varies,
    without_last_digits,
)
from ._statistics import moderate, named_statistics

LARGEST_SIDE = 600
"""Samples that are looked at for what gives them away, half of each side."""

LISTED = 8
"""Statistics that are listed."""

NEARLY = 0.01
"""Accuracy by which a statistic may be worse than the best and still be named first, if it is simpler."""

WITH_UNITS = (
    "mean ", "spread of ", "low ", "median ", "high ", "change of ", "least ", "largest "
)  # fmt: skip
"""How the names of statistics begin that have the unit of their signal."""

TELLS = 0.55
"""Accuracy below which a statistic gives nothing away."""

TOGETHER = 0.1
"""Accuracy by which all statistics have to be better than the best alone for this to be said first."""

ALIKE_CORRELATION = 0.9
"""Correlation of the ranks from which on two statistics say the same; the second is not listed."""

SHUFFLED = 5
"""Statistics that are listed with what is lost where they are shuffled."""

STATED_DIGITS = 9
"""Of both values of a statistic, at most: as many as samples are not rounded to."""

SHORTEST_PART = 4
"""Steps of a part of a sample, at least."""

TIME_SCALE_PARTS = (1, 2, 4, 8, 16)
"""Into how many parts samples are cut to see on which time scale they differ."""

WINDOWS = 3
"""Telltale windows that are shown."""


@dataclass(frozen=True)
class Telling:
    """Something by which the sides are told apart, or not."""

    kind: str  #: "statistic", "shuffled", "signal", "without" or "scale"
    what: str  #: In words
    #: Share of right answers by it, or by all without it, or where it is shuffled; 0.5 is guessing
    accuracy: float
    real: float | None = None  #: Mean of a statistic of real samples
    simulated: float | None = None  #: The same of simulated ones
    unit: str = ""  #: Of both

    def said(self, value: float | None) -> str | None:
        """Return a mean with its unit."""
        if value is None:
            return None
        if self.unit == "%":
            return f"{value:.1%}".replace("%", " %")
        return f"{value:.3g} {self.unit}".strip()

    @property
    def words(self) -> str:
        """Both values in words, such as "74 % against 8 %", simulated first; empty without values."""
        if self.real is None or self.simulated is None:
            return ""
        if self.unit == "%":
            return f"{self.simulated:.0%} against {self.real:.0%}".replace("%", " %")
        unit = f" {self.unit}" if self.unit else ""
        digits = 3
        # "3 against 3" tells nobody anything
        while (
            digits < STATED_DIGITS and f"{self.simulated:.{digits}g}" == f"{self.real:.{digits}g}"
        ):
            digits += 1
        return f"{self.simulated:.{digits}g} against {self.real:.{digits}g}{unit}"


@dataclass(frozen=True, eq=False)
class LabelledWindows:
    """Samples of both sides, with what is needed to say what gives them away."""

    windows: np.ndarray  #: (K, T, D), the real ones first
    labels: np.ndarray  #: (K,), 1 for real
    groups: np.ndarray  #: (K,), numbers of the groups
    names: tuple[str, ...]  #: Of the signals
    units: dict[str, str]  #: Of the signals; empty for numbers
    interval_s: float  #: Duration of a step (s); 0 if it is not known

    @cached_property
    def statistics(self) -> tuple[list[str], np.ndarray]:
        """Names (F,) and values (K, F) of what examiners see of them."""
        return named_statistics(self.windows, self.names, self.interval_s)

    def some(self, rng: np.random.Generator) -> "LabelledWindows":
        """Return a part that is quick to look at, of as many samples of both sides."""
        rows = []
        for side in (self.labels > 0.5, self.labels < 0.5):
            where = np.flatnonzero(side)
            rows.append(np.sort(rng.permutation(where)[: LARGEST_SIDE // 2]))
        chosen = np.concatenate(rows)
        groups = np.unique(self.groups[chosen], return_inverse=True)[1].ravel()
        return LabelledWindows(
            self.windows[chosen],
            self.labels[chosen],
            groups,
            self.names,
            self.units,
            self.interval_s,
        )

    def accuracy(self, windows: np.ndarray, names: Sequence[str]) -> float:
        """Return how often a regression is right that sees other windows (K, any, any) of the same samples."""
        views = Views.of(windows, names, self.interval_s, (), 0)
        labels = self.labels[:, None]
        scores = Ridge().cross_fitted(views.standardized["statistics"], labels, self.groups)
        return _balanced(right_answers(scores, labels, self.groups), self.labels)[0]


def what_tells(samples: LabelledWindows, seed: int, *, told: bool) -> list[Telling]:
    """Return statistics, the most telling first, alone and shuffled, then signals alone and left out, and time scales.

    Where a panel has not `told` the sides apart, nothing is shuffled: the loss would be chance.
    """
    subset = samples.some(np.random.default_rng((seed, 3)))
    telling = statistics_that_tell(subset)
    if told:
        telling += _shuffled(subset, seed)
    return [*telling, *_signals(subset), *_scales(subset)]


def telling_statistics(
    real: np.ndarray,
    simulated: np.ndarray,
    groups: np.ndarray,
    *,
    names: Sequence[str],
    units: Mapping[str, str],
    interval_s: float = 0.0,
    seed: int = 0,
) -> tuple[Telling, ...]:
    """Return what gives simulated samples away, as `test` does, but without its panel.

    Parameters
    ----------
    real, simulated : (K, T, D), (L, T, D)
        Samples of both; at most 300 of each are looked at.
    groups : (K,)
        Which real samples belong together. Each simulated one is a group of its own.
    names, units
        Of the D signals; units by name, where they have some.
    interval_s
        Duration of a step (s); 0 if it is not known.
    seed
        Of all random numbers.

    Returns
    -------
    tuple of Telling
        Statistics, the most telling first.
    """
    numbers = np.unique(groups, return_inverse=True)[1].ravel()
    own_groups = 1 + numbers.max() + np.arange(len(simulated))
    samples = LabelledWindows(
        without_last_digits(np.concatenate((real, simulated))),
        np.repeat([1.0, 0.0], (len(real), len(simulated))),
        np.concatenate((numbers, own_groups)),
        tuple(names),
        dict(units),
        interval_s,
    )
    return tuple(statistics_that_tell(samples.some(np.random.default_rng((seed, 3)))))


def statistics_that_tell(samples: LabelledWindows) -> list[Telling]:
    """Return the statistics that tell most, each alone; those that say the same as a better one are left out."""
    names, values = samples.statistics
    ranks = scipy.stats.rankdata(values, axis=0) / len(values)
    labels = np.repeat(samples.labels[:, None], len(names), axis=1)
    genuine = samples.labels > 0.5
    sign = np.where(ranks[genuine].mean(axis=0) >= ranks[~genuine].mean(axis=0), 1.0, -1.0)
    accuracy = np.array(
        _balanced(right_answers(sign * ranks, labels, samples.groups), samples.labels)
    )
    # names come in the order from simple to intricate: of nearly equal ones the simplest is named
    order = np.lexsort((np.arange(len(names)), -np.floor(accuracy / NEARLY)))
    telling: list[Telling] = []
    taken: list[int] = []
    unlike = ranks - ranks.mean(axis=0)
    unlike /= np.maximum(unlike.std(axis=0), 1e-9)
    for column in order:
        alike = [abs(float((unlike[:, column] * unlike[:, earlier]).mean())) for earlier in taken]
        if len(telling) == LISTED or (alike and max(alike) > ALIKE_CORRELATION):
            continue
        taken.append(int(column))
        unit = _unit(names[column], samples.units)
        real = float(values[genuine, column].mean())
        simulated = float(values[~genuine, column].mean())
        telling.append(
            Telling("statistic", names[column], float(accuracy[column]), real, simulated, unit)
        )
    return telling


def _shuffled(samples: LabelledWindows, seed: int) -> list[Telling]:
    """Return how often a regression on all statistics is right, and how often where one of them is shuffled.

    What matters only together with others is found so. Statistics that say the same are shuffled together, in samples of
    groups that the regression has not seen. Those are listed that cost most; nothing where the regression hardly tells.

    Source
    ------
    Permutation importance: L. Breiman, Random forests, Machine Learning 45 (2001), section 10; for other learners
    A. Fisher, C. Rudin, F. Dominici, Journal of Machine Learning Research 20 (2019) 177.
    """
    names, values = samples.statistics
    is_moderate = moderate(names, samples.names)
    names, values = list(np.array(names)[is_moderate]), values[:, is_moderate]
    varying = np.flatnonzero(varies(values))
    if not len(varying):
        return []
    standard = in_deviations(values)
    alike = _alike(standard)
    genuine = samples.labels > 0.5
    folds = folds_of(genuine, samples.groups, seed)
    rng = np.random.default_rng((seed, 5))
    # the first column of all statistics as they are
    scores = np.empty((len(standard), 1 + len(alike)))
    for fold in range(folds.max() + 1):
        out = folds == fold
        regression = Kernel()
        regression.fit(standard[~out], samples.labels[~out])
        scores[out, 0] = regression.score(standard[out])
        for place, columns in enumerate(alike, start=1):
            shuffled = standard[out].copy()
            shuffled[:, columns] = rng.permutation(shuffled[:, columns])
            scores[out, place] = regression.score(shuffled)
    complete, *without = _balanced((scores > 0) == genuine[:, None], samples.labels)
    if complete < TELLS:
        return []
    telling = [Telling("shuffled", "all statistics", float(complete))]
    for place in np.argsort(without, kind="stable")[:SHUFFLED]:
        if without[place] <= complete - NEARLY:
            name = names[varying[alike[place][0]]]
            telling.append(Telling("shuffled", f"{name} shuffled", float(without[place])))
    return telling


def _alike(values: np.ndarray) -> list[list[int]]:
    """Return columns of values (K, F) in sets that say the same as the first of each."""
    ranks = scipy.stats.rankdata(values, axis=0)
    correlations = np.abs(np.atleast_2d(np.corrcoef(ranks, rowvar=False)))
    sets: list[list[int]] = []
    for column in range(values.shape[1]):
        for columns in sets:
            if correlations[column, columns[0]] > ALIKE_CORRELATION:
                columns.append(column)
                break
        else:
            sets.append([column])
    return sets


def _unit(statistic: str, units: dict[str, str]) -> str:
    """Return the unit of a statistic, "%" for a share, nothing for numbers without unit."""
    if statistic.startswith("share of"):
        return "%"
    if not statistic.startswith(WITH_UNITS):
        return ""
    # the longest name first: one signal's name may be part of another's
    matching = [name for name in sorted(units, key=len, reverse=True) if name in statistic]
    return units[matching[0]] if matching else ""


def _signals(samples: LabelledWindows) -> list[Telling]:
    """Return how well samples are told by each signal alone, and without each."""
    count = len(samples.names)
    telling = []
    for cue in ("signal", "without"):
        for place, name in enumerate(samples.names):
            if cue == "signal":
                columns = [place]
            else:
                columns = [another for another in range(count) if another != place]
            if columns and count > 1:
                names = [samples.names[column] for column in columns]
                words = f"{name} alone" if cue == "signal" else f"all but {name}"
                telling.append(
                    Telling(cue, words, samples.accuracy(samples.windows[..., columns], names))
                )
    return telling


def _scales(samples: LabelledWindows) -> list[Telling]:
    """Return how well samples are told by a part of each, as long as parts have enough steps."""
    length = samples.windows.shape[1]
    telling = []
    for divisor in TIME_SCALE_PARTS:
        steps = length // divisor
        if steps < SHORTEST_PART:
            break
        begin = (length - steps) // 2
        words = f"{steps} steps"
        if samples.interval_s:
            words = f"windows of {steps * samples.interval_s:.2g} s"
        accuracy = samples.accuracy(samples.windows[:, begin : begin + steps], samples.names)
        telling.append(Telling("scale", words, accuracy))
    return telling


def _balanced(right: np.ndarray, labels: np.ndarray) -> list[float]:
    """Return the share of right answers (K, B), both kinds weighing the same."""
    genuine = labels > 0.5
    return list((right[genuine].mean(axis=0) + right[~genuine].mean(axis=0)) / 2)


def told_by(telling: Sequence[Telling]) -> str:
    """Say in a sentence what gives away simulated samples that are told."""
    # what tells hardly better than guessing gives nothing away
    statistics = [cue for cue in telling if cue.kind == "statistic" and cue.accuracy >= TELLS]
    clear = [cue for cue in statistics if cue.accuracy >= CLEAR_ACCURACY]
    shuffled = [cue for cue in telling if cue.kind == "shuffled"]
    if not clear and len(shuffled) > 1:
        everything, *without = shuffled
        alone = max([cue.accuracy for cue in statistics], default=0.5)
        if everything.accuracy >= alone + TOGETHER:
            lost = " or ".join(f"{cue.what} ({cue.accuracy:.2f})" for cue in without[:2])
            together = f"all together do ({everything.accuracy:.2f}), less with {lost}"
            return f"No single statistic tells it as well; {together}."
    if not statistics:
        return "No single statistic tells it; it takes several together."
    listed = ", ".join(f"{cue.what} ({cue.words})" for cue in (clear or statistics[:1])[:3])
    return f"Told by (simulated against real): {listed}."


def telltale_windows(scores: np.ndarray, samples: LabelledWindows) -> list[tuple[int, int]]:
    """Return the simulated windows that are told most surely, each with the real one nearest to it, by their numbers.

    The nearest has the least distance in all statistics, in units of their standard deviations.
    """
    _, values = samples.statistics
    table = in_deviations(values)
    real = np.flatnonzero(samples.labels > 0.5)
    surest = np.flatnonzero(samples.labels < 0.5)
    surest = surest[np.argsort(scores[surest], kind="stable")]
    pairs: list[tuple[int, int]] = []
    for window in surest[:WINDOWS]:
        distances = ((table[real] - table[window]) ** 2).sum(axis=1)
        pairs.append((int(window), int(real[distances.argmin()])))
    return pairs
