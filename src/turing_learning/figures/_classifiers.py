"""What classifiers can tell: accuracies, what an estimate leaves open, abnormal individuals."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning.arrays import array
from turing_learning.errors import require

from ._style import (
    BLUE,
    DASHED,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    RULE,
    SKY,
    Panels,
    add_legend,
    grid_of_panels,
    label,
    one_panel,
    row_of_panels,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_NAMES = 60


def accuracy_figure(
    generations: np.ndarray, *, subjective: np.ndarray, objective: np.ndarray, jury: np.ndarray | None = None
) -> "Figure":
    """Draw the decision accuracy (R, G) of the best classifiers of some generations (G,), as in figure 7 of the paper.

    `subjective` is that of the classifier with the highest subjective fitness; `objective` and `jury` are the
    highest of a single classifier of the population, and of the population or its archive: mean and deviation over
    the runs. The horizontal axis is linear up to generation 1 and logarithmic from there.
    """
    from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

    figure, axes = one_panel(5.2, 3.3)
    for values, name, color, marker, dashes in (
        (jury, "best with archive (objective)", GREEN, "^", ":"),
        (objective, "best classifier (objective)", BLUE, "s", "-"),
        (subjective, "best classifier (subjective)", ORANGE, "o", "--"),
    ):
        if values is not None:
            deviation = values.std(axis=0) if len(values) > 1 else None
            axes.errorbar(
                generations, values.mean(axis=0), yerr=deviation, color=color, marker=marker, markersize=4, linestyle=dashes,
                linewidth=1.3, elinewidth=0.8, capsize=2, label=name,
            )  # fmt: skip
    axes.set_xscale("symlog", linthresh=1)
    last = 1.2 * max(generations.max(), 1)
    axes.xaxis.set_major_locator(FixedLocator([0, *(10**k for k in range(7) if 10**k <= last)]))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.set_xlim(-0.2, last)
    ends = [values.mean(axis=0) + sign * values.std(axis=0) for values in (objective, subjective) for sign in (-1, 1)]
    axes.set_ylim(min(0.5, 100 * np.min(ends) // 5 / 20), max(1.0, np.max(ends)) + 0.01)
    label(axes, "Decision accuracy")
    add_legend(figure, loc="outside upper left", ncols=2)
    return figure


@dataclass(frozen=True, eq=False)
class Distribution:
    """One panel of `quantities_figure`: shares of genuine and of simulated values (B,) in bins with these edges (B + 1,)."""

    name: str
    edges: np.ndarray
    genuine: np.ndarray
    simulated: np.ndarray


def quantities_figure(distributions: Sequence[Distribution], *, panels: Panels | None = None) -> "Figure":
    """Draw distributions of genuine motion and of motion simulated at the estimate, one panel each."""
    panels = panels or grid_of_panels([each.name for each in distributions], 2.1)
    for k, (axes, each) in enumerate(zip(panels.axes, distributions, strict=True)):
        axes.stairs(each.genuine, each.edges, fill=True, color=SKY, alpha=0.45, label="genuine")
        axes.stairs(each.simulated, each.edges, color=ORANGE, linewidth=1.3, label="simulated at the estimate")
        axes.set_ylim(bottom=0)
        label(axes, "" if k % panels.columns else "Share", "")
    panels.legend(ncols=2)
    return panels.figure


@dataclass(frozen=True, eq=False)
class ParameterProfile:
    """One panel of `profiles_figure`: accuracy of fresh classifiers over the values of a parameter."""

    name: str  # with the unit
    values: np.ndarray  # ascending (G,)
    accuracies: np.ndarray  # at each value (G,)
    criticals: np.ndarray  # accuracies above which the classifiers do not guess (G,)
    estimate: float
    interval: Sequence[float] | None  # None, and not drawn, where it is not known
    recovered: Sequence[float] = field(default=())  # what runs found whose truth was the estimate
    logarithmic: bool = False


def profiles_figure(profiles: Sequence[ParameterProfile]) -> "Figure":
    """Draw how well fresh classifiers tell genuine samples from models in which one parameter is moved, one panel each."""
    panels = grid_of_panels([each.name for each in profiles], 2.1)
    for k, (axes, each) in enumerate(zip(panels.axes, profiles, strict=True)):
        if each.interval is not None:
            axes.axvspan(*each.interval, color=MUTED, alpha=0.22, linewidth=0, label="interval")
        axes.axvline(each.estimate, color=INK, linewidth=1.0, label="estimate")
        look = dict[str, Any](linewidth=1.3, marker="o", markersize=3.5)
        axes.plot(each.values, each.accuracies, color=BLUE, label="fresh classifiers", **look)
        axes.plot(each.values, each.criticals, color=MUTED, linewidth=1.0, linestyle=DASHED, label="guessing, 95 %")
        if len(each.recovered):
            foot, mark = np.full(len(each.recovered), 0.42), dict[str, Any](marker="^", markersize=6, linestyle="none")
            axes.plot(each.recovered, foot, color=GREEN, label="recovered", **mark)
        axes.set_ylim(min(0.38, float(each.accuracies.min()) - 0.03), 1.02)
        if each.logarithmic:
            axes.set_xscale("log")
        label(axes, "" if k % panels.columns else "Accuracy", "")
    panels.legend()
    return panels.figure


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
    """
    alike = len(names) == len(windows) == len(scores) == len(abnormal) > 0
    require(alike, "names", "be one name for each of the individuals, at least one", len(names))
    panels = row_of_panels([""], 8.4, 0.34 * min(len(names), MOST_NAMES) + 1.1)
    (axes,) = panels.axes
    axes.grid(visible=False)
    for row, (spans, values, bad) in enumerate(zip(windows, scores, abnormal, strict=True)):
        spans = array("windows", spans, "W 2")
        values, bad = array("scores", values, "W", W=len(spans)), array("abnormal", bad, "W", dtype=bool, W=len(spans))
        axes.axhline(row + 0.4, color=RULE, linewidth=0.6)
        for chosen, color, name in ((~bad, SKY, "normal"), (bad, ORANGE, "abnormal")):
            if chosen.any():
                axes.bar(
                    spans[chosen, 0], -0.8 * values[chosen] - 0.02, width=np.diff(spans[chosen])[:, 0], bottom=row + 0.4,
                    align="edge", color=color, linewidth=0, label=name,
                )  # fmt: skip
        axes.axhline(row + 0.4, color=RULE, linewidth=0.6)
    axes.set_xlim(0, limit)
    axes.set_ylim(len(names) - 0.5, -0.6)
    axes.set_yticks(np.arange(len(names)), [str(name) for name in names], color=INK, parse_math=False)
    label(axes, "", "Time (s)")
    panels.legend(ncols=2)
    return panels.figure


def paths_figure(names: Sequence[str], paths: Sequence[np.ndarray], abnormal: Sequence[bool]) -> "Figure":
    """Draw where some individuals were, paths (F, 2) in cm with NaN for gaps, a panel each, on the same scale."""
    panels = grid_of_panels(names, 2.4)
    panels.figure.set_layout_engine("constrained", hspace=0.08)
    places = np.concatenate(paths)
    low, high = np.nanmin(places, axis=0), np.nanmax(places, axis=0)
    low, high = low - 0.04 * (high - low), high + 0.04 * (high - low)
    for axes, path, bad in zip(panels.axes, paths, abnormal, strict=True):
        axes.plot(path[:, 0], path[:, 1], color=ORANGE if bad else BLUE, linewidth=0.8)
        axes.plot(*path[np.flatnonzero(np.isfinite(path[:, 0]))[-1]], color=INK, marker="o", markersize=4)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        axes.grid(visible=False)
    return panels.figure
