"""One recording in pictures: where individuals were, when they were there, how fast they moved and turned."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from .style import (
    BLUE,
    DASHED,
    INK,
    MUTED,
    ORANGE,
    RULE,
    Panels,
    new_figure,
    one_panel,
    series,
    titled,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_POINTS = 30_000
"""Points of all paths in a figure; more make a page of megabytes."""
MOST_ROWS = 40
"""Individuals that have a row over time."""
MOST_LABELS = 12
"""Individuals that are named in a legend."""
HISTOGRAM_BINS = 60
DRAWN_PERCENTILES = (0.1, 99.9)
"""Percentiles between which a distribution is drawn."""


def tracks_figure(
    names: Sequence[str],
    positions: np.ndarray,
    tank: np.ndarray,
    *,
    unlikely: np.ndarray,
    unit: str,
) -> "Figure":
    """Draw the paths of individuals, and the tank of the models.

    Parameters
    ----------
    names
        Of the individuals A.
    positions : (F, A, 2)
        x, y, NaN where somebody is absent.
    tank : (2, 2)
        Lowest and highest x, y.
    unlikely : (N, 2)
        Positions that can hardly be true; they are crosses.
    unit
        Of lengths.
    """
    panels, axes = one_panel(5.4, 4.6)
    every = max(1, positions.shape[0] * positions.shape[1] // MOST_POINTS)
    for who, name in enumerate(names):
        # Matplotlib leaves a label with an underscore out of the legend.
        label = name if len(names) <= MOST_LABELS else "_"
        color = series(who)["color"]
        axes.plot(*positions[::every, who].T, color=color, linewidth=0.7, alpha=0.8, label=label)
    if len(unlikely):
        axes.plot(*unlikely[:MOST_POINTS].T, "x", color=ORANGE, markersize=5, label="hardly true")
    (left, bottom), (right, top) = tank
    corners = np.array([[left, bottom], [right, bottom], [right, top], [left, top], [left, bottom]])
    axes.plot(*corners.T, color=INK, linestyle=DASHED, linewidth=1.0, label="tank of the models")
    axes.set_aspect("equal", adjustable="datalim")
    axes.grid(visible=False)
    panels.label(f"y ({unit})", f"x ({unit})")
    return panels.with_legend(ncols=4)


def presence_figure(
    names: Sequence[str], present: np.ndarray, jumps: Sequence[tuple[int, float]], fps: float
) -> "Figure":
    """Draw a row for each individual: a bar where it is there, a mark where it jumps.

    Parameters
    ----------
    names
        Of the individuals A; of more than `MOST_ROWS` the first ones are drawn.
    present : (F, A)
        Whether somebody is there.
    jumps
        Number of the individual, and time (s), of each jump.
    fps
        Frame rate (1/s).
    """
    names = names[:MOST_ROWS]
    panels, axes = one_panel(8.4, 0.24 * len(names) + 1.2)
    axes.grid(visible=False)
    for row in range(len(names)):
        changes = np.diff(present[:, row].astype(int), prepend=0, append=0)
        begins = np.flatnonzero(changes == 1) / fps
        stops = np.flatnonzero(changes == -1) / fps
        bars = list(zip(begins, stops - begins, strict=True))
        axes.broken_barh(bars, (row - 0.3, 0.6), color=BLUE, linewidth=0)
    drawn = [(time, who) for who, time in jumps if who < len(names)]
    if drawn:
        axes.plot(*zip(*drawn, strict=True), "|", color=ORANGE, markersize=9, label="jump")
    axes.set_xlim(0, len(present) / fps)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_yticks(np.arange(len(names)), list(names), color=INK, parse_math=False)
    panels.label("", "Time (s)")
    return panels.with_legend(ncols=1)


def distribution_figure(values: np.ndarray, label: str) -> "Figure":
    """Draw how often values (N,) occur, between their percentiles 0.1 and 99.9, with their median."""
    panels, axes = one_panel(4.1, 2.6)
    low, high = np.percentile(values, DRAWN_PERCENTILES)
    if low == high:
        low -= 0.5
        high += 0.5
    counts, edges = np.histogram(values, bins=HISTOGRAM_BINS, range=(low, high))
    across, share = np.repeat(edges, 2)[1:-1], np.repeat(counts / len(values), 2)
    axes.fill_between(across, share, color=BLUE, linewidth=0)
    # a line, which answers to the pointer on pages
    axes.plot(
        across, share, color=BLUE, linewidth=0.8, label=f"share in each of {HISTOGRAM_BINS} bins"
    )
    axes.set_ylim(bottom=0)
    median = float(np.median(values))
    axes.axvline(median, color=INK, linestyle=DASHED, linewidth=1.0, label=f"median {median:.3g}")
    axes.tick_params(labelleft=False, length=0, axis="y")
    axes.tick_params(colors=MUTED, axis="x")
    panels.label("Frequency", label)
    return panels.with_legend(ncols=1)


def maps_figure(
    titles: Sequence[str],
    values: Sequence[Sequence[np.ndarray]],
    edges: Sequence[tuple[np.ndarray, np.ndarray]],
    labels: Sequence[tuple[str, str, str]],
) -> "Figure":
    """Draw maps side by side, a row for each of several sources; a column has one scale of colors.

    Parameters
    ----------
    titles
        Of the R rows.
    values : R x C arrays (rows, columns)
        What is drawn, NaN where nothing is known; 0 is white.
    edges
        Of each column: those of the cells along x and along y.
    labels
        Of each column: what is drawn with its unit, and the two axes.
    """
    count = len(edges)
    headings = [f"{title}: {labels[k][0]}" for title in titles for k in range(count)]
    figure = new_figure(3.6 * count, 3.1 * len(titles))
    figure.set_layout_engine("constrained", w_pad=0.1)
    axes = list(figure.subplots(len(titles), count, squeeze=False).flat)
    panels = titled(Panels(figure, axes, count), headings, fontsize=8.5, parse_math=False)
    for k in range(count):
        column = [row[k] for row in values]
        strengths = np.concatenate([np.abs(picture[np.isfinite(picture)]) for picture in column])
        # single cells with few moments would make everything else pale
        limit = float(np.quantile(strengths, 0.98)) if len(strengths) else 1.0
        for r, picture in enumerate(column):
            panel = panels.axes[r * count + k]
            panel.grid(visible=False)
            panel.set_facecolor(RULE)
            along_x, along_y = edges[k]
            mesh = panel.pcolormesh(
                along_x, along_y, picture, cmap="PuOr_r", vmin=-limit, vmax=limit
            )
            panel.set_xlabel(labels[k][1], fontsize=8.5, color=INK)
            panel.set_ylabel(labels[k][2], fontsize=8.5, color=INK)
            bar = figure.colorbar(mesh, ax=panel, shrink=0.85)
            bar.ax.tick_params(labelsize=7.5, colors=MUTED)
    return figure
