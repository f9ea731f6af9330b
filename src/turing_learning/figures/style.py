"""What all figures share: colors, axes, panels and legends."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK = "#1f2933"
MUTED = "#66717d"
RULE = "#d5dae0"
# Okabe and Ito's palette, which people with any color vision can tell apart.
BLUE = "#0072b2"
ORANGE = "#d55e00"
GREEN = "#009e73"
PURPLE = "#aa5d8f"
SKY = "#56b4e9"
AMBER = "#b8860b"

PAGE_COLORS = {
    INK: "--ink", MUTED: "--muted", RULE: "--rule", BLUE: "--blue", ORANGE: "--orange", GREEN: "--green", PURPLE: "--purple",
    SKY: "--sky", AMBER: "--amber",
}  # fmt: skip
"""Colors that a page may replace, for its dark mode; see `svg_markup`."""

DASHED = (0, (4, 2.5))
"""Line style of true values and limits."""

TRUE_VALUE: dict[str, Any] = {"color": INK, "linewidth": 1.1, "linestyle": DASHED}
"""Look of lines at true values, and at the best that there can be."""

_COLORS = (BLUE, ORANGE, GREEN, PURPLE, SKY, AMBER)
_DASHES: tuple[Any, ...] = (
    "-",
    (0, (5, 1.5)),
    (0, (1.5, 1.2)),
    (0, (6, 1.5, 1.5, 1.5)),
    (0, (9, 2)),
    (0, (3, 3)),
)


def series(k: int) -> dict[str, Any]:
    """Return color and dashes of the k-th of several lines, which differ without color, too."""
    return {"color": _COLORS[k % len(_COLORS)], "linestyle": _DASHES[k % len(_DASHES)]}


@dataclass(frozen=True, eq=False)
class Panels:
    """Axes with the common look, so many in a row: of a new figure, or those of a caller's figure."""

    figure: "Figure"
    axes: "list[Axes]"
    columns: int
    callers_axes: bool = False

    def label(self, y: str, x: str) -> None:
        """Label all panels, the vertical axes of those in the first column alone."""
        for k, axes in enumerate(self.axes):
            label(axes, "" if k % self.columns else y, x)

    def over_generations(self, y: str, generations: int, trials: np.ndarray | None = None) -> None:
        """Label all panels, and let them run from 0 to the number of generations, or to the last of the trials."""
        from matplotlib.ticker import MaxNLocator

        self.label(y, "Generation" if trials is None else "Trials")
        for axes in self.axes:
            axes.set_xlim(0, generations if trials is None else trials[-1])
            axes.xaxis.set_major_locator(
                MaxNLocator(nbins=5, integer=True, steps=[1, 2, 2.5, 5, 10])
            )

    def logarithmic(self, *values: np.ndarray) -> None:
        """Make the vertical axis logarithmic with plain numbers as labels, if there is a positive value to show."""
        from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

        axes = self.axes[0]
        every_value = np.concatenate(list(map(np.ravel, values)))
        positive = every_value[every_value > 0]
        if not positive.size:
            return
        axes.set_yscale("log", nonpositive="mask")
        decades = np.log10(positive.max() / positive.min())
        # Powers of ten alone would be too few labels.
        steps = (1.0, 2.0, 5.0) if decades < 2 else (1.0,)
        axes.yaxis.set_major_locator(LogLocator(subs=steps, numticks=12))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())

    def with_legend(
        self, *, ncols: int | None = None, loc: str = "left", handles: Sequence[Any] = ()
    ) -> "Figure":
        """Add one legend, above a new figure or in the first of the caller's axes, in which each name stands once."""
        handle_of = {handle.get_label(): handle for handle in handles}
        for axes in self.axes:
            for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
                handle_of.setdefault(name, handle)
        look: dict[str, Any] = {
            "frameon": False,
            "fontsize": 8.5,
            "labelcolor": INK,
            "handlelength": 2.6,
        }
        if handle_of and self.callers_axes:
            self.axes[0].legend(**look)
        elif handle_of:
            look |= {"loc": f"outside upper {loc}", "ncols": ncols or len(handle_of)}
            self.figure.legend(list(handle_of.values()), list(handle_of), **look)
        return self.figure


def new_figure(width: float, height: float) -> "Figure":
    """Return an empty figure of the given size (inches), laid out so that labels fit."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def one_panel(width: float, height: float) -> "tuple[Panels, Axes]":
    """Return the panel of a new figure, and its axes."""
    panels = panel_row([""], width, height)
    return panels, panels.axes[0]


def panel_row(
    titles: Sequence[str], width: float, height: float, *, sharey: bool = True, **look: Any
) -> Panels:
    """Return a figure with panels side by side."""
    figure = new_figure(width, height)
    axes = list(figure.subplots(1, len(titles), sharey=sharey, squeeze=False)[0])
    return titled(Panels(figure, axes, len(titles)), titles, **look)


def panel_grid(
    titles: Sequence[str],
    height: float,
    *,
    sharex: bool = False,
    make: "Callable[[float, float], Figure]" = new_figure,
) -> Panels:
    """Return a figure, which `make` gives, with panels in rows."""
    count = len(titles)
    # Four panels make a square, others have three in a row.
    columns = min(count, 2 if count in (2, 4) else 3)
    # rounded up
    rows = -(-count // columns)
    figure = make(8.4, height * rows + 0.55)
    axes = list(figure.subplots(rows, columns, sharex=sharex, squeeze=False).flat)
    for unused in axes[count:]:
        unused.set_visible(False)
    return titled(
        Panels(figure, axes[:count], columns), titles, fontweight="bold", parse_math=False
    )


def titled(panels: Panels, titles: Sequence[str], **look: Any) -> Panels:
    """Give panels the common look and a title each."""
    options: dict[str, Any] = {"color": INK, "loc": "left", "fontsize": 10} | look
    for axes, title in zip(panels.axes, titles, strict=True):
        prepare_axes(axes)
        axes.set_title(title, **options)
    return panels


def prepare_axes(axes: "Axes") -> None:
    """Give axes the common look: two spines, quiet ticks, horizontal rules."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(MUTED)
    axes.tick_params(colors=MUTED, labelsize=8.5, length=3)
    axes.grid(axis="y", color=RULE, linewidth=0.6)
    axes.set_axisbelow(True)


def label(axes: "Axes", y: str, x: str) -> None:
    """Label both axes; an empty text leaves an axis without label."""
    axes.set_xlabel(x, color=INK, fontsize=9.5)
    axes.set_ylabel(y, color=INK, fontsize=9.5)


def note(axes: "Axes", text: str, *, height: float = 1.02) -> None:
    """Write a remark above the right end of a panel."""
    look: dict[str, Any] = {"ha": "right", "va": "bottom", "fontsize": 7.5, "color": MUTED}
    axes.text(1, height, text, transform=axes.transAxes, **look)


def draw_line(
    axes: "Axes", values: np.ndarray, trials: np.ndarray | None = None, **options: Any
) -> None:
    """Draw one value per generation, or over the trials spent by then; a single generation becomes a dot."""
    if len(values) == 1:
        options |= {"marker": "o", "markersize": 4}
    axes.plot(np.arange(len(values)) if trials is None else trials, values, **options)
