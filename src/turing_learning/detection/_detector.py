"""Classifiers with votes, and what these say of an individual."""

import logging
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from turing_learning.coevolution import THRESHOLD, Classifier
from turing_learning.config import ConfigurationError, nearest
from turing_learning.report import counted

from ._chance import DRAWS, known_needed, p_values
from ._checks import checked_motion
from ._motion import Motion
from ._recorded import RecordedMotion
from ._run import StoredRun, calibration_motion, run_classifiers
from ._scan import Scan, TimedVerdict
from ._verdict import DIGITS, Verdict, decide_verdict, mean_score
from ._weights import weigh

RULES = ("fittest", "unanimous", "single", "majority", "group", "archive", "jury", "discriminant")
"""Names of the rules; see `Detector`."""
DEFAULT_RULE = "discriminant"
_ANY = 10.0**-DIGITS
_LOGGER = logging.getLogger("turing_learning")


@dataclass(frozen=True, eq=False)
class Detector:
    """Tell from motion which individuals behave abnormally.

    Classifiers vote on each sample; its score is the weighted share of votes that say genuine. An individual is
    called abnormal if the mean score of its samples is so low that chance makes it so in the stated share of cases
    at most. Eight rules choose the voters:

    ==============  =============================================  ==========================================
    rule            voters                                         abnormal if
    ==============  =============================================  ==========================================
    "fittest"       the subjectively best of the last generation   low mean score
    "unanimous"     the one of the last generation that decides    all samples are judged counterfeit: with
                    best by this rule                              ten, the rule of the paper
    "single"        the one of the last generation with the        low mean score
                    largest Youden's J
    "majority"      all of the last generation, with equal votes   low mean score
    "group"         all of the last generation                     low mean score
    "archive"       the best of up to 100 generations              low mean score
    "jury"          both of these                                  low mean score
    "discriminant"  the same, weighted together                    low mean score
    ==============  =============================================  ==========================================

    A vote weighs Youden's J = specificity + sensitivity - 1 where that is positive, measured on genuine and on abnormal
    motion; one that guesses has no vote. "discriminant" weighs those that have one by Fisher's linear discriminant: who says
    the same as others counts for less, and who hardly ever errs for more. Chance is measured on genuine individuals that had no
    part in the weights, see `p_values`.

    Parameters
    ----------
    classifier
        Judges.
    genomes : (N, Q)
        The voters.
    weights : (N,)
        Of their votes, above 0; they sum to 1.
    rule
        One of `RULES`.
    false_alarms
        Share of genuine individuals that may be called abnormal, in (0, 1); "unanimous" does not keep to it.
    genuine_scores, abnormal_scores : (any,)
        Scores of single samples, by which p-values and the beginning of abnormal motion are found.
    steps, signals
        Steps T and signals D of a sample.

    Source
    ------
    Paper, section 4.4; Youden, Index for rating diagnostic tests (1950); docs/decisions/0014 and 0019.
    """

    classifier: Classifier
    genomes: np.ndarray
    weights: np.ndarray
    rule: str
    false_alarms: float
    genuine_scores: np.ndarray
    abnormal_scores: np.ndarray
    steps: int
    signals: int

    @classmethod
    def calibrate(
        cls,
        classifier: Classifier,
        genomes: np.ndarray,
        *,
        genuine: np.ndarray,
        abnormal: np.ndarray,
        rule: str = DEFAULT_RULE,
        false_alarms: float = 0.01,
    ) -> "Detector":
        """Choose voters and weights; nothing is trained.

        Parameters
        ----------
        classifier
            Judges.
        genomes : (N, Q)
            Classifiers to choose from.
        genuine : (individuals, samples, T, D)
            Motion of normal individuals, at least two. The first half weighs the votes, the second says what scores
            are usual.
        abnormal : (individuals, samples, T, D)
            Other motion, of any that behave otherwise, for example in `random_controllers`, or of a run's random models.
        rule, false_alarms
            As for the class.

        Raises
        ------
        ConfigurationError
            If a shape or number does not fit, or no classifier can tell the two kinds of motion apart.
        """
        check_rule(rule)
        _check_rate(false_alarms)
        genomes = np.asarray(genomes)
        signals = np.shape(genuine)[-1] if np.ndim(genuine) else 0
        genuine = checked_motion("genuine", genuine, signals=signals)
        abnormal = checked_motion("abnormal", abnormal, signals=signals, steps=genuine.shape[2])
        if len(genuine) < 2:
            raise ConfigurationError(f"`genuine` must hold at least 2 individuals; got {len(genuine)}.")
        _refuse_same(genuine, abnormal)
        votes, abnormal_votes = _votes(classifier, genomes, genuine), _votes(classifier, genomes, abnormal)
        half = len(genuine) // 2
        weights = weigh(rule, votes[:, :half], abnormal_votes)
        voters = weights > 0
        return cls(
            classifier=classifier,
            genomes=genomes[voters],
            weights=weights[voters],
            rule=rule,
            false_alarms=false_alarms,
            genuine_scores=_scores(weights, votes[:, half:]).ravel(),
            abnormal_scores=_scores(weights, abnormal_votes).ravel(),
            steps=genuine.shape[2],
            signals=signals,
        )

    @classmethod
    def from_run(
        cls,
        result: StoredRun,
        *,
        rule: str = DEFAULT_RULE,
        false_alarms: float = 0.01,
        genuine: np.ndarray | None = None,
        abnormal: np.ndarray | None = None,
        behaviors: int = 100,
        trials: int = 10,
        seed: int = 0,
        threads: int | None = None,
    ) -> "Detector":
        """Make a detector of the classifiers of a run.

        Parameters
        ----------
        result
            A run that is stored in a folder with its full history: ``turing_learning.load_run(path)``.
        rule, false_alarms
            As for the class.
        genuine, abnormal : (individuals, samples, T, D)
            Motion for `calibrate`. None takes what the run has kept, as runs in a laboratory and on custom systems do,
            or simulates the run's scenario, agents beside individuals with random controllers.
        behaviors, trials
            Number of random controllers that are simulated, >= 1, and of trials of each.
        seed
            Of what is simulated, >= 0.
        threads
            Number of threads of the simulation; None takes every processor.

        Raises
        ------
        ConfigurationError
            If the run does not hold what is needed, or something does not fit.
        """
        check_rule(rule)
        run = run_classifiers(result)
        genuine, abnormal = calibration_motion(
            run, genuine, abnormal, behaviors=behaviors, trials=trials, seed=seed, threads=threads
        )
        return cls.calibrate(
            run.classifier, run.voters(rule), genuine=genuine, abnormal=abnormal, rule=rule, false_alarms=false_alarms
        )

    def judge(self, samples: np.ndarray) -> np.ndarray:
        """Return the scores (S,) of samples (S, T, D): the weighted shares of the votes that say genuine, 0 to 1.

        Raises
        ------
        ConfigurationError
            If the shape does not fit or a value is not finite.
        """
        return self._judge_all(np.asarray(samples)[None], "samples")[0]

    def p_values(self, motion: np.ndarray) -> np.ndarray:
        """Return for each individual of motion (individuals, S, T, D) how often chance makes its mean score as low as it is.

        The share (individuals,) of all choices of S samples, out of its own and the genuine ones of the calibration, with a mean
        score that is as low or lower. If samples are independent, no more genuine individuals than q have a p-value of at most q,
        whatever the distribution of scores, and however many samples there are.

        Raises
        ------
        ConfigurationError
            If the shape does not fit or a value is not finite.

        Source
        ------
        Pitman, Significance tests which may be applied to samples from any populations (1937); docs/decisions/0022.
        """
        return p_values(self.genuine_scores, self._judge_all(motion, "motion"))

    def abnormal(self, samples: np.ndarray) -> bool:
        """Return whether the individual that moves as in samples (S, T, D) behaves abnormally; see `verdicts`."""
        return bool(self._called(self._judge_all(np.asarray(samples)[None], "samples"))[1][0])

    def called_abnormal(self, motion: np.ndarray) -> np.ndarray:
        """Return whether each individual (individuals,) of motion (individuals, S, T, D) behaves abnormally; see `verdicts`."""
        return self._called(self._judge_all(motion, "motion"))[1]

    def _called(self, scores: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the p-values of individuals with the scores (individuals, S), and whether they are called abnormal."""
        found = p_values(self.genuine_scores, scores)
        if self.rule == "unanimous":
            return found, mean_score(scores) < _ANY
        return found, found <= self.false_alarms

    def verdicts(self, motion: Motion | np.ndarray) -> tuple[Verdict, ...]:
        """Say of each individual whether it behaves abnormally, and since when.

        It does if its p-value is at most the share of false alarms, see `p_values`; by the rule "unanimous", if all of its samples
        are judged counterfeit. If nobody could be called abnormal, or the detector does not tell the motion apart that it was
        calibrated with, a warning is logged, with the numbers.

        The beginning is where the sum of what speaks for abnormal motion, from there to the end, is largest (Page, Continuous
        inspection schemes, 1954). A sample speaks for it by how far its score is below the middle between the mean scores of
        genuine and of abnormal samples.

        Parameters
        ----------
        motion
            Samples of individuals in the order of observation, an array (individuals, samples, T, D) or with names.

        Raises
        ------
        ConfigurationError
            If the shape does not fit or a value is not finite.
        """
        if not isinstance(motion, Motion):
            motion = Motion(tuple(str(k + 1) for k in range(len(motion))), motion)
        scores = self._judge_all(motion.samples, "motion", motion.individuals)
        found, abnormal = self._called(scores)
        self._warn_if_blind()
        self._warn_if_no_score_is_low_enough(scores.shape[1])
        middle = float(self.genuine_scores.mean() + self.abnormal_scores.mean()) / 2
        return tuple(
            decide_verdict(name, row, float(p_value), bool(called), middle)
            for name, row, p_value, called in zip(motion.individuals, scores, found, abnormal, strict=True)
        )

    def timeline(self, motion: RecordedMotion) -> tuple[TimedVerdict, ...]:
        """Say of each individual of a recording whether it behaves abnormally at some time, and when.

        A window speaks against an individual by how low its score lies among those of genuine samples, a stretch of consecutive
        windows by the mean of this in standard errors. An individual is called abnormal if its strongest stretch, of whatever
        length, is stronger than a threshold, placed where the stated share of genuine individuals with as many windows would be
        called so, if windows are independent. All rules keep to that rate here. Warnings are logged as by `verdicts`.

        Parameters
        ----------
        motion
            From `recorded_motion`.

        Raises
        ------
        ConfigurationError
            If the windows do not fit the detector.

        Source
        ------
        Glaz, Naus and Wallenstein, Scan statistics (2001); docs/decisions/0022.
        """
        counts = [len(samples) for samples in motion.samples]
        scores = np.split(self.judge(np.concatenate(motion.samples)), np.cumsum(counts)[:-1])
        scan = Scan(self.genuine_scores)
        thresholds = {count: scan.threshold(count, self.false_alarms, DRAWS) for count in set(counts) if count}
        self._warn_if_blind()
        self._warn_if_none_can_be_above(scan, thresholds, counts)
        return tuple(
            scan.verdict(name, times, values, thresholds.get(len(values), 0.0))
            for name, times, values in zip(motion.individuals, motion.times, scores, strict=True)
        )

    def mean_scores(self, motion: np.ndarray) -> np.ndarray:
        """Return the mean score (individuals,) of motion (individuals, samples, T, D); see `judge`."""
        return mean_score(self._judge_all(motion, "motion"))

    def with_false_alarms(self, share: float) -> "Detector":
        """Return a detector with another share of false alarms; nothing is judged again.

        Raises
        ------
        ConfigurationError
            If the share is not in (0, 1).
        """
        _check_rate(share)
        return replace(self, false_alarms=share)

    def _warn_if_blind(self) -> None:
        """Log a warning if genuine motion that had no part in the weights scores no higher than abnormal motion."""
        genuine, abnormal = float(self.genuine_scores.mean()), float(self.abnormal_scores.mean())
        if genuine <= abnormal:
            _LOGGER.warning(
                "The classifiers do not tell genuine from abnormal motion: the mean score of %s that had no part in the weights is "
                "%.3f, and that of abnormal motion %.3f. Verdicts mean nothing; run more generations, or calibrate with other "
                "motion.",
                counted(len(self.genuine_scores), "genuine sample"), genuine, abnormal,
            )  # fmt: skip

    def _warn_if_no_score_is_low_enough(self, samples: int) -> None:
        """Log why nobody with so many samples can have so small a p-value: genuine samples are too few, or have score 0."""
        least = float(p_values(self.genuine_scores, np.zeros((1, samples)))[0])
        if self.rule == "unanimous" or least <= self.false_alarms:
            return
        known, needed = len(self.genuine_scores), known_needed(self.false_alarms, samples)
        remedy = "Take more samples of each, another rule"
        reason = f"{np.mean(self.genuine_scores <= 0):.3g} of {counted(known, 'genuine sample')} have that score"
        if known < needed:
            remedy = "Calibrate with more, take more samples of each"
            who = "genuine samples without a part in the weights (the second half of `genuine`)"
            reason = f"{needed} {who} are needed, and there are {known}"
        _LOGGER.warning(
            "Nobody can be called abnormal by %s each: with score 0 throughout the p-value is %.3g, and at most %.3g is asked for; "
            "%s. %s, or allow more false alarms.",
            counted(samples, "sample"), least, self.false_alarms, reason, remedy,
        )  # fmt: skip

    def _warn_if_none_can_be_above(self, scan: Scan, thresholds: Mapping[int, float], counts: list[int]) -> None:
        """Log how many individuals cannot be called abnormal, because even with score 0 their windows are too few."""
        most = {count: float(scan.strengths(np.zeros(count))) for count in thresholds}
        blind = [count for count in counts if count and most[count] <= thresholds[count]]
        if blind:
            _LOGGER.warning(
                "%d of %s cannot be called abnormal, whatever they do: the evidence in %s is at most %.2f, and the threshold %.2f, "
                "by %s and a share of false alarms of %.3g. Record for longer, calibrate with more genuine motion, or allow more "
                "false alarms.",
                len(blind), counted(len(counts), "individual"), counted(max(blind), "window"), most[max(blind)],
                thresholds[max(blind)], counted(len(self.genuine_scores), "genuine sample"), self.false_alarms,
            )  # fmt: skip

    def _judge_all(self, motion: Any, name: str, names: tuple[str, ...] | None = None) -> np.ndarray:
        where = str if names is None else names.__getitem__
        motion = checked_motion(name, motion, signals=self.signals, steps=self.steps, where=where)
        return _scores(self.weights, _votes(self.classifier, self.genomes, motion))


def check_rule(rule: str) -> None:
    """Refuse what is no rule."""
    if rule not in RULES:
        raise ConfigurationError(f"`rule` must be one of the rules; got {rule!r}. {nearest(rule, RULES)}")


def check_rules(rules: Iterable[str]) -> tuple[str, ...]:
    """Return rules; refuse what is none."""
    rules = tuple(rules)
    for rule in rules:
        check_rule(rule)
    return rules


def _refuse_same(genuine: np.ndarray, abnormal: np.ndarray) -> None:
    """Refuse samples as abnormal that are genuine, all of them."""
    known, others = ({sample.tobytes() for sample in each.reshape(-1, *each.shape[2:])} for each in (genuine, abnormal))
    if others <= known:
        raise ConfigurationError(
            f"`abnormal` must be other motion than `genuine`; got {abnormal.shape[0] * abnormal.shape[1]} samples that are all in "
            "`genuine`, too. Give motion of individuals that behave otherwise."
        )


def _check_rate(share: float) -> None:
    if not 0 < share < 1:
        raise ConfigurationError(f"`false_alarms` must be above 0 and below 1; got {share}.")


def _votes(classifier: Classifier, genomes: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Return whether each of N classifiers judges each sample genuine (N, individuals, samples)."""
    individuals, samples, *series = motion.shape
    outputs = classifier.judge(genomes, motion.reshape(individuals * samples, *series))
    return (outputs >= THRESHOLD).reshape(len(genomes), individuals, samples)


def _scores(weights: np.ndarray, votes: np.ndarray) -> np.ndarray:
    return np.round(np.tensordot(weights, votes, axes=1), DIGITS)
