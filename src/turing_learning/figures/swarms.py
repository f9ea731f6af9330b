"""Swarms: one moment, several moments side by side, and what they come to over time."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.arrays import array
from turing_learning.errors import integer

from .style import BLUE, GREEN, INK, MUTED, ORANGE, TRUE_VALUE, Panels, label, new_figure, panel_row

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SMALLEST_BODY = 0.008
"""Radius of a robot as drawn, over the side of its panel: smaller ones could not be seen."""


def swarm_frame(
    axes: "Axes",
    poses: np.ndarray,
    *,
    robots: int,
    replicas: np.ndarray | None = None,
    trail: np.ndarray | None = None,
    robot_radius_cm: float = 3.5,
    object_radius_cm: np.typing.ArrayLike = 5.0,
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
    robot_radius_cm
        Radius of a robot (cm).
    object_radius_cm : () or (O,)
        Of objects (cm).
    """
    from matplotlib.patches import Circle

    def disk(x: float, y: float, radius: float, **options: Any) -> None:
        axes.add_patch(Circle((x, y), radius, **options))

    poses = array("poses", poses, "B 3")
    robots = integer("robots", robots, 0, len(poses))
    if replicas is None:
        replicas = np.zeros(robots, dtype=bool)
    is_replica = array("replicas", replicas, "A", dtype=bool, empty=True, A=robots)
    if trail is not None:
        paths = array("trail", trail, "F B 3", B=len(poses))[:, :robots]
        for k, replica in enumerate(is_replica):
            color = ORANGE if replica else BLUE
            axes.plot(
                paths[:, k, 0], paths[:, k, 1], color=color, linewidth=0.6, alpha=0.35, zorder=2
            )
    radii_cm = np.broadcast_to(object_radius_cm, len(poses) - robots)
    for (x, y, _), radius_cm in zip(poses[robots:], radii_cm, strict=True):
        disk(x, y, radius_cm, facecolor=GREEN, edgecolor="none", alpha=0.75)
    for (x, y, heading), replica in zip(poses[:robots], is_replica, strict=True):
        ahead = robot_radius_cm * np.array([np.cos(heading), np.sin(heading)])
        # A replica has a ring, too: colors alone do not tell for everybody
        if replica:
            disk(x, y, robot_radius_cm, facecolor=ORANGE, edgecolor="none", alpha=0.35, zorder=3)
            disk(
                x,
                y,
                0.88 * robot_radius_cm,
                facecolor="none",
                edgecolor=ORANGE,
                linewidth=1.2,
                zorder=3,
            )
        else:
            disk(x, y, robot_radius_cm, facecolor=BLUE, edgecolor="none", zorder=3)
        color = INK if replica else "white"
        axes.plot(
            [x, x + ahead[0]],
            [y, y + ahead[1]],
            color=color,
            linewidth=1,
            solid_capstyle="butt",
            zorder=4,
        )
    axes.set_aspect("equal")
    axes.axis("off")


def snapshots_figure(
    poses: np.ndarray,
    *,
    times_s: Sequence[float],
    robots: int,
    robot_radius_cm: float,
    object_radius_cm: float = 5.0,
    columns: int | None = None,
) -> "Figure":
    """Draw some moments of one trial, poses (F, A + O, 3), side by side or in rows of so many columns, at the same scale.

    In a wide arena robots and objects are enlarged, together, until they can be seen; the figure
    says how much. As in figures 2, 3 and 22 of the paper.
    """
    low = poses[..., :2].min(axis=(0, 1))
    high = poses[..., :2].max(axis=(0, 1))
    center = (low + high) / 2
    reach = float((high - low).max()) / 2 + 2 * max(robot_radius_cm, object_radius_cm)
    # A robot smaller than a few pixels could not be seen.
    growth = max(1.0, SMALLEST_BODY * 2 * reach / robot_radius_cm)
    columns = min(columns or len(times_s), len(times_s))
    rows = -(-len(times_s) // columns)
    figure = new_figure(1.95 * columns, 2.4 + 2.15 * (rows - 1))
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for unused in panels[len(times_s) :]:
        unused.axis("off")
    radii: dict[str, Any] = {
        "robot_radius_cm": growth * robot_radius_cm,
        "object_radius_cm": growth * object_radius_cm,
    }
    for axes, moment, time_s in zip(panels[: len(times_s)], poses, times_s, strict=True):
        swarm_frame(axes, moment, robots=robots, **radii)
        axes.axis("on")
        axes.set(
            xlim=(center[0] - reach, center[0] + reach), ylim=(center[1] - reach, center[1] + reach)
        )
        axes.set_xticks([])
        axes.set_yticks([])
        axes.spines[:].set_color(MUTED)
        axes.set_title(
            f"after {time_s:g} s" if time_s else "initial configuration", fontsize=9, color=INK
        )
    enlarged = f"; drawn {growth:.1f} times as large" if growth > 1 else ""
    # Room above the titles of the panels.
    figure.suptitle(" ", fontsize=2)
    text = f"side of a panel: {2 * reach / 100:.1f} m{enlarged}"
    figure.supxlabel(text, fontsize=8, color=MUTED, x=0.995, ha="right")
    return figure


def draw_paths(
    panels: Panels,
    swarms: Sequence[tuple[np.ndarray, int, np.ndarray | None]],
    *,
    robot_radius_cm: float,
    object_radius_cm: np.typing.ArrayLike,
) -> None:
    """Draw paths and ends of each swarm (poses (F, A + O, 3), A, replicas (A,)) into a panel, all at the same scale."""
    positions = np.concatenate([poses[..., :2].reshape(-1, 2) for poses, *_ in swarms])
    room = 2 * np.max(np.append(object_radius_cm, robot_radius_cm))
    low = positions.min(axis=0) - room
    high = positions.max(axis=0) + room
    radii: dict[str, Any] = {
        "robot_radius_cm": robot_radius_cm,
        "object_radius_cm": object_radius_cm,
    }
    for axes, (poses, robots, replicas) in zip(panels.axes, swarms, strict=True):
        swarm_frame(axes, poses[-1], robots=robots, replicas=replicas, trail=poses, **radii)
        axes.axis("on")
        axes.grid(visible=False)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    panels.label("y (cm)", "x (cm)")


def gathering_figure(
    times_s: np.ndarray,
    curves: Mapping[str, Mapping[str, np.ndarray]],
    *,
    limits: Mapping[str, float],
) -> "Figure":
    """Draw quantities of swarms over time (K,), a panel each: mean over trials as a line, standard deviation as a band.

    `curves` holds quantity -> who -> values (R, K); `limits` the best that there can be of each
    quantity, dashed. As in figure 21 of the paper.
    """
    panels = panel_row([""] * len(curves), 7.4, 3.2, sharey=False)
    for axes, (quantity, swarms) in zip(panels.axes, curves.items(), strict=True):
        looks = ((ORANGE, "-"), (BLUE, (0, (5, 1.5))))
        for (name, values), (color, dashes) in zip(swarms.items(), looks, strict=True):
            mean = values.mean(axis=0)
            deviation = values.std(axis=0)
            axes.fill_between(
                times_s, mean - deviation, mean + deviation, color=color, alpha=0.15, linewidth=0
            )
            axes.plot(times_s, mean, color=color, linestyle=dashes, linewidth=1.4, label=name)
        axes.axhline(limits[quantity], label="best possible", **TRUE_VALUE)
        axes.set_xlim(0, times_s[-1])
        axes.set_ylim(bottom=0)
        label(axes, quantity, "Time (s)")
    return panels.with_legend(ncols=3)
