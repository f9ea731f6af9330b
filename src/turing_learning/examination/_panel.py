"""The panel: several examiners, cross-fitted by groups, and one p-value by permutations of the groups."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from itertools import combinations
from math import comb
from typing import Any

import numpy as np
import scipy  # its parts come when they are used: scipy.stats alone takes half a second
from scipy.special import ndtr, ndtri, stdtrit

from turing_learning.analysis import LEVEL, area_under_curve
from turing_learning.errors import integer, require

from ._convolution import convolution_features
from ._examiners import PANEL, TINY, TREE_RANKS, Examiner, Ridge
from ._statistics import moderate, named_statistics

PERMUTATIONS = 99
"""Exchanges of labels; with 99 a p-value can be 0.01."""

EXAMINER_FOLDS = 5
"""Parts in which groups are left out by examiners that have to learn anew for each labelling."""

NOTICED_SHARE = 0.8
"""Share of cases in which a difference of the size of the power must be noticed. Source: Cohen, Statistical power analysis
for the behavioral sciences (1988), section 2.4."""

PRECISION = 1e-9
"""Of a signal, as a share of its largest value: what is smaller is rounding. No camera measures as precisely."""

SMALLEST = 1e-290
"""Largest value of a signal, at least, so that its last digits are numbers, too."""

CLEAR_ACCURACY = 2 / 3
"""Accuracy against a clearly wrong model: of three samples two are told."""


@dataclass(frozen=True)
class Member:
    """What one examiner of the panel found."""

    name: str  #: Of the examiner
    accuracy: float  #: Share of right answers, both kinds weighing the same
    p_value: float  #: Of this examiner alone; that of the panel counts


@dataclass(frozen=True)
class Examined:
    """Whether a panel of examiners tells two kinds of samples apart."""

    #: Share of right answers of the best examiner on left-out groups, both kinds weighing the same; 0.5 is guessing
    accuracy: float
    #: Of the accuracy, 95 %, by the spread of the groups
    interval: tuple[float, float]
    #: How often labels that are exchanged between groups give so high an accuracy
    p_value: float
    auc: float  #: Area under the ROC curve of the examiner who judges best
    auc_interval: tuple[float, float]  #: The same, 95 %
    #: The accuracy from which on the p-value is at most 0.05; above 1 if none is
    critical: float
    #: The smallest accuracy that would be noticed in 80 % of such tests; None if none would be
    power_accuracy: float | None
    #: Share of such tests that would notice a clearly wrong model, told with an accuracy of 2/3
    power: float
    examiners: tuple[Member, ...]  #: What each examiner found
    samples: tuple[int, int]  #: Genuine and other samples
    groups: tuple[int, int]  #: Genuine and other groups
    grouping: str  #: What a group is
    #: Of all samples by the examiner who judges best, the genuine ones first
    scores: tuple[float, ...] = ()

    @property
    def told_apart(self) -> bool:
        """Whether the p-value is at most 0.05."""
        return self.p_value <= LEVEL

    @property
    def blind(self) -> bool:
        """Whether all samples look the same to all examiners."""
        # guessing is all that any labelling gives
        return self.power_accuracy is None and self.critical < 0.5 + TINY

    @property
    def best(self) -> Member:
        """The examiner with the highest accuracy."""
        return max(self.examiners, key=lambda member: member.accuracy)

    def to_json(self) -> dict[str, Any]:
        """Return all but the scores by name."""
        content = {name: value for name, value in vars(self).items() if name != "scores"}
        # JSON has no infinity: nothing is noticed then
        content["critical"] = self.critical if np.isfinite(self.critical) else None
        content["examiners"] = [dict(vars(member)) for member in self.examiners]
        return content


SEEN = ("statistics", "ranks", "convolutions", "windows")
"""What examiners may ask to see of samples."""


@dataclass(frozen=True, eq=False)
class Views:
    """What examiners see of samples; computed once, without labels."""

    windows: np.ndarray  #: (K, T, D)
    #: What examiners see (K, ...), by the word that they ask for it
    standardized: dict[str, np.ndarray]

    @classmethod
    def of(
        cls,
        windows: np.ndarray,
        names: Sequence[str],
        interval_s: float,
        examiners: Sequence[Examiner],
        seed: int,
    ) -> "Views":
        """Describe windows (K, T, D) of signals with names (D,) for some examiners."""
        windows = without_last_digits(windows)
        statistic_names, statistics = named_statistics(windows, names, interval_s)
        without_extremes = statistics[:, moderate(statistic_names, names)]
        views = {"windows": windows, "statistics": in_deviations(without_extremes)}
        if any(examiner.sees == "ranks" for examiner in examiners):
            values = in_deviations(statistics)
            ranks = scipy.stats.rankdata(values, method="min", axis=0) - 1
            views["ranks"] = np.floor(ranks * TREE_RANKS / len(windows))
        if any(examiner.sees == "convolutions" for examiner in examiners):
            views["convolutions"] = in_deviations(
                convolution_features(windows, np.random.default_rng(seed))
            )
        return cls(windows, views)


def without_last_digits(windows: np.ndarray) -> np.ndarray:
    """Return windows (K, T, D) without what rounding has left of each signal.

    A speed that is constant differs in its last digits, by how far from the origin and for how long somebody has moved.
    That tells one recording from another, and a model from what it imitates.
    """
    largest = np.abs(windows).max(axis=(0, 1))
    unit = np.maximum(largest, SMALLEST) * PRECISION
    return np.round(windows / unit) * unit


def examine(
    genuine: np.ndarray, others: np.ndarray, *, groups: tuple[np.ndarray, np.ndarray] | None = None,
    names: Sequence[str] | None = None, interval_s: float = 1.0, grouping: str = "samples",
    examiners: Sequence[Examiner] = PANEL, permutations: int = PERMUTATIONS, seed: int = 0,
) -> Examined:  # fmt: skip
    """Ask a panel of examiners to tell genuine samples from others.

    Every sample is judged by examiners that have not seen its group; the accuracy is that of the best of them. The
    labels of whole groups are exchanged, every examiner learns anew, and the best counts again: if the groups are
    alike, p-values of at most q are no more frequent than q.

    Parameters
    ----------
    genuine, others : (K, T, D), (L, T, D)
        Samples of both kinds.
    groups : (K,), (L,)
        Labels of both; samples with the same one belong together. None: each sample is a group.
    names : (D,)
        Of the signals.
    interval_s
        Duration of a step (s), for the names of statistics.
    grouping
        What a group is, in a word.
    examiners
        Who judges.
    permutations
        Exchanges of labels, at least 19. If there are fewer ways to exchange them, all are tried.
    seed
        Of all random numbers, >= 0.

    Source
    ------
    Lopez-Paz and Oquab, Revisiting classifier two-sample tests, ICLR 2017; Ojala and Garriga, Permutation tests for
    studying classifier performance, Journal of Machine Learning Research 11 (2010); docs/decisions/0039-examination.md.
    """
    windows = np.concatenate((genuine, others))
    names = tuple(names or (f"signal {d + 1}" for d in range(windows.shape[2])))
    views = Views.of(windows, names, interval_s, examiners, seed)
    owners = group_numbers((len(genuine), len(others)), groups)
    return examine_views(views, owners, grouping, examiners, permutations, seed)


def group_numbers(
    counts: tuple[int, int], groups: tuple[np.ndarray, np.ndarray] | None
) -> tuple[np.ndarray, np.ndarray]:
    """Return numbers of the groups of genuine samples and of others, from 0; those of the others come after."""
    sides = groups or (np.arange(counts[0]), np.arange(counts[1]))
    numbers = []
    begin = 0
    for name, side, count in zip(("real", "simulated"), sides, counts, strict=True):
        rule = f"be one label for each of the {count} {name} samples"
        require(len(side) == count, "groups", rule, len(side))
        labels, members = np.unique(np.asarray(side), return_inverse=True)
        rule = f"tell at least 2 groups of {name} samples apart"
        remedy = "Record more, or name smaller groups."
        require(len(labels) >= 2, "groups", rule, len(labels), remedy)
        numbers.append(members.ravel() + begin)
        begin += len(labels)
    return numbers[0], numbers[1]


def examine_views(
    views: Views, owners: tuple[np.ndarray, np.ndarray], grouping: str, examiners: Sequence[Examiner],
    permutations: int, seed: int,
) -> Examined:  # fmt: skip
    """Examine samples that have been described; see `examine`."""
    integer("permutations", permutations, 19)
    require(len(examiners) > 0, "examiners", "be one or several", "none")
    for examiner in examiners:
        rule = f"see one of {', '.join(SEEN)}"
        require(examiner.sees in SEEN, "examiners", rule, repr(examiner.sees), place=examiner.name)
    groups = np.concatenate(owners)
    counts = len(np.unique(owners[0])), len(np.unique(owners[1]))
    rng = np.random.default_rng((seed, 1))
    # (G, B), the true one first
    labellings = group_labellings(counts, permutations, rng)
    labels = labellings[groups]
    scores = []
    for examiner in examiners:
        views_seen = views.standardized[examiner.sees]
        scores.append(_cross_fitted(examiner, views_seen, labels, groups))
    right = np.stack([right_answers(examiner, labels, groups) for examiner in scores])
    # both kinds weigh the same
    sides_right = (
        right.mean(axis=1, where=labels[None] > 0.5),
        right.mean(axis=1, where=labels[None] < 0.5),
    )
    single = (sides_right[0] + sides_right[1]) / 2  # (examiners, B)
    best_accuracies = single.max(axis=0)
    best = int(single[:, 0].argmax())
    order = np.sort(best_accuracies)
    # as many of all labellings, the true one among them, may reach the critical accuracy
    above = int(np.floor(LEVEL * len(best_accuracies) + 1e-9))
    critical = float(order[-above] + 1e-12) if above else np.inf
    spread = float(best_accuracies[1:].std())
    needed = critical + ndtri(NOTICED_SHARE) * spread
    of_best, genuine = scores[best][:, 0], labels[:, 0] > 0.5
    placement = _placements(of_best, genuine)
    members = []
    for examiner, accuracies in zip(examiners, single, strict=True):
        members.append(Member(examiner.name, float(accuracies[0]), _p_value(accuracies)))
    return Examined(
        accuracy=float(best_accuracies[0]),
        interval=_interval(right[best, :, 0].astype(float), genuine, groups),
        p_value=_p_value(best_accuracies),
        auc=float(area_under_curve(of_best[genuine], of_best[~genuine])),
        auc_interval=_interval(placement, genuine, groups),
        critical=critical,
        # of samples that are all the same nothing would be noticed
        power_accuracy=float(needed) if needed <= 1 and spread > 0 else None,
        power=float(ndtr((CLEAR_ACCURACY - critical) / spread)) if spread > 0 else 0.0,
        examiners=tuple(members),
        samples=(len(owners[0]), len(owners[1])),
        groups=counts,
        grouping=grouping,
        scores=tuple(of_best.tolist()),
    )


def group_labellings(
    sides: tuple[int, int], permutations: int, rng: np.random.Generator
) -> np.ndarray:
    """Return labels (G, B) of groups, 1 for genuine: the true ones first, then exchanged ones."""
    count = sum(sides)
    if comb(count, sides[0]) <= permutations + 1:
        # The first of them is the true one
        chosen = np.array(list(combinations(range(count), sides[0])))
    else:
        drawn = [rng.permutation(count)[: sides[0]] for _ in range(permutations)]
        chosen = np.array([np.arange(sides[0]), *drawn])
    labellings = np.zeros((count, len(chosen)))
    for row, groups in enumerate(chosen):
        labellings[groups, row] = 1.0
    return labellings


def varies(values: np.ndarray) -> np.ndarray:
    """Return which features (F,) of values (K, F) are not constant."""
    largest = np.maximum(np.abs(values).max(axis=0), TINY)
    return np.asarray(values.std(axis=0) > TINY * largest)


def in_deviations(values: np.ndarray) -> np.ndarray:
    """Return features in units of their standard deviation over all samples; constant ones are left out."""
    varying = values[:, varies(values)]
    if not varying.shape[1]:
        return np.zeros((len(values), 1))
    return np.asarray((varying - varying.mean(axis=0)) / varying.std(axis=0))


def _cross_fitted(
    examiner: Examiner, samples: np.ndarray, labels: np.ndarray, groups: np.ndarray
) -> np.ndarray:
    """Return scores (K, B) of samples by an examiner that has not seen their groups, for each labelling (K, B)."""
    if isinstance(examiner, Ridge):
        return examiner.cross_fitted(samples, labels, groups)
    # What it learns is nobody else's
    examiner = copy(examiner)
    scores = np.empty(labels.shape)
    for column, genuine in enumerate(labels.T > 0.5):
        folds = folds_of(genuine, groups, column)
        for fold in range(folds.max() + 1):
            out = folds == fold
            examiner.fit(samples[~out], genuine[~out])
            scores[out, column] = examiner.score(samples[out])
    return scores


def folds_of(genuine: np.ndarray, groups: np.ndarray, seed: int) -> np.ndarray:
    """Return in which part each sample (K,) is left out: groups of both kinds are spread evenly over the parts."""
    rng = np.random.default_rng(seed)
    sides = [np.unique(groups[genuine]), np.unique(groups[~genuine])]
    count = min(EXAMINER_FOLDS, *map(len, sides))
    fold_of = np.zeros(groups.max() + 1, dtype=int)
    for side in sides:
        fold_of[rng.permutation(side)] = np.arange(len(side)) % count
    return np.asarray(fold_of[groups])


def right_answers(scores: np.ndarray, labels: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return whether samples are judged right (K, B), by scores (K, B).

    The border of a group lies in the middle between the mean scores of both kinds in all other groups.
    """
    middle = np.zeros_like(scores)
    for side in (labels, 1 - labels):
        sums, counts = _per_group(side * scores, groups), _per_group(side, groups)
        middle += ((sums.sum(axis=0) - sums) / np.maximum(counts.sum(axis=0) - counts, 1))[
            groups
        ] / 2
    return np.asarray((scores > middle) == (labels > 0.5))


