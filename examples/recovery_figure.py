"""Draw what the recordings of recovery.py say of each parameter."""

from collections.abc import Sequence
from typing import Protocol

from matplotlib.figure import Figure

HELD, MISSED, INK, MUTED = "#0072b2", "#d55e00", "#1f2933", "#66717d"


class Estimate(Protocol):
    """What the runs on one recording say of one parameter."""

    family: str
    recording: int
    parameter: str
    unit: str
    truth: float
    estimate: float
    low: float
    high: float
    held: bool
    unknown: bool


def draw(rows: Sequence[Estimate], dim: set[tuple[str, str]]) -> Figure:
    """Draw estimates and intervals, a row of panels for each family; an estimate whose interval is not known is gray.

    Parameters
    ----------
    rows
        Of all recordings.
    dim
        Family and parameter of those that are not identifiable.
    """
    names = list(dict.fromkeys(row.family for row in rows))
    columns = max(len({row.parameter for row in rows if row.family == name}) for name in names)
    figure = Figure(figsize=(1.45 * columns, 1.6 * len(names)), layout="constrained")
    panels = figure.subplots(len(names), columns, squeeze=False)
    for line, name in zip(panels, names, strict=True):
        parameters = list(dict.fromkeys(row.parameter for row in rows if row.family == name))
        for axes, parameter in zip(line, parameters, strict=False):
            own = [row for row in rows if (row.family, row.parameter) == (name, parameter)]
            label = f"{parameter}\n({own[0].unit})" if own[0].unit else parameter
            axes.set_title(label, fontsize=8.5, color=MUTED if (name, parameter) in dim else INK)
            axes.axhline(own[0].truth, color=INK, linewidth=0.8, linestyle=(0, (4, 2)))
            for row in own:
                color = MUTED if row.unknown else HELD if row.held else MISSED
                axes.plot(
                    [row.recording, row.recording], [row.low, row.high], color=color, linewidth=1.4
                )
                axes.plot(row.recording, row.estimate, "o", color=color, markersize=2.6)
            axes.tick_params(labelsize=8.5, bottom=False, labelbottom=False)
            axes.spines[["top", "right", "bottom"]].set_visible(False)
        line[0].set_ylabel(name, fontsize=9.5, color=INK)
        for axes in line[len(parameters) :]:
            axes.set_axis_off()
    return figure
