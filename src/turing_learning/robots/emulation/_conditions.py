"""What an emulated laboratory is made of."""

import math
from dataclasses import dataclass, field, replace

from turing_learning.swarm import AGGREGATION, Arena, Robot, Trial

from ._camera import Optics

LABORATORY = replace(
    AGGREGATION,
    name="laboratory",
    title="Physical aggregation",
    description="As aggregation, in an arena with walls (paper, section 5).",
    agents=8,
    replicas=2,
    robot=Robot(clamp_wheel_speeds=True),
    arena=Arena(200.0, 225.0),
    trial=Trial(duration_s=5.0),
)
"""The paper's laboratory, section 5: walls, and motors that cannot turn faster than they can."""


@dataclass(frozen=True)
class Conditions:
    """What is not ideal in a laboratory.

    Attributes
    ----------
    clock_drift
        Largest relative error of a robot's clock.
    battery_s
        How long the weakest battery lasts; the best lasts 1.4 times as long.
    latency_s
        Shortest and longest time that bytes take between a robot and the PC.
    intervention_s
        How long the operator needs when asked.
    camera_lag_s
        Time of an image after the beginning of a control cycle: the camera knows nothing of the robots' clocks.
    optics
        Of the camera.
    """

    clock_drift: float = 5e-5
    battery_s: float = 6000.0
    latency_s: tuple[float, float] = (0.01, 0.04)
    intervention_s: float = 60.0
    camera_lag_s: float = 0.037
    optics: Optics = field(default_factory=Optics)

    def __post_init__(self) -> None:
        self._require(0 <= self.clock_drift < 0.01, "clock_drift", "in [0, 0.01)")
        self._require(self.battery_s > 0, "battery_s", "above 0")
        first, last = self.latency_s
        self._require(0 <= first <= last < math.inf, "latency_s", "two times, the first not above the second")
        self._require(0 <= self.intervention_s < math.inf, "intervention_s", "0 or more")
        self._require(0 <= self.camera_lag_s < 0.1, "camera_lag_s", "in [0, 0.1)")

    def _require(self, holds: bool, name: str, rule: str) -> None:
        if not holds:
            raise ValueError(f"`conditions.{name}` must be {rule}; got {getattr(self, name)}.")
