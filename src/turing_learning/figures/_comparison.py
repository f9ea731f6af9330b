"""How accurate several methods are with how much effort."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ._style import INK, SERIES_COLORS, SERIES_DASHES, add_legend, checked, label, logarithmic, new_figure, prepare_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MARKERS = ("o", "s", "^", "D", "v", "P")


def budget_figure(panels: Mapping[str, Mapping[str, Mapping[int, np.ndarray]]]) -> "Figure":
    """Draw errors over the number of trials: every run as a dot, the medians as a line, methods by color, mark and dashes.

    Parameters
    ----------
    panels
        Title of the panel -> name of the method -> number of trials -> error of each run (R,), > 0.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there is no panel, or an error is not finite.
    """
    if not panels:
        raise ValueError("`panels` must hold at least one panel; got none.")
    from matplotlib.ticker import FuncFormatter

    figure = new_figure(4.1 * len(panels), 3.6)
    row = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for axes, (title, methods) in zip(row, panels.items(), strict=True):
        prepare_axes(axes)
        for place, (name, errors) in enumerate(methods.items()):
            _draw_method(axes, name, errors, place)
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
        axes.set_title(title, fontsize=9.5, color=INK)
        label(axes, "Mean absolute error" if axes is row[0] else "", "Trials")
    logarithmic(
        row[0], *(runs for methods in panels.values() for errors in methods.values() for runs in errors.values())
    )
    handles, names = row[0].get_legend_handles_labels()
    add_legend(figure, handles=handles, labels=names, loc="outside upper center", ncols=len(names))
    return figure


def _draw_method(axes: "Axes", name: str, errors: Mapping[int, np.ndarray], place: int) -> None:
    runs = {trials: checked(f"errors of {name}", errors[trials], "R") for trials in sorted(errors)}
    color, marker = SERIES_COLORS[place % len(SERIES_COLORS)], MARKERS[place % len(MARKERS)]
    for trials, values in runs.items():
        axes.plot(
            np.full(len(values), trials), values, marker, color=color, markersize=3.5, alpha=0.45, markeredgewidth=0
        )
    axes.plot(
        list(runs), [float(np.median(values)) for values in runs.values()],
        color=color, marker=marker, markersize=5.5, linestyle=SERIES_DASHES[place % len(SERIES_DASHES)], linewidth=1.3, label=name,
    )  # fmt: skip
