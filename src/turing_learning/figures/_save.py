"""Figures as files."""

from pathlib import Path
from typing import TYPE_CHECKING

from turing_learning._files import whole

from ._svg import SALT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 200
_METADATA: dict[str, dict[str, str | None]] = {"png": {"Software": None}, "svg": {"Date": None}}


def save_figure(figure: "Figure", folder: str | Path, name: str) -> tuple[Path, Path]:
    """Write a figure as PNG (200 dots per inch) and as SVG; the same figure gives the same bytes.

    Each file appears whole or not at all.

    Parameters
    ----------
    figure
        The figure.
    folder
        An existing folder.
    name
        Name of the files, without suffix.

    Returns
    -------
    tuple of Path
        The PNG and the SVG file.

    Raises
    ------
    ValueError
        If `name` is not a plain file name.
    OSError
        If the folder cannot be written to.
    """
    if not name or Path(name).name != name or name.startswith("."):
        raise ValueError(f"`name` must be a file name without folder and leading dot; got {name!r}.")
    settle_layout(figure)
    return _write(figure, Path(folder) / f"{name}.png"), _write(figure, Path(folder) / f"{name}.svg")


def settle_layout(figure: "Figure") -> None:
    """Lay a figure out once and for all; otherwise it is drawn twice for each file."""
    if figure.get_layout_engine() is not None:
        figure.draw_without_rendering()
        figure.set_layout_engine("none")


def _write(figure: "Figure", path: Path) -> Path:
    import matplotlib as mpl

    kind = path.suffix[1:]
    with whole(path) as temporary, mpl.rc_context({"svg.hashsalt": SALT}):
        figure.savefig(temporary, format=kind, dpi=DOTS_PER_INCH, facecolor="white", metadata=_METADATA[kind])
    return path
