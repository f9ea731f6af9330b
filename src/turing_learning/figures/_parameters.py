"""Inferred parameters over generations."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ._style import (
    BLUE,
    DASHED,
    INK,
    MUTED,
    SKY,
    add_legend,
    checked,
    checked_names,
    draw_line,
    label,
    new_figure,
    over_generations,
    prepare_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CENTRAL = (0.5, 99.5)  # percentiles that a panel shows in any case


def parameters_figure(
    best_models: np.ndarray,
    typical_models: np.ndarray,
    *,
    names: Sequence[str],
    truth: Sequence[float] | np.ndarray | None = None,
    unit: str = "",
) -> "Figure":
    """Draw the inferred parameters over generations, one panel per parameter.

    A panel spans the central 99 % of its values and the truth; where that hides excursions, it names the whole range.

    Parameters
    ----------
    best_models : (G, P)
        The model with the highest subjective fitness of each generation.
    typical_models : (G, P)
        The median of the better half of the models of each generation.
    names
        Names of the P parameters.
    truth : (P,)
        The parameters of the agents, drawn dashed; None where they are unknown.
    unit
        Unit of the parameters, for the vertical axes.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.

    Source
    ------
    Paper, figure 5, which shows the same quantities for 30 runs.
    """
    best_models = checked("best_models", best_models, "G", "P")
    typical_models = checked("typical_models", typical_models, *best_models.shape)
    names = checked_names(names, best_models.shape[1])
    truth = None if truth is None else checked("truth", truth, len(names))
    columns = min(len(names), 2 if len(names) in (2, 4) else 3)
    rows = -(-len(names) // columns)
    figure = new_figure(8.4, 2.15 * rows + 0.55)
    panels = figure.subplots(rows, columns, sharex=True, squeeze=False)
    for k, axes in enumerate(panels.flat):
        if k >= len(names):
            axes.set_visible(False)
            continue
        _draw_panel(axes, best_models[:, k], typical_models[:, k], None if truth is None else truth[k])
        axes.set_title(names[k], loc="left", fontsize=10, color=INK, fontweight="bold", parse_math=False)
        over_generations(axes, len(best_models))
        below = k + columns >= len(names)
        axes.tick_params(labelbottom=below)
        label(axes, unit if k % columns == 0 else "", "Generation" if below else "")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    add_legend(figure, handles=handles, labels=labels, loc="outside upper left", ncols=3)
    return figure


def _draw_panel(axes: "Axes", best: np.ndarray, typical: np.ndarray, truth: float | None) -> None:
    prepare_axes(axes)
    draw_line(axes, best, color=SKY, linewidth=0.6, alpha=0.9, label="best model")
    draw_line(axes, typical, color=BLUE, linewidth=1.2, label="median of the better half")
    if truth is not None:
        axes.axhline(truth, color=INK, linewidth=1.1, linestyle=DASHED, label="true value")
    _focus(axes, np.concatenate([best, typical]), truth)


def _focus(axes: "Axes", values: np.ndarray, truth: float | None) -> None:
    shown = np.percentile(values, CENTRAL)
    if truth is not None:
        shown = np.append(shown, truth)
    low, high = shown.min(), shown.max()
    margin = 0.12 * (high - low) or 0.1 * max(abs(high), 1.0)
    axes.set_ylim(low - margin, high + margin)
    if values.min() < low - margin or values.max() > high + margin:
        note = f"whole range {values.min():.3g} to {values.max():.3g}".replace("-", "\N{MINUS SIGN}")
        axes.text(1, 1.03, note, transform=axes.transAxes, ha="right", va="bottom", fontsize=7.5, color=MUTED)
