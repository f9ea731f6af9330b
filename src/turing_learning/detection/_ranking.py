"""What detection says: individuals in order of their scores, p-values, and what can be promised.

Scores are distances from normal individuals: high ones are abnormal.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ._methods import BASELINES, CLASSIFIERS

ROUNDING = 1e-9
"""By which a p-value may be above the level: it may be as large, but for rounding."""


@dataclass(frozen=True)
class Standing:
    """How unlike normal ones an individual is."""

    individual: str  #: Its name
    rank: int  #: 1 for the most abnormal
    score: float  #: Mean of `shares`; NaN without windows
    #: Share of normal individuals with so high a score, the individual itself counted; NaN where none are known, or it
    #: has too few windows to be judged
    p_value: float
    #: Whether the p-value is at most the level; None where no level can be promised, or it has too few windows
    abnormal: bool | None
    windows: int  #: Number of its windows W
    shares: np.ndarray  #: (W,), of the windows, whose mean is the score
    #: (W,), whether it belongs to the stretch that makes an individual abnormal
    flagged: np.ndarray


@dataclass(frozen=True, eq=False)
class Ranking:
    """The individuals, in the order of the motion, by one method."""

    name: str  #: Of the method
    individuals: tuple[Standing, ...]
    #: Probability that a case that is known to be abnormal scores above a normal individual; None without such cases
    area: float | None
    #: How many normal individuals would have been called abnormal, each by the recordings of the others; NaN for none
    called: float


@dataclass(frozen=True, eq=False)
class Detection:
    """The individuals of a recording, ranked by several methods."""

    #: The first is the one to read: motion statistics, unless another method tells known cases clearly better
    rankings: tuple[Ranking, ...]
    #: Share of normal individuals that may be called abnormal, as it was asked for
    false_alarms: float
    level: float | None  #: The share that can be promised; None if none can
    normal: int  #: Number of normal individuals
    #: Number of recordings that these are from; 0 where all are of one pool
    recordings: int
    cases: str  #: What abnormal cases are known, in words; empty for none
    least_windows: float = 0.0  #: Who has fewer windows is too short to judge

    @property
    def individuals(self) -> tuple[Standing, ...]:
        """Of the ranking to read."""
        return self.rankings[0].individuals

    @property
    def verdict(self) -> str:
        """What an individual is at the level: "abnormal" only where the rate that was asked for can be promised."""
        if self.level is not None and self.level > self.false_alarms:
            return "stands out"
        return "abnormal"

    @property
    def too_short(self) -> tuple[str, ...]:
        """Names of those who have windows, but too few to be judged; of nobody if no level can be promised."""
        if self.level is None:
            return ()
        short = []
        for individual in self.individuals:
            if individual.windows and individual.abnormal is None:
                short.append(individual.individual)
        return tuple(short)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What can be promised, and how the methods compare, in sentences."""
        return (*self._about_the_promise(), *self._about_the_methods())

    def _about_the_promise(self) -> list[str]:
        if self.level is None:
            exception = "but those that the run has learned from " * bool(self.recordings)
            reason = f"as no recordings of normal individuals {exception}are given (`genuine`)"
            return [f"Nobody is called abnormal, {reason}; the ranking stands."]
        sentences = []
        judged = sum(math.isfinite(individual.p_value) for individual in self.individuals)
        if self.level > self.false_alarms:
            sentences.append(
                f"A false-alarm rate of {self.false_alarms:.3g} cannot be promised by {self.normal} "
                f"normal individuals: the lowest is 1 of {self.normal + 1}, {self.level:.2g}. "
                "Individuals stand out if their score is above all of these: about "
                f"{self.level * judged:.2g} of {judged} normal ones would, too."
            )
        called = self.rankings[0].called
        others = "others"
        if self.recordings > 1:
            others = "recordings of the others"
        check = (
            f"As a check, each of the {self.normal} normal individuals was judged by the {others}"
        )
        result = "came out as abnormal"
        if self.verdict == "stands out":
            result = "stood out"
        sentence = f"{check}: {called:.3g} {result}, falsely."
        if called % 1:
            sentence += " Who did so in one of its two pieces counts 0.5."
        sentences.append(sentence)
        if self.too_short:
            sentences.append(
                f"Too short to judge: {', '.join(self.too_short)}. With fewer than "
                f"{math.ceil(self.least_windows)} windows chance alone makes scores high."
            )
        return sentences

    def _about_the_methods(self) -> list[str]:
        names = []
        areas = {}
        for ranking in self.rankings:
            areas[ranking.name] = ranking.area or 0.0
            name = ranking.name
            if ranking.area is not None:
                name = f"{name} {ranking.area:.3f}"
            names.append(name)
        compared = ", ".join(names)
        if not self.cases:
            return [f"Also looked at: {compared}."]
        baselines = [areas[name] for name in BASELINES if name in areas]
        if CLASSIFIERS not in areas or not baselines:
            return []
        beat = "beat" if areas[CLASSIFIERS] > max(baselines) else "do not beat"
        return [
            f"On {self.cases} the classifiers {beat} the baselines; area under the ROC curve: {compared}."
        ]


