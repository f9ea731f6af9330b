"""What an experiment is, and what it leaves behind."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import pandas as pd

from turing_learning.figures import Picture

from ._verdicts import ClaimVerdict, prose
from ._work import Work

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Table:
    """A small table."""

    name: str  # of its file, without suffix
    caption: str  # what it holds
    frame: pd.DataFrame  # the index is left out
    inline: bool = False  # whether the page of the experiment shows it

    def csv(self) -> bytes:
        """Return the table as a CSV file; six digits are more than any of the quantities has."""
        return self.frame.to_csv(index=False, float_format="%.6g", lineterminator="\n").encode()


def stacked(frames: Mapping[Any, pd.DataFrame], *columns: str) -> pd.DataFrame:
    """Return frames one below the other, after columns with what their keys say."""
    frame = pd.concat(dict(frames), names=columns)
    return frame.reset_index(level=list(range(len(columns)))).reset_index(drop=True)


@dataclass(frozen=True)
class Captions:
    """Makes the tables and pictures of an experiment: experiments.toml has their captions under patterns of their names."""

    experiment: str  # its id

    def table(self, pattern: str, frame: pd.DataFrame, inline: bool = False, /, **words: Any) -> Table:
        """Return a table; name and caption are filled in with the words."""
        return Table(pattern.format(**words), self._caption("tables", pattern, words), frame, inline)

    def picture(self, pattern: str, claim: str, figure: "Figure", /, **words: Any) -> Picture:
        """Return a picture that belongs to a claim."""
        return Picture(pattern.format(**words), claim, self._caption("pictures", pattern, words), figure)

    def _caption(self, kind: str, pattern: str, words: Mapping[str, Any]) -> str:
        return str(prose()[kind][self.experiment][pattern]).format(**words)


@dataclass(frozen=True)
class Findings:
    """What an experiment has found; the title of a picture is the id of its claim, remarks are sentences in Markdown."""

    verdicts: Sequence[ClaimVerdict]
    tables: Sequence[Table]
    pictures: Sequence[Picture]
    remarks: Sequence[str] = ()


@dataclass(frozen=True)
class Experiment:
    """One section of the paper, repeated."""

    id: str  # the section
    title: str
    cost: str  # how long it takes at full size
    claims: tuple[str, ...]  # ids of the claims that it is held against
    deviations: tuple[str, ...]  # what is done differently, or is not known from the paper, and why
    full: Any  # sizes: frozen dataclasses of plain values
    fast: Any
    conduct: Callable[[Work], Findings]  # does the work: pieces that are there already are not done again
    conditions: tuple[str, ...] = ()  # what is compared, where the paper has nothing to be held against
    packages: tuple[str, ...] = ()  # beyond those of the installation
    extra: str = ""  # that brings them

    @classmethod
    def of(cls, id: str, conduct: Callable[[Work], Findings], *, full: Any, fast: Any) -> "Experiment":
        """Return an experiment about which experiments.toml says the rest."""
        entries: dict[str, Any] = prose()["experiments"][id]
        about: dict[str, Any] = {key: tuple(x) if isinstance(x, list) else x for key, x in entries.items()}
        return cls(id=id, conduct=conduct, full=full, fast=fast, **about)

    @property
    def missing(self) -> tuple[str, ...]:
        """Packages that are not installed."""
        return tuple(package for package in self.packages if find_spec(package) is None)
