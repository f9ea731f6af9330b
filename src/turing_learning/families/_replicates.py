"""The paper's robots as a family, and groups as they were recorded: several, each with individuals and a tank of its own."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import repeat
from typing import Any, ClassVar

import numpy as np

from turing_learning.errors import require

from ..models import FULL_VIEW, Parameter
from ..swarm import AGGREGATION, Scenario
from ..trajectories import Trajectories, Windows
from ._family import NEIGHBOR, Family, Particles


@dataclass(frozen=True, kw_only=True)
class Robots(Family):
    """Robots with wheels and a sensor that sees what is ahead; every robot of a group executes the model.

    Parameters: wheel speeds for each sensor state, as fractions of the maximum (vl0, vr0, vl1, vr1, ...); the
    field of view of the sensor as well, theta (rad), if that is the scenario's representation of models. Speeds
    are signed, as the robots' headings are known. Source: paper, sections 3.2 and 4.1; docs/physics.md.
    """

    individuals: int = 11
    start_side_cm: float = 331.66
    #: Robots, objects, sensor and walls; what it says of the agents' controller and of numbers of robots does
    #: not matter. Where there are walls, robots and objects start anywhere within them instead of in the square
    scenario: Scenario = AGGREGATION

    least: ClassVar[float] = -math.inf
    headings: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        crowd = self.scenario.start(self.individuals, self._side).crowd
        remedy = "Take fewer, or give them more room: `start_side_cm`, or within the walls of the scenario."
        require(not crowd, "individuals", "have room where they start", f"{self.individuals}, and {crowd}", remedy)

    @property
    def _side(self) -> float | None:
        return None if self.scenario.arena.bounded else self.start_side_cm

    @property
    def parameters(self) -> dict[str, Parameter]:
        """Left and right wheel speed for each sensor state; field of view, where it is a parameter."""
        speed, angle = Parameter(-2, 2, initial=(-1, 1)), Parameter(0, FULL_VIEW, unit="rad")
        pairs = zip(self.scenario.parameter_names, self.scenario.model.parameter_units, strict=True)
        return {name: angle if unit else speed for name, unit in pairs}

    def _paths(self, parameters: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        from ..swarm import execution_of, initial_poses, simulate  # needs the compiled kernels

        seed = int(rng.integers(2**63))
        duration_s = self.moves * self.interval_s
        trial = replace(self.scenario.trial, control_interval_s=self.interval_s, duration_s=duration_s)
        scenario = replace(self.scenario, trial=trial)
        starts = initial_poses(scenario, len(parameters), rng, robots=self.individuals, side_cm=self._side)
        executed = np.repeat(np.arange(len(parameters))[:, None], self.individuals, axis=1)
        robots = execution_of(scenario, scenario.model.behavior(parameters), executed)
        how: dict[str, Any] = {"control_steps": self.moves, "seed": seed, "fields_of_view": robots.fields_of_view}
        poses = simulate(scenario, robots.controllers, starts, **how).poses
        seen = poses[:, self.settling_steps :, : self.individuals]
        return seen[..., :2], seen[..., 2]


@dataclass(frozen=True)
class Replicates:
    """A simulator of one family for several recordings: each model is executed by one of the groups, by chance."""

    groups: tuple[Family, ...]  #: Families that differ in individuals and tank alone
    shares: tuple[float, ...]  #: How often each group is drawn; they sum to 1

    parameters = property(lambda self: self.groups[0].parameters)  #: The P parameters with suggested ranges
    signals = property(lambda self: self.groups[0].signals)  #: The D signals of a step
    steps = property(lambda self: self.groups[0].steps)  #: Time steps T of a sample
    interval_s = property(lambda self: self.groups[0].interval_s)  #: Duration of a step (s)
    headings = property(lambda self: self.groups[0].headings)  #: Whether individuals have headings

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
    family: type[Family], recordings: Trajectories | Sequence[Trajectories], windows: Windows, *,
    tanks: Sequence[tuple[float, float] | None] = (), **settings: Any,
) -> Family | Replicates:  # fmt: skip
    """Return a simulator of groups as large as those that windows are learned from, with their steps, rate and signals.

    Parameters
    ----------
    family
        Whose models are simulated.
    recordings, windows
        What was recorded, once or several times, and the windows of all of it.
    tanks
        Width and height of the tank (cm) of each recording, or one for all; None, or none, for the unbounded
        plane.
    **settings
        Others of the family.

    Returns
    -------
    Family or Replicates
        `Replicates` where recordings differ in the number of individuals or the tank; they are drawn as often
        as windows are from them.
    """
    recordings = [recordings] if isinstance(recordings, Trajectories) else recordings
    pixels = any(each.unit != "cm" for each in recordings)
    require(not pixels, "recordings", "be in cm, as the models are", "pixels", "Give their scale, pixels_per_cm.")
    given = list(tanks) * (len(recordings) if len(tanks) == 1 else 1)
    fits = len(given) in (0, len(recordings))
    require(fits, "tanks", f"be one, or one for each of {len(recordings)} recordings", len(tanks))
    walls = any(tank is not None for tank in given)
    rule = "be left out for this family, whose walls are those of its scenario"
    require(not walls or issubclass(family, Particles), "tanks", rule, family.__name__)
    if hasattr(family, "period_cm") and (walls or NEIGHBOR & set(windows.names)):
        settings = {"period_cm": None} | settings
    kinds = [(len(each.individuals), tank) for each, tank in zip(recordings, given or repeat(None), strict=False)]
    alike = Counter(kinds[k] for k in windows.learning_recording)
    own = {"steps": windows.learning.shape[1], "interval_s": windows.interval_s, "signals": windows.names}
    groups = {
        kind: family(individuals=kind[0], **own, **settings | ({} if kind[1] is None else {"tank_cm": kind[1]}))
        for kind in dict.fromkeys(kinds)
        if alike[kind]  # nothing is learned from a recording that is held out
    }
    first, *others = groups.values()
    return Replicates((first, *others), tuple(alike[kind] / alike.total() for kind in groups)) if others else first
