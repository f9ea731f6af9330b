"""What a replay shows: swarms in motion, plain data."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

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

    Raises
    ------
    ValueError
        If a shape does not fit or a pose is not finite.
    """

    label: str
    poses: np.ndarray
    robots: int
    replica_mask: np.ndarray | None = None

    def __post_init__(self) -> None:
        poses = np.asarray(self.poses, dtype=float)
        if poses.ndim != 3 or poses.shape[2] != 3 or 0 in poses.shape:
            raise ValueError(f"`poses` must have the shape (F, A + O, 3), no axis empty; got {poses.shape}.")
        if not np.isfinite(poses).all():
            frame, body, _ = (int(k) for k in np.argwhere(~np.isfinite(poses))[0])
            raise ValueError(f"`poses` must be finite; got {poses[frame, body].tolist()} in frame {frame}, row {body}.")
        if not 0 <= self.robots <= poses.shape[1]:
            raise ValueError(
                f"`robots` must be between 0 and the number of rows in `poses`, {poses.shape[1]}; got {self.robots}."
            )
        mask = np.zeros(self.robots, bool) if self.replica_mask is None else np.asarray(self.replica_mask, dtype=bool)
        if mask.shape != (self.robots,):
            raise ValueError(f"`replica_mask` must have the shape ({self.robots},); got {mask.shape}.")
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

    Raises
    ------
    ValueError
        If a number is not positive, there is no swarm, or the swarms differ in their number of frames.
    """

    title: str
    robot_radius_cm: float
    object_radius_cm: float
    interval_s: float
    swarms: tuple[Swarm, ...]
    walls_cm: tuple[float, float, float, float] | None = None

    def __post_init__(self) -> None:
        for name in ("robot_radius_cm", "object_radius_cm", "interval_s"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise ValueError(f"`{name}` must be positive and finite; got {value}.")
        if not self.swarms:
            raise ValueError("`swarms` must hold at least one swarm; got none.")
        if len({len(swarm.poses) for swarm in self.swarms}) > 1:
            frames = [len(swarm.poses) for swarm in self.swarms]
            raise ValueError(f"`swarms` must all have the same number of frames; got {frames}.")
        if self.walls_cm is not None and not (
            np.isfinite(self.walls_cm).all()
            and self.walls_cm[0] < self.walls_cm[2]
            and self.walls_cm[1] < self.walls_cm[3]
        ):
            raise ValueError(f"`walls_cm` must be left < right and bottom < top, finite; got {self.walls_cm}.")
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
