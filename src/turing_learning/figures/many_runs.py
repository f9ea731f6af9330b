"""Many runs in one figure: boxes, medians over generations, a histogram of errors, errors over effort."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.arrays import array
from turing_learning.errors import require

from .style import (
    BLUE,
    DASHED,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    RULE,
    SKY,
    TRUE_VALUE,
    draw_line,
    note,
    one_panel,
    panel_row,
    series,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Numbers = Sequence[float] | np.ndarray | None
"""True values of parameters, None where they are unknown."""
WHISKERS = 1.5
"""Interquartile ranges: paper, footnote on box plots."""
SMALLEST_ERROR = 1e-6
"""Error that a logarithmic axis can show."""
LEVEL_LABELS = 12
"""Names that fit side by side, at most."""
HIGHEST_DISPERSION = 4.0
"""Dispersions that are drawn, in multiples of the agents' largest."""
MARKERS = ("o", "s", "^", "D", "v", "P")
ERROR_CURVES: dict[str, dict[str, Any]] = {
    "average": {"color": ORANGE, "linestyle": (0, (1.5, 1.2)), "label": "average of all models"},
    "subjective": {"color": GREEN, "linestyle": "-", "label": "subjectively best"},
    "objective": {"color": BLUE, "linestyle": (0, (5, 1.5)), "label": "objectively best"},
}
"""Curve of `error_panels_figure` -> its look."""


def box_figure(
    values: np.ndarray, *, names: Sequence[str], truth: Sequence[float] | np.ndarray | None = None
) -> "Figure":
    """Draw the inferred parameters of many runs as boxes.

    A box spans the quartiles and is divided by the median; whiskers reach the last values within
    1.5 interquartile ranges; circles are beyond. Circles so far off that the boxes could not be
    seen are left out, and their number is given.

    Parameters
    ----------
    values : (R, P)
        One model of each run.
    names
        Names of the P parameters.
    truth : (P,)
        The agents' parameters, dashed; None where they are unknown.

    Source
    ------
    Paper, figure 4.
    """
    values = array("values", values, "R P")
    parameters = values.shape[1]
    rule = f"hold one name per parameter, {parameters}"
    require(len(names) == parameters, "names", rule, len(names))
    if truth is not None:
        truth = array("truth", truth, "P", P=parameters)
    return box_panels_figure({"": values}, names=names, truth=truth)


def box_panels_figure(
    groups: Mapping[str, np.ndarray],
    *,
    names: Sequence[str],
    truth: Numbers,
    quantity: str = "Value of the parameter",
) -> "Figure":
    """Draw `box_figure` for groups of runs (R, P) with titles, side by side at one scale: figures 11 and 13 of the paper."""
    width, height = (max(3.6, 0.9 * len(names) + 1.4), 3.4)
    if len(groups) > 1:
        width, height = (max(3.6, 2.7 * len(groups)), 3.2)
    panels = panel_row(list(groups), width, height)
    true_values = [] if truth is None else list(truth)
    centers = np.arange(1, len(true_values) + 1)
    limits = []
    for axes, values in zip(panels.axes, groups.values(), strict=True):
        _draw_boxes(axes, list(values.T), names=names)
        if true_values:
            ends = (centers - 0.42, centers + 0.42)
            axes.hlines(true_values, *ends, label="true value", zorder=3, **TRUE_VALUE)
        limits.append(_limits(axes, values, true_values))
    panels.label(quantity, "Parameter")
    lows, highs = zip(*limits, strict=True)
    panels.axes[0].set_ylim(min(lows), max(highs))
    return panels.with_legend(ncols=1)


def _limits(axes: "Axes", values: np.ndarray, truth: list[float]) -> tuple[float, float]:
    """Return limits that show all whiskers, the truth, and as much again on both sides; note how many values are beyond."""
    lower, upper = np.quantile(values, (0.25, 0.75), axis=0)
    reach = WHISKERS * (upper - lower)
    inside = values[(values >= lower - reach) & (values <= upper + reach)]
    low = min([inside.min(), *truth])
    high = max([inside.max(), *truth])
    span = (high - low) or 1.0
    visible = values[(values >= low - span) & (values <= high + span)]
    if beyond := values.size - visible.size:
        note(axes, f"{beyond} outliers beyond")
    return min(visible.min(), low) - 0.05 * span, max(visible.max(), high) + 0.05 * span


