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
    """Return the first generation from which the values (G,) stay near the truth; None if they never do."""
    near = np.abs(values - truth) <= NEAR
    for generation in np.flatnonzero(near):
        if near[generation : generation + LASTING].all():
            return int(generation)
    return None


def convergence_verdict(outcomes: Sequence[Outcome]) -> Verdict:
    """Hold the generations at which the medians settle, of outcomes of one preset, against the text."""
    observed, agrees = [], True
    for outcome in outcomes:
        truth = outcome.case.scenario.controller
        found = [settled(values, true) for values, true in zip(outcome.medians.T, truth, strict=True)]
        named = NAMED[outcome.case.scenario.name]
        agrees &= all(one is not None and one <= SLOWNESS * limit for one, limit in zip(found, named, strict=True))
        texts = (f"{name} {'never' if one is None else one}" for name, one in zip(outcome.names, found, strict=True))
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


def emergence_verdict(outcome: Outcome, claims: Mapping[str, Claim]) -> Verdict:
    """Hold the number of models whose swarms do what the agents do against the printed one."""
    claim = outcome.case.claim("4.3-emergent-{}")
    count, total = claims[claim].values["no_significant_difference"]
    comparison = outcome.emergence.comparison
    alike, models = comparison.without_difference, len(comparison.p_values)
    medians = np.median(outcome.emergence.models, axis=1)
    others = outcome.emergence.without_difference_from_repeated
    span = " to ".join(str(n) for n in sorted({min(others), max(others)}))
    again = f" ({span} with {len(others)} repetitions of the agents' trials)"
    return Verdict(
        claim,
        shares_not_worse(alike / models, models, count / total, total),
        f"no significant difference in {count} of {total} cases",
        f"no significant difference in {alike} of {models} cases{again}; median dispersion of the agents "
        f"{np.median(outcome.emergence.agents):.0f}, of the models {medians.min():.0f} to {medians.max():.0f}",
        "counts",
        outcome.variant(),
    )
