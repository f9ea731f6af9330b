"""When what came out agrees with what the paper prints: one rule per kind of claim.

docs/decisions/0027 lists the rules that were changed when results were known.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from turing_learning.errors import choice

from ._claims import load_claims

PAPER_RUNS = 30
ROUNDING = 0.005
"""Half a unit of the last digit of the paper's absolute errors."""

RULES = {
    "absolute errors": "of every parameter, the mean error exceeds the printed mean by at most twice the standard error that the "
    "difference has where both scatter as printed, plus 0.005, half of the last printed digit; smaller errors agree",
    "errors of the baseline": "of every parameter, the mean error lies within the printed mean plus or minus the printed "
    "standard deviation (plus 0.005): a baseline must be neither worse nor better",
    "convergence": "the median over the runs has come within 0.1 of the truth, for 20 generations on end, at the latest in twice "
    "the generation that the text names; from when on it never leaves again, and which reading is learned first, is told and "
    "not judged",
    "counts": "the share of models without a significant difference falls short of the printed one by at most twice the "
    "standard error of the difference, both being shares of so many runs; and the swarms of all models gather: no model's median "
    "dispersion exceeds twice that of the agents",
    "accuracy of classifiers": "both of the following agree",
    "accuracy of the subjective best": "its mean over the runs is higher in one of the generations 1 to 5 than in generation 0; "
    "from generation 50 on, all means are below the highest of the first 5 generations, and within 0.62 to 0.80 give or take twice "
    "their standard errors",
    "accuracy of the objective best": "the highest accuracy of a single classifier of the jury (the population, and its archive "
    "where it has one): its mean over the runs is above 0.95 in the last generation, higher than in the first, "
    "and in no generation more than 0.02 below that of an earlier one",
    "shares": "the mean lies within twice its standard error, plus 0.0005, of the printed share",
    "snapshots": "at the end of each row at least 90 % of the robots, or objects, are in the largest cluster",
    "baseline's picture": "the middle half of the runs, from the lower to the upper quartile of every parameter, is nearer to the "
    "mean of its wheel's speeds, weighted by how often the agents are in each state, than to the truth",
    "random behaviors": "absolute errors agree as above; the shares of runs below 0.05 and up to 0.1 fall short of the printed "
    "ones by at most twice the standard error of the difference; the errors for I = 0 are significantly lower than those for "
    "I = 1 (Mann-Whitney, Bonferroni)",
    "black box": "for every number of hidden neurons, the median over the runs of every steady output lies within 0.1 of the "
    "agent's parameter, the share of runs with all outputs within 0.2 falls short of the printed one (28 of 30 with five, all with "
    "fewer) by at most twice the standard error of the difference, and the outputs of the network of median performance are within "
    "0.1 of their steady values at the latest in the third step after every change of the reading, to stay; that more neurons be "
    "worse is not asked for",
    "separated": "the absolute errors of no parameter differ significantly between separated and mixed runs (two-sided "
    "Mann-Whitney tests, 5 % for all parameters together, with Bonferroni's correction)",
    "dynamics": "in more than half of the generations the median error of the subjectively best model lies between those of the "
    "best and of the average model, in emulated and in simulated runs; over the last fifth of the generations the medians of "
    "every parameter of both kinds of runs are at most 0.1 apart, on average (how far over all generations is told, and not "
    "judged)",
    "validation": "neither the proportion of robots in the largest cluster nor the dispersion differs significantly between agents "
    "and model, at the end of the trials and on average over them (two-sided Mann-Whitney tests, 5 % for all four together, with "
    "Bonferroni's correction; ten trials against ten notice a shift by one standard deviation with a chance of 27 % in each, "
    "by two with 91 %)",
    "classifiers in the laboratory": "the mean accuracy of the objectively best is at least 0.9 in the last generation; that of "
    "the subjectively best is in no generation below that of an earlier one by more than twice the standard error of the "
    "difference",
    "theorem": "in all random cases the minimum that is searched for is the stated one, and is not the agent",
}
"""Kind of claim -> when it agrees."""


