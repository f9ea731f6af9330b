"""What the paper prints, claim by claim, and how it fares: when is a claim held to agree with what came out?"""

import math
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType
from typing import Any

import numpy as np

from turing_learning.errors import choice

PAPER_RUNS = 30
ROUNDING = 0.005  # half a unit of the last digit of the paper's absolute errors


@dataclass(frozen=True)
class Claim:
    """One number or picture of the paper."""

    id: str  #: section and name, for example "4.3-aggregation-ae"
    where: str  #: section, figure and conditions
    kind: str  #: "value" for printed numbers, "figure" for a picture without
    seen: str  #: what is to be seen, of a figure
    values: Mapping[str, Any]  #: the printed numbers by name
    note: str  #: what else is to be known

    @property
    def section(self) -> str:
        """Section of the paper."""
        return self.id.partition("-")[0]


@cache
def load_claims() -> Mapping[str, Claim]:
    """Return id -> claim, in the order of the paper: those of sections 3.2, 4 and 5."""
    claims = {}
    for entry in _data("claims.toml")["claim"]:
        words = {key: entry.pop(key, "") for key in ("id", "where", "seen", "note")}
        claims[words["id"]] = Claim(**words, kind=entry.pop("kind", "value"), values=MappingProxyType(entry))
    return MappingProxyType(claims)


@cache
def prose() -> dict[str, Any]:
    """Return experiments.toml: what the experiments are about, their captions, and when claims agree."""
    return _data("experiments.toml")


def _data(name: str) -> dict[str, Any]:
    return tomllib.loads((files(__package__) / name).read_text(encoding="utf-8"))


RULES: Mapping[str, str] = prose()["rules"]  # kind of claim -> when it agrees
PRINTED: Mapping[str, str] = prose()["printed"]  # claim -> what the paper prints in words, in short
REASONS: Mapping[str, str] = prose()["reasons"]  # claim, or finding -> why a verdict differs


@dataclass(frozen=True)
class ClaimVerdict:
    """How a claim fares."""

    claim: str  # its id
    agrees: bool
    printed: str  # what the paper prints, in few words
    observed: str  # what came out
    rule: str  # key of `RULES`
    variant: str = ""  # "" for the verdict that counts, otherwise what stands beside it, for example "preset paper"
    reason: str = ""  # why it differs, where that is known

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

    The observed deviation does not enter: with it, a few runs that fail altogether would widen the limit that
    they are held against.
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
    pairs = zip(observed, printed, strict=True)
    return all(abs(own.mean - theirs.mean) <= theirs.standard_deviation + ROUNDING for own, theirs in pairs)


def listed(names: Sequence[str], spreads: Sequence[Spread], digits: int = 3) -> str:
    """Return names with means and standard deviations in parentheses."""
    pairs = zip(names, spreads, strict=True)
    return ", ".join(f"{name} {one.mean:.{digits}f} ({one.standard_deviation:.{digits}f})" for name, one in pairs)


def valued(names: Sequence[str], values: Iterable[float], form: str = ".2f") -> str:
    """Return names with values."""
    return ", ".join(f"{name} {value:{form}}" for name, value in zip(names, values, strict=True))


def errors_verdict(
    claim: str, errors: np.ndarray, names: Sequence[str], variant: str = "", *,
    paper_runs: int = PAPER_RUNS, printed_also: str = "", observed_also: str = "", reason: str = "",
) -> ClaimVerdict:  # fmt: skip
    """Hold absolute errors (R, P) against the printed ones, by the rule "absolute errors"; add to what is said of both."""
    printed, observed = printed_spreads(claim, paper_runs), spreads_of(errors)
    agrees = not_worse(observed, printed)
    texts = listed(names, printed, 2) + printed_also, listed(names, observed) + observed_also
    return ClaimVerdict(claim, agrees, *texts, "absolute errors", variant, "" if agrees else reason)
