import base64
import hashlib
import html
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.figure import Figure

from turing_learning import report
from turing_learning.analysis import Judgment, Verdict
from turing_learning.figures import Picture
from turing_learning.report import Listing, Report, describe_selection, report_page

NASTY = """</script><script>alert("x")</script><!-- & ' ${title}"""


class Reader(HTMLParser):
    """Rows of tables, and everything that could make a request."""

    def __init__(self, page):
        super().__init__()
        self.rows, self.addresses, self.scripts, self.open = [], [], 0, []
        self.feed(page)

    def handle_starttag(self, tag, attributes):
        self.open.append(tag)
        self.scripts += tag == "script"
        names = ("src", "href", "action", "srcset", "poster", "data")
        self.addresses += [value for name, value in attributes if name in names]
        if tag == "tr":
            self.rows.append([])
        elif tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_data(self, data):
        if self.rows and self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data

    def handle_endtag(self, tag):
        if self.open and self.open[-1] == tag:
            self.open.pop()


def make_replay(frames=4):
    rng = np.random.default_rng(1)
    agents, replicas = 50 * rng.normal(size=(2, frames, 3, 3))
    swarms = (
        report.Swarm("Agents", agents, 2),
        report.Swarm("Replicas", replicas, 2, np.array([True, False])),
    )
    return report.Replay("Both", 3.5, 5.0, 0.1, swarms)


def table(*rows, columns=("Parameter", "Inferred", "Note"), **changes):
    return Listing("result", "Inferred parameters", columns, rows, **changes)


def make_report(**changes):
    rows = table(("vl0", -0.70321, "0.01"), foot=("Mean", "", 0.5))
    return Report(**{"title": "Run", "summary": "Done.", "listings": [rows]} | changes)


def embedded(page):
    return json.loads(
        re.search(r'<script type="application/json" id="replay-data">(.*?)</script>', page)[1]
    )


def test_a_table_shows_its_rows_and_sets_the_last_one_apart():
    page = report_page(make_report())
    assert Reader(page).rows == [
        ["Parameter", "Inferred", "Note"],
        ["vl0", "-0.7032", "0.01"],
        ["Mean", "", "0.5000"],
    ]
    assert '<tfoot><tr><th scope="row">Mean</th>' in page


def test_columns_can_stand_out():
    page = report_page(
        make_report(
            listings=[table(("a", 1.0, 2.0), looks={"Inferred": "strong", "Note": "apart"})]
        )
    )
    for markup in (
        '<th scope="col" class="apart">Note</th>',
        '<td class="strong">1.0000</td><td class="apart">2.0000</td>',
    ):
        assert markup in page


@pytest.mark.parametrize(
    ("numbers", "shown"),
    [
        ([0.0006085, 0.0148], ["0.00061", "0.01480"]),
        ([1.234e-5, 2e-5], ["1.234e-05", "2.000e-05"]),
        ([0.5, 12345.678], ["5.000e-01", "1.235e+04"]),
        ([0.25, None], ["0.2500", "\u2013"]),
        ([0.25, float("nan")], ["0.2500", "\u2013"]),
        ([3, 4], ["3", "4"]),
    ],
)
def test_the_numbers_of_a_column_have_the_same_places_and_none_is_shown_as_zero(numbers, shown):
    rows = [(f"v{k}", each, "") for k, each in enumerate(numbers)]
    assert [
        row[1] for row in Reader(report_page(make_report(listings=[table(*rows)]))).rows[1:]
    ] == shown


def test_errors_of_some_millionths_have_no_exponents():
    errors = table(("a", 9.4e-6), ("b", 0.0012), columns=("Parameter", "Absolute error"))
    page = report_page(make_report(listings=[errors]))
    assert "0.000009" in page
    assert "0.001200" in page


def test_long_tables_are_folded_and_come_after_the_figures():
    long = Listing("runs", "Every run", ("Run", "Verdict"), [(1, "good")], folded=True)
    page = report_page(
        make_report(
            listings=[long, table(("a", 1.0, ""))], figures=(Picture("a", "A", "", Figure()),)
        )
    )
    assert page.index('id="result"') < page.index("<svg ") < page.index('<details id="runs">')


def test_a_warning_is_shown_where_there_is_one():
    page = report_page(make_report(warning="1 < 2 runs failed"))
    assert 'class="health warning" role="note">1 &lt; 2 runs failed' in page
    assert 'role="note"' not in report_page(make_report())


@pytest.mark.parametrize(
    ("verdicts", "look", "also"),
    [
        ((Verdict.CONVERGED,), "good", None),
        ((Verdict.MOVING, Verdict.BOUND), "warning", "Also: at a bound."),
        ((Verdict.REJECTED, Verdict.DISAGREE), "bad", "Also: runs disagree."),
        ((Verdict.FAILED,), "bad", None),
    ],
)
def test_the_first_verdict_is_shown_and_the_others_beside_it(verdicts, look, also):
    page = report_page(make_report(judgment=Judgment(verdicts)))
    banner = re.search(
        r'<p class="judged (\w+)" id="verdict"><b>(.*?)</b> <span>(.*?)</span>', page
    )
    assert banner.group(1, 2) == (look, verdicts[0])
    written = re.sub("</?code>", "`", html.unescape(banner[3]))
    assert written == " ".join(filter(None, (verdicts[0].meaning, also)))


