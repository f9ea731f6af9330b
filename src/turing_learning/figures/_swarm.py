"""One moment of a swarm."""

from typing import TYPE_CHECKING, Any

import numpy as np

from ._style import BLUE, GREEN, INK, ORANGE, checked

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def swarm_frame(
    axes: "Axes",
    poses: np.ndarray,
    *,
    robots: int,
    replicas: np.ndarray | None = None,
    trail: np.ndarray | None = None,
    robot_radius_cm: float = 3.5,
    object_radius_cm: float = 5.0,
) -> None:
    """Draw robots as disks with their heading, replicas as rings in another color, and objects as plain disks.

    Axes get the same scale in both directions and no frame; their limits are the caller's.

    Parameters
    ----------
    axes
        Where to draw.
    poses : (A + O, 3)
        x, y (cm), heading (rad, anticlockwise); robots first.
    robots
        Number of robots A.
    replicas : (A,) bool
        Which robots execute a model; none by default.
    trail : (F, A + O, 3)
        Past poses, drawn as faint lines.
    robot_radius_cm, object_radius_cm
        Radii (cm).

    Raises
    ------
    ValueError
        If a shape or a number does not fit.
    """
    poses = checked("poses", poses, "A + O", 3)
    if not 0 <= robots <= len(poses):
        raise ValueError(f"`robots` must be between 0 and the number of poses, {len(poses)}; got {robots}.")
    is_replica = np.zeros(robots, dtype=bool) if replicas is None else np.asarray(replicas, dtype=bool)
    if is_replica.shape != (robots,):
        raise ValueError(f"`replicas` must have the shape ({robots},); got {is_replica.shape}.")
    if trail is not None:
        _draw_trail(axes, checked("trail", trail, "F", len(poses), 3)[:, :robots], is_replica)
    for x, y, _ in poses[robots:]:
        _draw_disk(axes, x, y, object_radius_cm, facecolor=GREEN, edgecolor="none", alpha=0.75)
    for pose, replica in zip(poses[:robots], is_replica, strict=True):
        _draw_robot(axes, pose, robot_radius_cm, replica)
    axes.set_aspect("equal")
    axes.axis("off")


def _draw_disk(axes: "Axes", x: float, y: float, radius: float, **options: Any) -> None:
    from matplotlib.patches import Circle

    axes.add_patch(Circle((x, y), radius, **options))


def _draw_robot(axes: "Axes", pose: np.ndarray, radius: float, replica: bool) -> None:
    x, y, heading = pose
    ahead = radius * np.array([np.cos(heading), np.sin(heading)])
    if replica:
        _draw_disk(axes, x, y, radius, facecolor=ORANGE, edgecolor="none", alpha=0.35, zorder=3)
        _draw_disk(axes, x, y, 0.88 * radius, facecolor="none", edgecolor=ORANGE, linewidth=1.2, zorder=3)
    else:
        _draw_disk(axes, x, y, radius, facecolor=BLUE, edgecolor="none", zorder=3)
    color = INK if replica else "white"
    axes.plot([x, x + ahead[0]], [y, y + ahead[1]], color=color, linewidth=1, solid_capstyle="butt", zorder=4)


def _draw_trail(axes: "Axes", trail: np.ndarray, is_replica: np.ndarray) -> None:
    for k, replica in enumerate(is_replica):
        color = ORANGE if replica else BLUE
        axes.plot(trail[:, k, 0], trail[:, k, 1], color=color, linewidth=0.6, alpha=0.35, zorder=2)
