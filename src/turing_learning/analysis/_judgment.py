"""Whether to believe an estimate: one judgment, from which all words and sentences follow."""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol

import numpy as np
from scipy.special import stdtrit

LEVEL = 0.05
"""How often a test, or a claim, may be wrong."""

SURE = 0.01
"""p-value up to which a model is called wrong without a check, or though searches for known truths fail."""

POWER = 0.8
"""Share of clearly wrong models that a test has to notice; with less its silence says nothing.

Source: Cohen, Statistical power analysis for the behavioral sciences (1988), section 2.4.
"""


class Verdict(StrEnum):
    """Whether to believe an estimate; of several that hold, the first of this order is shown."""

    REJECTED = "model rejected"
    FAILED = "search failed"
    PHASES = "phases differ"
    TOLD = "classifiers can still tell"
    DISPUTED = "classifiers disagree"
    DIFFERENT = "samples differ"
    DISAGREE = "runs disagree"
    UNEXAMINED = "not yet examined"
    MOVING = "still moving"
    UNRELIABLE = "search unreliable"
    BOUND = "at a bound"
    SEVERAL = "several solutions"
    UNIDENTIFIED = "not identified"
    UNTESTED = "check cannot say"
    LOOSE = "nothing pinned down"
    CONVERGED = "converged"

    @property
    def meaning(self) -> str:
        """What it means, and what to do, in a sentence."""
        return _MEANINGS[self]


_MEANINGS = {
    Verdict.REJECTED: (
        "Fresh classifiers tell the model from the system, however well it is fitted: try another model."
    ),
    Verdict.FAILED: (
        "Fresh classifiers tell the estimate from the system. The search also misses known truths: give more trials."
    ),
    Verdict.PHASES: (
        "Replicas can be told from agents by when they act in a control cycle, whatever the model: let all robots "
        "wait for a random part of a cycle before each trial, or take poses at the moments that the program names."
    ),
    Verdict.TOLD: (
        "Classifiers tell the models of this run from the system: run longer; if that does not help, try another model."
    ),
    Verdict.DISPUTED: (
        "The run tells its models from the system, fresh classifiers do not: run longer, or pool other seeds."
    ),
    Verdict.DIFFERENT: "New samples of the estimate differ from the genuine ones: run longer, or try another model.",
    Verdict.DISAGREE: "Runs with other seeds settle elsewhere: believe no single one; run longer.",
    Verdict.UNEXAMINED: "All trials are spent, but the estimate is not yet examined: resume the run.",
    Verdict.MOVING: (
        "The models had not settled when the run ended: run longer. Such a run states no interval."
    ),
    Verdict.UNRELIABLE: (
        "Searches for a known truth miss it, so this estimate may be off, too: give more trials."
    ),
    Verdict.BOUND: (
        "An estimate sits at an end of its range: the truth may lie beyond; widen the range."
    ),
    Verdict.SEVERAL: "Separate regions of the parameters explain the motion equally well: `result.modes` states each.",
    Verdict.UNIDENTIFIED: (
        "The interval of one or more parameters is as wide as its range, and the others' may be too "
        "narrow: give more trials, or other signals."
    ),
    Verdict.UNTESTED: (
        "Fresh classifiers would often miss a clearly wrong model here: run longer, record more, or hold out more."
    ),
    Verdict.LOOSE: (
        "The estimate passes, but other values of its parameters may pass as well: record more, or other signals."
    ),
    Verdict.CONVERGED: (
        "Nothing speaks against the estimate so far; `check` and further seeds can."
    ),
}
_CHECKED = "Neither the run nor its check speaks against the estimate; further seeds can."
_MOST = "Most runs have converged, and they agree; what the others say stands above."

TELLING = frozenset({Verdict.TOLD, Verdict.DIFFERENT})
"""What a run says that tells its models from the system by itself; what fresh classifiers tell takes its place."""

OF_CHECKS = frozenset(
    {
        Verdict.REJECTED,
        Verdict.FAILED,
        Verdict.DISPUTED,
        Verdict.UNRELIABLE,
        Verdict.UNTESTED,
        Verdict.LOOSE,
    }
)
"""What only a check says of a run."""

FITTING = (
    Verdict.REJECTED,
    Verdict.FAILED,
    Verdict.TOLD,
    Verdict.DIFFERENT,
    Verdict.DISPUTED,
    Verdict.UNTESTED,
    Verdict.LOOSE,
)
"""What says whether the model fits: no two of these are said of one estimate, but the first."""


