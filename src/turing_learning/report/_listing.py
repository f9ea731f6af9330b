"""Tables of a page: plain data in, markup out."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from ._numbers import short_number, shown

Cell = str | float | int | None
NOTHING = "&ndash;"
"""Stands in a cell without a number, as markup."""


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


def section(name: str, heading: str, body: str) -> str:
    """Return a part of a page under a heading; the texts are markup already."""
    title = f'<h2 id="{name}-heading">{heading}</h2>'
    return f'<section id="{name}" aria-labelledby="{name}-heading">{title}\n{body}</section>'


def listing_markup(listing: Listing) -> str:
    """Return a table as markup."""
    header = "".join(f'<th scope="col">{escape(column)}</th>' for column in listing.columns)
    body = "\n".join(_row(row) for row in listing.rows)
    note = f'<p class="note">{escape(listing.note)}</p>' if listing.note else ""
    table = (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(listing.heading)}"><table class="numbers">'
        f"<thead><tr>{header}</tr></thead>\n<tbody>{body}</tbody></table></div>{note}"
    )
    if listing.folded:
        return f'<details id="{escape(listing.name)}"><summary>{escape(listing.heading)}</summary>{table}</details>'
    return section(escape(listing.name), escape(listing.heading), table)


def _row(row: Sequence[Cell]) -> str:
    head, *rest = row
    return f'<tr><th scope="row">{_cell(head)}</th>{"".join(f"<td>{_cell(cell)}</td>" for cell in rest)}</tr>'


def number_markup(value: float | None) -> str:
    """Return a number as it stands in a table of a page; None where there is none, NaN where it is not known."""
    return shown(value, lambda number: short_number(number, 4), NOTHING)


def _cell(value: Cell) -> str:
    return number_markup(value) if value is None or isinstance(value, float) else escape(str(value))
