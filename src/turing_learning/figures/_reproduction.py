"""Pictures that only the reproduction of the paper needs."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._studies import WHISKERS
from ._style import (
    BLUE,
    DASHED,
    INK,
    MUTED,
    ORANGE,
    SKY,
    add_legend,
    checked,
    checked_names,
    label,
    new_figure,
    prepare_axes,
)
from ._swarm import swarm_frame

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SMALLEST_BODY = 0.008  # radius of a robot as drawn, over the side of its panel: smaller ones could not be seen
HIGHEST = 4.0  # dispersions shown, in multiples of the agents' largest


def snapshots_figure(
    poses: np.ndarray,
    *,
    times_s: Sequence[float],
    robots: int,
    robot_radius_cm: float = 3.5,
    object_radius_cm: float = 5.0,
    columns: int | None = None,
) -> "Figure":
    """Draw some moments of one trial side by side, all at the same scale.

    In a wide arena robots and objects are enlarged, together, until they can be seen; the figure says how much.

    Parameters
    ----------
    poses : (F, A + O, 3)
        x, y (cm), heading (rad) at each moment; robots first.
    times_s
        Time of each moment (s).
    robots
        Number of robots A.
    robot_radius_cm, object_radius_cm
        Radii (cm).
    columns
        Moments in a row; None puts all into one.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If a shape or a number does not fit.

    Source
    ------
    Paper, figures 2, 3 and 22.
    """
    poses = checked("poses", poses, len(times_s), "A + O", 3)
    low, high = poses[..., :2].min(axis=(0, 1)), poses[..., :2].max(axis=(0, 1))
    center, reach = (low + high) / 2, float((high - low).max()) / 2 + 2 * max(robot_radius_cm, object_radius_cm)
    growth = max(1.0, SMALLEST_BODY * 2 * reach / robot_radius_cm)
    columns = min(columns or len(times_s), len(times_s))
    rows = -(-len(times_s) // columns)
    figure = new_figure(1.95 * columns, 2.4 + 2.15 * (rows - 1))
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for unused in panels[len(times_s) :]:
        unused.axis("off")
    for axes, moment, time_s in zip(panels[: len(times_s)], poses, times_s, strict=True):
        swarm_frame(
            axes,
            moment,
            robots=robots,
            robot_radius_cm=growth * robot_radius_cm,
            object_radius_cm=growth * object_radius_cm,
        )
        _frame(axes, center, reach, f"after {time_s:g} s" if time_s else "initial configuration")
    enlarged = f"; drawn {growth:.1f} times as large" if growth > 1 else ""
    figure.suptitle(" ", fontsize=2)  # room above the titles of the panels
    note = f"side of a panel: {2 * reach / 100:.1f} m{enlarged}"
    figure.supxlabel(note, fontsize=8, color=MUTED, x=0.995, ha="right")
    return figure


def _frame(axes: "Axes", center: np.ndarray, reach: float, text: str) -> None:
    axes.axis("on")
    axes.set(xlim=(center[0] - reach, center[0] + reach), ylim=(center[1] - reach, center[1] + reach))
    axes.set_xticks([])
    axes.set_yticks([])
    axes.spines[:].set_color(MUTED)
    axes.set_title(text, fontsize=9, color=INK)


def dispersion_figure(agents: np.ndarray, models: np.ndarray, *, least: float, gathered: str = "robots") -> "Figure":
    """Draw the dispersion that agents, and replicas of several models, have reached: a box for each.

    Values above four times the agents' largest are left out, and their number is given.

    Parameters
    ----------
    agents : (R,)
        Dispersion of the agents in R trials.
    models : (M, R)
        Dispersion of replicas of each model.
    least
        The smallest possible dispersion, dashed.
    gathered
        What gathers.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.

    Source
    ------
    Paper, figure 6.
    """
    agents = checked("agents", agents, "R")
    models = checked("models", models, "M", "R")
    figure = new_figure(7.2, 3.2)
    axes = figure.subplots()
    prepare_axes(axes)
    _dispersion_boxes(axes, [agents], [0], color=INK, facecolor="#c9ced4", hatch="////")
    _dispersion_boxes(axes, list(models), range(1, len(models) + 1), color=BLUE, facecolor="white", hatch="")
    axes.axhline(least, color=INK, linewidth=1.1, linestyle=DASHED, label="least possible")
    axes.set_xlim(-0.9, len(models) + 0.9)
    named = _some(len(models))
    axes.set_xticks([0, *named], ["agents", *map(str, named)])
    _limit(axes, np.concatenate([agents, models.ravel()]), least, float(agents.max()))
    label(axes, f"Dispersion of the {gathered}", "Model")
    add_legend(figure, loc="outside upper left")
    return figure


def _some(models: int) -> list[int]:
    """Return the numbers of models that are written: all, or every fifth, so that "agents" has room."""
    return [k for k in range(1, models + 1) if models <= 12 or k % 5 == 0]


def _dispersion_boxes(
    axes: "Axes", groups: list[np.ndarray], places: Sequence[int], *, color: str, facecolor: str, hatch: str
) -> None:
    line: dict[str, Any] = {"color": color, "linewidth": 1.0}
    axes.boxplot(
        groups,
        positions=list(places),
        whis=WHISKERS,
        widths=0.55,
        patch_artist=True,
        manage_ticks=False,
        boxprops={"facecolor": facecolor, "edgecolor": color, "linewidth": 1.0, "hatch": hatch},
        whiskerprops=line,
        capprops=line,
        medianprops={"color": ORANGE, "linewidth": 1.5},
        flierprops={"marker": "o", "markersize": 3, "markerfacecolor": "none", "markeredgecolor": MUTED},
    )


def _limit(axes: "Axes", values: np.ndarray, least: float, reference: float) -> None:
    top = min(float(values.max()), HIGHEST * reference)
    bottom = min(least, float(values.min()))
    margin = 0.06 * (top - bottom)
    axes.set_ylim(bottom - margin, top + margin)
    if beyond := int(np.count_nonzero(values > top)):
        note = f"{beyond} trials beyond"
        axes.text(1, 1.02, note, transform=axes.transAxes, ha="right", va="bottom", fontsize=7.5, color=MUTED)


def prediction_figure(
    values: np.ndarray, *, predicted: np.ndarray, truth: np.ndarray, names: Sequence[str]
) -> "Figure":
    """Draw what many runs have inferred beside what theory predicts and beside the truth.

    Parameters
    ----------
    values : (R, P)
        One model of each run; median, and quartiles as a bar, are drawn.
    predicted, truth : (P,)
        The prediction, and the agents' parameters.
    names
        Names of the P parameters.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.
    """
    values = checked("values", values, "R", "P")
    names = checked_names(names, values.shape[1])
    predicted, truth = checked("predicted", predicted, len(names)), checked("truth", truth, len(names))
    low, middle, high = np.quantile(values, (0.25, 0.5, 0.75), axis=0)
    places = np.arange(len(names))
    figure = new_figure(max(4.2, 0.8 * len(names) + 1.4), 3.2)
    axes = figure.subplots()
    prepare_axes(axes)
    axes.hlines(truth, places - 0.36, places + 0.36, color=INK, linewidth=1.1, linestyle=DASHED, label="true value")
    axes.plot(places - 0.14, predicted, "D", color=ORANGE, markersize=6, markerfacecolor="none", label="predicted")
    axes.errorbar(
        places + 0.14, middle, np.stack([middle - low, high - middle]),
        fmt="o", color=BLUE, ecolor=SKY, markersize=5, capsize=3, label="inferred: median, quartiles",
    )  # fmt: skip
    axes.set_xticks(places, names, parse_math=False)
    label(axes, "Value of the parameter", "Parameter")
    add_legend(figure, loc="outside upper left", ncols=3)
    return figure
