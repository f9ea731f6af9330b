"""What was done to a system, beside what it answered."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from ._style import BLUE, DASHED, ORANGE, legend_above, new_figure, prepare_axes

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_KINDS = (("system", BLUE, "-"), ("estimate", ORANGE, DASHED))


def dialogues_figure(
    dialogues: Mapping[str, np.ndarray], *, names: Sequence[str], rows: Sequence[str], interval_s: float
) -> "Figure":
    """Draw stimuli (n, 2, T, S) beside answers (n, 2, T, D), in n rows with these titles; names are of answers, then stimuli.

    Stimuli have the `ranges` (S, 2). `outputs` (n, 2) and `accuracy` (n,) are written above the rows, where classifiers chose.
    """
    stimuli, answers, outputs = dialogues["stimuli"], dialogues["answers"], dialogues.get("outputs")
    count, _, steps, width = stimuli.shape
    own = answers.shape[3]
    order = [*range(own, own + width), *range(own)]  # of the columns
    figure = new_figure(max(7.2, 2.4 * len(order)), 0.7 + 1.6 * count)
    grid = np.atleast_2d(figure.subplots(count, len(order), sharex=True, squeeze=False))
    time = np.arange(1, steps + 1) * (interval_s or 1.0)
    for row, panels in enumerate(grid):
        for place, axes in zip(order, panels, strict=True):
            prepare_axes(axes)
            drawn = answers[row, ..., place] if place < own else stimuli[row, ..., place - own]
            for series, (kind, color, style) in zip(drawn, _KINDS, strict=True):
                shape = "default" if place < own else "steps-post"
                axes.plot(time, series, color=color, linestyle=style, linewidth=1.1, drawstyle=shape, label=kind)
            if place >= own:
                low, high = dialogues["ranges"][place - own]
                axes.set_ylim(low - 0.06 * (high - low), high + 0.06 * (high - low))
            axes.set_ylabel(names[place].replace("_", " "))
            if row == count - 1:
                axes.set_xlabel("Time (s)" if interval_s else "Step")
        if outputs is not None:
            text = f"{rows[row]}: {dialogues['accuracy'][row]:.0%} right; output {outputs[row, 0]:.2f} for the system, "
            panels[0].set_title(f"{text}{outputs[row, 1]:.2f} for the estimate", loc="left", fontsize="small")
    legend_above(figure, [grid[0, 0]], ncols=2)
    return figure
