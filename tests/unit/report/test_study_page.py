from matplotlib.figure import Figure

from turing_learning.figures import Picture
from turing_learning.report._page import Listing, Report, report_page

LISTINGS = (
    Listing("errors", "Errors", ("Parameter", "Mean"), [("vl0 <b>", 0.25), ("vr0", None)], note="Of <all> runs."),
    Listing("runs", "Every run", ("Run", "Verdict"), [(1, "good"), (2, 12345.678)], folded=True),
)


def page(**changes):
    return report_page(Report("A study & more", "2 of 2 runs.", LISTINGS, **changes))


def test_a_page_shows_its_tables_and_escapes_what_it_shows():
    html = page(configuration="[run]\nseed = 1 # <>")
    for text in (
        "<title>A study &amp; more</title>",
        '<th scope="row">vl0 &lt;b&gt;</th><td>0.2500</td>',
        '<th scope="row">vr0</th><td>&ndash;</td>',
        '<th scope="row">2</th><td>1.235e+04</td>',
        "Of &lt;all&gt; runs.",
        "seed = 1 # &lt;&gt;",
    ):
        assert text in html


def test_the_numbers_of_a_column_have_the_same_places():
    rows = [("vl0", 0.0006085, 3), ("vl1", 0.0148, 4)]
    listing = Listing("errors", "Errors", ("Parameter", "Mean", "Runs"), rows)
    html = report_page(Report("A study", "2 of 2 runs.", (listing,)))
    assert '<th scope="row">vl0</th><td>0.00061</td><td>3</td>' in html
    assert '<th scope="row">vl1</th><td>0.01480</td><td>4</td>' in html


def test_long_tables_are_folded_and_come_after_the_figures():
    html = page(figures=(Picture("boxes", "Boxes", "", Figure()),))
    assert html.index('id="errors"') < html.index("<svg ") < html.index('<details id="runs">')


def test_a_warning_is_shown_where_there_is_one():
    assert 'class="health warning" role="note">1 &lt; 2 runs failed' in page(warning="1 < 2 runs failed")
    assert 'role="note"' not in page()


def test_the_page_may_load_nothing():
    assert "default-src 'none'" in page()
