"""A figure with its words."""

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Drawing(NamedTuple):
    """A figure with its name, title and caption."""

    name: str
    title: str
    caption: str
    figure: "Figure"
