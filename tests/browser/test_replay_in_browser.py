"""The pages in a real browser: the replay moves, obeys, and nothing leaves the page."""

from pathlib import Path

import numpy as np
import pytest

from turing_learning import report
from turing_learning.figures import Picture
from turing_learning.figures.one_run import error_figure
from turing_learning.figures.style import panel_grid
from turing_learning.report import Listing, Report, report_page

INTERVAL_S = 0.1
FRAMES = 301
ROBOTS = 5
SPACE, END, HOME, RIGHT = (" ", 32, " "), ("End", 35), ("Home", 36), ("ArrowRight", 39)
TIME = "Number(document.getElementById('replay').dataset.time)"
PLAYING = "document.getElementById('replay').dataset.playing === 'true'"
PIXELS = "[...document.querySelectorAll('canvas')].map((canvas) => canvas.toDataURL()).join()"
BLUE, ORANGE = [0, 114, 178], [213, 94, 0]


def circling(direction: float) -> np.ndarray:
    """Robots on a circle, and one object at rest in its middle."""
    angles = direction * 0.05 * np.arange(FRAMES)[:, None] + 2 * np.pi * np.arange(ROBOTS) / ROBOTS
    headings = angles + direction * np.pi / 2
    robots = np.stack([100 * np.cos(angles), 100 * np.sin(angles), headings], axis=-1)
    return np.concatenate([robots, np.zeros((FRAMES, 1, 3))], axis=1)


def make_replay() -> report.Replay:
    replicas = np.ones(ROBOTS, dtype=bool)
    swarms = (
        report.Swarm("Agents", circling(1.0), ROBOTS),
        report.Swarm("Replicas", circling(-1.0), ROBOTS, replicas),
    )
    return report.Replay("Two swarms", 3.5, 5.0, INTERVAL_S, swarms)


def make_report() -> Report:
    drawing = error_figure(np.geomspace(1, 0.1, 9), np.geomspace(1, 0.01, 9))
    return Report(
        title="<script>console.error('title')</script>",
        summary="<img src='https://example.org/verdict.png'>",
        listings=[
            Listing(
                "result", "Inferred parameters", ("Parameter", "Inferred"), [("<b>vl0</b>", -0.7)]
            )
        ],
        figures=(Picture("error", "Error", "", drawing),),
        configuration="</code></pre><script src='https://example.org/a.js'></script>",
        manifest=(("<i>seed</i>", "</table><iframe src='https://example.org'></iframe>"),),
        replay=make_replay(),
    )


@pytest.fixture(scope="session")
def report_file(tmp_path_factory) -> Path:
    return report.write_page(
        report_page(make_report()), tmp_path_factory.mktemp("page") / "report.html"
    )


@pytest.fixture
def opened(page, report_file):
    """Return the page as those see it who ask for reduced motion, with all of the plane in view, at the pace of the robots."""
    page.call(
        "Emulation.setEmulatedMedia",
        features=[{"name": "prefers-reduced-motion", "value": "reduce"}],
    )
    page.open(report_file)
    page.evaluate(
        "document.querySelector('.speed').value = '1'; document.querySelector('.follow').click()"
    )
    return page


def color_at(page, canvas: int, time_s: float, robot: int) -> list[int]:
    """The color on a robot, half a radius behind its center, after seeking to a time."""
    replay = make_replay()
    x, y, heading = replay.swarms[canvas].poses[round(time_s / INTERVAL_S), robot]
    left, bottom, right, top = replay.view_cm
    back = 0.87 * replay.robot_radius_cm  # on the rim, which replicas draw in full color
    u = (x - back * np.cos(heading) - left) / (right - left)
    v = (top - y + back * np.sin(heading)) / (top - bottom)
    return page.evaluate(
        f"(() => {{ const c = document.querySelectorAll('canvas')[{canvas}];"
        f" return [...c.getContext('2d').getImageData({u} * c.width, {v} * c.height, 1, 1).data.slice(0, 3)]; }})()"
    )


