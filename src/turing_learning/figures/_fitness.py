"""Fitness of both populations over generations."""

from typing import TYPE_CHECKING

import numpy as np

from ._style import (
    BLUE,
    MUTED,
    ORANGE,
    add_legend,
    checked,
    draw_line,
    label,
    new_figure,
    over_generations,
    prepare_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_POINTS = 1000  # corners of a band's edge; more could not be seen


def fitness_figure(
    model_fitness: np.ndarray, classifier_fitness: np.ndarray, *, stopped: np.ndarray | None = None
) -> "Figure":
    """Draw the subjective fitness of models and classifiers over generations: median and quartiles.

    Parameters
    ----------
    model_fitness : (G, M)
        Fitness of every model, in [0, 1] with the paper's rewards.
    classifier_fitness : (G, N)
        Fitness of every classifier.
    stopped : (G,) bool
        Generations in which selection stopped: every classifier accepted, or every classifier rejected, every model.
        They are shaded.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If shapes do not agree or a value is not finite.

    Source
    ------
    Paper, equations 1 and 2.
    """
    model_fitness = checked("model_fitness", model_fitness, "G", "M")
    generations = len(model_fitness)
    classifier_fitness = checked("classifier_fitness", classifier_fitness, generations, "N")
    stops = np.zeros(generations) if stopped is None else checked("stopped", stopped, generations)
    figure = new_figure(5.2, 3.1)
    axes = figure.subplots()
    prepare_axes(axes)
    _shade(axes, stops.astype(bool))
    _draw_band(axes, model_fitness, color=ORANGE, linestyle=(0, (5, 1.2)), label="models")
    _draw_band(axes, classifier_fitness, color=BLUE, linestyle="-", label="classifiers")
    over_generations(axes, generations)
    label(axes, "Fitness (median, quartiles)")
    add_legend(figure, loc="outside upper left", ncols=3)
    return figure


def _draw_band(axes: "Axes", fitness: np.ndarray, *, color: str, **options: object) -> None:
    lower, middle, upper = np.quantile(fitness, (0.25, 0.5, 0.75), axis=1)
    starts = np.arange(0, len(middle), -(-len(middle) // MOST_POINTS))
    low, high = np.minimum.reduceat(lower, starts), np.maximum.reduceat(upper, starts)
    axes.fill_between(starts, low, high, color=color, alpha=0.22, linewidth=0)
    draw_line(axes, middle, color=color, linewidth=1.2, **options)


def _shade(axes: "Axes", stopped: np.ndarray) -> None:
    edges = np.flatnonzero(np.diff(stopped, prepend=False, append=False))
    for number, (start, stop) in enumerate(edges.reshape(-1, 2)):
        name = "selection stopped" if number == 0 else "_"
        axes.axvspan(start - 0.5, stop - 0.5, facecolor=MUTED, alpha=0.3, edgecolor=MUTED, linewidth=0.5, label=name)
