"""The page of a study: plain data in, HTML out."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from ._page import _configuration, _figures, _page, _section
from ._run import Picture

Cell = str | float | int | None


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
class StudyReport:
    """A study as a reader should see it.

    Parameters
    ----------
    title, verdict
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
    verdict: str
    listings: tuple[Listing, ...]
    figures: tuple[Picture, ...] = ()
    warning: str = ""
    configuration: str = ""


def study_page(report: StudyReport) -> str:
    """Return a study as one HTML page that works offline.

    Parameters
    ----------
    report
        What to show.

    Returns
    -------
    str
        The page; its Content-Security-Policy forbids it to load anything.
    """
    warning = f'<p class="health warning" role="note">{escape(report.warning)}</p>' if report.warning else ""
    sections = [
        *(_listing(listing) for listing in report.listings if not listing.folded),
        warning,
        _figures(report.figures),
        *(_listing(listing) for listing in report.listings if listing.folded),
        _configuration(report.configuration),
    ]
    return _page(report.title, report.verdict, sections, None)


def _listing(listing: Listing) -> str:
    header = "".join(f'<th scope="col">{escape(column)}</th>' for column in listing.columns)
    body = "\n".join(_row(row) for row in listing.rows)
    note = f'<p class="note">{escape(listing.note)}</p>' if listing.note else ""
    table = (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(listing.heading)}"><table class="numbers">'
        f"<thead><tr>{header}</tr></thead>\n<tbody>{body}</tbody></table></div>{note}"
    )
    if listing.folded:
        return f'<details id="{escape(listing.name)}"><summary>{escape(listing.heading)}</summary>{table}</details>'
    return _section(escape(listing.name), escape(listing.heading), table)


def _row(row: Sequence[Cell]) -> str:
    head, *rest = row
    return f'<tr><th scope="row">{_cell(head)}</th>{"".join(f"<td>{_cell(cell)}</td>" for cell in rest)}</tr>'


def _cell(value: Cell) -> str:
    if value is None:
        return "&ndash;"
    if isinstance(value, float):
        return f"{value:.4f}" if abs(value) < 1000 else f"{value:.4g}"
    return escape(str(value))
