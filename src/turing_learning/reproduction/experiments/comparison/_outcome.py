"""What one method has inferred with one number of trials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from turing_learning.analysis import absolute_error
from turing_learning.swarm import Scenario

TURING_LEARNING, ABC_SMC, NPE, NPE_IN_ROUNDS, MIXTURE = "turing-learning", "abc-smc", "npe", "npe-rounds", "mixture"
METHODS = {
    TURING_LEARNING: "Turing Learning",
    ABC_SMC: "ABC-SMC",
    NPE: "NPE",
    NPE_IN_ROUNDS: "NPE in rounds",
    MIXTURE: "mixture",
}
"""Key of a method -> its name."""


@dataclass(frozen=True)
class Outcome:
    """What one method has inferred in one scenario, seed by seed.

    Attributes
    ----------
    scenario, method, trials, seeds
        Which runs; trials are those that were simulated, of the mixture those that were observed.
    estimates : (R, P)
        The parameters.
    intervals : (R, 2, P)
        Lower and upper ends of the central 90 %, NaN where they are not known; None where the method has none.
    processor_seconds : (R,)
        Time of one core (s), without that of imports.
    """

    scenario: Scenario
    method: str
    trials: int
    seeds: tuple[int, ...]
    estimates: np.ndarray
    intervals: np.ndarray | None
    processor_seconds: np.ndarray

    @classmethod
    def of(
        cls, scenario: Scenario, method: str, trials: int, seeds: tuple[int, ...], found: Sequence[Mapping[str, Any]]
    ) -> "Outcome":
        """Return the outcome of what the pieces of work hold, seed by seed."""
        estimates = np.array([one["estimate"] for one in found])
        none = any(one["low"] is None for one in found)
        intervals = None if none else np.array([(one["low"], one["high"]) for one in found], dtype=float)
        return cls(
            scenario, method, trials, seeds, estimates, intervals, np.array([one["processor_seconds"] for one in found])
        )

    @property
    def errors(self) -> np.ndarray:
        """Absolute errors (R, P)."""
        return absolute_error(self.estimates, self.scenario.controller)

    @property
    def maes(self) -> np.ndarray:
        """Mean absolute errors (R,)."""
        return self.errors.mean(axis=1)

    @property
    def mae(self) -> float:
        """Median of the mean absolute errors."""
        return float(np.median(self.maes))

    @property
    def worst(self) -> float:
        """Largest of the mean absolute errors."""
        return float(self.maes.max())

    @property
    def seconds(self) -> float:
        """Median processor time (s)."""
        return float(np.median(self.processor_seconds))

    @property
    def coverage(self) -> float | None:
        """Share of the true parameters that are inside their intervals; an unknown one holds nothing."""
        if self.intervals is None:
            return None
        truth = np.array(self.scenario.controller)
        return float(((self.intervals[:, 0] <= truth) & (truth <= self.intervals[:, 1])).mean())

    @property
    def width(self) -> float | None:
        """Mean width of the intervals that are known; None where there is none."""
        widths = np.array([]) if self.intervals is None else np.diff(self.intervals, axis=1)
        known = widths[np.isfinite(widths)]
        return float(known.mean()) if known.size else None

    @property
    def unknown(self) -> int:
        """Number of intervals, of all seeds and parameters, that are not known."""
        return 0 if self.intervals is None else int(np.isnan(self.intervals).any(axis=1).sum())