def error_box_figure(
    errors: Mapping[str, np.ndarray], *, quantity: str = "Absolute error", where: str = "Parameter"
) -> "Figure":
    """Draw groups of errors (R,) as boxes on a logarithmic axis, as in figure 14b of the paper; the least is drawn at 1e-6."""
    groups = [np.maximum(group, SMALLEST_ERROR) for group in errors.values()]
    panels, axes = one_panel(min(12.0, max(3.6, 1.1 * len(errors) + 1.4)), 3.4)
    _draw_boxes(axes, groups, names=list(errors))
    panels.logarithmic(*groups)
    if len(errors) > LEVEL_LABELS:
        axes.tick_params(axis="x", rotation=60)
    panels.label(quantity, where)
    return panels.figure


def error_groups_figure(groups: Mapping[str, np.ndarray], *, names: Sequence[str]) -> "Figure":
    """Draw errors (R, P) of several kinds of runs as boxes, side by side for each of P names, on a logarithmic axis."""
    from matplotlib.patches import Patch

    panels, axes = one_panel(max(5.2, 0.45 * len(names) * len(groups) + 1.4), 3.3)
    width = len(groups) + 1
    handles = []
    # Groups stand side by side, with a gap of one box between parameters.
    for k, (group, errors) in enumerate(groups.items()):
        color = series(k)["color"]
        centers = [width * p + k for p in range(len(names))]
        _draw_boxes(axes, list(np.maximum(errors, 1e-4).T), positions=centers, color=color)
        handles.append(Patch(edgecolor=color, facecolor="none", label=group))
    axes.set_xticks([width * p + (len(groups) - 1) / 2 for p in range(len(names))], list(names))
    panels.logarithmic(*groups.values())
    panels.label("Absolute error, share of range", "Parameter")
    return panels.with_legend(handles=handles)


def dispersion_figure(
    agents: np.ndarray, models: np.ndarray, *, least_possible: float, gathered: str
) -> "Figure":
    """Draw the dispersion that agents (R,), hatched, and replicas of several models (M, R) have reached: a box for each.

    The least possible dispersion is dashed. Values above four times the agents' largest are left
    out, and counted. As in figure 6 of the paper.
    """
    panels, axes = one_panel(7.2, 3.2)
    numbers = range(1, len(models) + 1)
    _draw_boxes(axes, [agents], positions=[0], color=INK, facecolor="#c9ced4", hatch="////")
    _draw_boxes(axes, list(models), positions=numbers, facecolor="white")
    axes.axhline(least_possible, label="least possible", **TRUE_VALUE)
    axes.set_xlim(-0.9, len(models) + 0.9)
    # With many models few numbers are named, so that "agents" has room.
    named = [k for k in numbers if len(models) <= LEVEL_LABELS or k % 5 == 0]
    axes.set_xticks([0, *named], ["agents", *map(str, named)])
    values = np.concatenate([agents, models.ravel()])
    top = min(float(values.max()), HIGHEST_DISPERSION * float(agents.max()))
    bottom = min(least_possible, float(values.min()))
    margin = 0.06 * (top - bottom)
    axes.set_ylim(bottom - margin, top + margin)
    if beyond := int(np.count_nonzero(values > top)):
        note(axes, f"{beyond} trials beyond")
    panels.label(f"Dispersion of the {gathered}", "Model")
    return panels.with_legend()