@dataclass(frozen=True)
class Verdict:
    """How a claim fares.

    Attributes
    ----------
    claim
        Its id.
    agrees
        Whether what came out agrees with it.
    printed, observed
        What the paper prints, and what came out, in few words.
    rule
        Key of `RULES`.
    variant
        What the verdict is about: "" for the one that counts, otherwise what stands beside it, for example "preset paper".
    reason
        Why it differs, where that is known.
    """

    claim: str
    agrees: bool
    printed: str
    observed: str
    rule: str
    variant: str = ""
    reason: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "agrees", bool(self.agrees))  # a comparison of NumPy's cannot be stored
        choice("rule", self.rule, RULES)

    @property
    def word(self) -> str:
        """Return "agree" or "differ"."""
        return "agree" if self.agrees else "differ"

    @property
    def outcome(self) -> str:
        """Return what came out, and why it differs, where that is known."""
        return f"{self.observed} (why: {self.reason})" if self.reason else self.observed


@dataclass(frozen=True)
class Spread:
    """Mean and standard deviation of one quantity over runs."""

    mean: float
    standard_deviation: float
    runs: int

    @classmethod
    def of(cls, values: np.typing.ArrayLike) -> "Spread":
        """Return mean and standard deviation (n - 1; 0 for a single run) of the values of the runs (R,)."""
        array = np.asarray(values, dtype=np.float64)
        return cls(float(array.mean()), float(array.std(ddof=1)) if array.size > 1 else 0.0, array.size)

    @property
    def standard_error(self) -> float:
        """Standard deviation of the mean."""
        return self.standard_deviation / math.sqrt(self.runs)


def spreads_of(values: np.ndarray) -> list[Spread]:
    """Return the spread of each column of values (R, P)."""
    return [Spread.of(column) for column in values.T]


def printed_spreads(claim: str, runs: int = PAPER_RUNS) -> list[Spread]:
    """Return the absolute errors that a claim prints, parameter by parameter, of so many runs."""
    values = load_claims()[claim].values
    return [Spread(mean, std, runs) for mean, std in zip(values["ae_mean"], values["ae_std"], strict=True)]


def not_worse(observed: Sequence[Spread], printed: Sequence[Spread]) -> bool:
    """Apply the rule "absolute errors".

    The observed deviation does not enter: with it, a few runs that fail altogether would widen the limit that they are held
    against.
    """
    return all(
        own.mean - theirs.mean
        <= 2 * theirs.standard_deviation * math.hypot(own.runs**-0.5, theirs.runs**-0.5) + ROUNDING
        for own, theirs in zip(observed, printed, strict=True)
    )


def shares_not_worse(own: float, own_runs: int, printed: float, printed_runs: int) -> bool:
    """Return whether a share of runs falls short of a printed one by at most twice the standard error of the difference."""
    error = math.hypot(*(math.sqrt(p * (1 - p) / runs) for p, runs in ((own, own_runs), (printed, printed_runs))))
    return printed - own <= 2 * error


def within_spread(observed: Sequence[Spread], printed: Sequence[Spread]) -> bool:
    """Apply the rule "errors of the baseline"."""
    return all(
        abs(own.mean - theirs.mean) <= theirs.standard_deviation + ROUNDING
        for own, theirs in zip(observed, printed, strict=True)
    )


def listed(names: Sequence[str], spreads: Sequence[Spread], digits: int = 3) -> str:
    """Return names with means and standard deviations in parentheses."""
    return ", ".join(
        f"{name} {one.mean:.{digits}f} ({one.standard_deviation:.{digits}f})"
        for name, one in zip(names, spreads, strict=True)
    )


def valued(names: Sequence[str], values: Iterable[float], form: str = ".2f") -> str:
    """Return names with values."""
    return ", ".join(f"{name} {value:{form}}" for name, value in zip(names, values, strict=True))


def errors_verdict(
    claim: str, errors: np.ndarray, names: Sequence[str], variant: str = "", *,
    paper_runs: int = PAPER_RUNS, printed_also: str = "", observed_also: str = "", reason: str = "",
) -> Verdict:  # fmt: skip
    """Hold absolute errors (R, P) against the printed ones, by the rule "absolute errors"; add to what is said of both."""
    printed, observed = printed_spreads(claim, paper_runs), spreads_of(errors)
    agrees = not_worse(observed, printed)
    texts = listed(names, printed, 2) + printed_also, listed(names, observed) + observed_also
    return Verdict(claim, agrees, *texts, "absolute errors", variant, "" if agrees else reason)
