"""Mutation strengths of both populations over generations."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ._style import (
    INK,
    SERIES_COLORS,
    SERIES_DASHES,
    add_legend,
    checked,
    checked_names,
    draw_line,
    label,
    logarithmic,
    new_figure,
    over_generations,
    prepare_axes,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH_OF_NAMES = 75
"""Characters that fit side by side above the figure, with 4 for each line that a name explains."""


def step_sizes_figure(
    model_step_sizes: np.ndarray, classifier_step_sizes: np.ndarray, *, names: Sequence[str]
) -> "Figure":
    """Draw the step sizes over generations on a logarithmic axis.

    Parameters
    ----------
    model_step_sizes : (G, P)
        Median over the models, of each parameter's step size.
    classifier_step_sizes : (G,)
        Median over classifiers and their parameters.
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
    model_step_sizes = checked("model_step_sizes", model_step_sizes, "G", "P")
    generations, parameters = model_step_sizes.shape
    classifier_step_sizes = checked("classifier_step_sizes", classifier_step_sizes, generations)
    names = checked_names(names, parameters)
    figure = new_figure(5.2, 3.1)
    axes = figure.subplots()
    prepare_axes(axes)
    for k in range(parameters):
        color, dashes = SERIES_COLORS[k % len(SERIES_COLORS)], SERIES_DASHES[k % len(SERIES_DASHES)]
        draw_line(axes, model_step_sizes[:, k], color=color, linestyle=dashes, linewidth=1.1, label=_plain(names[k]))
    draw_line(axes, classifier_step_sizes, color=INK, linewidth=1.8, label="classifiers")
    logarithmic(axes, model_step_sizes, classifier_step_sizes)
    over_generations(axes, generations)
    label(axes, "Step size (median)")
    longest = max(map(len, (*names, "classifiers")))
    add_legend(figure, loc="outside upper left", ncols=max(1, min(5, WIDTH_OF_NAMES // (longest + 4))))
    return figure


def _plain(name: str) -> str:
    # A legend reads dollar signs as formulas and skips names with a leading underscore.
    name = name.replace("$", r"\$")
    return f"\u200b{name}" if name.startswith("_") else name
