"""What pages show: plain data."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby

from turing_learning.analysis import Verdict
from turing_learning.figures import Picture

from ._replay import Replay

Cell = str | float | int | None
ACTIVE = "active"
MOST_SPANS = 6  # listed one by one


@dataclass(frozen=True)
class Listing:
    """A table with a heading.

    Parameters
    ----------
    name
        Makes its ids unique in the page: lower-case letters.
    heading
        Heading.
    columns
        Headings of the columns; the first column names the row.
    rows
        One cell for each column: a text, a number, or None where there is nothing.
    note
        What a reader needs to read it.
    folded
        Whether it is closed until it is asked for, because it is long.
    """

    name: str
    heading: str
    columns: tuple[str, ...]
    rows: Sequence[Sequence[Cell]]
    note: str = ""
    folded: bool = False


@dataclass(frozen=True)
class ParameterRow:
    """One inferred parameter.

    Parameters
    ----------
    name
        Name of the parameter.
    estimate, best_model
        Inferred values: the run's estimate, and the model with the highest subjective fitness in the last generation.
    truth
        The agents' value; None where it is unknown.
    estimate_error, best_model_error
        Absolute errors; None where there is no truth.
    published_error
        Absolute error in the paper; None where it has none.
    interval
        Lower and upper end of the 90 % interval of the estimate, NaN where they are not known; None where there is none.
    """

    name: str
    estimate: float
    best_model: float
    truth: float | None = None
    estimate_error: float | None = None
    best_model_error: float | None = None
    published_error: float | None = None
    interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class RunTable:
    """Inferred parameters beside the truth.

    Parameters
    ----------
    rows
        One row per parameter.
    estimate_mae, best_model_mae
        Mean absolute errors; None where there is no truth.
    note
        What a reader needs to read the table, for example where the published errors come from.
    """

    rows: tuple[ParameterRow, ...]
    estimate_mae: float | None = None
    best_model_mae: float | None = None
    note: str = ""


@dataclass(frozen=True)
class RunReport:
    """A run as a reader should see it.

    Parameters
    ----------
    title, summary
        Title, and the result in one sentence.
    table
        Inferred parameters.
    selection
        One of "active", "all accepted", and "all rejected" for each generation.
    figures
        Figures, in order.
    configuration
        The resolved configuration as text (TOML).
    manifest
        Names and values: seed, versions, machine, timing.
    replay
        Agents beside replicas; None leaves it out.
    check, check_figures
        Whether the estimate can be believed, as a table and figures; None and empty before anybody asked.
    verdicts
        Whether to believe the result: the first is shown, the others are named beside it.
    facts
        Names and values that belong at the top: seed, date, command, citation.
    steps
        What to do next: commands, and what they are for.
    data
        Name of a file -> its content, for download.
    """

    title: str
    summary: str
    table: RunTable
    selection: Sequence[str] = ()
    figures: tuple[Picture, ...] = ()
    configuration: str = ""
    manifest: Sequence[tuple[str, str]] = ()
    replay: Replay | None = None
    check: Listing | None = None
    check_figures: tuple[Picture, ...] = ()
    verdicts: tuple[Verdict, ...] = ()
    facts: Sequence[tuple[str, str]] = ()
    steps: Sequence[tuple[str, str]] = ()
    data: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class StudyReport:
    """A study as a reader should see it.

    Parameters
    ----------
    title, summary
        Title, and the result in one sentence.
    listings
        Tables; folded ones come after the figures.
    figures
        Figures, in order.
    warning
        What a reader must not miss; empty if there is nothing.
    configuration
        The resolved configuration of the first run as text (TOML).
    """

    title: str
    summary: str
    listings: tuple[Listing, ...]
    figures: tuple[Picture, ...] = ()
    warning: str = ""
    configuration: str = ""


def describe_selection(selection: Sequence[str]) -> str:
    """Say in a sentence in which generations selection stopped; nothing if it never did.

    Selection stops in a generation in which every classifier accepts every model or every classifier rejects
    every model: all models are then equally fit.

    Parameters
    ----------
    selection
        One of "active", "all accepted", and "all rejected" for each generation.

    Examples
    --------
    >>> describe_selection(["active", "all rejected", "all rejected"])
    'Selection stopped in 2 of 3 generations: 1 to 2 (all rejected).'
    """
    count, spans, first = len(selection), [], 0
    stopped = sum(state != ACTIVE for state in selection)
    if not stopped:
        return ""
    for state, group in groupby(selection):
        last = first + sum(1 for _ in group) - 1
        if state != ACTIVE:
            spans.append(f"{first} ({state})" if first == last else f"{first} to {last} ({state})")
        first = last + 1
    rest = f", and {len(spans) - MOST_SPANS} more times" if len(spans) > MOST_SPANS else ""
    return f"Selection stopped in {stopped} of {count} generations: {', '.join(spans[:MOST_SPANS])}{rest}."
