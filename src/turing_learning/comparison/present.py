"""The page of a comparison: hand the numbers to the rooms that draw."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from turing_learning.analysis import is_known
from turing_learning.figures import Picture
from turing_learning.figures.style import BLUE, DASHED, INK, MUTED, ORANGE, one_panel, panel_grid
from turing_learning.report import Listing, Report, report_page

from ._result import Compared, Comparison, ranking

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PATHS = 12
"""Samples whose paths are drawn in a panel."""


def comparison_page(comparison: Comparison, title: str, command: str = "") -> str:
    """Return the page of a comparison: the ranking, accuracies with intervals, what gives each away, and motion."""
    examined = comparison.models[0].test.examined
    facts = [
        ("Samples", f"{examined.samples[0]} genuine, held out from learning, and as many of each"),
        ("Groups", f"{examined.groups[0]} {examined.grouping}"),
        ("Signals", ", ".join(comparison.models[0].test.signals)),
        ("How samples were made", " ".join(comparison.models[0].test.remarks)),
    ]
    if comparison.control is None:
        facts.append(("Control", "none, as there are fewer than four genuine groups"))
    if command:
        facts.append(("Command", command))
    columns = ["model", "accuracy (95 %)", "more than the first (95 %)", "p", "verdict"]
    note = "Accuracy of the best examiner of the panel on groups that it has not seen; 0.5 is guessing. p by permutation "
    note += "of whole groups. Control: one half of the genuine groups against the other."
    ranked = [row[: len(columns)] for row in ranking(comparison.to_json())]
    listings = [Listing("ranking", "The hardest to tell first", columns, ranked, note=note)]
    rows: list[list[str | float | None]] = []
    for model in comparison.models:
        for telling in model.telling:
            accuracy = f"{telling.accuracy:.3f}"
            means = [telling.said(telling.simulated), telling.said(telling.real)]
            rows.append([model.name, telling.what, accuracy, *means])
    # Nothing gives a model away that is not told.
    if rows:
        columns = ["model", "statistic", "accuracy alone", "simulated", "genuine"]
        note = (
            "The three most telling statistics of each model that is told. Means over all samples."
        )
        listings.append(Listing("telling", "What gives each away", columns, rows, note=note))
    listings.append(_estimates(comparison.models))
    report = Report(
        title=title,
        summary=" ".join(comparison.sentences[: len(comparison.models)]),
        listings=listings,
        figures=pictures(comparison),
        facts=facts,
        data={"comparison.csv": comparison.to_dataframe().to_csv()},
    )
    return report_page(report)


def _estimates(models: Sequence[Compared]) -> Listing:
    """Return what the runs have inferred."""
    rows: list[list[str | float | None]] = []
    for model in models:
        for name, value in model.estimate.items():
            low, high = model.interval_of_estimate[name]
            interval = f"{low:.3g} to {high:.3g}" if is_known(low, high) else "-"
            rows.append([model.name, name, f"{value:.4g}", interval, model.said])
    columns = ["model", "parameter", "estimate", "90 %", "its run says"]
    return Listing("estimates", "What the runs inferred", columns, rows, folded=True)


def pictures(comparison: Comparison) -> list[Picture]:
    """Return accuracies with intervals, and motion of each model beside the genuine one."""
    caption = "Of the panel on held-out groups, with 95 % intervals; guessing is dashed."
    drawn = [
        Picture("accuracies", "How well each is told", caption, _accuracies(comparison), wide=True)
    ]
    motion = _motion(comparison)
    if motion is not None:
        caption = "Paths of samples from one starting point, on one scale."
        drawn.append(Picture("motion", "Motion", caption, motion, wide=True))
    return drawn


def _accuracies(comparison: Comparison) -> "Figure":
    """Draw an accuracy and its interval for each model, and the control."""
    entries = [(model.name, model.accuracy, model.interval, BLUE) for model in comparison.models]
    if comparison.control is not None:
        control = comparison.control
        entries.append(("control", control.accuracy, control.interval, MUTED))
    panels, axes = one_panel(7.2, 0.9 + 0.38 * len(entries))
    for row, (_, accuracy, (low, high), color) in enumerate(entries):
        axes.plot([low, high], [row, row], color=color, linewidth=1.6)
        axes.plot(accuracy, row, color=color, marker="o", markersize=6)
    axes.axvline(0.5, color=MUTED, linewidth=1.0, linestyle=DASHED)
    axes.set_yticks(range(len(entries)), [entry[0] for entry in entries], color=INK, fontsize=9.5)
    axes.set_ylim(len(entries) - 0.5, -0.5)
    lowest = min(entry[2][0] for entry in entries)
    axes.set_xlim(min(0.4, lowest - 0.02), 1.02)
    axes.grid(visible=False)
    panels.label("", "Accuracy")
    return panels.figure


def _motion(comparison: Comparison) -> "Figure | None":
    """Draw paths of genuine samples, and of those of each model; None where samples have no paths."""
    sides = [
        comparison.models[0].test.paths[0],
        *(model.test.paths[1] for model in comparison.models),
    ]
    paths = [side for side in sides if side is not None]
    if len(paths) < len(sides):
        return None
    titles = ["genuine", *(model.name for model in comparison.models)]
    panels = panel_grid(titles, 2.6)
    reach = 0.0
    for axes, side, title in zip(panels.axes, paths, titles, strict=True):
        color = BLUE if title == "genuine" else ORANGE
        drawn = np.linspace(0, len(side) - 1, min(PATHS, len(side))).round().astype(int)
        reach = max(reach, float(np.abs(side[drawn]).max()))
        # Spread over all samples, which are in order of time.
        for path in side[drawn]:
            axes.plot(path[:, 0], path[:, 1], color=color, linewidth=0.9)
            axes.plot(*path[-1], color=INK, marker="o", markersize=2.5)
        axes.grid(visible=False)
    for axes in panels.axes:
        limits = (-1.05 * reach, 1.05 * reach)
        axes.set(xlim=limits, ylim=limits, box_aspect=1)
    panels.label("cm", "cm")
    return panels.figure
