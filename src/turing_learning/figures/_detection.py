"""What classifiers can tell: decision accuracy over generations, and detections over false alarms."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ._style import (
    BLUE,
    GREEN,
    MUTED,
    ORANGE,
    SERIES_COLORS,
    SERIES_DASHES,
    add_legend,
    checked,
    label,
    new_figure,
    prepare_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def accuracy_figure(
    generations: np.ndarray, *, subjective: np.ndarray, objective: np.ndarray, jury: np.ndarray | None = None
) -> "Figure":
    """Draw the decision accuracy of the best classifiers over generations: mean and standard deviation over the runs.

    The horizontal axis is linear up to generation 1 and logarithmic from there.

    Parameters
    ----------
    generations : (G,)
        Numbers of the generations, ascending, >= 0.
    subjective, objective : (R, G)
        Accuracy, 0 to 1, of the classifier with the highest subjective fitness, and the highest accuracy of a single
        classifier of the population, in each run.
    jury : (R, G)
        Highest accuracy of a single classifier of the population or its archive; None without an archive.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.

    Source
    ------
    Paper, figure 7.
    """
    generations = checked("generations", generations, "G")
    objective = checked("objective", objective, "R", len(generations))
    subjective = checked("subjective", subjective, *objective.shape)
    figure = new_figure(5.2, 3.3)
    axes = figure.subplots()
    prepare_axes(axes)
    if jury is not None:
        jury = checked("jury", jury, *objective.shape)
        name = "best with archive (objective)"
        _draw_accuracy(axes, generations, jury, name=name, color=GREEN, marker="^", dashes=":")
    _draw_accuracy(axes, generations, objective, name="best classifier (objective)", color=BLUE, marker="s", dashes="-")
    _draw_accuracy(
        axes, generations, subjective, name="best classifier (subjective)", color=ORANGE, marker="o", dashes="--"
    )
    _even_ratios(axes, generations)
    ends = [values.mean(axis=0) + sign * values.std(axis=0) for values in (objective, subjective) for sign in (-1, 1)]
    axes.set_ylim(min(0.5, 100 * np.min(ends) // 5 / 20), max(1.0, np.max(ends)) + 0.01)
    label(axes, "Decision accuracy")
    add_legend(figure, loc="outside upper left", ncols=2)
    return figure


def _draw_accuracy(
    axes: "Axes", generations: np.ndarray, values: np.ndarray, *, name: str, color: str, marker: str, dashes: str
) -> None:
    """Draw mean and standard deviation over the runs; marker and dashes differ, for print in black and white."""
    axes.errorbar(
        generations,
        values.mean(axis=0),
        yerr=values.std(axis=0) if len(values) > 1 else None,
        color=color,
        marker=marker,
        markersize=4,
        linestyle=dashes,
        linewidth=1.3,
        elinewidth=0.8,
        capsize=2,
        label=name,
    )


def _even_ratios(axes: "Axes", generations: np.ndarray) -> None:
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    axes.set_xscale("symlog", linthresh=1)
    last = 1.2 * max(generations.max(), 1)
    decades = [10**k for k in range(7) if 10**k <= last]
    axes.xaxis.set_major_locator(FixedLocator([0, *decades]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlim(-0.2, last)


def roc_figure(curves: Mapping[str, tuple[np.ndarray, np.ndarray]]) -> "Figure":
    """Draw how many abnormal individuals are detected at which share of false alarms, for several rules.

    Parameters
    ----------
    curves
        Name of the rule -> false alarms and detections, (K,) each, ascending from 0 to 1.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there is no curve, shapes do not agree, or a value is not finite.
    """
    if not curves:
        raise ValueError("`curves` must hold at least one curve; got none.")
    figure = new_figure(4.6, 3.9)
    axes = figure.subplots()
    prepare_axes(axes)
    axes.plot([0, 1], [0, 1], color=MUTED, linewidth=0.7, linestyle=(0, (2, 3)), label="_")
    for k, (name, (false_alarms, detections)) in enumerate(curves.items()):
        false_alarms = checked("false_alarms", false_alarms, "K")
        detections = checked("detections", detections, *false_alarms.shape)
        color, dashes = SERIES_COLORS[k % len(SERIES_COLORS)], SERIES_DASHES[k % len(SERIES_DASHES)]
        axes.plot(false_alarms, detections, color=color, linestyle=dashes, linewidth=1.4, label=name)
    axes.set_xlim(-0.01, 1)
    axes.set_ylim(0, 1.01)
    label(axes, "Share of abnormal individuals detected", "Share of genuine individuals called abnormal")
    add_legend(axes, loc="lower right")
    return figure