@dataclass(frozen=True, eq=False)
class MethodScores:
    name: str  # of the method
    # (W,) of each individual that is judged: what its windows add
    shares: list[np.ndarray]
    # (n,), of normal individuals, each by what was learned without it
    normal: np.ndarray
    weights: np.ndarray  # (n,), of these; pieces of one individual have the sum 1
    groups: np.ndarray  # (n,), of individuals that were left out together
    area: float | None  # see `Ranking`


def rank(
    scores: MethodScores,
    names: Sequence[str],
    false_alarms: float | None,
    least_windows: float = 0.0,
) -> Ranking:
    """Rank individuals; without a rate of false alarms, or with fewer windows, nobody has a p-value."""
    means = np.array([shares.mean() if len(shares) else np.nan for shares in scores.shares])
    # An individual without windows comes last.
    ranks = np.argsort(np.argsort(-means, kind="stable")) + 1
    p_values = np.full(len(means), np.nan)
    abnormal: list[bool | None] = [None] * len(means)
    called = float("nan")
    if false_alarms is not None:
        p_values = _p_values(means, scores.normal, scores.weights)
        abnormal = _below_level(p_values, false_alarms, scores.weights).tolist()
        called = _called_normal_individuals(scores, false_alarms)
    # Few windows have extreme means by chance
    for k, shares in enumerate(scores.shares):
        if 0 < len(shares) < least_windows:
            p_values[k] = np.nan
            abnormal[k] = None
    individuals = []
    for k, (name, shares) in enumerate(zip(names, scores.shares, strict=True)):
        flagged = np.zeros(len(shares), dtype=bool)
        if abnormal[k]:
            flagged[_strongest_stretch(shares)] = True
        individuals.append(
            Standing(
                individual=name,
                rank=int(ranks[k]),
                score=float(means[k]),
                p_value=float(p_values[k]),
                abnormal=abnormal[k],
                windows=len(shares),
                shares=shares,
                flagged=flagged,
            )
        )
    return Ranking(scores.name, tuple(individuals), scores.area, called)


def _p_values(scores: np.ndarray, normal: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return (1 + weight of normal ones with so high a score) / (1 + weight of all)."""
    order = np.argsort(normal)
    # The weight of all from each place of the order on.
    weight_above = np.append(np.cumsum(weights[order][::-1])[::-1], 0.0)
    ranks = np.searchsorted(normal[order], scores, "left")
    p_values = (1 + weight_above[ranks]) / (weights.sum() + 1)
    return np.where(np.isnan(scores), np.nan, p_values)


def _below_level(p_values: np.ndarray, false_alarms: float, weights: np.ndarray) -> np.ndarray:
    """Return which p-values are at most the rate of false alarms, or the least possible."""
    return p_values <= max(false_alarms, 1 / (weights.sum() + 1)) + ROUNDING


def _called_normal_individuals(scores: MethodScores, false_alarms: float) -> float:
    """Return how many normal individuals those of other groups would call abnormal."""
    called = 0.0
    for group in np.unique(scores.groups):
        inside = scores.groups == group
        weights = scores.weights[~inside]
        p_values = _p_values(scores.normal[inside], scores.normal[~inside], weights)
        called += float(scores.weights[inside][_below_level(p_values, false_alarms, weights)].sum())
    return called


def _strongest_stretch(shares: np.ndarray) -> slice:
    """Return the windows whose shares, less half of the mean share, have the largest sum."""
    sums = np.concatenate(([0.0], np.cumsum(shares - shares.mean() / 2)))
    # The sum of a stretch is the difference of two sums: of its end, and the lowest before it.
    lowest = np.minimum.accumulate(sums)
    stop = int(np.argmax(sums - lowest))
    begin = 0
    if stop:
        begin = int(np.flatnonzero(sums[: stop + 1] == lowest[stop])[-1])
    return slice(begin, stop)
