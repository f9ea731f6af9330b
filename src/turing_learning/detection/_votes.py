"""Rules of detection by votes: who votes, how much a vote counts, and what it says."""

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np

from turing_learning.analysis import Jury, competence
from turing_learning.coevolution import Classifier
from turing_learning.config import ConfigurationError
from turing_learning.errors import check, integer, nearest, number
from turing_learning.report import counted

from ._chance import (
    CHANCE_DRAWS,
    SCORE_DIGITS,
    Scan,
    TimedVerdict,
    genuine_samples_needed,
    p_values,
)
from ._methods import split_by_individual
from ._motion import Motion, RecordedMotion, checked_motion
from ._run import StoredRun, motion_to_calibrate, run_classifiers

RULES = ("fittest", "unanimous", "discriminant")
"""Names of the rules; see `Detector`."""
DEFAULT_RULE = "discriminant"
COVARIANCE_SHRINKAGE = 0.5
"""Of covariances towards none between classifiers: many votes are nearly the same."""
LEAST_VARIANCE = 1e-3
"""Added to variances: a classifier that never erred may err yet."""
LEAST_SCORE = 10.0**-SCORE_DIGITS
"""The least score above 0, as scores are rounded."""
_LOGGER = logging.getLogger("turing_learning")


@dataclass(frozen=True)
class SampleVerdict:
    """What a detector says about an individual."""

    individual: str  #: Its name
    #: Mean over its samples of the weighted share of votes that say genuine; 0 to 1
    score: float
    #: How often chance makes a score as low, see `Detector.p_values`
    p_value: float
    #: Share of its samples whose score is nearer to the mean score of genuine samples than to that of abnormal ones
    genuine_share: float
    abnormal: bool  #: Whether it behaves abnormally
    #: Number, from 1, of the sample at which abnormal motion most likely begins; None for a normal individual
    since: int | None


