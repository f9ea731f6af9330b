"""The page of a study: plain data in, HTML out."""

from dataclasses import dataclass
from html import escape

from turing_learning.figures import Picture

from ._listing import Listing, listing_markup
from ._page import _configuration, _figures, _page


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
        *(listing_markup(listing) for listing in report.listings if not listing.folded),
        warning,
        _figures(report.figures),
        *(listing_markup(listing) for listing in report.listings if listing.folded),
        _configuration(report.configuration),
    ]
    return _page(report.title, report.verdict, sections, None)
