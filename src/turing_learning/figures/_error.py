"""Mean absolute error over generations."""

from typing import TYPE_CHECKING

import numpy as np

from ._style import (
    BLUE,
    SKY,
    add_legend,
    checked,
    draw_line,
    label,
    logarithmic,
    new_figure,
    over_generations,
    prepare_axes,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def error_figure(mae_best: np.ndarray, mae_typical: np.ndarray) -> "Figure":
    """Draw the mean absolute error (MAE) over generations on a logarithmic axis.

    Parameters
    ----------
    mae_best : (G,)
        MAE of the model with the highest subjective fitness, in units of the parameters.
    mae_typical : (G,)
        MAE of the median of the better half of the models.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.
    """
    mae_best = checked("mae_best", mae_best, "G")
    mae_typical = checked("mae_typical", mae_typical, *mae_best.shape)
    figure = new_figure(5.2, 3.1)
    axes = figure.subplots()
    prepare_axes(axes)
    draw_line(axes, mae_best, color=SKY, linewidth=0.7, label="best model")
    draw_line(axes, mae_typical, color=BLUE, linewidth=1.2, label="median of the better half")
    logarithmic(axes, mae_best, mae_typical)
    over_generations(axes, len(mae_best))
    label(axes, "Mean absolute error")
    add_legend(figure, loc="outside upper left", ncols=2)
    return figure
