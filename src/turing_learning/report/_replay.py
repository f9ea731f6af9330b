"""What a replay shows: swarms in motion, plain data."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from turing_learning.arrays import array
from turing_learning.errors import integer, number, require

MARGIN = 0.04  # of the longer side, around everything that moves
NARROWEST = 0.6  # shorter side of the view, relative to the longer one


@dataclass(frozen=True, eq=False)
class Swarm:
    """One swarm in motion.

    Parameters
    ----------
    label
        What the swarm is, for example "agents".
    poses : (F, A + O, 3)
        x, y (cm), heading (rad, anticlockwise) in each of F frames; robots first, then objects.
    robots
        Number of robots A.
    replica_mask : (A,) bool
        Which robots execute a model; none by default.
    """

    label: str
    poses: np.ndarray
    robots: int
    replica_mask: np.ndarray | None = None

    def __post_init__(self) -> None:
        poses = array("poses", self.poses, "F B 3")
        integer("robots", self.robots, 0, poses.shape[1])
        given = np.zeros(self.robots, bool) if self.replica_mask is None else self.replica_mask
        mask = array("replica_mask", given, "A", dtype=bool, empty=True, A=self.robots)
        object.__setattr__(self, "poses", poses)
        object.__setattr__(self, "replica_mask", mask)

    @property
    def is_replica(self) -> np.ndarray:
        """Which robots execute a model: (A,) bool."""
        return np.asarray(self.replica_mask)

    @property
    def objects(self) -> int:
        """Number of objects O."""
        return self.poses.shape[1] - self.robots


@dataclass(frozen=True, eq=False)
class Replay:
    """Swarms that move side by side, in the same view.

    Parameters
    ----------
    title
        What is seen.
    robot_radius_cm, object_radius_cm
        Radii (cm).
    interval_s
        Time between two frames (s).
    swarms
        One or more swarms with the same number of frames.
    walls_cm
        Left, bottom, right, and top of the arena (cm); None where it is unbounded.
    """

    title: str
    robot_radius_cm: float
    object_radius_cm: float
    interval_s: float
    swarms: tuple[Swarm, ...]
    walls_cm: tuple[float, float, float, float] | None = None

    def __post_init__(self) -> None:
        for name in ("robot_radius_cm", "object_radius_cm", "interval_s"):
            number(name, getattr(self, name), above=0)
        require(self.swarms, "swarms", "hold at least one swarm", "none")
        frames = [len(swarm.poses) for swarm in self.swarms]
        require(len(set(frames)) == 1, "swarms", "all have the same number of frames", frames)
        if self.walls_cm is not None:
            left, bottom, right, top = array("walls_cm", self.walls_cm, "4")
            require(left < right and bottom < top, "walls_cm", "be left < right and bottom < top", self.walls_cm)
        object.__setattr__(self, "swarms", tuple(self.swarms))

    @property
    def frames(self) -> int:
        """Number of frames F."""
        return len(self.swarms[0].poses)

    @property
    def duration_s(self) -> float:
        """Time from the first to the last frame (s)."""
        return (self.frames - 1) * self.interval_s

    @cached_property
    def view_cm(self) -> tuple[float, float, float, float]:
        """Left, bottom, right, and top (cm) of a view that holds every swarm at any time."""
        points = np.concatenate([swarm.poses[:, :, :2].reshape(-1, 2) for swarm in self.swarms])
        radius = max(self.robot_radius_cm, self.object_radius_cm)
        low, high = points.min(axis=0) - radius, points.max(axis=0) + radius
        if self.walls_cm is not None:
            low, high = np.minimum(low, self.walls_cm[:2]), np.maximum(high, self.walls_cm[2:])
        sides = high - low
        wanted = np.maximum(sides, NARROWEST * sides.max()) + 2 * MARGIN * sides.max()
        center = (low + high) / 2
        left, bottom = center - wanted / 2
        right, top = center + wanted / 2
        return float(left), float(bottom), float(right), float(top)
