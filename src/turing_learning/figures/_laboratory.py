"""Pictures of runs in a laboratory beside simulated ones, and of what large swarms come to."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ._studies import draw_convergence
from ._style import (
    BLUE,
    DASHED,
    GREEN,
    INK,
    ORANGE,
    add_legend,
    checked,
    checked_names,
    label,
    new_figure,
    over_generations,
    prepare_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ERRORS: dict[str, dict[str, Any]] = {
    "average of all models": {"color": ORANGE, "linestyle": (0, (1.5, 1.2))},
    "subjectively best": {"color": GREEN, "linestyle": "-"},
    "objectively best": {"color": BLUE, "linestyle": (0, (5, 1.5))},
}


def convergence_panels_figure(
    medians: Sequence[np.ndarray], *, titles: Sequence[str], names: Sequence[str], truth: Sequence[float] | np.ndarray
) -> "Figure":
    """Draw how models converge in several kinds of runs, side by side on one scale.

    Parameters
    ----------
    medians : (G, P) each
        Median over the runs of each parameter of the best models.
    titles
        Of the panels.
    names
        Names of the P parameters.
    truth : (P,)
        The agents' parameters, thin and dashed in the same colors.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.

    Source
    ------
    Paper, figure 19.
    """
    figure, panels = _panels(titles, len(medians))
    names = checked_names(names, np.shape(medians[0])[-1])
    truth = checked("truth", truth, len(names))
    for axes, values in zip(panels, medians, strict=True):
        draw_convergence(axes, checked("medians", values, "G", len(names)), names, truth)
        label(axes, "")
    label(panels[0], "Median over the runs")
    _common_legend(figure, panels[0], ncols=min(len(names), 6))
    return figure


def error_panels_figure(errors: Sequence[Mapping[str, np.ndarray]], *, titles: Sequence[str]) -> "Figure":
    """Draw the errors of the models of each generation in several kinds of runs, side by side on one scale.

    Parameters
    ----------
    errors : name -> (G,) each
        Of "average of all models", "subjectively best" and "objectively best".
    titles
        Of the panels.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there is another curve, or a value is not finite.

    Source
    ------
    Paper, figure 20.
    """
    figure, panels = _panels(titles, len(errors))
    for axes, curves in zip(panels, errors, strict=True):
        if set(curves) != set(_ERRORS):
            raise ValueError(f"`errors` must hold {', '.join(_ERRORS)}; got {', '.join(curves) or 'nothing'}.")
        for name, style in _ERRORS.items():
            values = checked(name, curves[name], "G")
            axes.plot(values, label=name, linewidth=1.4, **style)
            over_generations(axes, len(values))
        axes.set_ylim(bottom=0)
        label(axes, "")
    label(panels[0], "Mean absolute error")
    _common_legend(figure, panels[0], ncols=3)
    return figure


def gathering_figure(
    times_s: np.ndarray, curves: Mapping[str, Mapping[str, np.ndarray]], *, limits: Mapping[str, float]
) -> "Figure":
    """Draw quantities of swarms over time, a panel each: mean over trials as a line, standard deviation as a band.

    Parameters
    ----------
    times_s : (K,)
        Moments (s).
    curves
        Quantity -> who -> values (R, K) in R trials, K moments.
    limits
        Quantity -> the best that there can be, dashed.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.

    Source
    ------
    Paper, figure 21.
    """
    times_s = checked("times_s", times_s, "K")
    figure = new_figure(7.4, 3.2)
    panels = figure.subplots(1, len(curves), squeeze=False)[0]
    for axes, (quantity, swarms) in zip(panels, curves.items(), strict=True):
        prepare_axes(axes)
        for (name, values), color, dashes in zip(swarms.items(), (ORANGE, BLUE), ("-", (0, (5, 1.5))), strict=True):
            _band(axes, times_s, checked(name, values, "R", len(times_s)), name, color, dashes)
        axes.axhline(limits[quantity], color=INK, linewidth=1.1, linestyle=DASHED, label="best possible")
        axes.set_xlim(0, times_s[-1])
        axes.set_ylim(bottom=0)
        label(axes, quantity, "Time (s)")
    _common_legend(figure, panels[0], ncols=3)
    return figure


def _band(axes: "Axes", times_s: np.ndarray, values: np.ndarray, name: str, color: str, dashes: Any) -> None:
    mean, deviation = values.mean(axis=0), values.std(axis=0)
    axes.fill_between(times_s, mean - deviation, mean + deviation, color=color, alpha=0.15, linewidth=0)
    axes.plot(times_s, mean, color=color, linestyle=dashes, linewidth=1.4, label=name)


def _panels(titles: Sequence[str], count: int) -> tuple["Figure", list["Axes"]]:
    titles = checked_names(titles, count)
    figure = new_figure(7.4, 3.3)
    panels = list(figure.subplots(1, count, sharey=True, squeeze=False)[0])
    for axes, title in zip(panels, titles, strict=True):
        prepare_axes(axes)
        axes.set_title(title, fontsize=9.5, color=INK)
    return figure, panels


def _common_legend(figure: "Figure", axes: "Axes", *, ncols: int) -> None:
    """Add one legend for all panels, above them."""
    handles, names = axes.get_legend_handles_labels()
    add_legend(figure, handles=handles, labels=names, loc="outside upper left", ncols=ncols)
