"""A test as a page: hand the numbers to the rooms that draw."""

from collections.abc import Sequence
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from turing_learning.figures import Picture
from turing_learning.figures.one_run import quantities_figure
from turing_learning.figures.style import BLUE, INK, MUTED, ORANGE, panel_grid
from turing_learning.report import Listing, Report, report_page

from ._telling import LabelledWindows, Telling, telltale_windows
from ._test import TuringTest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = 3
"""Statistics whose distributions are drawn."""

TITLE_LETTERS = 24
"""In a line above a panel."""

HISTOGRAM_BINS = 30

DRAWN_PERCENTILES = (0.5, 99.5)
"""Percentiles between which values are drawn; what is beyond them counts in the outermost bins."""

KINDS = {
    "shuffled": "All statistics, and what is lost without one",
    "signal": "Signals alone",
    "without": "Signals left out",
    "scale": "Shorter windows",
}


def test_page(result: TuringTest, title: str, command: str = "") -> str:
    """Return the page of a test: the sentences, who told it, what gives it away, distributions and windows."""
    examined = result.examined
    low, high = examined.interval
    power = examined.power_accuracy
    noticed = "nothing"
    if power is not None:
        noticed = f"an accuracy of {power:.2f}"
    facts = [
        ("Verdict", result.verdict),
        ("Accuracy", f"{examined.accuracy:.3f} ({low:.3f} to {high:.3f}); 0.5 is guessing"),
        ("p-value", f"{examined.p_value:.3f}"),
        ("Area under the ROC curve", f"{examined.auc:.3f}"),
        ("Noticed in 80 % of tests", noticed),
        ("Samples", f"{examined.samples[0]} real, {examined.samples[1]} simulated"),
        ("Groups", f"{examined.groups[0]} and {examined.groups[1]} {examined.grouping}"),
        ("Signals", ", ".join(result.signals)),
    ]
    if result.control is not None:
        control = result.control
        text = f"accuracy {control.accuracy:.3f}, p = {control.p_value:.3f}"
        facts.append(("Control, real against real", text))
    facts.append(("How samples were made", " ".join(result.remarks)))
    if command:
        facts.append(("Command", command))
    note = "The best examiner counts; the p-value of the panel allows for that."
    rows: list[list[str | float | None]] = []
    for member in examined.examiners:
        rows.append([member.name, member.accuracy, member.p_value])
    columns = ["examiner", "accuracy", "own p-value"]
    listings = [Listing("examiners", "Who tells", columns, rows, note=note)]
    statistics = [cue for cue in result.telling if cue.kind == "statistic"]
    rows = []
    for cue in statistics:
        rows.append([cue.what, cue.accuracy, cue.said(cue.simulated), cue.said(cue.real)])
    columns = ["statistic", "accuracy alone", "simulated", "real"]
    note = "Means over all samples. Statistics that say the same as a better one are left out."
    listings.append(Listing("statistics", "What gives it away", columns, rows, note=note))
    for kind, heading in KINDS.items():
        rows = [[cue.what, cue.accuracy] for cue in result.telling if cue.kind == kind]
        if rows:
            listings.append(Listing(kind, heading, ["what is seen", "accuracy"], rows))
    warning = ""
    if result.verdict == "cannot say":
        warning = " ".join(result.sentences[2:])
    report = Report(
        title=title,
        summary=" ".join(result.sentences[:2]),
        listings=listings,
        figures=_pictures(result, statistics),
        warning=warning,
        facts=facts,
    )
    return report_page(report)


def _pictures(result: TuringTest, statistics: Sequence[Telling]) -> list[Picture]:
    """Return distributions of the most telling statistics, and telltale windows."""
    if result.windows is None:
        return []
    pictures = []
    telling = statistics[:SHOWN]
    if telling:
        caption = "Shares of the samples. Filled: real; line: simulated. What is farther out counts in the outermost bins."
        figure = _distributions(result.windows, telling)
        pictures.append(Picture("distributions", "What differs most", caption, figure, wide=True))
    pairs = telltale_windows(np.array(result.examined.scores), result.windows)
    if pairs:
        caption = (
            "Above: the simulated samples that are told most surely. "
            "Below each the real sample that is most like it. Dots are where paths end."
        )
        figure = _windows(result, pairs)
        pictures.append(Picture("windows", "Telltale samples", caption, figure, wide=True))
    return pictures


def _distributions(samples: LabelledWindows, telling: Sequence[Telling]) -> "Figure":
    """Draw histograms of statistics, a panel each."""
    names, values = samples.statistics
    # names of statistics are long: in several lines they do not run into each other
    titles = [fill(cue.what, TITLE_LETTERS) for cue in telling]
    panels = panel_grid(titles, 2.3)
    genuine = samples.labels > 0.5
    distributions = {}
    for cue in telling:
        column = values[:, names.index(cue.what)]
        low, high = np.percentile(column, DRAWN_PERCENTILES)
        # A statistic may be one number in nearly all samples.
        if high <= low:
            low -= 0.5
            high += 0.5
        edges = np.linspace(low, high, HISTOGRAM_BINS + 1)
        shares = []
        for side in (genuine, ~genuine):
            counts = np.histogram(np.clip(column[side], low, high), edges)[0]
            shares.append(counts / side.sum())
        distributions[cue.what] = (edges, shares[0], shares[1])
    figure = quantities_figure(distributions, panels=panels, labels=("real", "simulated"))
    for axes, cue in zip(panels.axes, telling, strict=True):
        if cue.unit != "%":
            axes.set_xlabel(cue.unit, color=INK, fontsize=9)
    return figure


def _windows(result: TuringTest, pairs: Sequence[tuple[int, int]]) -> "Figure":
    """Draw simulated samples above, real ones below: paths where they are known, else the first signal over time."""
    samples = result.windows
    assert samples is not None
    simulated, real = zip(*pairs, strict=True)
    order = simulated + real
    titles = ["simulated"] * len(pairs) + ["real"] * len(pairs)
    # panels stand in rows of three; fewer pairs leave some empty
    panels = panel_grid(titles, 2.3)
    stated_paths = [path for path in result.paths if path is not None]
    paths = None
    if len(stated_paths) == len(result.paths) > 0:
        paths = np.concatenate(stated_paths)
    reach = 0.0
    for axes, window, title in zip(panels.axes, order, titles, strict=True):
        color = BLUE if title == "real" else ORANGE
        axes.title.set_fontsize(9)
        if paths is None:
            axes.plot(samples.windows[window, :, 0], color=color, linewidth=1.0)
            continue
        # Each around its own middle: where it was in the tank says nothing.
        path = paths[window] - paths[window].mean(axis=0)
        reach = max(reach, float(np.abs(path).max()))
        axes.plot(path[:, 0], path[:, 1], color=color, linewidth=1.0)
        axes.plot(*path[-1], color=INK, marker="o", markersize=3.5)
        axes.grid(visible=False)
        axes.tick_params(colors=MUTED)
    if paths is not None:
        # On one scale, so that a slow one looks slow.
        limits = (-1.05 * reach, 1.05 * reach)
        for axes in panels.axes:
            axes.set(xlim=limits, ylim=limits, aspect="equal")
    else:
        panels.label(samples.names[0], "step")
    return panels.figure
