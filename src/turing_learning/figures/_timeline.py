"""Which individuals behave abnormally, and when."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ._style import INK, ORANGE, RULE, SKY, add_legend, checked, label, new_figure, prepare_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_NAMES = 60


def timeline_figure(
    names: Sequence[str],
    windows: Sequence[np.ndarray],
    scores: Sequence[np.ndarray],
    abnormal: Sequence[np.ndarray],
    *,
    limit: float,
) -> "Figure":
    """Draw a row for each individual: the score of its motion over time, shaded where it is called abnormal.

    Parameters
    ----------
    names
        Of the individuals A, at least one.
    windows : A arrays (W, 2)
        Begin and end (s) of each window.
    scores : A arrays (W,)
        Mean score of the windows around each, 0 to 1.
    abnormal : A arrays (W,) bool
        Whether a window is called abnormal.
    limit
        Longest time shown (s).

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there is nobody, shapes do not agree or a value is not finite.
    """
    if not len(names) == len(windows) == len(scores) == len(abnormal) > 0:
        raise ValueError(f"`names` must be one name for each of the individuals, at least one; got {len(names)}.")
    figure = new_figure(8.4, 0.34 * min(len(names), MOST_NAMES) + 1.1)
    axes = figure.subplots()
    prepare_axes(axes)
    axes.grid(visible=False)
    for row, (spans, values, bad) in enumerate(zip(windows, scores, abnormal, strict=True)):
        spans = checked("windows", spans, "W", 2)
        values, bad = checked("scores", values, len(spans)), np.asarray(bad, dtype=bool)
        axes.axhline(row + 0.4, color=RULE, linewidth=0.6)
        for chosen, color, name in ((~bad, SKY, "normal"), (bad, ORANGE, "abnormal")):
            if chosen.any():
                axes.bar(
                    spans[chosen, 0],
                    -0.8 * values[chosen] - 0.02,
                    width=np.diff(spans[chosen])[:, 0],
                    bottom=row + 0.4,
                    align="edge",
                    color=color,
                    linewidth=0,
                    label=name,
                )
        axes.axhline(row + 0.4, color=RULE, linewidth=0.6)
    axes.set_xlim(0, limit)
    axes.set_ylim(len(names) - 0.5, -0.6)
    axes.set_yticks(np.arange(len(names)), [str(name) for name in names], color=INK, parse_math=False)
    label(axes, "", "Time (s)")
    entries = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    add_legend(figure, handles=list(entries.values()), labels=list(entries), loc="outside upper left", ncols=2)
    return figure
