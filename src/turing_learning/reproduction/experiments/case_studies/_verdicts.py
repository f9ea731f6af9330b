"""Section 4.3 held against what the paper prints."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from turing_learning.reproduction._claims import Claim
from turing_learning.reproduction._verdicts import Spread, Verdict, listed, not_worse, printed_spreads, shares_not_worse

from ._outcome import Case, Outcome

NEAR = 0.1
LASTING = 20
SHARE_ROUNDING = 0.0005
SLOWNESS = 2.0
SPREAD_OUT = 2.0
"""A swarm does not gather if its median dispersion is this many times that of the agents."""
NAMED = {"aggregation": (50, 50, 200, 200), "object-clustering": (200, 200, 200, 200, 400, 400)}
"""Generations at which the paper's text sees the parameters close to the truth, or about to be."""


def errors_verdict(outcome: Outcome, kind: str, claims: Mapping[str, Claim]) -> Verdict:
    """Hold the absolute errors of an outcome against the printed ones."""
    claim = outcome.case.claim("4.3-{}-ae")
    printed = printed_spreads(claims[claim].values)
    observed = [Spread.of(errors) for errors in outcome.errors[kind].T]
    return Verdict(
        claim,
        not_worse(observed, printed),
        listed(outcome.names, printed, 2),
        listed(outcome.names, observed),
        "absolute errors",
        outcome.variant(kind),
    )


def settled(values: np.ndarray, truth: float) -> int | None:
    """Return the first generation from which the values (G,) are near the truth for some time; None if they never are."""
    near = np.abs(values - truth) <= NEAR
    for generation in np.flatnonzero(near):
        if near[generation : generation + LASTING].all():
            return int(generation)
    return None


def settled_for_good(values: np.ndarray, truth: float) -> int | None:
    """Return the first generation from which the values (G,) are near the truth until the end; None if they are not in the end."""
    far = np.flatnonzero(np.abs(values - truth) > NEAR)
    first = int(far[-1]) + 1 if far.size else 0
    return first if first < len(values) else None


def _generations(values: np.ndarray, truth: float) -> str:
    """Say when the values (G,) have come near the truth, and from when on they never leave again, where that is later."""
    first, last = settled(values, truth), settled_for_good(values, truth)
    if first is None:
        return "never"
    return str(first) if first == last else f"{first} (for good {'never' if last is None else last})"


def convergence_verdict(outcomes: Sequence[Outcome]) -> Verdict:
    """Hold the generations at which the medians settle, of outcomes of one preset, against the text."""
    observed, agrees = [], True
    for outcome in outcomes:
        truth = outcome.case.scenario.controller
        found = [settled(values, true) for values, true in zip(outcome.medians.T, truth, strict=True)]
        named = NAMED[outcome.case.scenario.name]
        agrees &= all(one is not None and one <= SLOWNESS * limit for one, limit in zip(found, named, strict=True))
        medians = zip(outcome.names, outcome.medians.T, truth, strict=True)
        texts = (f"{name} {_generations(values, true)}" for name, values, true in medians)
        observed.append(f"{outcome.case.scenario.title.lower()}: {', '.join(texts)}")
    printed = (
        "aggregation: I = 0 about 50, I = 1 about 200; clustering: I = 0 and 1 about 200, I = 2 about 400 generations"
    )
    return Verdict("4.3-convergence", agrees, printed, "; ".join(observed), "convergence", outcomes[0].variant())


def shares_verdict(cases: Sequence[Case], shares: Sequence[Sequence[Spread]], claims: Mapping[str, Claim]) -> Verdict:
    """Hold the shares of the sensor readings against the printed ones."""
    values = claims["4.3-sensor-shares"].values
    agrees = all(
        abs(one.mean - printed) <= 2 * one.standard_error + SHARE_ROUNDING
        for case, found in zip(cases, shares, strict=True)
        for one, printed in zip(found, values[case.key], strict=True)
    )
    printed = "; ".join(f"{case.key}: {_joined(values[case.key])}" for case in cases)
    observed = "; ".join(
        f"{case.key}: {_joined([one.mean for one in found])}" for case, found in zip(cases, shares, strict=True)
    )
    reason = "" if agrees else (
        "the simulator of the paper does not give the printed shares itself; what it gives agrees with ours (docs/physics.md)"
    )  # fmt: skip
    return Verdict("4.3-sensor-shares", agrees, printed, observed, "shares", reason=reason)


def _joined(shares: Any) -> str:
    return " / ".join(f"{share:.3f}" for share in shares)


def emergence_verdict(outcome: Outcome, kind: str, claims: Mapping[str, Claim]) -> Verdict:
    """Hold the number of models whose swarms do what the agents do against the printed one."""
    claim = outcome.case.claim("4.3-emergent-{}")
    count, total = claims[claim].values["no_significant_difference"]
    emergence = outcome.emergence[kind]
    alike, models = emergence.comparison.without_difference, len(emergence.comparison.p_values)
    agents, medians = np.median(emergence.agents), np.median(emergence.models, axis=1)
    others = emergence.without_difference_from_repeated
    span = " to ".join(str(n) for n in sorted({min(others), max(others)}))
    again = f" ({span} with {len(others)} repetitions of the agents' trials)"
    agrees = shares_not_worse(alike / models, models, count / total, total) and medians.max() <= SPREAD_OUT * agents
    by_chance = (
        f"; {alike} is fewer than {count}, but not by more than chance explains" if agrees and alike < count else ""
    )
    return Verdict(
        claim,
        bool(agrees),
        f"no significant difference in {count} of {total} cases",
        f"no significant difference in {alike} of {models} cases{again}; median dispersion of the agents "
        f"{agents:.0f}, of the models {medians.min():.0f} to {medians.max():.0f}{by_chance}",
        "counts",
        outcome.variant(kind),
    )
