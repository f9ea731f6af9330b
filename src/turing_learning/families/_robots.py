"""The paper's robots."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from turing_learning.errors import refuse

from ..models import FULL_VIEW, Parameter
from ..swarm import AGGREGATION, Scenario
from ._family import Family


@dataclass(frozen=True, kw_only=True)
class Robots(Family):
    """Robots with wheels and a sensor that sees what is ahead; every robot of a group executes the model.

    Parameters: wheel speeds for each sensor state, as fractions of the maximum (vl0, vr0, vl1, vr1, ...); the
    field of view of the sensor as well, theta (rad), if that is the scenario's representation of models.

    Parameters
    ----------
    scenario
        Robots, objects, sensor and walls; what it says of the agents' controller and of numbers of robots does not
        matter. Where there are walls, robots and objects start anywhere within them instead of in the square.

    Source
    ------
    Paper, sections 3.2 and 4.1; docs/physics.md. Speeds are signed, as the robots' headings are known.
    """

    individuals: int = 11
    start_side_cm: float = 331.66
    scenario: Scenario = AGGREGATION

    least: ClassVar[float] = -math.inf
    headings: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        crowd = self.scenario.start(self.individuals, self._side).crowd
        if crowd:
            refuse(
                "individuals",
                "have room where they start",
                f"{self.individuals}, and {crowd}",
                "Take fewer, or give them more room: `start_side_cm`, or within the walls of the scenario.",
            )

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
        from ..swarm import initial_poses, simulate  # needs the compiled kernels

        seed = int(rng.integers(2**63))
        scenario = self._observed_scenario()
        starts = initial_poses(scenario, len(parameters), rng, robots=self.individuals, side_cm=self._side)
        model = scenario.model.behavior(parameters)
        shape = (len(parameters), self.individuals)
        controllers = np.repeat(model.wheel_speeds[:, None], self.individuals, axis=1)
        views = None if model.field_of_view is None else np.broadcast_to(model.field_of_view[:, None], shape)
        poses = simulate(scenario, controllers, starts, control_steps=self.moves, seed=seed, fields_of_view=views).poses
        seen = poses[:, self.settling_steps :, : self.individuals]
        return seen[..., :2], seen[..., 2]

    def _observed_scenario(self) -> Scenario:
        trial = replace(
            self.scenario.trial, control_interval_s=self.interval_s, duration_s=self.moves * self.interval_s
        )
        return replace(self.scenario, trial=trial)
