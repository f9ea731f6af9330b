"""Judged alike: whoever belongs is judged by every classifier as those who belong are.

A classifier has a direction: genuine against the counterfeits that lived then. Many together, taken without a
direction, describe an individual. The score of an individual is the Mahalanobis distance of its mean outputs
from those of normal individuals. Motion statistics are scored by the same distance, and are read first. Two baselines,
few statistics of each window and a one-class support vector machine, are beside. Source: docs/decisions/0031-judged-alike.md.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np

from turing_learning.analysis import area_under_curve
from turing_learning.analysis.statistics import rhythm_statistics, signal_statistics, signal_trends
from turing_learning.errors import check, number

FELLOWS = 3
"""Individuals of a recording from which on their median is subtracted: what all share is no sign of anybody."""
BESIDE = 0.5
"""Share of the median score of the fellows that is subtracted from a score: in some recordings all differ more than in others."""
OWN = 5
"""Signals that describe own motion: the first ones."""
RHYTHM = 3
"""Signals whose rhythm is looked at: speed, turn, and acceleration."""
STATISTICS = 8
"""Window statistics of a signal, and its trend."""
MEANS = 13
"""Signals from this one on say how much an individual does what others did before; only their means are used."""
SHRINKAGE = 0.1
"""Added to each variance, as a share of their mean."""
WITHIN = 0.3
"""Share of the covariance of windows of one individual, as large as that of individuals, that is added for planted ones."""
PLANTED = 0.1
"""Weight of the mean square along the directions of planted individuals; it and the squared distance are 1 for normal ones."""
LEAST_SPREAD = 1e-3
"""Standard deviation from which on a feature counts as it is: an output that never changes is no measure."""
CLASSIFIERS, MOTION = "judged alike", "motion statistics"
BASELINES = ("window statistics", "one-class SVM")
MARGIN = 0.02
"""By how much the area of another way to look must be larger to be read instead of motion statistics: few cases decide it."""
FOLDS = 10
WINDOWS = 2000  # that a support vector machine learns from, at most

Windows = Sequence[np.ndarray]
"""What is known of the individuals of one recording: of each its windows (W, T, D), in order of time."""


class Seen(NamedTuple):
    """An individual as a way to look sees it."""

    windows: np.ndarray  # (W, F), its features
    shared: np.ndarray | float = 0.0  # (F,), what is usual for all of the recording


class Planted(NamedTuple):
    """Somebody who behaves otherwise, in the place of a normal individual."""

    whose: int  # with whom it is left out, see `Normal`
    kind: str
    change: np.ndarray  # (F,), of the mean features


Scorer = Callable[..., np.ndarray]
"""From what is seen of an individual to what each of its windows (W,) adds: the mean says how unlike normal ones it is.
What was learned from planted individuals of a kind, a second argument, is left out."""


def split(values: np.ndarray, like: Windows) -> list[np.ndarray]:
    """Cut what was found of all windows, one individual after the other, into parts as long as the individuals'."""
    return np.split(values, np.cumsum([len(each) for each in like])[:-1])


def distance(normal: Sequence[Seen], relative: bool, planted: Sequence[Planted] = (), apart: int = 0) -> Scorer:
    """Learn how normal individuals deviate from what is usual; score by the Mahalanobis distance, whose square is a sum.

    Of planted individuals, learn for each kind the direction in which it differs most (Fisher's linear
    discriminant); the mean square along these is added to that of the distance. If `relative`, what is usual is
    the median of the fellows. Features are in units of the standard deviations of windows. Covariances of the last
    `apart` features with the others are taken as 0.
    """
    spread = np.maximum(np.concatenate([each.windows for each in normal]).std(axis=0), LEAST_SPREAD)
    deviations = np.stack([(each.windows.mean(axis=0) - each.shared) / spread for each in normal])
    center = 0.0 if relative else deviations.mean(axis=0)
    around = deviations - center
    covariance = around.T @ around / max(len(around) - 1, 1)
    if apart:
        covariance[:-apart, -apart:] = covariance[-apart:, :-apart] = 0.0
    ridge = max(SHRINKAGE * float(np.trace(covariance)) / len(covariance), 1e-12)
    covariance = covariance + ridge * np.eye(len(covariance))
    inverse = np.linalg.inv(covariance)
    inverse /= max(float(np.einsum("nf,fg,ng->n", around, inverse, around).mean()), 1e-12)
    changes: dict[str, list[np.ndarray]] = {}
    for each in planted:
        changes.setdefault(each.kind, []).append(each.change / spread)
    kinds, towards = np.array(list(changes)), np.empty((len(inverse), 0))
    if changes:
        windows = np.concatenate([(each.windows - each.windows.mean(axis=0)) / spread for each in normal])
        within = windows.T @ windows
        covariance = covariance + WITHIN * np.trace(covariance) / max(float(np.trace(within)), 1e-12) * within
        towards = np.linalg.solve(covariance, np.stack([np.mean(some, axis=0) for some in changes.values()], axis=1))
        towards /= np.maximum(np.sqrt(((around @ towards) ** 2).mean(axis=0)), 1e-12)

    def score(one: Seen, without: str = "") -> np.ndarray:
        weights, unlike, kept = inverse, (one.windows - one.shared) / spread - center, towards[:, kinds != without]
        if kept.size:
            weights = inverse + PLANTED / kept.shape[1] * (kept @ kept.T)
        mean = unlike.mean(axis=0)
        way = weights @ mean
        return np.asarray(unlike @ way / max(float(np.sqrt(mean @ way)), 1e-12))

    return score


