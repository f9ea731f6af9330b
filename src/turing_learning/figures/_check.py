"""Whether an estimate can be believed: distributions side by side, and what each parameter leaves open."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ._style import (
    BLUE,
    DASHED,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    SKY,
    add_legend,
    checked,
    label,
    new_figure,
    prepare_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Distribution:
    """One panel of `quantities_figure`: shares of genuine and of simulated values in bins with these edges."""

    name: str
    edges: np.ndarray
    genuine: np.ndarray
    simulated: np.ndarray


@dataclass(frozen=True, eq=False)
class ParameterProfile:
    """One panel of `profiles_figure`.

    Parameters
    ----------
    name
        Of the parameter, with its unit.
    values, accuracies, criticals : (G,)
        Accuracy of fresh classifiers at values of the parameter, ascending, and that above which they do not guess.
    estimate, interval
        What the run inferred; the interval is None where it is not known, and is not drawn.
    recovered
        What runs found whose truth was the estimate.
    logarithmic
        Whether the parameter has a logarithmic scale.
    """

    name: str
    values: np.ndarray
    accuracies: np.ndarray
    criticals: np.ndarray
    estimate: float
    interval: tuple[float, float] | None
    recovered: Sequence[float] = field(default=())
    logarithmic: bool = False


def quantities_figure(distributions: Sequence[Distribution]) -> "Figure":
    """Draw distributions of genuine motion and of motion simulated at the estimate, one panel each.

    Parameters
    ----------
    distributions
        At least one.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there is none, shapes do not agree or a value is not finite.
    """
    if not distributions:
        raise ValueError("`distributions` must hold at least one distribution; got none.")
    figure, panels = _panels(len(distributions))
    for axes, each in zip(panels, distributions, strict=True):
        edges = checked("edges", each.edges, "B")
        genuine = checked("genuine", each.genuine, len(edges) - 1)
        simulated = checked("simulated", each.simulated, len(edges) - 1)
        prepare_axes(axes)
        axes.stairs(genuine, edges, fill=True, color=SKY, alpha=0.45, label="genuine")
        axes.stairs(simulated, edges, color=ORANGE, linewidth=1.3, label="simulated at the estimate")
        _title(axes, each.name)
        axes.set_ylim(bottom=0)
        label(axes, "Share" if axes in panels[:: _columns(len(distributions))] else "", "")
    handles, labels = panels[0].get_legend_handles_labels()
    add_legend(figure, handles=handles, labels=labels, loc="outside upper left", ncols=2)
    return figure


def profiles_figure(profiles: Sequence[ParameterProfile]) -> "Figure":
    """Draw how well fresh classifiers tell genuine samples from models in which one parameter is moved, one panel each.

    Parameters
    ----------
    profiles
        At least one.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    ValueError
        If there is none, shapes do not agree or a value is not finite.
    """
    if not profiles:
        raise ValueError("`profiles` must hold at least one profile; got none.")
    figure, panels = _panels(len(profiles))
    for axes, each in zip(panels, profiles, strict=True):
        _draw_profile(axes, each)
        label(axes, "Accuracy" if axes in panels[:: _columns(len(profiles))] else "", "")
    entries = {name: handle for axes in panels for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)}
    add_legend(
        figure, handles=list(entries.values()), labels=list(entries), loc="outside upper left", ncols=len(entries)
    )
    return figure


def _draw_profile(axes: "Axes", each: ParameterProfile) -> None:
    values = checked("values", each.values, "G")
    accuracies = checked("accuracies", each.accuracies, len(values))
    criticals = checked("criticals", each.criticals, len(values))
    prepare_axes(axes)
    if each.interval is not None:
        axes.axvspan(*each.interval, color=MUTED, alpha=0.22, linewidth=0, label="interval")
    axes.axvline(each.estimate, color=INK, linewidth=1.0, label="estimate")
    axes.plot(values, accuracies, color=BLUE, linewidth=1.3, marker="o", markersize=3.5, label="fresh classifiers")
    axes.plot(values, criticals, color=MUTED, linewidth=1.0, linestyle=DASHED, label="guessing, 95 %")
    if len(each.recovered):
        foot = np.full(len(each.recovered), 0.42)
        axes.plot(each.recovered, foot, color=GREEN, marker="^", markersize=6, linestyle="none", label="recovered")
    axes.set_ylim(min(0.38, float(accuracies.min()) - 0.03), 1.02)
    if each.logarithmic:
        axes.set_xscale("log")
    _title(axes, each.name)


def _title(axes: "Axes", text: str) -> None:
    axes.set_title(text, loc="left", fontsize=10, color=INK, fontweight="bold", parse_math=False)


def _columns(count: int) -> int:
    return min(count, 2 if count in (2, 4) else 3)


def _panels(count: int) -> "tuple[Figure, list[Axes]]":
    columns = _columns(count)
    rows = -(-count // columns)
    figure = new_figure(8.4, 2.1 * rows + 0.55)
    panels = list(figure.subplots(rows, columns, squeeze=False).flat)
    for axes in panels[count:]:
        axes.set_visible(False)
    return figure, panels[:count]
