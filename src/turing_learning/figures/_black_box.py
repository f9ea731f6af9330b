"""Several ways to infer side by side, and what networks do over time."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ._studies import draw_boxes, draw_truth, focus
from ._style import (
    BLUE,
    DASHED,
    INK,
    MUTED,
    ORANGE,
    RULE,
    add_legend,
    checked,
    checked_names,
    label,
    new_figure,
    prepare_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def box_panels_figure(
    groups: Sequence[np.ndarray],
    *,
    titles: Sequence[str],
    names: Sequence[str],
    truth: Sequence[float] | np.ndarray,
    what: str = "Value of the parameter",
) -> "Figure":
    """Draw the inferred parameters of many runs as boxes, a panel for each group of runs, all at the same scale.

    Circles so far off that the boxes could not be seen are left out, and their number is given.

    Parameters
    ----------
    groups : (R, P) each
        One model of each run; groups may differ in the number of runs.
    titles
        Of the groups.
    names
        Names of the P parameters.
    truth : (P,)
        The agents' parameters, dashed.
    what
        What the vertical axis shows.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.

    Source
    ------
    Paper, figures 11 and 13.
    """
    truth = checked("truth", truth, "P")
    names = checked_names(names, len(truth))
    values = [checked("groups", group, "R", len(truth)) for group in groups]
    if len(titles) != len(values) or not values:
        raise ValueError(f"`titles` must be as many as there are groups, at least one; got {len(titles)}.")
    figure = new_figure(max(3.6, 2.7 * len(values)), 3.2)
    panels = figure.subplots(1, len(values), sharey=True, squeeze=False)[0]
    for axes, group, title in zip(panels, values, titles, strict=True):
        prepare_axes(axes)
        draw_boxes(axes, list(group.T), names)
        draw_truth(axes, truth)
        axes.set_title(title, loc="left", fontsize=10, color=INK)
        label(axes, what if axes is panels[0] else "", "Parameter")
    limits = np.array([focus(axes, group, list(truth)) for axes, group in zip(panels, values, strict=True)])
    panels[0].set_ylim(limits[:, 0].min(), limits[:, 1].max())
    add_legend(figure, handles=panels[0].get_legend_handles_labels()[0], loc="outside upper left")
    return figure


def dynamic_outputs_figure(
    outputs: Sequence[np.ndarray], *, readings: np.ndarray, titles: Sequence[str], truth: np.ndarray
) -> "Figure":
    """Draw what networks put out while the sensor reading changes, a panel for each.

    Parameters
    ----------
    outputs : (T, 2) each
        Left and right wheel speed in each time step.
    readings : (T,)
        The sensor readings I; where one is not 0, the panel is shaded.
    titles
        Of the networks.
    truth : (T, 2)
        Wheel speeds of the agents for the same readings, dashed.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.

    Source
    ------
    Paper, figure 12.
    """
    readings = checked("readings", readings, "T")
    truth = checked("truth", truth, len(readings), 2)
    series = [checked("outputs", one, len(readings), 2) for one in outputs]
    if len(titles) != len(series) or not series:
        raise ValueError(f"`titles` must be as many as there are networks, at least one; got {len(titles)}.")
    figure = new_figure(max(3.6, 2.7 * len(series)), 3.0)
    panels = figure.subplots(1, len(series), sharey=True, squeeze=False)[0]
    for axes, one, title in zip(panels, series, titles, strict=True):
        _draw_outputs(axes, one, readings, truth)
        axes.set_title(title, loc="left", fontsize=10, color=INK)
        label(axes, "Output" if axes is panels[0] else "", "Time step")
    panels[0].set_ylim(-1.1, 1.1)
    add_legend(figure, handles=panels[0].get_legend_handles_labels()[0], loc="outside upper left", ncols=4)
    return figure


def _draw_outputs(axes: "Axes", outputs: np.ndarray, readings: np.ndarray, truth: np.ndarray) -> None:
    prepare_axes(axes)
    steps = np.arange(1, len(outputs) + 1)
    for step in steps[readings != 0]:
        axes.axvspan(step - 0.5, step + 0.5, color=RULE, alpha=0.6, linewidth=0, zorder=0)
    for side, color, name in ((0, BLUE, "left wheel"), (1, ORANGE, "right wheel")):
        axes.plot(steps, truth[:, side], color=color, linewidth=1.0, linestyle=DASHED, drawstyle="steps-mid")
        axes.plot(steps, outputs[:, side], "o-", color=color, markersize=3, linewidth=1.2, label=name)
    axes.plot([], [], color=MUTED, linewidth=1.0, linestyle=DASHED, label="agents")
    axes.axvspan(0, 0, color=RULE, alpha=0.6, linewidth=0, label="I = 1")
    axes.set_xlim(0.5, len(steps) + 0.5)