def _draw_boxes(
    axes: "Axes",
    groups: list[np.ndarray],
    *,
    names: Sequence[str] = (),
    positions: Sequence[int] | None = None,
    color: str = BLUE,
    **face: Any,
) -> None:
    """Draw groups of values (R,) as boxes at positions, by default 1, 2, ...; these get the names as ticks."""
    line: dict[str, Any] = {"color": color, "linewidth": 1.1}
    axes.boxplot(
        groups, positions=positions, whis=WHISKERS, widths=0.5, patch_artist=True, manage_ticks=positions is None,
        boxprops={"facecolor": "none", "edgecolor": color, "linewidth": 1.1} | face, whiskerprops=line, capprops=line,
        medianprops={"color": ORANGE, "linewidth": 1.6},
        flierprops={"marker": "o", "markersize": 3.5, "markerfacecolor": "none", "markeredgecolor": MUTED},
    )  # fmt: skip
    if names:
        axes.set_xticks(range(1, len(names) + 1), names, parse_math=False)


def convergence_figure(
    medians: Mapping[str, np.ndarray],
    *,
    names: Sequence[str],
    truth: Numbers = None,
    trials: np.ndarray | None = None,
) -> "Figure":
    """Draw medians over the runs (G, P), of runs of trials over those spent (G,), as in figure 5 of the paper.

    Several kinds of runs, by titles, are side by side on one scale, as in figure 19. True values
    are thin and dashed.
    """
    width, height = (7.4, 3.3) if len(medians) > 1 else (6.4, 3.4)
    panels = panel_row(list(medians), width, height, loc="center", fontsize=9.5)
    for axes, values in zip(panels.axes, medians.values(), strict=True):
        for k, name in enumerate(names):
            draw_line(axes, values[:, k], trials, linewidth=1.3, label=name, **series(k))
            if truth is not None:
                look = {"color": series(k)["color"], "linewidth": 0.7, "linestyle": (0, (2, 3))}
                axes.axhline(truth[k], label="_", **look)
    panels.over_generations("Median over the runs", len(values), trials)
    return panels.with_legend(ncols=min(len(names), 6))


def error_panels_figure(errors: Mapping[str, Mapping[str, Any]]) -> "Figure":
    """Draw the errors of the models of each generation in kinds of runs, as figure 20.

    By the titles of the kinds, the curves (G,) of `ERROR_CURVES`.
    """
    panels = panel_row(list(errors), 7.4, 3.3, loc="center", fontsize=9.5)
    for axes, curves in zip(panels.axes, errors.values(), strict=True):
        for name, style in ERROR_CURVES.items():
            axes.plot(curves[name], linewidth=1.4, **style)
        axes.set_ylim(bottom=0)
    panels.over_generations("Mean absolute error", len(curves["average"]))
    return panels.with_legend(ncols=3)


def error_histogram_figure(maes: np.ndarray, *, limits: tuple[float, float]) -> "Figure":
    """Draw the distribution of the mean absolute errors (R,) of many runs; the limits of good and fair ones are dashed.

    The axis ends at the largest error, at most three times the second limit; errors beyond share
    the last bar. As in figure 14a of the paper.
    """
    # a little beyond the largest error, and beyond the first limit in any case
    upper = min(3 * limits[1], max(1.1 * limits[0], 1.02 * float(maes.max())))
    panels, axes = one_panel(5.2, 3.1)
    edges = np.linspace(0, upper, 31)
    axes.hist(
        np.minimum(maes, upper), bins=edges.tolist(), color=SKY, edgecolor=BLUE, linewidth=0.7
    )
    axes.locator_params(axis="y", integer=True)
    for limit in limits:
        if limit < upper:
            axes.axvline(limit, color=INK, linewidth=0.9, linestyle=DASHED)
    if beyond := int(np.count_nonzero(maes > upper)):
        note(axes, f"{beyond} beyond {upper:g}")
    panels.label("Number of runs", "Mean absolute error")
    return panels.figure