def test_the_replay_opens_playing_fast_and_zoomed_to_the_swarm(page, report_file):
    page.open(report_file)
    page.wait_until(f"{PLAYING} && {TIME} > 0.5")
    assert page.evaluate(
        "[document.querySelector('.follow').checked, document.querySelector('.speed').value]"
    ) == [True, "10"]


def test_the_replay_waits_at_the_start_where_reduced_motion_is_asked_for(opened):
    assert opened.evaluate(f"[{TIME}, {PLAYING}]") == [0, False]


def test_the_replay_moves_after_a_click_on_play(opened):
    before = opened.evaluate(PIXELS)
    opened.click(".play")
    opened.wait_until(f"{TIME} > 0.3")
    assert opened.evaluate(PIXELS) != before


def test_the_replay_stands_still_after_pause(opened):
    opened.click(".play")
    opened.wait_until(f"{TIME} > 0.1")
    opened.click(".play")
    assert opened.evaluate(PLAYING) is False
    pause = (
        f"new Promise((done) => {{ const t = {TIME}; setTimeout(() => done({TIME} - t), 200); }})"
    )
    assert opened.evaluate(pause) == 0


def test_the_space_key_plays_and_pauses(opened):
    opened.press(*SPACE)
    assert opened.evaluate(PLAYING) is True
    opened.press(*SPACE)
    assert opened.evaluate(PLAYING) is False


def test_the_space_key_on_the_focused_button_toggles_once(opened):
    opened.evaluate("document.querySelector('.play').focus()")
    opened.press(*SPACE)
    assert opened.evaluate(PLAYING) is True


def test_an_arrow_key_steps_one_frame(opened):
    opened.press(*RIGHT)
    assert opened.evaluate(TIME) == pytest.approx(INTERVAL_S)


def test_a_click_on_the_slider_seeks(opened):
    opened.click(".seek", x=0.5)
    assert opened.evaluate(TIME) == pytest.approx(15, abs=0.5)
    assert opened.evaluate(PLAYING) is False


def test_the_clock_shows_seconds(opened):
    opened.evaluate("document.querySelector('.seek').focus()")
    opened.press(*END)
    assert opened.evaluate("document.querySelector('.clock').textContent") == "30.0 s of 30.0 s"


def test_play_at_the_end_starts_over(opened):
    opened.evaluate("document.querySelector('.seek').focus()")
    opened.press(*END)
    opened.click(".play")
    opened.wait_until(f"{PLAYING} && {TIME} > 0")
    assert opened.evaluate(TIME) < 20


def test_the_replay_stops_at_the_end(opened):
    opened.evaluate("document.querySelector('.speed').value = '20'")
    opened.click(".play")
    opened.wait_until(f"!({PLAYING})")
    assert opened.evaluate(TIME) == 30


@pytest.mark.parametrize(("speed", "least", "most"), [("0.5", 0.05, 0.8), ("20", 4.0, 32.0)])
def test_the_speed_is_obeyed(opened, speed, least, most):
    opened.evaluate(f"document.querySelector('.speed').value = '{speed}'")
    opened.click(".play")
    # Frames that a busy machine drops make the replay slower, never faster: hence the wide lower margin.
    rate = opened.evaluate(
        "new Promise((done) => requestAnimationFrame((start) => {"
        f" const t = {TIME}; setTimeout(() => requestAnimationFrame((stop) =>"
        f" done(1000 * ({TIME} - t) / (stop - start))), 500); }}))"
    )
    assert least < rate < most


@pytest.mark.parametrize("time_s", [0.0, 7.3])
@pytest.mark.parametrize("robot", range(ROBOTS))
def test_agents_are_where_the_data_say(opened, time_s, robot):
    opened.evaluate(f"(() => {{ const s = document.querySelector('.seek'); s.value = {time_s};"
                    " s.dispatchEvent(new Event('input')); })()")  # fmt: skip
    assert color_at(opened, 0, time_s, robot) == pytest.approx(BLUE, abs=40)
    assert color_at(opened, 1, time_s, robot) == pytest.approx(ORANGE, abs=40)


