"""What an experiment is, and what it leaves behind."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
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
    inline
        Whether the page of the experiment shows it.
    """

    name: str
    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    inline: bool = False


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
        Id of the claim that it belongs to, "" if to none.
    figure
        The figure.
    """

    name: str
    caption: str
    claim: str
    figure: "Figure"


@dataclass(frozen=True)
class Findings:
    """What an experiment has found; remarks are sentences in Markdown."""

    verdicts: Sequence[Verdict]
    tables: Sequence[Table]
    pictures: Sequence[Picture]
    remarks: Sequence[str] = ()


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
    conditions
        What is compared under which conditions, where the paper has nothing to be held against.
    packages, extra
        Packages beyond those of the installation, and the extra that brings them.
    """

    id: str
    title: str
    cost: str
    claims: tuple[str, ...]
    deviations: tuple[str, ...]
    full: Any
    fast: Any
    conduct: Callable[[Work], Findings]
    conditions: tuple[str, ...] = ()
    packages: tuple[str, ...] = ()
    extra: str = ""

    @property
    def missing(self) -> tuple[str, ...]:
        """Packages that are not installed."""
        return tuple(package for package in self.packages if find_spec(package) is None)

    def sizes(self, *, fast: bool) -> Any:
        """Return the sizes of one of the two forms."""
        return self.fast if fast else self.full