class Examination(Protocol):
    """What any test of genuine samples against samples of the estimate has found."""

    @property
    def accuracy(self) -> float:
        """Share of right answers; 0.5 is guessing."""

    @property
    def p_value(self) -> float:
        """How often guessing would do as well or better."""

    @property
    def power(self) -> float:
        """How often a clearly wrong model would be noticed."""

    @property
    def plausible(self) -> tuple[float, ...]:
        """Accuracies of the same examination of models that the run calls plausible."""


@dataclass(frozen=True)
class Judgment:
    """Whether to believe an estimate, and the evidence: the one place that says so.

    Source: docs/decisions/0038.
    """

    #: By the run of itself, and by the last pool that it was in
    said: tuple[Verdict, ...] = ()
    examination: Examination | None = None  #: Of the estimate; None without a check
    #: Accuracies of the same examination of what searches for a known truth found; 2 or more count
    recovered: tuple[float, ...] = ()
    attainable: tuple[float, ...] = ()  #: The same of those truths themselves
    #: Whether these searches came near their truth in every parameter; None without them
    near: bool | None = None
    parameters: int = 0  #: Number of parameters of which the check says something
    loose: tuple[str, ...] = ()  #: Those that are not pinned down
    #: Whether some of several runs say something else than most of them
    dissent: bool = False

    @property
    def search_succeeds(self) -> bool | None:
        """Whether searches find a known truth; None if that is not known.

        They do not if what they find is told, in the mean, better than 95 % of single examinations
        of a truth would tell it: as an estimate is told. Where only distances are known, one that is far off may be as good as
        its truth: then it is not known.
        """
        if self._calibrated:
            return float(np.mean(self.recovered)) <= _limit(self.attainable, LEVEL)
        return self.near or None

    @property
    def margin(self) -> float | None:
        """The accuracy up to which the estimate is told no better than right models are.

        Right are models that the run calls plausible, and those that searches found that succeed.
        Of single ones 95 % are told no better. None if it is not known how well they are told.
        """
        usual: tuple[float, ...] = ()
        if self.examination is not None:
            usual = tuple(self.examination.plausible)
        if self._calibrated:
            usual += self.attainable
            if self.search_succeeds:
                usual += self.recovered
        return None if len(usual) < 2 else _limit(usual, LEVEL)

    @property
    def fits(self) -> bool | None:
        """Whether the estimate passes its examination; None without one that could say no.

        It passes, too, if it is told no better than right models. Where these are told so well
        that nothing could be told better, that says nothing.
        """
        test = self.examination
        if test is None:
            return None
        if test.p_value > LEVEL:
            return True if test.power >= POWER else None
        margin = self.margin
        if margin is None or test.accuracy > margin:
            return False
        return True if margin < 1 else None

    @property
    def fault(self) -> Verdict | None:
        """Of an estimate that does not pass: `REJECTED`, `FAILED`, or `TOLD` if neither is sure.

        Searches for a known truth are a parametric bootstrap: a model that is told better than what
        they find is wrong. If they miss their truth, it has to be told much better.
        """
        if self.examination is None or self.fits is not False:
            return None
        # how far off searches are says less than classifiers see
        if not self._calibrated:
            return Verdict.TOLD
        # or it is told better than what searches for a known truth found
        if self.search_succeeds or self.examination.accuracy > _limit(self.recovered, SURE):
            return Verdict.REJECTED
        return Verdict.FAILED

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """All that is to be said in a word, the one to show first; "converged" stands alone."""
        verdicts = set(map(Verdict, self.said)) - {Verdict.CONVERGED}
        if self.fault is not None:
            verdicts.add(self.fault)
        elif self.examination is not None:
            if self.search_succeeds is False:
                verdicts.add(Verdict.UNRELIABLE)
            if self.fits is None:
                verdicts.add(Verdict.UNTESTED)
            if self.fits and self._all_loose:
                verdicts.add(Verdict.LOOSE)
            if self.fits and verdicts & TELLING:
                verdicts = verdicts - TELLING | {Verdict.DISPUTED}
        fitting = [verdict for verdict in FITTING if verdict in verdicts]
        verdicts -= set(fitting[1:])
        return tuple(verdict for verdict in Verdict if verdict in verdicts) or (Verdict.CONVERGED,)

    @property
    def verdict(self) -> Verdict:
        """The first of `verdicts`."""
        return self.verdicts[0]

    @property
    def meaning(self) -> str:
        """What the verdict means, and what else holds."""
        main, *further = self.verdicts
        meaning = main.meaning
        if main is Verdict.CONVERGED and (self.dissent or self.examination is not None):
            meaning = _MOST if self.dissent else _CHECKED
        return meaning + (f" Also: {', '.join(further)}." if further else "")

    @property
    def line(self) -> str:
        """The verdict and its meaning."""
        return f"Verdict: {self.verdict}. {self.meaning}"

    @property
    def look(self) -> str:
        """How the verdict is shown: "good", "bad", or as a "warning"."""
        if self.verdict is Verdict.CONVERGED:
            return "good"
        if self.verdict in (Verdict.REJECTED, Verdict.FAILED):
            return "bad"
        return "warning"

    @property
    def sentences(self) -> tuple[str, ...]:
        """What a check has found, sentence by sentence; none without a check."""
        test = self.examination
        if test is None:
            return ()
        numbers = f"(accuracy {test.accuracy:.3f}, p = {test.p_value:.3f})"
        # The run's own classifiers may tell what the check does not
        told_by_run = bool(TELLING & {*self.said})
        if self.fits is False:
            sentences = [f"Fresh classifiers can tell held-out samples from the model {numbers}."]
            if self.margin is not None:
                sentences.append(
                    f"Right models are told with an accuracy of up to {self.margin:.3f}."
                )
        elif self.fits is None:
            why = f"they would notice a clearly wrong model in {test.power:.0%} of such checks"
            if test.p_value <= LEVEL:
                why = "models that the run calls plausible are told, too, and none could be told better"
            sentences = [
                f"Fresh classifiers cannot say whether the estimate fits {numbers}: {why}."
            ]
            if told_by_run:
                sentences.append("The run itself tells its models from the system.")
        else:
            tell = "cannot tell held-out samples from the model"
            if test.p_value <= LEVEL:
                tell = "tell held-out samples from the model no better than from right ones"
                numbers = f"{numbers[:-1]}; right ones: up to {self.margin:.3f})"
            sentences = [f"The estimate passes: fresh classifiers {tell} {numbers}."]
            if told_by_run:
                sentences.append("Yet the run itself tells its models from the system.")
        return *sentences, *self._of_searches(), *self._of_parameters()

    def to_json(self) -> dict[str, Any]:
        """Return what `check.json` holds of it."""
        return {
            "verdict": self.verdict,
            "verdicts": list(self.verdicts),
            "fits": self.fits,
            "search_succeeds": self.search_succeeds,
            "not_pinned_down": list(self.loose),
            "power": None if self.examination is None else self.examination.power,
            "margin": self.margin,
            "sentences": [*self.sentences, self.line],
        }

    @property
    def _calibrated(self) -> bool:
        """Whether searches for a known truth say what is usual."""
        return min(len(self.recovered), len(self.attainable)) >= 2

    @property
    def _all_loose(self) -> bool:
        return 0 < self.parameters <= len(self.loose)

    def _of_searches(self) -> list[str]:
        sentences = []
        if self.search_succeeds is False:
            mean = f"mean accuracy {np.mean(self.recovered):.3f}"
            outcome = "end with models that classifiers tell from it"
            sentences.append(f"Searches for a known truth {outcome} ({mean}).")
            if self.fault is Verdict.REJECTED:
                sentences.append("The estimate is told far better: the search does not explain it.")
        elif self.search_succeeds:
            outcome = "come near it"
            if self._calibrated:
                outcome = "end with models that pass for it"
            sentences.append(f"Searches for a known truth {outcome}.")
        if self.fault is Verdict.TOLD:
            sentences.append("Whether the model or the search is at fault is not known.")
        return sentences

    def _of_parameters(self) -> list[str]:
        if not self.parameters:
            return ["Without profiles the check says nothing of single parameters."]
        if not self.loose:
            return ["Every parameter is pinned down."]
        listed = f"Not pinned down: {', '.join(self.loose)}."
        if self.fits and self._all_loose:
            return ["The check shows for no parameter that the samples determine it.", listed]
        return [listed]


def _limit(sample: Iterable[float], level: float) -> float:
    """Return the value that one more of a normal sample exceeds with the probability of a level."""
    values = np.array([*sample])
    # one more value varies around a mean that varies, too: hence 1 + 1 / n
    error = max(float(values.std(ddof=1)), 1e-9) * np.sqrt(1 + 1 / len(values))
    return float(values.mean() + stdtrit(len(values) - 1, 1 - level) * error)