@pytest.mark.parametrize("option", [".follow", ".sight"])
def test_an_option_changes_the_picture(opened, option):
    opened.click(".seek", x=0.3)
    before = opened.evaluate(PIXELS)
    opened.click(option)
    assert opened.evaluate(PIXELS) != before


def test_canvases_have_the_resolution_of_the_screen(opened):
    opened.call(
        "Emulation.setDeviceMetricsOverride",
        width=800,
        height=900,
        deviceScaleFactor=3,
        mobile=False,
    )
    opened.wait_until(
        "(() => { const c = document.querySelector('canvas'); return c.width === 3 * c.clientWidth; })()"
    )


def test_the_page_fits_a_phone(opened):
    opened.call(
        "Emulation.setDeviceMetricsOverride",
        width=375,
        height=800,
        deviceScaleFactor=2,
        mobile=True,
    )
    assert opened.evaluate("document.documentElement.scrollWidth") == 375


def over_the_figure(page, x, y):
    """Return where in the window a part of the figure's width and height is."""
    return page.evaluate(
        "(() => { const e = document.querySelector('svg[data-axes]'); e.scrollIntoView({block: 'center'});"
        f" const b = e.getBoundingClientRect(); return [b.left + {x} * b.width, b.top + {y} * b.height]; }})()"
    )


def point(page, x, y, kind="mouseMoved", **more):
    left, top = over_the_figure(page, x, y)
    page.call("Input.dispatchMouseEvent", type=kind, x=left, y=top, **more)


TIP = "document.querySelector('.tip:not([hidden])')?.innerText"
TICKS = "[...document.querySelectorAll('[id*=ytick_] text')].map((text) => text.textContent).join()"


def test_curves_answer_to_the_pointer(opened):
    point(opened, 0.5, 0.5)
    generation, best, typical = opened.evaluate(TIP).split("\n")[:3]
    at = float(generation.removeprefix("Generation: "))
    # both curves are straight on the figure's logarithmic axis, from 1 to 0.1 and to 0.01
    assert float(best.removeprefix("best model: ")) == pytest.approx(10 ** (-at / 8), rel=0.01)
    value = float(typical.removeprefix("median of the better half: "))
    assert value == pytest.approx(10 ** (-at / 4), rel=0.01)
    point(opened, 0.5, 0.01)
    assert opened.evaluate(TIP) is None


def test_a_part_of_a_figure_is_shown_larger(opened):
    before = opened.evaluate(TICKS)
    point(opened, 0.4, 0.4, "mousePressed", button="left", buttons=1, clickCount=1)
    point(opened, 0.7, 0.7, buttons=1)
    point(opened, 0.7, 0.7, "mouseReleased", button="left", clickCount=1)
    assert opened.evaluate(TICKS) != before
    point(opened, 0.5, 0.5)
    generation, best = opened.evaluate(TIP).split("\n")[:2]
    at = float(generation.removeprefix("Generation: "))
    assert float(best.removeprefix("best model: ")) == pytest.approx(10 ** (-at / 8), rel=0.01)
    for count in (1, 2):
        point(opened, 0.5, 0.5, "mousePressed", button="left", buttons=1, clickCount=count)
        point(opened, 0.5, 0.5, "mouseReleased", button="left", clickCount=count)
    assert opened.evaluate(TICKS) == before
    assert opened.complaints() == []


