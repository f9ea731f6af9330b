"""What the page of a run shows: plain data."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from turing_learning.figures import Picture

from ._listing import Listing
from ._replay import Replay

ACTIVE = "active"
MOST_SPANS = 6  # listed one by one


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
    title, verdict
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
    """

    title: str
    verdict: str
    table: RunTable
    selection: Sequence[str] = ()
    figures: tuple[Picture, ...] = ()
    configuration: str = ""
    manifest: Sequence[tuple[str, str]] = ()
    replay: Replay | None = None
    check: Listing | None = None
    check_figures: tuple[Picture, ...] = ()


def describe_selection(selection: Sequence[str]) -> str:
    """Say in one or two sentences in which generations selection stopped.

    Selection stops in a generation in which every classifier accepts every model or every classifier rejects every
    model: all models are then equally fit.

    Parameters
    ----------
    selection
        One of "active", "all accepted", and "all rejected" for each generation.

    Returns
    -------
    str

    Examples
    --------
    >>> describe_selection(["active", "all rejected", "all rejected"])
    'Selection stopped in 2 of 3 generations: 1 to 2 (all rejected).'
    """
    stopped = sum(state != ACTIVE for state in selection)
    if not stopped:
        count = len(selection)
        return "Selection was active in every generation." if count != 1 else "Selection was active."
    spans = [_describe_span(state, first, last) for state, first, last in _spans(selection) if state != ACTIVE]
    listed = ", ".join(spans[:MOST_SPANS])
    rest = f", and {len(spans) - MOST_SPANS} more times" if len(spans) > MOST_SPANS else ""
    return f"Selection stopped in {stopped} of {len(selection)} generations: {listed}{rest}."


def _spans(selection: Sequence[str]) -> list[tuple[str, int, int]]:
    spans, start = [], 0
    for state, group in groupby(selection):
        length = sum(1 for _ in group)
        spans.append((state, start, start + length - 1))
        start += length
    return spans


def _describe_span(state: str, first: int, last: int) -> str:
    return f"{first} ({state})" if first == last else f"{first} to {last} ({state})"
