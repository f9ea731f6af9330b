"""What an experiment is, and what it leaves behind."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ._verdicts import Verdict
from ._work import Work

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Cell = str | int | float | bool | None


@dataclass(frozen=True)
class Table:
    """A small table.

    Attributes
    ----------
    name
        Name of its file, without suffix.
    caption
        What it holds.
    columns, rows
        Headings and cells.
    """

    name: str
    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]


@dataclass(frozen=True)
class Picture:
    """A figure.

    Attributes
    ----------
    name
        Name of its files, without suffix.
    caption
        What it shows.
    claim
        Id of the claim that it belongs to.
    figure
        The figure.
    """

    name: str
    caption: str
    claim: str
    figure: "Figure"


@dataclass(frozen=True)
class Findings:
    """What an experiment has found."""

    verdicts: Sequence[Verdict]
    tables: Sequence[Table]
    pictures: Sequence[Picture]


@dataclass(frozen=True)
class Experiment:
    """One section of the paper, repeated.

    Attributes
    ----------
    id
        The section.
    title
        What it is about.
    cost
        About how long it takes at full size.
    claims
        Ids of the claims that it is held against.
    deviations
        What is done differently, or is not known from the paper, and why.
    full, fast
        Sizes: frozen dataclasses of plain values.
    conduct
        Does the work: pieces that are there already are not done again.
    """

    id: str
    title: str
    cost: str
    claims: tuple[str, ...]
    deviations: tuple[str, ...]
    full: Any
    fast: Any
    conduct: Callable[[Work], Findings]

    def sizes(self, *, fast: bool) -> Any:
        """Return the sizes of one of the two forms."""
        return self.fast if fast else self.full
