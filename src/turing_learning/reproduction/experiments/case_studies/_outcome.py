"""What the runs of a case study have inferred."""

from dataclasses import dataclass

import numpy as np

from turing_learning.reproduction.experiments._variants import variant_of
from turing_learning.swarm import Scenario

from ._emergence import Emergence, EmergenceSizes


@dataclass(frozen=True)
class Case:
    """One case study: what differs between the two.

    Attributes
    ----------
    scenario
        What is observed.
    key
        Its name in the ids of the claims.
    emergence
        How the swarms of its models are measured.
    """

    scenario: Scenario
    key: str
    emergence: EmergenceSizes

    @property
    def gathered(self) -> str:
        """What gathers: "objects" or "robots"."""
        return "objects" if self.scenario.objects.count else "robots"

    @property
    def gathering(self) -> int:
        """How many objects or robots are to gather when emergence is measured."""
        objects = round(self.scenario.objects.count * self.emergence.robots / self.scenario.individuals)
        return objects or self.emergence.robots

    def claim(self, pattern: str) -> str:
        """Return the id of a claim from what both case studies have in common, for example "4.3-{}-ae"."""
        return pattern.format(self.key)


@dataclass(frozen=True)
class Outcome:
    """What the runs of one case study with one preset have inferred.

    Attributes
    ----------
    case, preset, seeds
        Which runs.
    models, errors : kind -> (R, P)
        Models of R runs and their absolute errors; see `KINDS`.
    intervals : (R, 2, P)
        Lower and upper ends of the 90 % interval of each run's estimate; NaN where unknown.
    medians : (G, P)
        Medians over the runs of the best model of each generation.
    emergence : kind -> Emergence
        What swarms of the models do.
    """

    case: Case
    preset: str
    seeds: tuple[int, ...]
    models: dict[str, np.ndarray]
    errors: dict[str, np.ndarray]
    intervals: np.ndarray
    medians: np.ndarray
    emergence: dict[str, Emergence]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.case.scenario.parameter_names

    @property
    def coverage(self) -> float:
        """Share of the true parameters that are inside the intervals of the runs."""
        low, high = self.intervals[:, 0], self.intervals[:, 1]
        truth = np.array(self.case.scenario.controller)
        return float(((low <= truth) & (truth <= high)).mean())

    def variant(self, kind: str = "best_model") -> str:
        """Return what stands beside the verdict that counts; nothing for that one."""
        return variant_of(self.preset, kind)
