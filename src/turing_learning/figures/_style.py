"""What all figures share: colors, axes over generations, and the checks at the door."""

from collections.abc import Sequence
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

# Colors that a page may replace, for its dark mode; see `svg_markup`.
PAGE_COLORS = {
    INK: "--ink",
    MUTED: "--muted",
    RULE: "--rule",
    BLUE: "--blue",
    ORANGE: "--orange",
    GREEN: "--green",
    PURPLE: "--purple",
    SKY: "--sky",
    AMBER: "--amber",
}

DASHED = (0, (4, 2.5))
"""Line style of true values and limits."""

SERIES_COLORS = (BLUE, ORANGE, GREEN, PURPLE, SKY, AMBER)
SERIES_DASHES: tuple[Any, ...] = (
    "-",
    (0, (5, 1.5)),
    (0, (1.5, 1.2)),
    (0, (6, 1.5, 1.5, 1.5)),
    (0, (9, 2)),
    (0, (3, 3)),
)


def new_figure(width: float, height: float) -> "Figure":
    """Return an empty figure of the given size (inches), laid out so that labels fit."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def prepare_axes(axes: "Axes") -> None:
    """Give axes the common look: two spines, quiet ticks, horizontal rules."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(MUTED)
    axes.tick_params(colors=MUTED, labelsize=8.5, length=3)
    axes.grid(axis="y", color=RULE, linewidth=0.6)
    axes.set_axisbelow(True)


def label(axes: "Axes", y: str, x: str = "Generation") -> None:
    """Label both axes; an empty text leaves an axis without label."""
    axes.set_xlabel(x, color=INK, fontsize=9.5)
    axes.set_ylabel(y, color=INK, fontsize=9.5)


def over_generations(axes: "Axes", generations: int) -> None:
    """Let the horizontal axis run from 0 to the number of generations, with whole numbers as ticks."""
    from matplotlib.ticker import MaxNLocator

    axes.set_xlim(0, generations)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=5, integer=True, steps=[1, 2, 2.5, 5, 10]))


def draw_line(axes: "Axes", values: np.ndarray, **options: Any) -> None:
    """Draw one value per generation; a single generation becomes a dot."""
    marker: dict[str, Any] = {"marker": "o", "markersize": 4} if len(values) == 1 else {}
    axes.plot(np.arange(len(values)), values, **marker, **options)


def logarithmic(axes: "Axes", *values: np.ndarray) -> None:
    """Make the vertical axis logarithmic with plain numbers as labels, if there is a positive value to show."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    everything = np.concatenate([np.ravel(value) for value in values])
    positive = everything[everything > 0]
    if not positive.size:
        return
    axes.set_yscale("log", nonpositive="mask")
    decades = np.log10(positive.max() / positive.min())
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < 2 else (1.0,), numticks=12))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def add_legend(target: Any, **options: Any) -> None:
    """Add a legend without frame, in the color of the text."""
    target.legend(frameon=False, fontsize=8.5, labelcolor=INK, handlelength=2.6, **options)


def checked(name: str, values: Any, *shape: str | int) -> np.ndarray:
    """Return `values` as float array of the given shape; a letter stands for any length of at least 1.

    Raises
    ------
    ValueError
        If the shape differs, an axis is empty, or a value is not finite.
    """
    array = np.asarray(values, dtype=float)
    fits = array.ndim == len(shape) and all(
        have >= 1 and (isinstance(want, str) or have == want) for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits:
        expected = f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"
        raise ValueError(f"`{name}` must have the shape {expected}, no axis empty; got {array.shape}.")
    if not np.isfinite(array).all():
        where = tuple(int(k) for k in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"`{name}` must be finite; got {array[where]} at index {where}.")
    return array


def checked_names(names: Sequence[str], count: int) -> tuple[str, ...]:
    """Return the parameter names, one for each of `count` parameters.

    Raises
    ------
    ValueError
        If there are more or fewer names.
    """
    if len(names) != count:
        raise ValueError(f"`names` must hold one name per parameter, {count}; got {len(names)}.")
    return tuple(names)