def _per_group(values: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Return sums (G, B) of values (K, B)."""
    sums = np.zeros((groups.max() + 1, values.shape[1]))
    np.add.at(sums, groups, values)
    return sums


def _p_value(values: np.ndarray) -> float:
    """Return the share of labellings that do as well as the first, the true one."""
    return float((values >= values[0] - 1e-12).mean())


def _placements(scores: np.ndarray, genuine: np.ndarray) -> np.ndarray:
    """Return for each score (K,) the share of scores of the other kind that it is on the right side of."""
    placements = np.empty(len(scores))
    for side, sign in ((genuine, 1.0), (~genuine, -1.0)):
        opponents = np.sort(sign * scores[~side])
        mine = sign * scores[side]
        below = np.searchsorted(opponents, mine, "left") + np.searchsorted(opponents, mine, "right")
        placements[side] = below / (2 * len(opponents))
    return placements


def _interval(values: np.ndarray, genuine: np.ndarray, groups: np.ndarray) -> tuple[float, float]:
    """Return a 95 % interval of the mean of two means of values (K,), from 0 to 1, by the spread of the groups.

    It is that of Student's t with the degrees of freedom of Welch, and no narrower than Wilson's for independent
    samples, which still has a width if all answers are right.
    """
    middle = 0.0
    variance = 0.0
    freedom = 0.0
    for side in (genuine, ~genuine):
        mean = values[side].mean()
        _, members = np.unique(groups[side], return_inverse=True)
        residuals = np.bincount(members, weights=values[side] - mean)
        count = len(residuals)
        # of groups, not samples, as those of a group are alike; a side has half of the weight: / 4
        own_variance = (residuals**2).sum() / side.sum() ** 2 * count / max(count - 1, 1) / 4
        middle += mean / 2
        variance += own_variance
        freedom += own_variance**2 / max(count - 1, 1)
    # Welch and Satterthwaite: groups of two sides with unequal variances
    freedom = variance**2 / freedom if freedom > 0 else np.inf
    half = 0.0
    if variance > 0:
        half = stdtrit(max(freedom, 1.0), 0.975) * np.sqrt(variance)
    z = ndtri(0.975)
    count = len(values)
    center = (middle + z**2 / (2 * count)) / (1 + z**2 / count)
    reach = (
        z
        / (1 + z**2 / count)
        * np.sqrt(max(middle * (1 - middle), 0) / count + z**2 / (4 * count**2))
    )
    low, high = min(middle - half, center - reach), max(middle + half, center + reach)
    return float(max(low, 0.0)), float(min(high, 1.0))
