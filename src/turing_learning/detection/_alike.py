"""Judged alike: an individual is abnormal if it is described otherwise than normal individuals are.

Classifiers of a run tell genuine motion from the counterfeits that lived then. Alone, none of them
knows other abnormal motion. Together, their outputs describe an individual, as statistics of its
motion do. The method that takes these outputs is named "judged alike", but all judge alike. Each

1. describes the windows of all individuals by features; where several are recorded together, by
how these differ from the median of the recording (`beside_fellows`), as a whole recording may be
slower than others (the support vector machine takes them as they are);
2. learns from normal individuals how features vary, and scores by the distance from them
(`learn_distance`);
3. scores each normal individual by what was learned without its recording
(`TrainedMethod.left_out_scores`);
4. calls an individual abnormal if nearly all normal ones have lower scores (`rank`).

Known abnormal cases, planted ones for example, are scored as normal ones are. They say which method
to read. Source: docs/decisions/0031-judged-alike.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from turing_learning.analysis import area_under_curve
from turing_learning.errors import check, number

from ._features import FIRST_FOLLOWING_SIGNAL, OWN_SIGNALS, STATISTICS_PER_SIGNAL
from ._methods import (
    MOTION,
    TINY,
    Features,
    Learner,
    Method,
    PlantedChange,
    Scorer,
    Windows,
    learn_distance,
    learn_one_class,
)
from ._ranking import Detection, MethodScores, rank

FEWEST_TOGETHER = 3
"""Individuals of a recording from which on their median is subtracted: what all share makes nobody abnormal."""
FELLOWS_WEIGHT = 0.5
"""Share of the fellows' median score that is subtracted from a score: in some recordings all differ by more."""
AREA_MARGIN = 0.02
"""By which the area of another method must be larger to be read before motion statistics: cases are few."""
SHORTEST_SHARE = 0.75
"""Of the usual windows, with fewer of which nobody is judged: chance makes scores high, see decision 0031."""
NORMAL_FOLDS = 10
"""Groups of normal individuals are left out in so many parts, at most: each part costs a training."""


@dataclass(frozen=True, eq=False)
class Case:
    """An individual that is known to be abnormal.

    One that was planted has a `kind`. It is judged by what was learned without its kind.
    """

    windows: np.ndarray  # (W, T, D)
    # of the normal recordings, among whose individuals it is; None: alone
    recording: int | None = None
    index: int = 0  # of the individual in whose stead it is
    kind: str = ""


@dataclass(frozen=True, eq=False)
class PlacedCase:
    """The features of a case, and of the normal individuals of its recording, at the same time."""

    case: Case
    group: int  # see `NormalIndividuals`
    features: np.ndarray  # (W, F)
    # (W, F) of each individual, the one in whose stead the case is included
    fellows: list[np.ndarray]