def prediction_figure(
    values: np.ndarray, *, predicted: np.ndarray, truth: np.ndarray, names: Sequence[str]
) -> "Figure":
    """Draw median and quartiles of what many runs have inferred (R, P) beside what theory predicts and beside the truth."""
    low, middle, high = np.quantile(values, (0.25, 0.5, 0.75), axis=0)
    centers = np.arange(len(names))
    panels, axes = one_panel(max(4.2, 0.8 * len(names) + 1.4), 3.2)
    axes.hlines(truth, centers - 0.36, centers + 0.36, label="true value", **TRUE_VALUE)
    look: dict[str, Any] = {"color": ORANGE, "markersize": 6, "markerfacecolor": "none"}
    axes.plot(centers - 0.14, predicted, "D", label="predicted", **look)
    axes.errorbar(
        centers + 0.14, middle, np.stack([middle - low, high - middle]),
        fmt="o", color=BLUE, ecolor=SKY, markersize=5, capsize=3, label="inferred: median, quartiles",
    )  # fmt: skip
    axes.set_xticks(centers, names, parse_math=False)
    panels.label("Value of the parameter", "Parameter")
    return panels.with_legend(ncols=3)


def budget_figure(panels: Mapping[str, Mapping[str, Mapping[int, np.ndarray]]]) -> "Figure":
    """Draw errors over the number of trials: every run as a dot, the medians as a line, methods by color, mark and dashes.

    `panels` holds title -> name of the method -> number of trials -> error of each run (R,), > 0.
    """
    from matplotlib.ticker import FuncFormatter

    row = panel_row(list(panels), 4.1 * len(panels), 3.6, loc="center", fontsize=9.5)
    for axes, methods in zip(row.axes, panels.values(), strict=True):
        for number, (name, errors) in enumerate(methods.items()):
            look = series(number)
            marker = MARKERS[number % len(MARKERS)]
            # Single runs are faint, so that the medians stand out.
            dots = {"color": look["color"], "markersize": 3.5, "alpha": 0.45, "markeredgewidth": 0}
            for trials in sorted(errors):
                axes.plot(np.full(len(errors[trials]), trials), errors[trials], marker, **dots)
            medians = [float(np.median(errors[trials])) for trials in sorted(errors)]
            look |= {"marker": marker, "markersize": 5.5, "linewidth": 1.3}
            axes.plot(sorted(errors), medians, label=name, **look)
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    row.label("Mean absolute error", "Trials")
    every_error: list[np.ndarray] = []
    for methods in panels.values():
        for errors in methods.values():
            every_error += errors.values()
    row.logarithmic(*every_error)
    return row.with_legend(loc="center")


def dynamic_outputs_figure(
    outputs: Mapping[str, np.ndarray], *, readings: np.ndarray, truth: np.ndarray
) -> "Figure":
    """Draw both outputs (T, 2) of networks, by titles, while the sensor reading (T,) changes; those of agents are dashed.

    A panel is shaded where the reading is not 0. As in figure 12 of the paper.
    """
    panels = panel_row(list(outputs), max(3.6, 2.7 * len(outputs)), 3.0)
    steps = np.arange(1, len(readings) + 1)
    dashed: dict[str, Any] = {"linewidth": 1.0, "linestyle": DASHED}
    dots: dict[str, Any] = {"markersize": 3, "linewidth": 1.2}
    for axes, values in zip(panels.axes, outputs.values(), strict=True):
        for step in steps[readings != 0]:
            axes.axvspan(step - 0.5, step + 0.5, color=RULE, alpha=0.6, linewidth=0, zorder=0)
        for side, color, name in ((0, BLUE, "left wheel"), (1, ORANGE, "right wheel")):
            axes.plot(steps, truth[:, side], color=color, drawstyle="steps-mid", **dashed)
            axes.plot(steps, values[:, side], "o-", color=color, label=name, **dots)
        axes.plot([], [], color=MUTED, label="agents", **dashed)
        axes.axvspan(0, 0, color=RULE, alpha=0.6, linewidth=0, label="I = 1")
        axes.set_xlim(0.5, len(steps) + 0.5)
    panels.label("Output", "Time step")
    panels.axes[0].set_ylim(-1.1, 1.1)
    return panels.with_legend(ncols=4)