def one_class(normal: Sequence[Seen], relative: bool, planted: Sequence[Planted] = ()) -> Scorer:
    """Learn by a one-class support vector machine, as scikit-learn has it."""
    from sklearn.svm import OneClassSVM

    windows = np.concatenate([each.windows for each in normal])
    center, spread = windows.mean(axis=0), np.maximum(windows.std(axis=0), 1e-9)
    chosen = np.random.default_rng(len(windows)).permutation(len(windows))[:WINDOWS]
    machine = OneClassSVM(nu=0.1, gamma="scale").fit((windows[chosen] - center) / spread)
    return lambda one, without="": -machine.decision_function((one.windows - center) / spread)


@dataclass(frozen=True, eq=False)
class Eye:
    """A way to look at some columns of windows (K, T, D): how it describes them by features (K, F), and learns what is usual."""

    name: str
    describe: Callable[[np.ndarray], np.ndarray]
    learn: Callable[[Sequence[Seen], bool, Sequence[Planted]], Scorer] = distance
    columns: slice = field(default_factory=lambda: slice(None))

    def see(self, windows: Windows) -> list[np.ndarray]:
        """Return the features (W, F) of the windows of each individual."""
        return split(self.describe(np.concatenate(windows)[..., self.columns]), windows)


def motion_statistics(windows: np.ndarray) -> np.ndarray:
    """Return window statistics and the trend of signals, and the rhythm of the first three (K, F).

    Statistics of the signals that do not describe own motion come last.
    """
    parts = [rhythm_statistics(windows[..., :RHYTHM])]
    trends = signal_trends(windows)
    for some in (slice(OWN), slice(OWN, MEANS)):
        parts += [signal_statistics(windows[..., some]), trends[:, some]]
    parts.append(windows[..., MEANS:].mean(axis=1))
    return np.concatenate(parts, axis=1)


STATISTICS_EYE = Eye(BASELINES[0], signal_statistics)
ONE_CLASS_EYE = Eye(BASELINES[1], signal_statistics, one_class)
MOTION_EYE = Eye(MOTION, motion_statistics)
"""The only one that is shown planted individuals."""


@dataclass(frozen=True)
class Standing:
    """How unlike normal ones an individual is."""

    individual: str  #: Its name
    rank: int  #: 1 for the most abnormal
    score: float  #: Mean of `shares`; NaN without windows
    #: Share of normal individuals with so high a score, the individual itself counted; NaN where none are known
    p_value: float
    abnormal: bool | None  #: Whether the p-value is at most the level; None where no level can be promised
    windows: int  #: Number of its windows W
    shares: np.ndarray  #: (W,), what each window adds to the score
    flagged: np.ndarray  #: (W,), whether it belongs to the stretch that makes an individual abnormal


@dataclass(frozen=True, eq=False)
class Ranking:
    """What one way to look says, by its `name`, of the individuals in the order of the motion."""

    name: str
    individuals: tuple[Standing, ...]
    #: Probability that a case that is known to be abnormal scores above a normal individual; None without such cases
    area: float | None
    #: How many normal individuals would have been called abnormal, each by the recordings of the others; NaN for none
    called: float