@dataclass(frozen=True, eq=False)
class NormalIndividuals:
    """Normal individuals, in pieces of recordings about as long as the motion that is judged.

    Individuals of one recording have much in common, and so they are left out together, as a group.
    Where there is only one recording, each individual is a group.
    """

    pieces: list[Windows]
    recordings: list[int]  # of each piece
    # Piece, and index in it, of all with windows there (n,)
    members: list[tuple[int, int]]
    groups: np.ndarray  # (n,), numbers from 0
    # (n,), 1 by the number of pieces in which the individual is
    weights: np.ndarray
    group_of: dict[tuple[int, int], int]  # by recording and index
    one_recording: bool
    least_windows: float  # with fewer nobody is judged, nor normal

    @classmethod
    def of(cls, recordings: Sequence[Windows], median_windows: float) -> "NormalIndividuals":
        """Cut recordings into pieces of about `median_windows`, the median number of those that are judged."""
        pieces: list[Windows] = []
        recording_of_piece: list[int] = []
        for k, windows in enumerate(recordings):
            lengths = list(filter(None, map(len, windows)))
            # A recording is cut in two from 1.75 times the length on.
            count = max(1, int(np.median(lengths or [0]) / max(median_windows, 1) + 0.25))
            for portion in range(count):
                pieces.append([_part_of(individual, portion, count) for individual in windows])
                recording_of_piece.append(k)
        lengths = []
        for windows in pieces:
            lengths += filter(None, map(len, windows))
        usual_length = float(np.median(lengths))
        # Nobody needs more windows than the median individual that is judged has. So at least half of
        # these can be judged, where pieces are longer than their motion.
        usual_length = min(usual_length, median_windows / SHORTEST_SHARE)
        # Chance makes the scores of short pieces high: they would hide who is abnormal.
        least_windows = SHORTEST_SHARE * usual_length
        members = []
        for piece, windows in enumerate(pieces):
            for index, individual in enumerate(windows):
                if len(individual) >= max(1, least_windows):
                    members.append((piece, index))
        individuals = [(recording_of_piece[piece], index) for piece, index in members]
        _, individual_of, pieces_of = np.unique(
            individuals, axis=0, return_inverse=True, return_counts=True
        )
        _, recording_of = np.unique(
            [recording for recording, _ in individuals], return_inverse=True
        )
        one_recording = not recording_of.any()
        groups = individual_of if one_recording else recording_of
        return cls(
            pieces=pieces,
            recordings=recording_of_piece,
            members=members,
            groups=groups,
            weights=1 / pieces_of[individual_of],
            group_of=dict(zip(individuals, groups.tolist(), strict=True)),
            one_recording=one_recording,
            least_windows=least_windows,
        )

    def place_cases(
        self, cases: Sequence[Case], method: Method, pieces: Sequence[list[np.ndarray]]
    ) -> list[PlacedCase]:
        """Return cases among the individuals of the first piece of their recording, by features."""
        if not cases:
            return []
        placed = []
        for case, features in zip(
            cases, method.features([case.windows for case in cases]), strict=True
        ):
            group = 0
            fellows = [features]
            if case.recording is not None:
                # Who is too short is in no group: nothing was learned from it, so that the scorer of
                # any group has not seen it.
                group = self.group_of.get((case.recording, case.index), 0)
                fellows = pieces[self.recordings.index(case.recording)]
            # A case may be longer than the piece, which is as long as the motion that is judged.
            features = features[: max(1, len(fellows[case.index]))]
            fellows = [individual[: len(features)] for individual in fellows]
            placed.append(PlacedCase(case, group, features, fellows))
        return placed


