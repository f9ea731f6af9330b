"""A game in a real browser: people answer by keys, mouse and touch, and save what they answered."""

import time
from urllib.parse import unquote

import numpy as np
import pytest

from turing_learning import report
from turing_learning.examination import pool_answers

RNG = np.random.default_rng(3)
PAIRS = 4
GAME = report.Game(
    title="Fish <b>or</b> not",
    real=np.cumsum(RNG.standard_normal((PAIRS, 30, 3, 2)), axis=1),
    simulated=np.cumsum(RNG.standard_normal((PAIRS, 30, 3, 2)), axis=1),
    interval_s=0.1,
    panel=0.9,
    seed=5,
)
KEYS = {"1": 49, "2": 50, "ArrowLeft": 37, "ArrowRight": 39}
# from which on an answer counts, see `_game.js`
PAUSE_S = 0.35


@pytest.fixture
def opened(page, tmp_path):
    page.open(report.write_page(report.game_page(GAME), tmp_path / "game.html"))
    return page


def answer(page, how):
    time.sleep(PAUSE_S)
    if how in KEYS:
        page.press(how, KEYS[how])
    else:
        page.click(f".choice[data-side={how}] canvas")


def test_who_knows_the_sides_is_right_each_time_and_saves_that(opened, tmp_path):
    assert opened.evaluate("document.querySelector('h1').textContent") == GAME.title
    assert "panel" not in opened.evaluate("document.body.innerText")
    ways = {True: ["1", "ArrowLeft", "left", "1"], False: ["2", "ArrowRight", "right", "2"]}
    for number, left in enumerate(GAME.real_is_left.tolist()):
        shown = opened.evaluate("document.querySelector('#game-heading').textContent")
        assert shown == f"Pair {number + 1} of {PAIRS}"
        answer(opened, ways[left][number])
    text = opened.evaluate("document.body.innerText")
    assert "You were right 4 of 4 times" in text
    assert "in 6 % of games (binomial p = 0.063)" in text
    assert "tells 90 % of pairs of single samples: about 3.6 of 4" in text
    opened.evaluate("document.querySelector('.player').value = 'A \"quoted\", name'")
    opened.evaluate("document.querySelector('.player').dispatchEvent(new Event('input'))")
    address = opened.evaluate("document.querySelector('.save').href")
    saved = tmp_path / "answers.csv"
    saved.write_text(unquote(address.partition(",")[2]))
    pooled = pool_answers([saved])
    assert (pooled.right, pooled.answers, pooled.people) == (4, 4, 1)
    assert pooled.p_value == 1 / 16
    assert pooled.table["player"][0] == 'A "quoted", name'
    assert opened.complaints() == []


def test_a_touch_answers_and_a_second_one_at_once_is_none(opened):
    time.sleep(PAUSE_S)
    box = opened.evaluate(
        "(() => { const b = document.querySelector('.choice canvas').getBoundingClientRect();"
        " return [b.left + b.width / 2, b.top + b.height / 2]; })()"
    )
    for _ in range(2):
        at = [{"x": box[0], "y": box[1]}]
        opened.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=at)
        opened.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
    opened.wait_until("document.querySelector('.number').textContent === '2'")
    assert opened.evaluate("document.querySelector('#game').dataset.playing") == "true"
    opened.press(" ", 32)
    assert opened.evaluate("document.querySelector('#game').dataset.playing") == "false"
