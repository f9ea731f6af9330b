"""When what came out agrees with what the paper prints: one rule per kind of claim.

docs/decisions/0027 lists the rules that were changed when results were known.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from turing_learning.errors import choice

from ._claims import load_claims, prose

PAPER_RUNS = 30
ROUNDING = 0.005
"""Half a unit of the last digit of the paper's absolute errors."""

RULES: Mapping[str, str] = prose()["rules"]
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
