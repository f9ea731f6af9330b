"""A figure as SVG markup that lives inside a page."""

import io
import re
from html import escape
from typing import TYPE_CHECKING

from ._style import PAGE_COLORS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SALT = "turing-learning"


def svg_markup(figure: "Figure", prefix: str, description: str) -> str:
    """Return a figure as one ``<svg>`` element to be put inline into a page.

    Texts stay texts, the background is transparent, ids start with `prefix`, and the figure's colors become the page's
    CSS variables (``--ink``, ``--muted``, ``--rule``, ``--blue``, ``--orange``, ...) with the printed colors as
    fallback, so that the figure follows the page into dark mode.

    Parameters
    ----------
    figure
        The figure.
    prefix
        What makes its ids unique in the page: a letter, then letters, digits, and hyphens.
    description
        What the figure shows, for those who cannot see it.

    Returns
    -------
    str

    Raises
    ------
    ValueError
        If `prefix` is not of that form.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9-]*", prefix):
        raise ValueError(f"`prefix` must be a letter, then letters, digits, and hyphens; got {prefix!r}.")
    drawing = _draw(figure)
    drawing = re.sub(r"<(metadata|style).*?</\1>", "", drawing, flags=re.DOTALL)
    drawing = re.sub(r'\bid="', f'id="{prefix}-', drawing)
    drawing = re.sub(r"(url\(|href=\")#", rf"\1#{prefix}-", drawing)
    drawing = re.sub(r"\bd=\"[^\"]*\"", _shorten, drawing)
    drawing = re.sub(r"('DejaVu Sans'[^;\"]*?)(?=[;\"])", "system-ui, sans-serif", drawing)
    for color, variable in PAGE_COLORS.items():
        drawing = drawing.replace(color, f"var({variable}, {color})")
    return _opened(figure, drawing, description)


def _draw(figure: "Figure") -> str:
    import matplotlib as mpl

    file = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": SALT, "svg.fonttype": "none"}):
        figure.savefig(file, format="svg", transparent=True, metadata={"Date": None})
    return file.getvalue()


def _shorten(path: re.Match[str]) -> str:
    # Hundredths of a point are finer than any screen; the digits behind them are half of the file.
    return re.sub(r"(\.\d\d)\d+", r"\1", path[0]).replace("\n", "")


def _opened(figure: "Figure", drawing: str, description: str) -> str:
    width, height = 72 * figure.get_size_inches()
    tag = (
        f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" '
        f'viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(description)}" stroke-linejoin="round">'
    )
    content = drawing.split("<svg", 1)[1].split(">", 1)[1]
    return tag + content.strip()
