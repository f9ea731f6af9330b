"""Whether to believe a run, in one word, from what needs no truth."""

from collections.abc import Iterable
from enum import StrEnum

import numpy as np

from ._estimate import interval

CONTRACTED = 0.3
"""Share of the spread of the first models below which a population has settled on a value."""

GUESSING = 0.51
"""Median fitness of the classifiers, over the last generations, up to which they guess; 0.5 is chance."""


class Verdict(StrEnum):
    """Whether to believe an estimate; of several that hold, the first of this order is shown."""

    REJECTED = "model rejected"
    TOLD = "classifiers can still tell"
    DISAGREE = "runs disagree"
    MOVING = "still moving"
    BOUND = "at a bound"
    CONVERGED = "converged"

    @property
    def meaning(self) -> str:
        """What it means, and what to do, in a sentence."""
        return _MEANINGS[self]


_MEANINGS = {
    Verdict.REJECTED: "Fresh classifiers tell the model from the system, however well it is fitted: try another model.",
    Verdict.TOLD: "Classifiers tell the models of this run from the system: run longer; if that does not help, try another model.",
    Verdict.DISAGREE: "Runs with other seeds settle elsewhere: believe no single one; run longer.",
    Verdict.MOVING: "The models had not settled when the run ended: run longer. Such a run states no interval.",
    Verdict.BOUND: "An estimate sits at an end of its range: the truth may lie beyond; widen the range.",
    Verdict.CONVERGED: "Nothing speaks against the estimate so far; `check` and further seeds can.",
}


def ordered(verdicts: Iterable[str]) -> tuple[Verdict, ...]:
    """Return all verdicts that hold, the one to show first; "converged" only where no other does."""
    found = {Verdict(each) for each in verdicts} - {Verdict.CONVERGED}
    return tuple(each for each in Verdict if each in found) or (Verdict.CONVERGED,)


def settled(typical_models: np.ndarray, window: int, spreads: np.ndarray | None = None) -> np.ndarray:
    """Say whether the models of a run have settled, parameter by parameter.

    A parameter has settled if the halves of the generations that make the estimate agree within its interval, and if the
    population has contracted, or its typical model has been through all that the population still spans: then the
    parameter is open, not on its way.

    Parameters
    ----------
    typical_models : (G, P)
        Typical model of each generation.
    window
        Number of generations that make the estimate, as for `estimate`.
    spreads : (G, P)
        Standard deviation of the models of each generation, in the same units; None where that is not known.

    Returns
    -------
    (P,) bool
        Whether each parameter has settled.

    Source
    ------
    docs/decisions/0033.
    """
    last = np.asarray(typical_models, dtype=float)[-window:]
    half = np.diff(interval(last, window), axis=1)[:, 0] / 2
    middles = [np.median(part, axis=0) for part in np.array_split(last, 2) if len(part)]
    still = ~(np.abs(middles[-1] - middles[0]) > half)
    if spreads is None:
        return still & ~np.isnan(half)
    now, first = spreads[-window:].mean(axis=0), np.where(spreads[0] > 0, spreads[0], spreads.max(axis=0))
    quiet: np.ndarray = still & ((now < CONTRACTED * first) | (half >= now))
    return quiet


def told(classifier_fitness: np.ndarray, window: int) -> bool:
    """Say whether classifiers tell the models of a run from the system: their median fitness (G,) is above chance at last."""
    return bool(np.mean(classifier_fitness[-window:]) > GUESSING)


def judgment(verdicts: tuple[Verdict, ...]) -> str:
    """Say the first of some verdicts, what it means, and what else holds."""
    first, *others = verdicts
    also = f" Also: {', '.join(others)}." if others else ""
    return f"Verdict: {first}. {first.meaning}{also}"