def test_tables_are_there_to_download():
    page = report_page(make_report(data={"a.csv": "x,y\n1,2\n"}))
    found = re.search(r'<a download="a.csv" href="data:text/csv;base64,(.*?)">', page)
    assert base64.b64decode(found[1]) == b"x,y\n1,2\n"


def test_how_to_read_it_is_on_the_page_of_a_run_alone():
    assert '<details id="reading">' in report_page(make_report(judgment=Judgment()))
    assert '<details id="reading">' not in report_page(make_report())


def test_configuration_manifest_and_figures_are_on_the_page():
    picture = Picture("one", "Error", "What it shows.", Figure(), wide=True)
    page = report_page(
        make_report(configuration="a = 1\nb = 2", manifest=[("seed", "7")], figures=(picture,))
    )
    assert "<pre><code>a = 1\nb = 2</code></pre>" in page
    assert ["seed", "7"] in Reader(page).rows
    assert picture.svg in page
    assert "<b>Error</b> What it shows." in page


def test_every_text_of_the_user_is_escaped():
    poses = np.zeros((2, 1, 3))
    replay = report.Replay(NASTY, 3.5, 5.0, 0.1, (report.Swarm(NASTY, poses, 1),))
    dangerous = make_report(
        title=NASTY,
        summary=NASTY,
        listings=[table((NASTY, 1, 1), note=NASTY)],
        warning=NASTY,
        figures=(Picture("nasty", NASTY, NASTY, Figure()),),
        configuration=NASTY,
        manifest=[(NASTY, NASTY)],
        replay=replay,
    )
    page = report_page(dangerous)
    assert NASTY not in page
    assert page.count(html.escape(NASTY)) == 16
    assert Reader(page).scripts == 2


@pytest.mark.parametrize(
    "page", [report_page(make_report(replay=make_replay())), report.replay_page(make_replay())]
)
def test_a_page_refers_to_nothing_outside(page):
    assert set(Reader(page).addresses) == {"data:,"}
    assert "url(" not in page
    assert "@import" not in page


def test_the_policy_allows_the_pages_own_script_alone():
    page = report.replay_page(make_replay())
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)[1]
    script = re.search(r"<script>(.*?)</script>", page, re.DOTALL)[1]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy.startswith("default-src 'none';")
    assert f"script-src 'sha256-{digest}';" in policy


def test_poses_survive_the_page_up_to_rounding():
    replay = make_replay()
    data = embedded(report.replay_page(replay))
    left, bottom, right, top = data["view"]
    for swarm, stored in zip(replay.swarms, data["swarms"], strict=True):
        steps = (
            np.frombuffer(base64.b64decode(stored["poses"]), dtype="<u2").reshape(swarm.poses.shape)
            / 65535
        )
        step = max(right - left, top - bottom) / 65535
        np.testing.assert_allclose(
            left + steps[..., 0] * (right - left), swarm.poses[..., 0], atol=step
        )
        np.testing.assert_allclose(
            bottom + steps[..., 1] * (top - bottom), swarm.poses[..., 1], atol=step
        )
        turn = np.exp(1j * (2 * np.pi * steps[..., 2] - swarm.poses[..., 2]))
        np.testing.assert_allclose(turn, 1, atol=1e-4)


def test_the_page_knows_who_is_a_replica_and_who_an_object():
    stored = embedded(report.replay_page(make_replay()))["swarms"][1]
    assert (stored["robots"], stored["bodies"], stored["replicas"]) == (2, 3, [1, 0])


def test_the_caption_counts_what_is_seen():
    page = report.replay_page(make_replay())
    assert '<span class="key agent">2 agents</span><span class="key object">1 object</span>' in page
    assert (
        '<span class="key agent">1 agent</span><span class="key replica">1 replica</span>' in page
    )


def test_a_replay_page_may_have_its_own_title():
    assert "<title>Trial</title>" in report.replay_page(make_replay(), "Trial")
    assert "<title>Both</title>" in report.replay_page(make_replay())


def test_the_same_run_gives_the_same_page():
    assert report_page(make_report(replay=make_replay())) == report_page(
        make_report(replay=make_replay())
    )


def test_a_page_is_written_as_utf_8(tmp_path):
    file = report.write_page("\u03c3 \udcff", tmp_path / "a.html")
    assert file.read_bytes() == b"\xcf\x83 &#56575;"
    assert list(tmp_path.iterdir()) == [file]


def test_a_page_that_cannot_be_written_leaves_the_old_one(tmp_path, monkeypatch):
    (tmp_path / "a.html").write_text("old")

    def fail(self, target):
        raise OSError("No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", fail)
    with pytest.raises(OSError, match="No space left"):
        report.write_page("new", tmp_path / "a.html")
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("a.html", "old")]


@pytest.mark.parametrize(
    ("selection", "sentence"),
    [
        (["active"], ""),
        ([], ""),
        (["all accepted"], "Selection stopped in 1 of 1 generations: 0 (all accepted)."),
        (
            ["all accepted", "all rejected", "all rejected", "active"],
            "Selection stopped in 3 of 4 generations: 0 (all accepted), 1 to 2 (all rejected).",
        ),
    ],
)
def test_selection_is_described(selection, sentence):
    assert describe_selection(selection) == sentence


def test_many_stops_are_not_all_listed():
    sentence = describe_selection(["all accepted", "active"] * 8)
    assert sentence.startswith(
        "Selection stopped in 8 of 16 generations: 0 (all accepted), 2 (all accepted)"
    )
    assert sentence.endswith("10 (all accepted), and 2 more times.")