@dataclass(frozen=True, eq=False)
class Detection:
    """What is said of the individuals of a recording."""

    #: The first is the one to read: motion statistics, unless another way tells known cases clearly better
    rankings: tuple[Ranking, ...]
    false_alarms: float  #: Share of normal individuals that may be called abnormal, as it was asked for
    level: float | None  #: The share that can be promised; None if none can
    normal: int  #: Number of normal individuals
    recordings: int  #: That they are from; 0 where all are of one pool
    cases: str  #: What abnormal cases are known, in words; empty for none

    @property
    def individuals(self) -> tuple[Standing, ...]:
        """Of the ranking to read."""
        return self.rankings[0].individuals

    @property
    def remarks(self) -> tuple[str, ...]:
        """What can be promised, what the normal individuals say, and how the ways to look compare; a sentence each."""
        first, said = self.rankings[0], []
        if self.level is None:
            others = "but those that the run has learned from " * bool(self.recordings)
            given = f"as no recordings of normal individuals {others}are given (`genuine`)"
            said.append(f"Nobody is called abnormal, {given}; the ranking stands.")
        elif self.level > self.false_alarms:
            said.append(
                f"A false-alarm rate of {self.false_alarms:.3g} cannot be promised by {self.normal} normal individuals: the lowest "
                f"is 1 of {self.normal + 1}, {self.level:.2g}. Individuals are abnormal if their score is above all of these."
            )
        if self.level is not None:
            who = f"Of the {self.normal} normal individuals {first.called:.3g}"
            if self.recordings:
                own = f"On your normal recording{'s' * (self.recordings > 1)}"
                who = f"{own} {first.called:.3g} of {self.normal} individuals"
            said.append(f"{who} would have been called abnormal.")
        areas = {each.name: each.area for each in self.rankings}
        compared = ", ".join(name if area is None else f"{name} {area:.3f}" for name, area in areas.items())
        if not self.cases:
            return (*said, f"Also looked at: {compared}.")
        rivals = [area or 0.0 for name, area in areas.items() if name in BASELINES]
        if CLASSIFIERS in areas and rivals:
            beat = "beat" if (areas[CLASSIFIERS] or 0.0) > max(rivals) else "do not beat"
            said.append(f"On {self.cases} the classifiers {beat} the baselines; area under the ROC curve: {compared}.")
        return tuple(said)


@dataclass(frozen=True, eq=False)
class Case:
    """An individual that is known to be abnormal: its windows (W, T, D), among the fellows of a recording, or alone (None).

    One that was planted has a `kind`; it is judged by what was learned without its kind.
    """

    windows: np.ndarray
    recording: int | None = None
    place: int = 0
    kind: str = ""


def judge_alike(
    eyes: Sequence[Eye], motion: Windows, normal: Sequence[Windows], *, names: Sequence[str],
    cases: Sequence[Case] = (), planted: Sequence[Case] = (), said_of_cases: str = "", false_alarms: float = 0.01,
    relative: bool | None = None, promised: bool = True, recordings: int | None = None,
) -> Detection:  # fmt: skip
    """Rank individuals by how unlike normal ones they are; every normal one is scored by what was learned without its recording.

    Ways to look are compared by `cases`; those that learn from abnormal individuals are shown `planted`. The
    median of the fellows is subtracted if `relative`; None: if each recording has at least three individuals. A
    rate is `promised` if normal individuals stand for others. `recordings` of the user's are normal; None takes
    their number, 0 says a pool.
    """
    number("false_alarms", false_alarms, above=0, below=1)
    check(any(map(len, motion)), "motion", "hold a window", "none")
    there = [sum(1 for each in windows if len(each)) for windows in (motion, *normal)]
    counted = sum(there[1:])
    check(counted >= 2, "genuine", "hold at least 2 normal individuals with a window", counted, "Record more of them.")
    relative = min(filter(None, there)) >= FELLOWS if relative is None else relative
    known = Normal.of(normal, int(np.median([len(each) for each in motion if len(each)])))
    looks = [known.look(eye, motion, cases, planted, relative) for eye in eyes]
    rankings = [_ranked(look, names, false_alarms if promised else None) for look in looks]
    rankings.sort(key=lambda ranking: -(ranking.area or 0.0) - (ranking.name == MOTION) * MARGIN)
    return Detection(
        rankings=tuple(rankings),
        false_alarms=false_alarms,
        level=max(false_alarms, 1 / (counted + 1)) if promised else None,
        normal=counted,
        recordings=len(normal) if recordings is None else recordings,
        cases=said_of_cases if cases else "",
    )


def among(features: Sequence[np.ndarray], relative: bool) -> list[Seen]:
    """Return the individuals of a recording beside the median of all that have windows, or beside nothing."""
    means = [each.mean(axis=0) for each in features if len(each) and relative]
    shared = np.median(means, axis=0) if means else 0.0
    return [Seen(each, shared) for each in features]