@dataclass(frozen=True, eq=False)
class Detector:
    """Tell from motion which individuals behave abnormally, by votes of classifiers.

    Classifiers vote on each sample; its score is the weighted share of votes that say genuine. An
    individual is called abnormal if the mean score of its samples is so low that chance makes it so
    in the stated share of cases at most. Three rules choose the voters:

    ==============  =============================================  ==========================================
    rule            voters                                         abnormal if
    ==============  =============================================  ==========================================
    "fittest"       the subjectively best of the last generation   low mean score
    "unanimous"     the one of the last generation that decides    all samples are judged counterfeit: with
                    best by this rule                              ten, the rule of the paper
    "discriminant"  all of the last generation, and the best of    low mean score
                    up to 100 generations, weighted together
    ==============  =============================================  ==========================================

    "discriminant" gives a vote to classifiers whose Youden's J = specificity + sensitivity - 1 is
    positive on genuine and on abnormal motion, and weighs them by Fisher's linear discriminant: who
    says the same as others counts for less, and who hardly ever errs for more. Chance is measured
    on genuine individuals that had no part in the weights, see `p_values`.

    Source: paper, section 4.4; docs/decisions/0014, 0019 and 0031.

    Parameters
    ----------
    jury
        The voters and the weights of their votes.
    rule
        One of `RULES`.
    false_alarms
        Share of genuine individuals that may be called abnormal, in (0, 1); "unanimous" does not
        keep to it.
    genuine_scores, abnormal_scores : (any,)
        Scores of single samples, by which p-values and the beginning of abnormal motion are found.
    steps, signals
        Steps T and signals D of a sample.
    """

    jury: Jury
    rule: str
    false_alarms: float
    genuine_scores: np.ndarray
    abnormal_scores: np.ndarray
    steps: int
    signals: int

    @classmethod
    def calibrate(
        cls, classifier: Classifier, genomes: np.ndarray, *, genuine: np.ndarray, abnormal: np.ndarray,
        rule: str = DEFAULT_RULE, false_alarms: float = 0.01,
    ) -> "Detector":  # fmt: skip
        """Choose voters and weights; nothing is trained.

        Parameters
        ----------
        classifier
            Judges.
        genomes : (N, Q)
            Classifiers to choose from.
        genuine : (individuals, samples, T, D)
            Motion of normal individuals, at least two. The first half weighs the votes, the second
            says what scores are usual.
        abnormal : (individuals, samples, T, D)
            Other motion, of any that behave otherwise, for example in `random_controllers`, or of a
            run's random models.
        rule, false_alarms
            As for the class.
        """
        check_rule(rule)
        number("false_alarms", false_alarms, above=0, below=1, error=ConfigurationError)
        genuine = checked_motion("genuine", genuine)
        steps, signals = genuine.shape[2:]
        abnormal = checked_motion("abnormal", abnormal, T=steps, D=signals)
        check(len(genuine) >= 2, "genuine", "hold at least 2 individuals", len(genuine))
        same = _distinct_samples(abnormal) <= _distinct_samples(genuine)
        got = f"{abnormal.shape[0] * abnormal.shape[1]} samples that are all in `genuine`, too"
        remedy = "Give motion of individuals that behave otherwise."
        check(not same, "abnormal", "be other motion than `genuine`", got, remedy)
        everybody = Jury(classifier, np.asarray(genomes), np.ones(len(genomes)))
        half = len(genuine) // 2
        weights = weigh(rule, everybody.votes(genuine[:half]), everybody.votes(abnormal))
        voters = weights > 0
        jury = Jury(classifier, everybody.genomes[voters], weights[voters])
        return cls(
            jury=jury,
            rule=rule,
            false_alarms=false_alarms,
            genuine_scores=np.round(jury.score(genuine[half:]), SCORE_DIGITS).ravel(),
            abnormal_scores=np.round(jury.score(abnormal), SCORE_DIGITS).ravel(),
            steps=steps,
            signals=signals,
        )

    @classmethod
    def from_run(
        cls, result: StoredRun, *, rule: str = DEFAULT_RULE, false_alarms: float = 0.01,
        genuine: np.ndarray | None = None, abnormal: np.ndarray | None = None, behaviors: int = 100,
        trials: int = 10, seed: int = 0, threads: int | None = None,
    ) -> "Detector":  # fmt: skip
        """Make a detector of the classifiers of a run.

        Parameters
        ----------
        result
            A run that is stored in a folder with its full history:
            ``turing_learning.load_run(path)``.
        genuine, abnormal : (individuals, samples, T, D)
            Motion for `calibrate`. None takes what the run has stored, as runs in a laboratory and
            on custom systems do, or simulates the run's scenario, agents beside individuals with
            random controllers.
        behaviors, trials
            Number of random controllers that are simulated, >= 1, and of trials of each.
        """
        check_rule(rule)
        if threads is not None:
            integer("threads", threads, 1, error=ConfigurationError)
        run = run_classifiers(result)
        if genuine is None or abnormal is None:
            stored = run.calibration or motion_to_calibrate(run, behaviors, trials, seed, threads)
            if genuine is None:
                genuine = stored[0]
            if abnormal is None:
                abnormal = stored[1]
        return cls.calibrate(
            run.classifier,
            run.voters(rule),
            genuine=genuine,
            abnormal=abnormal,
            rule=rule,
            false_alarms=false_alarms,
        )

    @property
    def genomes(self) -> np.ndarray:
        """The voters (N, Q)."""
        return self.jury.genomes

    @property
    def weights(self) -> np.ndarray:
        """Of their votes (N,), above 0; they sum to 1."""
        return self.jury.weights

    def judge(self, samples: np.ndarray) -> np.ndarray:
        """Return the weighted shares (S,) of votes that say genuine, of samples (S, T, D)."""
        return self._judge_all(
            samples[None] if isinstance(samples, np.ndarray) else [samples], "samples"
        )[0]

    def p_values(self, motion: np.ndarray) -> np.ndarray:
        """Return for each individual how often chance makes its mean score as low as it is.

        The share (individuals,) of all choices of S samples, out of its own and the genuine ones of
        the calibration, with a mean score that is as low or lower: see `_chance.p_values`.
        """
        return p_values(self.genuine_scores, self._judge_all(motion, "motion"))

    def abnormal(self, samples: np.ndarray) -> bool:
        """Return whether an individual that moves as in samples (S, T, D) is abnormal; see `verdicts`."""
        return bool(self._called(self.judge(samples)[None])[1][0])

    def called_abnormal(self, motion: np.ndarray) -> np.ndarray:
        """Return whether each individual (individuals,) of motion (individuals, S, T, D) behaves abnormally; see `verdicts`."""
        return self._called(self._judge_all(motion, "motion"))[1]

    def _called(self, scores: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the p-values of individuals with the scores (individuals, S), and whether they are called abnormal."""
        chances = p_values(self.genuine_scores, scores)
        if self.rule == "unanimous":
            return chances, _mean(scores) < LEAST_SCORE
        return chances, chances <= self.false_alarms

    def verdicts(self, motion: Motion | np.ndarray) -> tuple[SampleVerdict, ...]:
        """Say of each individual whether its p-value, or the rule, calls it abnormal, and since when.

        A warning is logged if nobody could be called abnormal, or the detector is blind to the
        motion of its calibration. The beginning is where the sum of what speaks for abnormal
        motion, from there to the end, is largest (Page, Continuous inspection schemes, 1954). A
        sample speaks for it by how far its score is below the middle between the mean scores of
        genuine and of abnormal samples.

        Parameters
        ----------
        motion
            Samples of individuals in the order of observation, an array (individuals, samples, T,
            D) or with names.
        """
        names = None
        samples = motion
        if isinstance(motion, Motion):
            names = motion.individuals
            samples = motion.samples
        scores = self._judge_all(samples, "motion", names)
        if names is None:
            names = tuple(str(k + 1) for k in range(len(scores)))
        self._warn_if_blind()
        self._warn_if_no_score_is_low_enough(scores.shape[1])
        middle = float(self.genuine_scores.mean() + self.abnormal_scores.mean()) / 2
        chances, abnormal = self._called(scores)
        verdicts = []
        for k, name in enumerate(names):
            since = None
            if abnormal[k]:
                # Sums from each sample to the end.
                evidence = np.cumsum((middle - scores[k])[::-1])[::-1]
                since = int(np.argmax(evidence)) + 1
            verdicts.append(
                SampleVerdict(
                    individual=name,
                    score=float(_mean(scores[k])),
                    p_value=float(chances[k]),
                    genuine_share=float(np.mean(scores[k] >= middle)),
                    abnormal=bool(abnormal[k]),
                    since=since,
                )
            )
        return tuple(verdicts)

    def timeline(self, motion: RecordedMotion) -> tuple[TimedVerdict, ...]:
        """Say of each individual of a recording whether it behaves abnormally at some time, and when.

        A window speaks against an individual by how low its score lies among those of genuine
        samples, a stretch of consecutive windows by the mean of this in standard errors. An
        individual is called abnormal if its strongest stretch, of whatever length, is stronger than
        a threshold, placed where the stated share of genuine individuals with as many windows would
        be called so, if windows are independent. All rules keep to that rate here. Warnings are
        logged as by `verdicts`.

        Source: Glaz, Naus and Wallenstein, Scan statistics (2001); docs/decisions/0022.
        """
        scores = split_by_individual(self.judge(np.concatenate(motion.samples)), motion.samples)
        self._warn_if_blind()
        scan = Scan(self.genuine_scores)
        counts = list(map(len, motion.samples))
        thresholds = {0: 0.0}
        for count in set(counts) - {0}:
            thresholds[count] = scan.threshold(count, self.false_alarms, CHANCE_DRAWS)
        self._warn_if_windows_are_too_few(scan, counts, thresholds)
        verdicts = []
        for name, times, own_scores in zip(motion.individuals, motion.times, scores, strict=True):
            threshold = thresholds[len(own_scores)]
            verdicts.append(scan.verdict(name, times, own_scores, threshold))
        return tuple(verdicts)

    def _warn_if_blind(self) -> None:
        """Log a warning if genuine motion that had no part in the weights scores no higher than abnormal."""
        genuine, abnormal = float(self.genuine_scores.mean()), float(self.abnormal_scores.mean())
        if genuine <= abnormal:
            _LOGGER.warning(
                "The classifiers do not tell genuine from abnormal motion: the mean score of %s that had no part in the weights is "
                "%.3f, and that of abnormal motion %.3f. Verdicts mean nothing; run more generations, or calibrate with other "
                "motion.",
                counted(len(self.genuine_scores), "genuine sample"), genuine, abnormal,
            )  # fmt: skip

    def _warn_if_windows_are_too_few(
        self, scan: Scan, counts: list[int], thresholds: dict[int, float]
    ) -> None:
        """Log a warning if individuals have so few windows that the strongest evidence is below the threshold."""
        strongest = {count: float(scan.strengths(np.zeros(count))) for count in thresholds if count}
        blind = [count for count in counts if count and strongest[count] <= thresholds[count]]
        if blind:
            longest = max(blind)
            _LOGGER.warning(
                "%d of %s cannot be called abnormal, whatever they do: the evidence in %s is at most %.2f, "
                "and the threshold %.2f, by %s and a share of false alarms of %.3g. Record for longer, "
                "calibrate with more genuine motion, or allow more false alarms.",
                len(blind),
                counted(len(counts), "individual"),
                counted(longest, "window"),
                strongest[longest],
                thresholds[longest],
                counted(len(self.genuine_scores), "genuine sample"),
                self.false_alarms,
            )

    def _warn_if_no_score_is_low_enough(self, samples: int) -> None:
        """Log why nobody with so many samples can have so small a p-value: few genuine samples, or scores of 0."""
        lowest = float(p_values(self.genuine_scores, np.zeros((1, samples)))[0])
        if self.rule == "unanimous" or lowest <= self.false_alarms:
            return
        genuine_count = len(self.genuine_scores)
        needed = genuine_samples_needed(self.false_alarms, samples)
        if genuine_count < needed:
            who = "genuine samples without a part in the weights (the second half of `genuine`)"
            reason = f"{needed} {who} are needed, and there are {genuine_count}"
            remedy = "Calibrate with more, take more samples of each"
        else:
            share = np.mean(self.genuine_scores <= 0)
            reason = f"{share:.3g} of {counted(genuine_count, 'genuine sample')} have that score"
            remedy = "Take more samples of each, another rule"
        _LOGGER.warning(
            "Nobody can be called abnormal by %s each: with score 0 throughout the p-value is %.3g, "
            "and at most %.3g is asked for; %s. %s, or allow more false alarms.",
            counted(samples, "sample"),
            lowest,
            self.false_alarms,
            reason,
            remedy,
        )

    def _judge_all(
        self, motion: Any, name: str, names: tuple[str, ...] | None = None
    ) -> np.ndarray:
        motion = checked_motion(name, motion, names, T=self.steps, D=self.signals)
        return np.round(self.jury.score(motion), SCORE_DIGITS)


def check_rule(rule: str) -> None:
    check(rule in RULES, "rule", "be one of the rules", repr(rule), nearest(rule, RULES))


def weigh(rule: str, genuine: np.ndarray, abnormal: np.ndarray) -> np.ndarray:
    """Return weights (N,), none below 0, with the sum 1, of classifiers that vote (N, individuals, samples) on both kinds.

    Source: Fisher, The use of multiple measurements in taxonomic problems (1936), with shrunk
    covariances and nothing below 0.
    """
    if rule == "fittest" and len(genuine):
        return np.full(len(genuine), 1 / len(genuine))
    if rule == "unanimous":
        # An individual is judged genuine if one of its samples is.
        informedness = competence(
            np.asarray(genuine.any(axis=-1)), np.asarray(abnormal.any(axis=-1))
        )
    else:
        informedness = competence(genuine, abnormal)
    tells = informedness.max(initial=0.0) > 0
    requirement = "hold a classifier that tells genuine from abnormal motion"
    got = f"{len(genuine)} that cannot"
    check(tells, "genomes", requirement, got, "Run more generations.")
    if rule == "unanimous":
        return (np.arange(len(informedness)) == informedness.argmax()).astype(float)
    able = informedness > 0
    within = _covariance(genuine[able]) + _covariance(abnormal[able])
    variances = np.diag(np.diag(within) + LEAST_VARIANCE)
    shrunk = (1 - COVARIANCE_SHRINKAGE) * within + COVARIANCE_SHRINKAGE * variances
    shrunk = shrunk + LEAST_VARIANCE * np.eye(len(within))
    difference = genuine[able].mean(axis=(1, 2)) - abnormal[able].mean(axis=(1, 2))
    weights = np.zeros(len(informedness))
    weights[able] = np.maximum(np.round(np.linalg.solve(shrunk, difference), SCORE_DIGITS), 0)
    return weights / weights.sum()


def _distinct_samples(motion: np.ndarray) -> set[bytes]:
    samples = motion.reshape(-1, *motion.shape[2:])
    return {sample.tobytes() for sample in samples}


def _covariance(votes: np.ndarray) -> np.ndarray:
    """Return the covariances (N, N) between classifiers; the products are sums of integers, exact in any order."""
    flat = votes.reshape(len(votes), -1).astype(float)
    means = flat.mean(axis=1)
    return flat @ flat.T / flat.shape[1] - np.outer(means, means)


def _mean(scores: np.ndarray) -> np.ndarray:
    return np.round(scores.mean(axis=-1), SCORE_DIGITS)
