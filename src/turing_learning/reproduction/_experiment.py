"""What an experiment is, and what it leaves behind."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import pandas as pd

from turing_learning.figures import Picture

from ._claims import prose
from ._verdicts import Verdict
from ._work import Work


@dataclass(frozen=True, eq=False)
class Table:
    """A small table.

    Attributes
    ----------
    name
        Name of its file, without suffix.
    caption
        What it holds.
    frame
        Its columns; the index is left out.
    inline
        Whether the page of the experiment shows it.
    """

    name: str
    caption: str
    frame: pd.DataFrame
    inline: bool = False

    def csv(self) -> bytes:
        """Return the table as a CSV file; six digits are more than any of the quantities has."""
        return self.frame.to_csv(index=False, float_format="%.6g", lineterminator="\n").encode()


def stacked(frames: Mapping[Any, pd.DataFrame], *columns: str) -> pd.DataFrame:
    """Return frames one below the other, after columns with what their keys say."""
    frame = pd.concat(dict(frames), names=columns).reset_index(level=list(range(len(columns))))
    return frame.reset_index(drop=True)


@dataclass(frozen=True)
class Findings:
    """What an experiment has found; the title of a picture is the id of its claim, remarks are sentences in Markdown."""

    verdicts: Sequence[Verdict]
    tables: Sequence[Table]
    pictures: Sequence[Picture]
    remarks: Sequence[str] = ()


@dataclass(frozen=True)
class Experiment:
    """One section of the paper, repeated.

    Attributes
    ----------
    id, title, cost
        The section, what it is about, and how long it takes at full size.
    claims
        Ids of the claims that it is held against.
    deviations, conditions
        What is done differently, or is not known from the paper, and why; what is compared under which conditions, where the
        paper has nothing to be held against.
    full, fast
        Sizes: frozen dataclasses of plain values.
    conduct
        Does the work: pieces that are there already are not done again.
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

    @classmethod
    def of(cls, id: str, conduct: Callable[[Work], Findings], *, full: Any, fast: Any) -> "Experiment":
        """Return an experiment about which experiments.toml says the rest."""
        about: dict[str, Any] = {}
        for key, text in prose()["experiments"][id].items():
            about[key] = tuple(text) if isinstance(text, list) else text
        return cls(id=id, conduct=conduct, full=full, fast=fast, **about)

    @property
    def missing(self) -> tuple[str, ...]:
        """Packages that are not installed."""
        return tuple(package for package in self.packages if find_spec(package) is None)
