"""A figure with its words, as files and as markup of a page."""

import io
import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from turing_learning._files import whole
from turing_learning.errors import require

from .style import PAGE_COLORS

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

DOTS_PER_INCH = 200
SALT = "turing-learning"
"""Makes the ids of a figure the same each time it is written."""
# Without the version and the date, so that the same figure gives the same bytes.
_METADATA: dict[str, dict[str, str | None]] = {"png": {"Software": None}, "svg": {"Date": None}}


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure with its name and words.

    Attributes
    ----------
    name
        Of its files, without suffix; makes its ids unique in a page.
    title
        Heading in a page.
    caption
        What it shows.
    figure
        The figure.
    wide
        Whether it takes the width of a page.
    """

    name: str
    title: str
    caption: str
    figure: "Figure"
    wide: bool = False

    @property
    def svg(self) -> str:
        """The figure as markup of a page."""
        return svg_markup(self.figure, self.name, self.caption)

    def save(self, folder: str | Path) -> tuple[Path, Path]:
        """Write the figure into a folder; see `save_figure`."""
        return save_figure(self.figure, folder, self.name)


def save_figure(figure: "Figure", folder: str | Path, name: str) -> tuple[Path, Path]:
    """Write a figure as PNG (200 dots per inch) and as SVG; the same figure gives the same bytes.

    Parameters
    ----------
    figure
        The figure.
    folder
        An existing folder. Files appear complete or not at all.
    name
        Name of the files, without suffix.

    Returns
    -------
    tuple of Path
        The PNG and the SVG file.

    Raises
    ------
    OSError
        If the folder cannot be written to.
    """
    import matplotlib as mpl

    fits = name and Path(name).name == name and not name.startswith(".")
    require(fits, "name", "be a file name without folder and leading dot", repr(name))
    _lay_out(figure)
    png = Path(folder) / f"{name}.png"
    svg = Path(folder) / f"{name}.svg"
    look: dict[str, Any] = {"dpi": DOTS_PER_INCH, "facecolor": "white"}
    for path in (png, svg):
        format = path.suffix[1:]
        with whole(path) as temporary, mpl.rc_context({"svg.hashsalt": SALT}):
            figure.savefig(temporary, format=format, metadata=_METADATA[format], **look)
    return png, svg


def svg_markup(figure: "Figure", prefix: str, description: str) -> str:
    """Return a figure as one ``<svg>`` element to be put inline into a page, with a description for those who cannot see it.

    Texts stay texts, the background is transparent, ids start with `prefix`, and the figure's
    colors become the page's CSS variables (``--ink``, ``--blue``, ...) with the printed colors as
    fallback: the figure follows the page into dark mode. The attribute ``data-axes`` says where axes with
    curves are and which values their edges have, by which a page's script reads values off the curves.
    """
    import matplotlib as mpl

    fits = re.fullmatch(r"[A-Za-z][A-Za-z0-9-]*", prefix)
    require(fits, "prefix", "be a letter, then letters, digits, and hyphens", repr(prefix))
    _lay_out(figure)
    file = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": SALT, "svg.fonttype": "none"}), _named_curves(figure):
        figure.savefig(file, format="svg", transparent=True, metadata={"Date": None})
    drawing = re.sub(r"<(metadata|style).*?</\1>", "", file.getvalue(), flags=re.DOTALL)
    drawing = re.sub(r'\bid="', f'id="{prefix}-', drawing)
    drawing = re.sub(r"(url\(|href=\")#", rf"\1#{prefix}-", drawing)
    # Hundredths of a point are finer than any screen; the digits behind them are half of the file.
    drawing = re.sub(r"\bd=\"[^\"]*\"", _shortened, drawing)
    drawing = re.sub(r"('DejaVu Sans'[^;\"]*?)(?=[;\"])", "system-ui, sans-serif", drawing)
    for color, variable in PAGE_COLORS.items():
        drawing = drawing.replace(color, f"var({variable}, {color})")
    width, height = 72 * figure.get_size_inches()
    axes = _described_axes(figure, prefix, width, height)
    data = f' data-axes="{escape(json.dumps(axes))}"' if axes else ""
    content = drawing.split("<svg", 1)[1].split(">", 1)[1].strip()
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(description)}" stroke-linejoin="round"{data}>'
        f"{content}"
    )


def _lay_out(figure: "Figure") -> None:
    """Lay a figure out once: with an engine it is drawn twice for each file, even with one that does nothing."""
    import matplotlib as mpl

    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        # No engine is one of the user's settings otherwise.
        with mpl.rc_context({"figure.autolayout": False, "figure.constrained_layout.use": False}):
            figure.set_layout_engine(None)


@dataclass(frozen=True)
class _Curves:
    """Axes that have curves; names are those of their groups in the drawing."""

    axes: "Axes"
    name: str
    lines: "dict[str, Line2D]"


def _curves(figure: "Figure") -> list[_Curves]:
    """Return the axes of a figure that have curves, on linear or logarithmic scales."""
    curves = []
    for number, axes in enumerate(figure.axes):
        scales = {axes.get_xscale(), axes.get_yscale()}
        if not axes.get_visible() or not scales <= {"linear", "log"}:
            continue
        lines = {}
        for k, line in enumerate(axes.lines):
            if np.size(line.get_xdata()) > 1 and line.get_linestyle() != "None":
                lines[f"curve-{number}-{k}"] = line
        if lines:
            curves.append(_Curves(axes, f"axes-{number}", lines))
    return curves


@contextmanager
def _named_curves(figure: "Figure") -> Iterator[None]:
    """Name axes and curves in what is drawn meanwhile, and not after that: files of the figure stay the same."""
    before = []
    for curves in _curves(figure):
        artists: dict[str, Artist] = {curves.name: curves.axes, **curves.lines}
        for name, artist in artists.items():
            before.append((artist, artist.get_gid()))
            artist.set_gid(name)
    try:
        yield
    finally:
        for artist, gid in before:
            artist.set_gid(gid)


def _described_axes(
    figure: "Figure", prefix: str, width: float, height: float
) -> list[dict[str, Any]]:
    """Return what a script has to know of each axes with curves; boxes are in the units of the drawing."""
    labels = [axes.get_xlabel() for axes in figure.axes if axes.get_xlabel()]
    described = []
    for curves in _curves(figure):
        axes = curves.axes
        position = axes.get_position()
        box = [
            position.x0 * width,
            (1 - position.y1) * height,
            position.width * width,
            position.height * height,
        ]
        lines = []
        for name, line in curves.lines.items():
            label = str(line.get_label())
            visible_label = "" if label.startswith("_") else label
            lines.append({"id": f"{prefix}-{name}", "name": visible_label})
        # of panels above each other the lowest one is labelled
        x_name = axes.get_xlabel() or (labels[0] if labels else "")
        facts = {
            "id": f"{prefix}-{curves.name}",
            "box": [round(side, 2) for side in box],
            "title": axes.get_title(loc="left") or axes.get_title(),
            "xName": x_name,
            "yName": axes.get_ylabel(),
            "xGroup": _group(figure, axes.get_shared_x_axes().get_siblings(axes)),
            "yGroup": _group(figure, axes.get_shared_y_axes().get_siblings(axes)),
            "x": _edges(axes.get_xlim(), axes.get_xscale()),
            "y": _edges(axes.get_ylim(), axes.get_yscale()),
            "lines": lines,
        }
        described.append(facts)
    return described


def _group(figure: "Figure", siblings: "list[Axes]") -> int:
    """Return the number of the first of axes that share one of their two axes."""
    return min(map(figure.axes.index, siblings))


def _edges(limits: tuple[float, float], scale: str) -> dict[str, Any]:
    low, high = limits
    return {"low": float(low), "high": float(high), "log": scale == "log"}


def _shortened(path: re.Match[str]) -> str:
    return re.sub(r"(\.\d\d)\d+", r"\1", path[0]).replace("\n", "")
