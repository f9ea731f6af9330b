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
import pandas as pd

from turing_learning.errors import choice

PAPER_RUNS = 30
ROUNDING = 0.005
"""Half a unit of the last digit of the paper's absolute errors."""


@dataclass(frozen=True)
class Claim:
    """One number or picture of the paper."""

    id: str  # section and name, for example "4.3-aggregation-ae"
    where: str  # section, figure and conditions
    kind: str  # "value" for printed numbers, "figure" for a picture without
    seen: str  # what is to be seen, of a figure
    values: Mapping[str, Any]  # the printed numbers by name
    note: str  # what else is to be known


@cache
def load_claims() -> Mapping[str, Claim]:
    """Return id -> claim, in the order of the paper: those of sections 3.2, 4 and 5."""
    claims = {}
    for entry in _data("claims.toml")["claim"]:
        words = {key: entry.pop(key, "") for key in ("id", "where", "seen", "note")}
        claims[words["id"]] = Claim(
            **words, kind=entry.pop("kind", "value"), values=MappingProxyType(entry)
        )
    return MappingProxyType(claims)


@cache
def prose() -> dict[str, Any]:
    """Return experiments.toml: what the experiments are about, their captions, and when claims agree."""
    return _data("experiments.toml")


def _data(name: str) -> dict[str, Any]:
    return tomllib.loads((files(__package__) / name).read_text(encoding="utf-8"))


RULES: Mapping[str, str] = prose()["rules"]  # kind of claim -> when it agrees
# Claim, or finding -> why a verdict differs
REASONS: Mapping[str, str] = prose()["reasons"]


@dataclass(frozen=True)
class ClaimVerdict:
    """How a claim fares."""

    claim: str  # its id
    agrees: bool
    printed: str  # what the paper prints, in few words
    observed: str  # what came out
    rule: str  # key of `RULES`
    # "" for the verdict that counts, else what stands beside it: "preset paper"
    variant: str = ""
    reason: str = ""  # why it differs, where that is known

    def __post_init__(self) -> None:
        # A comparison of NumPy's cannot be stored.
        object.__setattr__(self, "agrees", bool(self.agrees))
        choice("rule", self.rule, RULES)

    @property
    def word(self) -> str:
        """Return "agree" or "differ"."""
        return "agree" if self.agrees else "differ"

    @property
    def outcome(self) -> str:
        """Return what came out, and why it differs, where that is known."""
        if self.reason:
            return f"{self.observed} (why: {self.reason})"
        return self.observed


def verdict_on(
    claim: str, agrees: Any, observed: str, rule: str, variant: str = "", *, printed: str = "", reason: str | None = None
) -> ClaimVerdict:  # fmt: skip
    """Return a verdict; experiments.toml has what is printed, and why it differs, if they are not given."""
    if reason is None:
        reason = REASONS.get(claim, "")
    return ClaimVerdict(
        claim=claim,
        agrees=agrees,
        printed=printed or prose()["printed"][claim],
        observed=observed,
        rule=rule,
        variant=variant,
        reason="" if agrees else reason,
    )


@dataclass(frozen=True, eq=False)
class Spreads:
    """Means and standard deviations (P,) of P quantities over runs."""

    mean: np.ndarray
    standard_deviation: np.ndarray
    runs: int

    @classmethod
    def of(cls, values: np.ndarray) -> "Spreads":
        """Return mean and standard deviation (n - 1; 0 for a single run) of each column of values (R, P)."""
        # Contiguous columns, so that sums have the same order whatever the layout of the values.
        columns = np.array(np.asarray(values, dtype=np.float64).T, order="C")
        runs = columns.shape[1]
        deviations = np.zeros(len(columns))
        if runs > 1:
            deviations = columns.std(axis=1, ddof=1)
        return cls(columns.mean(axis=1), deviations, runs)

    @classmethod
    def printed(cls, claim: str, runs: int = PAPER_RUNS) -> "Spreads":
        """Return the absolute errors that a claim prints, of so many runs."""
        values = load_claims()[claim].values
        return cls(np.array(values["ae_mean"]), np.array(values["ae_std"]), runs)

    @property
    def standard_error(self) -> np.ndarray:
        """Standard deviations of the means (P,)."""
        return self.standard_deviation / math.sqrt(self.runs)

    def not_worse(self, printed: "Spreads") -> bool:
        """Apply the rule "absolute errors"; with the observed deviation, failed runs would widen it."""
        error = printed.standard_deviation * math.hypot(self.runs**-0.5, printed.runs**-0.5)
        return bool((self.mean - printed.mean <= 2 * error + ROUNDING).all())

    def within(self, printed: "Spreads") -> bool:
        """Apply the rule "errors of the baseline"."""
        return bool(
            (np.abs(self.mean - printed.mean) <= printed.standard_deviation + ROUNDING).all()
        )

    def frame(self, mean: str = "mean", deviation: str = "standard_deviation") -> pd.DataFrame:
        """Return means and standard deviations as columns of these names."""
        return pd.DataFrame({mean: self.mean, deviation: self.standard_deviation})

    def listed(self, names: Sequence[str], digits: int = 3) -> str:
        """Return the names of the quantities with means, and standard deviations in parentheses."""
        triples = zip(names, self.mean, self.standard_deviation, strict=True)
        return ", ".join(
            f"{name} {mean:.{digits}f} ({deviation:.{digits}f})"
            for name, mean, deviation in triples
        )


def shares_not_worse(share: float, runs: int, printed: float, printed_runs: int) -> bool:
    """Return whether a share falls short of a printed one by at most two standard errors of the difference."""
    error = math.sqrt(share * (1 - share) / runs)
    printed_error = math.sqrt(printed * (1 - printed) / printed_runs)
    return printed - share <= 2 * math.hypot(error, printed_error)


def valued(names: Sequence[str], values: Iterable[float], form: str = ".2f") -> str:
    return ", ".join(f"{name} {value:{form}}" for name, value in zip(names, values, strict=True))


def errors_verdict(
    claim: str, errors: np.ndarray, names: Sequence[str], variant: str = "", *,
    paper_runs: int = PAPER_RUNS, printed_also: str = "", observed_also: str = "", reason: str | None = None,
) -> ClaimVerdict:  # fmt: skip
    """Hold errors (R, P) against the printed ones, by the rule "absolute errors"; add to both texts."""
    printed = Spreads.printed(claim, paper_runs)
    observed = Spreads.of(errors)
    return verdict_on(
        claim,
        observed.not_worse(printed),
        observed.listed(names) + observed_also,
        "absolute errors",
        variant,
        printed=printed.listed(names, 2) + printed_also,
        reason=reason,
    )
