"""Many runs in one picture: boxes, medians over generations, a histogram of errors."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._style import (
    BLUE,
    DASHED,
    INK,
    MUTED,
    ORANGE,
    SERIES_COLORS,
    SERIES_DASHES,
    SKY,
    add_legend,
    checked,
    checked_names,
    label,
    logarithmic,
    new_figure,
    over_generations,
    prepare_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WHISKERS = 1.5  # interquartile ranges: paper, footnote on box plots
SMALLEST = 1e-6  # error that a logarithmic axis can show
MOST_LEVEL_LABELS = 12  # names that fit side by side


def box_figure(
    values: np.ndarray, *, names: Sequence[str], truth: Sequence[float] | np.ndarray | None = None
) -> "Figure":
    """Draw the inferred parameters of many runs as boxes.

    A box spans the quartiles and is divided by the median; whiskers reach the last values within 1.5 interquartile ranges;
    circles are beyond. Circles so far off that the boxes could not be seen are left out, and their number is given.

    Parameters
    ----------
    values : (R, P)
        One model of each run.
    names
        Names of the P parameters.
    truth : (P,)
        The agents' parameters, dashed; None where they are unknown.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.

    Source
    ------
    Paper, figure 4.
    """
    values = checked("values", values, "R", "P")
    names = checked_names(names, values.shape[1])
    figure = new_figure(max(3.6, 0.9 * len(names) + 1.4), 3.4)
    axes = figure.subplots()
    prepare_axes(axes)
    draw_boxes(axes, list(values.T), names)
    if truth is not None:
        draw_truth(axes, checked("truth", truth, len(names)))
        add_legend(figure, loc="outside upper left")
    axes.set_ylim(*focus(axes, values, [] if truth is None else list(truth)))
    label(axes, "Value of the parameter", "Parameter")
    return figure


def draw_truth(axes: "Axes", truth: np.ndarray) -> None:
    """Dash the true value of each box."""
    places = np.arange(1, len(truth) + 1)
    axes.hlines(
        truth, places - 0.42, places + 0.42,
        color=INK, linewidth=1.1, linestyle=DASHED, label="true value", zorder=3,
    )  # fmt: skip


def focus(axes: "Axes", values: np.ndarray, truth: list[float]) -> tuple[float, float]:
    """Return limits that show all whiskers, the truth, and as much again on both sides; note how many values are beyond."""
    lower, upper = np.quantile(values, (0.25, 0.75), axis=0)
    reach = WHISKERS * (upper - lower)
    inside = values[(values >= lower - reach) & (values <= upper + reach)]
    low, high = min([inside.min(), *truth]), max([inside.max(), *truth])
    span = (high - low) or 1.0
    seen = values[(values >= low - span) & (values <= high + span)]
    if beyond := values.size - seen.size:
        note = f"{beyond} outliers beyond"
        axes.text(1, 1.02, note, transform=axes.transAxes, ha="right", va="bottom", fontsize=7.5, color=MUTED)
    return min(seen.min(), low) - 0.05 * span, max(seen.max(), high) + 0.05 * span


def error_box_figure(
    errors: Sequence[np.ndarray], *, names: Sequence[str], what: str = "Absolute error", where: str = "Parameter"
) -> "Figure":
    """Draw groups of errors as boxes on a logarithmic axis; groups may differ in size.

    Parameters
    ----------
    errors : (R,) each
        Errors, >= 0, group by group; below 1e-6 they are drawn there.
    names
        Names of the groups.
    what, where
        What the axes show.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.

    Source
    ------
    Paper, figure 14b.
    """
    groups = [np.maximum(checked("errors", group, "R"), SMALLEST) for group in errors]
    names = checked_names(names, len(groups))
    figure = new_figure(min(12.0, max(3.6, 1.1 * len(names) + 1.4)), 3.4)
    axes = figure.subplots()
    prepare_axes(axes)
    draw_boxes(axes, groups, names)
    logarithmic(axes, *groups)
    if len(names) > MOST_LEVEL_LABELS:
        axes.tick_params(axis="x", rotation=60)
    label(axes, what, where)
    return figure


def draw_boxes(axes: "Axes", groups: list[np.ndarray], names: Sequence[str]) -> None:
    """Draw a box for each group of values."""
    line: dict[str, Any] = {"color": BLUE, "linewidth": 1.1}
    axes.boxplot(
        groups,
        whis=WHISKERS,
        widths=0.5,
        patch_artist=True,
        boxprops={"facecolor": "none", "edgecolor": BLUE, "linewidth": 1.1},
        whiskerprops=line,
        capprops=line,
        medianprops={"color": ORANGE, "linewidth": 1.6},
        flierprops={"marker": "o", "markersize": 3.5, "markerfacecolor": "none", "markeredgecolor": MUTED},
    )
    axes.set_xticks(range(1, len(names) + 1), names, parse_math=False)


def convergence_figure(
    medians: np.ndarray, *, names: Sequence[str], truth: Sequence[float] | np.ndarray | None = None
) -> "Figure":
    """Draw how the models of many runs converge.

    Parameters
    ----------
    medians : (G, P)
        Median over the runs of each parameter of the best models.
    names
        Names of the P parameters.
    truth : (P,)
        The agents' parameters, thin and dashed in the same colors; None where they are unknown.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.

    Source
    ------
    Paper, figure 5.
    """
    medians = checked("medians", medians, "G", "P")
    names = checked_names(names, medians.shape[1])
    figure = new_figure(6.4, 3.4)
    axes = figure.subplots()
    prepare_axes(axes)
    draw_convergence(axes, medians, names, None if truth is None else checked("truth", truth, len(names)))
    label(axes, "Median over the runs")
    add_legend(figure, loc="outside upper left", ncols=min(len(names), 6))
    return figure


def draw_convergence(axes: "Axes", medians: np.ndarray, names: Sequence[str], truth: np.ndarray | None) -> None:
    """Draw parameters over the generations, their true values thin and dashed in the same colors."""
    for k, name in enumerate(names):
        color, dashes = SERIES_COLORS[k % len(SERIES_COLORS)], SERIES_DASHES[k % len(SERIES_DASHES)]
        marker: dict[str, Any] = {"marker": "o", "markersize": 4} if len(medians) == 1 else {}
        axes.plot(medians[:, k], color=color, linestyle=dashes, linewidth=1.3, label=name, **marker)
        if truth is not None:
            axes.axhline(truth[k], color=color, linewidth=0.7, linestyle=(0, (2, 3)), label="_")
    over_generations(axes, len(medians))


def error_histogram_figure(maes: np.ndarray, *, limits: tuple[float, float] = (0.05, 0.1)) -> "Figure":
    """Draw the distribution of the mean absolute errors of many runs.

    Errors of more than three times the second limit share the last bar.

    Parameters
    ----------
    maes : (R,)
        MAE of each run, >= 0.
    limits
        Below the first a run is good, below the second fair; they are dashed.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If the shape is wrong or a value is not finite.

    Source
    ------
    Paper, figure 14a.
    """
    maes = checked("maes", maes, "R")
    end = 3 * limits[1]
    width = limits[0] / 5
    edges = np.arange(0, end + 1.5 * width, width)
    figure = new_figure(5.2, 3.1)
    axes = figure.subplots()
    prepare_axes(axes)
    axes.hist(np.minimum(maes, end + width / 2), bins=edges.tolist(), color=SKY, edgecolor=BLUE, linewidth=0.7)
    for limit in limits:
        axes.axvline(limit, color=INK, linewidth=0.9, linestyle=DASHED)
    beyond = int(np.count_nonzero(maes > end))
    if beyond:
        note = f"{beyond} beyond {end:g}"
        axes.text(1, 1.02, note, transform=axes.transAxes, ha="right", va="bottom", fontsize=7.5, color=MUTED)
    label(axes, "Number of runs", "Mean absolute error")
    return figure
