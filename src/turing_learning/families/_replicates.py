"""Groups as they were recorded: several recordings, each with individuals and a tank of its own."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from turing_learning.errors import refuse, require

from ..models import Parameter
from ..trajectories import Trajectories, Windows
from ._family import NEIGHBOR, Family
from ._plane import Particles


@dataclass(frozen=True)
class Replicates:
    """A simulator of one family for several recordings: each model is executed by one of the groups, drawn at random.

    Parameters
    ----------
    groups
        Families that differ in individuals and tank alone.
    shares
        How often each group is drawn; they sum to 1.
    """

    groups: tuple[Family, ...]
    shares: tuple[float, ...]

    @property
    def parameters(self) -> dict[str, Parameter]:
        """The P parameters with suggested ranges."""
        return self.groups[0].parameters

    @property
    def signals(self) -> tuple[str, ...]:
        """The D signals of a step."""
        return self.groups[0].signals

    @property
    def steps(self) -> int:
        """Time steps T of a sample."""
        return self.groups[0].steps

    @property
    def interval_s(self) -> float:
        """Duration of a step (s)."""
        return self.groups[0].interval_s

    @property
    def headings(self) -> bool:
        """Whether individuals have headings."""
        return self.groups[0].headings

    def simulate(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return positions (M, F, A, 2) in the first group."""
        return self.groups[0].simulate(parameters, rng)

    def __call__(self, parameters: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Simulate models (M, P) and return samples (M, C, T, D) of them, each in a group of its own."""
        which = rng.choice(len(self.groups), size=len(parameters), p=self.shares)
        first = self.groups[0]
        found = np.empty((len(parameters), first.observed, first.steps, len(first.signals)))
        for k, group in enumerate(self.groups):
            if (which == k).any():
                found[which == k] = group(parameters[which == k], rng)
        return found


def as_recorded(
    family: type[Family],
    recordings: Sequence[Trajectories],
    windows: Windows,
    *,
    tanks: Sequence[tuple[float, float] | None] = (),
    **settings: Any,
) -> Family | Replicates:
    """Return a simulator of groups as large as those that windows are learned from, with their steps, rate and signals.

    Parameters
    ----------
    family
        Whose models are simulated.
    recordings, windows
        What was recorded, and the windows of all of it.
    tanks
        Width and height of the tank (cm) of each recording, or one for all; None, or none, for the unbounded plane.
    **settings
        Others of the family.

    Returns
    -------
    Family or Replicates
        `Replicates` where recordings differ in the number of individuals or the tank; they are drawn as often as windows are from
        them.
    """
    given = list(tanks) * (len(recordings) if len(tanks) == 1 else 1)
    fits = len(given) in (0, len(recordings))
    require(fits, "tanks", f"be one, or one for each of {len(recordings)} recordings", len(tanks))
    walls = any(tank is not None for tank in given)
    if walls and not issubclass(family, Particles):
        refuse("tanks", "be left out for this family, whose walls are those of its scenario", family.__name__)
    if hasattr(family, "period_cm") and (walls or NEIGHBOR & set(windows.names)):
        settings = {"period_cm": None} | settings
    alike: dict[tuple[int, tuple[float, float] | None], int] = {}
    counts = np.bincount(windows.learning_recording, minlength=len(recordings))
    for recording, tank, count in zip(recordings, given or [None] * len(recordings), counts, strict=True):
        key = (len(recording.individuals), tank)
        if count:  # nothing is learned from a recording that is held out
            alike[key] = alike.get(key, 0) + int(count)
    groups = tuple(
        family(
            individuals=individuals,
            steps=windows.learning.shape[1],
            interval_s=windows.interval_s,
            signals=windows.names,
            **(settings if tank is None else settings | {"tank_cm": tank}),
        )
        for individuals, tank in alike
    )
    if len(groups) == 1:
        return groups[0]
    total = sum(alike.values())
    return Replicates(groups, tuple(count / total for count in alike.values()))