def of_fellows(scores: np.ndarray) -> np.ndarray:
    """Return for each individual of a recording the median score of the others, 0 without any; a score is NaN without windows."""
    others = [np.delete(scores, k) for k in range(len(scores))]
    return np.array([np.median(each[~np.isnan(each)]) if not np.isnan(each).all() else 0.0 for each in others])


@dataclass(frozen=True, eq=False)
class Look:
    """What one way to look finds."""

    name: str
    known: "Normal"
    shares: list[np.ndarray]  # (W,) of each of the individuals
    normal: np.ndarray  # (n,), scores of normal individuals
    cases: np.ndarray  # (K,), scores of cases
    #: From the individuals of a recording to the shares of each. Normal individuals are scored by what was learned from
    #: fewer recordings, which gives higher scores; the scores of others are raised to match. What is usual for the fellows
    #: is subtracted from both
    score: Callable[..., list[np.ndarray]]

    @property
    def area(self) -> float | None:
        return area_under_curve(self.cases, self.normal, self.known.weights) if len(self.cases) else None


@dataclass(frozen=True, eq=False)
class Normal:
    """Normal individuals of recordings that are cut into pieces."""

    pieces: list[Windows]
    owners: list[int]  # of which recording each piece is
    members: list[tuple[int, int]]  # piece and place in it of all who have windows there (n,)
    single: bool  # whether these are of one recording
    whose: np.ndarray  # (n,), a recording, or an individual where there is one recording: with whom each is left out
    weights: np.ndarray  # (n,), that sum to 1 for each individual
    number: dict[tuple[int, int], int]  # of whose, by recording and place

    @classmethod
    def of(cls, recordings: Sequence[Windows], length: float) -> "Normal":
        """Cut recordings into pieces of about so many windows, as many as the motion."""
        pieces, owners = list[Windows](), list[int]()
        for k, windows in enumerate(recordings):
            count = max(1, int(np.median([len(each) for each in windows if len(each)] or [0]) / max(length, 1) + 0.25))
            for part in range(count):
                pieces.append([each[part * len(each) // count : (part + 1) * len(each) // count] for each in windows])
                owners.append(k)
        members = [(p, k) for p, windows in enumerate(pieces) for k, each in enumerate(windows) if len(each)]
        own = [(owners[p], k) for p, k in members]
        _, individual, parts = np.unique(own, axis=0, return_inverse=True, return_counts=True)
        _, recording = np.unique([r for r, _ in own], return_inverse=True)
        single = not recording.any()
        whose = individual if single else recording
        number = dict(zip(own, whose.tolist(), strict=True))
        return cls(pieces, owners, members, single, whose, 1 / parts[individual], number)

    def placed(
        self, eye: Eye, cases: Sequence[Case], seen: Sequence[list[np.ndarray]]
    ) -> Iterator[tuple[Case, int, np.ndarray, list[np.ndarray]]]:
        """Yield cases, the number of whose they are, what is seen of each, and of all of its recording at about the same time."""
        for case, own in zip(cases, eye.see([case.windows for case in cases]) if cases else (), strict=True):
            whose, fellows = 0, [own]
            if case.recording is not None:
                whose, fellows = self.number[case.recording, case.place], seen[self.owners.index(case.recording)]
            own = own[: max(1, len(fellows[case.place]))]
            yield case, whose, own, [each[: len(own)] for each in fellows]

    def look(self, eye: Eye, motion: Windows, cases: Sequence[Case], planted: Sequence[Case], relative: bool) -> Look:
        """Learn one way to look; score motion, normal individuals, and cases, the known ones by what was learned without them."""
        seen = [eye.see(windows) for windows in self.pieces]
        beside = [among(each, relative) for each in seen]
        usual, shown = [beside[p][k] for p, k in self.members], list[Planted]()
        learn, motion_eye = eye.learn, eye.name == MOTION
        signals = self.pieces[0][0][..., eye.columns].shape[-1]
        if self.single and motion_eye and signals > OWN:  # one recording does not say how recordings differ
            learn = partial(distance, apart=STATISTICS * (min(signals, MEANS) - OWN) + max(signals - MEANS, 0))
        compared, part = list(self.placed(eye, cases, seen)), BESIDE * relative
        examples = compared if planted is cases else self.placed(eye, planted, seen)  # features are computed once
        for case, whose, own, fellows in examples if motion_eye and not self.single else ():
            if len(before := fellows[case.place]):
                shown.append(Planted(whose, case.kind, own.mean(axis=0) - before.mean(axis=0)))
        whole, without, count = learn(usual, relative, shown), list[Scorer](), self.whose.max() + 1
        for fold in np.array_split(np.arange(count), min(FOLDS, count)):
            kept = [each for each, whose in zip(usual, self.whose, strict=True) if whose not in fold]
            without += [learn(kept, relative, [each for each in shown if each.whose not in fold])] * len(fold)

        def score(ones: Sequence[Seen], kind: str = "") -> list[np.ndarray]:
            shares = [whole(one, kind) if len(one.windows) else np.empty(0) for one in ones]
            means = np.array([each.mean() if len(each) else np.nan for each in shares])
            if not self.single:  # else individuals are left out, not recordings: the difference is not known
                scorers = dict.fromkeys(without)
                apart = [np.mean([each(one, kind).mean() for each in scorers]) for one in ones if len(one.windows)]
                scored = means[~np.isnan(means)]
                if eye.learn is one_class:  # its scores can be negative: a ratio has no meaning
                    higher, times = np.median(np.array(apart) - scored), 1.0
                else:
                    higher, times = 0.0, np.median(np.array(apart) / np.maximum(scored, 1e-12))
                shares, means = [higher + times * each for each in shares], higher + times * means
            return [each - less for each, less in zip(shares, part * of_fellows(means), strict=True)]

        def left_out(recording: int, ones: Sequence[Seen]) -> np.ndarray:
            """Return scores of the individuals of a normal recording by what was learned without them, NaN without windows."""
            by = [without[self.number.get((recording, k), 0)] for k in range(len(ones))]
            return np.array(
                [each(one).mean() if len(one.windows) else np.nan for each, one in zip(by, ones, strict=True)]
            )

        shares, known = score(among(eye.see(motion), relative)), list[float]()
        normal = [left_out(owner, each) for owner, each in zip(self.owners, beside, strict=True)]
        scores = np.concatenate([each - part * of_fellows(each) for each in normal])
        for case, whose, own, fellows in compared:
            others = np.zeros(1) if case.recording is None else left_out(case.recording, among(fellows, relative))
            fellows[case.place] = own
            unlike = without[whose](among(fellows, relative)[case.place], case.kind).mean()
            known.append(float(unlike - part * of_fellows(others)[case.place]))
        return Look(eye.name, self, shares, scores[~np.isnan(scores)], np.array(known), score)


def _ranked(look: Look, names: Sequence[str], false_alarms: float | None) -> Ranking:
    """Rank individuals; without a rate of false alarms nobody has a p-value."""

    def judged(scores: np.ndarray, by: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the p-values of scores among those of some normal individuals, NaN for NaN, and which of them say abnormal."""
        normal, weights = look.normal[by], look.known.weights[by]
        order, many = np.argsort(normal), weights.sum() + 1
        above = np.append(np.cumsum(weights[order][::-1])[::-1], 0.0)
        found = np.where(np.isnan(scores), np.nan, (1 + above[np.searchsorted(normal[order], scores, "left")]) / many)
        return found, found <= max(false_alarms or 0.0, 1 / many) + 1e-9

    means = np.array([each.mean() if len(each) else np.nan for each in look.shares])
    ranks = np.argsort(np.argsort(-means, kind="stable")) + 1  # who has no windows comes last
    chances, called = np.full(len(means), np.nan), float("nan")
    abnormal: list[bool | None] = [None] * len(means)
    if false_alarms is not None:
        chances, unlike = judged(means, look.known.whose >= 0)
        abnormal, called = unlike.tolist(), 0.0
        for one in np.unique(look.known.whose):
            own = look.known.whose == one
            called += float(look.known.weights[own][judged(look.normal[own], ~own)[1]].sum())
    individuals = []
    for k, (name, shares) in enumerate(zip(names, look.shares, strict=True)):
        flagged = np.zeros(len(shares), dtype=bool)
        if abnormal[k]:  # by the stretch in which the shares above half of their mean sum to most
            sums = np.concatenate(([0.0], np.cumsum(shares - shares.mean() / 2)))
            lowest = np.minimum.accumulate(sums)
            end = int(np.argmax(sums - lowest))
            begin = int(np.flatnonzero(sums[: end + 1] == lowest[end])[-1]) if end else 0
            flagged[begin:end] = True
        said = (name, int(ranks[k]), float(means[k]), float(chances[k]), abnormal[k], len(shares))
        individuals.append(Standing(*said, shares, flagged))
    return Ranking(look.name, tuple(individuals), look.area, called)