def test_panels_that_share_an_axis_are_shown_larger_together(page, tmp_path):
    panels = panel_grid(["A", "B"], 3.0, sharex=True)
    for axes, height in zip(panels.axes, (1, 10), strict=True):
        axes.plot([0, 8], [0, height])
    picture = Picture("two", "Two", "", panels.figure)
    told = Report(title="Two", summary="", listings=(), figures=(picture,), configuration="")
    page.open(report.write_page(report_page(told), tmp_path / "two.html"))
    labels = (
        "[...document.querySelectorAll('[id$=axes-NUMBER] [id*=AXISick_] text')]"
        ".map((text) => text.textContent).join()"
    )
    ticks = [
        labels.replace("NUMBER", number).replace("AXIS", axis)
        for number in "01"
        for axis in ("xt", "yt")
    ]
    before = [page.evaluate(text) for text in ticks]
    point(page, 0.15, 0.4, "mousePressed", button="left", buttons=1, clickCount=1)
    point(page, 0.3, 0.7, buttons=1)
    point(page, 0.3, 0.7, "mouseReleased", button="left", clickCount=1)
    after = [page.evaluate(text) for text in ticks]
    assert after[0] == after[2] != before[0]
    assert after[1] != before[1]
    assert after[3] == before[3]
    for count in (1, 2):  # in the other panel
        point(page, 0.7, 0.5, "mousePressed", button="left", buttons=1, clickCount=count)
        point(page, 0.7, 0.5, "mouseReleased", button="left", clickCount=count)
    assert [page.evaluate(text) for text in ticks] == [before[0], after[1], before[2], before[3]]


def test_nothing_leaves_the_page(opened, report_file):
    opened.click(".play")
    opened.wait_until(f"{TIME} > 0.2")
    assert [url for url in opened.requests() if not url.startswith("data:")] == [
        report_file.as_uri()
    ]


def test_a_page_that_asks_for_something_would_be_noticed(page, tmp_path):
    (tmp_path / "leak.html").write_text("<!doctype html><img src='http://127.0.0.1:9/leak.png'>")
    page.open(tmp_path / "leak.html")
    assert "http://127.0.0.1:9/leak.png" in page.requests()
    assert page.complaints() != []


def test_the_console_stays_silent(opened):
    opened.click(".play")
    opened.wait_until(f"{TIME} > 0.2")
    assert opened.complaints() == []


def test_the_policy_refuses_other_scripts(opened):
    opened.evaluate("(() => { const s = document.createElement('script'); s.textContent = 'window.intruder = 1';"
                    " document.body.append(s); })()")  # fmt: skip
    assert opened.evaluate("typeof window.intruder") == "undefined"


def test_texts_of_the_user_stay_texts(opened):
    assert opened.evaluate("document.querySelector('h1').textContent") == make_report().title
    assert (
        opened.evaluate("document.querySelector('pre').textContent") == make_report().configuration
    )
    assert opened.evaluate("document.querySelectorAll('iframe, img, main script').length") == 0


def test_ids_are_unique(opened):
    ids = opened.evaluate("[...document.querySelectorAll('[id]')].map((element) => element.id)")
    assert sorted(set(ids)) == sorted(ids)


def test_every_control_has_a_name(opened):
    tree = opened.call("Accessibility.getFullAXTree")["nodes"]
    roles = ("button", "slider", "checkbox", "combobox")
    controls = [node for node in tree if node["role"]["value"] in roles]
    assert sorted(node["name"]["value"].strip() for node in controls) == [
        "Lines of sight",
        "Play",
        "Speed",
        "Time",
        "Zoom in",
    ]


def test_a_page_with_one_frame_offers_nothing_to_play(page, tmp_path):
    still = report.Replay(
        "Still", 3.5, 5.0, 0.1, (report.Swarm("Agents", circling(1.0)[:1], ROBOTS),)
    )
    page.open(report.write_page(report.replay_page(still), tmp_path / "still.html"))
    assert page.evaluate("document.querySelector('.play').disabled") is True
    assert page.complaints() == []


def test_a_report_without_replay_runs_nothing(page, tmp_path):
    bare = Report(
        "Run", "Done.", [Listing("result", "Inferred", ("Parameter", "Inferred"), [("a", 1.0)])]
    )
    page.open(report.write_page(report_page(bare), tmp_path / "bare.html"))
    assert page.complaints() == []
    assert page.evaluate("document.querySelectorAll('canvas').length") == 0