def _part_of(windows: np.ndarray, portion: int, count: int) -> np.ndarray:
    return windows[portion * len(windows) // count : (portion + 1) * len(windows) // count]


@dataclass(frozen=True, eq=False)
class TrainedMethod:
    """A method that has learned from normal individuals: from all, and from all but each group."""

    method: Method
    normal: NormalIndividuals
    pieces: list[list[Features]]  # of the normal individuals
    placed: list[PlacedCase]
    relative: bool
    scorer: Scorer
    # By the number of the group that is left out; the same for those of a fold
    scorers_without: list[Scorer]

    @classmethod
    def learn(
        cls,
        method: Method,
        normal: NormalIndividuals,
        cases: Sequence[Case],
        planted: Sequence[Case],
        relative: bool,
    ) -> "TrainedMethod":
        """Learn from normal individuals, and from planted ones if the method does."""
        features = list(map(method.features, normal.pieces))
        pieces = [beside_fellows(piece, relative) for piece in features]
        placed = normal.place_cases(cases, method, features)
        changes: list[PlantedChange] = []
        # One recording does not say how other recordings differ from the planted ones.
        if method.learns_from_planted and not normal.one_recording:
            # Features of the same cases are not computed twice.
            examples = placed
            if planted is not cases:
                examples = normal.place_cases(planted, method, features)
            changes = _changes(examples)
        learn = _learner(method, normal)
        individuals = [pieces[piece][index] for piece, index in normal.members]
        scorer = learn(individuals, relative, changes)
        scorers_without: list[Scorer] = []
        group_count = normal.groups.max() + 1
        for fold in np.array_split(np.arange(group_count), min(NORMAL_FOLDS, group_count)):
            pairs = zip(individuals, normal.groups, strict=True)
            remaining = [individual for individual, group in pairs if group not in fold]
            remaining_changes = [change for change in changes if change.group not in fold]
            scorers_without += [learn(remaining, relative, remaining_changes)] * len(fold)
        return cls(method, normal, pieces, placed, relative, scorer, scorers_without)

    def shares(self, individuals: Sequence[Features], planted: str = "") -> list[np.ndarray]:
        """Return numbers (W,) for the windows of each individual of another recording; their mean is the score.

        What was learned from planted ones of a kind is left out.
        """
        shares = []
        means = np.full(len(individuals), np.nan)
        for who, individual in enumerate(individuals):
            own_shares = np.empty(0)
            if len(individual.windows):
                own_shares = self.scorer(individual, planted)
                means[who] = own_shares.mean()
            shares.append(own_shares)
        # With one recording, individuals are left out, not recordings.
        # How much that changes the scores of other recordings is not known.
        if not self.normal.one_recording:
            factor, offset = self._correction_for_fewer(
                individuals, means[~np.isnan(means)], planted
            )
            shares = [offset + factor * own_shares for own_shares in shares]
            means = offset + factor * means
        usual_scores = self._usual_scores(means)
        return [own_shares - usual for own_shares, usual in zip(shares, usual_scores, strict=True)]

    def _correction_for_fewer(
        self, individuals: Sequence[Features], scores: np.ndarray, planted: str
    ) -> tuple[float, float]:
        """Return a factor and an offset from scores by all recordings to scores by fewer.

        Normal individuals are scored by fewer recordings, which gives higher scores. Others are
        raised to be compared with them.
        """
        scores_by_fewer = []
        # Groups of a fold have one scorer.
        scorers = dict.fromkeys(self.scorers_without)
        for individual in individuals:
            if len(individual.windows):
                scores_by_fewer.append(
                    np.mean([scorer(individual, planted).mean() for scorer in scorers])
                )
        if self.method.learn is learn_one_class:
            # Its scores can be negative: a ratio has no meaning.
            return 1.0, float(np.median(np.array(scores_by_fewer) - scores))
        return float(np.median(np.array(scores_by_fewer) / np.maximum(scores, TINY))), 0.0

    def left_out_scores(self, recording: int, individuals: Sequence[Features]) -> np.ndarray:
        """Score the individuals of a normal recording, each by what was learned without its group.

        A score is NaN without windows.
        """
        scores = np.full(len(individuals), np.nan)
        for k, individual in enumerate(individuals):
            if len(individual.windows):
                scorer = self.scorers_without[self.normal.group_of.get((recording, k), 0)]
                scores[k] = scorer(individual).mean()
        return scores

    def normal_scores(self) -> np.ndarray:
        """Return the scores (n,) of normal individuals."""
        scores = []
        for recording, piece in zip(self.normal.recordings, self.pieces, strict=True):
            of_piece = self.left_out_scores(recording, piece)
            scores.append(of_piece - self._usual_scores(of_piece))
        return np.array([scores[piece][index] for piece, index in self.normal.members])

    def case_scores(self) -> np.ndarray:
        """Score cases (C,), each by what was learned without its group and its kind."""
        scores = []
        for placed in self.placed:
            case = placed.case
            scores_of_fellows = np.zeros(1)
            if case.recording is not None:
                individuals = beside_fellows(placed.fellows, self.relative)
                scores_of_fellows = self.left_out_scores(case.recording, individuals)
            # The case stands for the normal individual, also in the median of the recording.
            company = list(placed.fellows)
            company[case.index] = placed.features
            individual = beside_fellows(company, self.relative)[case.index]
            score = self.scorers_without[placed.group](individual, case.kind).mean()
            scores.append(float(score - self._usual_scores(scores_of_fellows)[case.index]))
        return np.array(scores)

    def _usual_scores(self, scores: np.ndarray) -> np.ndarray:
        """Return what is subtracted from the scores of the individuals of a recording."""
        return FELLOWS_WEIGHT * self.relative * medians_of_fellows(scores)

    def scores(self, motion: Windows) -> MethodScores:
        """Return the scores of motion that is judged, and of normal individuals."""
        normal = self.normal_scores()
        area = None
        if self.placed:
            area = area_under_curve(self.case_scores(), normal, self.normal.weights)
        individuals = beside_fellows(self.method.features(motion), self.relative)
        return MethodScores(
            name=self.method.name,
            shares=self.shares(individuals),
            normal=normal,
            weights=self.normal.weights,
            groups=self.normal.groups,
            area=area,
        )


def _learner(method: Method, normal: NormalIndividuals) -> Learner:
    """Return how a method learns.

    One recording has too few individuals to say how all features go together. So the covariances of
    an individual's own motion with what it does among others are taken as 0 then. Features are in
    the order of `motion_statistics`, own motion first: only methods that learn from planted
    individuals have them.
    """
    signals = normal.pieces[0][0][..., method.columns].shape[-1]
    if not (normal.one_recording and method.learns_from_planted and signals > OWN_SIGNALS):
        return method.learn
    described = min(signals, FIRST_FOLLOWING_SIGNAL) - OWN_SIGNALS
    means = max(signals - FIRST_FOLLOWING_SIGNAL, 0)
    return partial(learn_distance, independent=STATISTICS_PER_SIGNAL * described + means)


def _changes(planted: Sequence[PlacedCase]) -> list[PlantedChange]:
    """Return how planting changed the mean features of the individuals that have windows."""
    changes = []
    for placed in planted:
        before = placed.fellows[placed.case.index]
        if len(before):
            change = placed.features.mean(axis=0) - before.mean(axis=0)
            changes.append(PlantedChange(placed.group, placed.case.kind, change))
    return changes


def beside_fellows(features: Sequence[np.ndarray], relative: bool) -> list[Features]:
    """Return the individuals of a recording, if `relative` with the median of all."""
    usual: np.ndarray | float = 0.0
    means = [windows.mean(axis=0) for windows in features if len(windows)]
    if relative and means:
        usual = np.median(means, axis=0)
    return [Features(windows, usual) for windows in features]


def medians_of_fellows(scores: np.ndarray) -> np.ndarray:
    """Return for each individual of a recording the median score of the others, 0 without any.

    A score is NaN without windows.
    """
    medians = np.zeros(len(scores))
    for k in range(len(scores)):
        fellows = np.delete(scores, k)
        fellows = fellows[~np.isnan(fellows)]
        if len(fellows):
            medians[k] = np.median(fellows)
    return medians


def judge_alike(
    methods: Sequence[Method], motion: Windows, normal: Sequence[Windows], *, names: Sequence[str],
    cases: Sequence[Case] = (), planted: Sequence[Case] = (), cases_in_words: str = "",
    false_alarms: float = 0.01, relative: bool | None = None, promised: bool = True, recordings: int | None = None,
) -> Detection:  # fmt: skip
    """Rank individuals by how unlike normal ones they are.

    Parameters
    ----------
    methods
        Each gives a ranking.
    motion
        Windows of the individuals that are judged; `names` are theirs.
    normal
        Windows of normal individuals, for each recording.
    cases
        Individuals that are known to be abnormal, by which the methods are compared.
    planted
        Those that motion statistics learn from.
    relative
        Whether the median of the fellows is subtracted. None: if each recording has at least three
        individuals.
    promised
        Whether normal individuals stand for others, so that a rate of false alarms can be promised.
    recordings
        How many recordings of the user's are normal. None takes their number, 0 says that they are
        one pool.
    """
    number("false_alarms", false_alarms, above=0, below=1)
    check(any(map(len, motion)), "motion", "hold a window", "none")
    # individuals with a window, of each recording
    counts = [sum(map(bool, map(len, windows))) for windows in (motion, *normal)]
    normal_count = sum(counts[1:])
    rule = "hold at least 2 normal individuals with a window"
    check(normal_count >= 2, "genuine", rule, normal_count, "Record more of them.")
    if relative is None:
        relative = min(filter(None, counts)) >= FEWEST_TOGETHER
    # Normal individuals are judged by as many windows as those in question have
    median_windows = int(np.median(list(filter(None, map(len, motion)))))
    individuals = NormalIndividuals.of(normal, median_windows)
    normal_count = len(individuals.group_of)
    rule = (
        f"hold at least 2 normal individuals with {individuals.least_windows:.3g} windows or more"
    )
    check(normal_count >= 2, "genuine", rule, normal_count, "Record them for longer.")
    # With n normal individuals no rate below 1 / (n + 1) can be promised
    level = None
    if promised:
        level = max(false_alarms, 1 / (normal_count + 1))
    promised_rate = false_alarms if promised else None
    rankings = []
    for method in methods:
        trained = TrainedMethod.learn(method, individuals, cases, planted, relative)
        scores = trained.scores(motion)
        rankings.append(rank(scores, names, promised_rate, individuals.least_windows))
    # The method that tells known cases best comes first; motion statistics where they are nearly as good
    rankings.sort(
        key=lambda ranking: -(ranking.area or 0.0) - (ranking.name == MOTION) * AREA_MARGIN
    )
    return Detection(
        rankings=tuple(rankings),
        false_alarms=false_alarms,
        level=level,
        normal=normal_count,
        recordings=len(normal) if recordings is None else recordings,
        cases=cases_in_words if cases else "",
        least_windows=individuals.least_windows,
    )
