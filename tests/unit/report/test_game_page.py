import json
import re

import numpy as np
import pytest

from turing_learning import report

RNG = np.random.default_rng(4)
MOTION = RNG.standard_normal((2, 40, 8, 3, 2))


def game(seed=0, **changes):
    given = {"title": "Fish", "real": MOTION[0], "simulated": MOTION[1], "interval_s": 0.2}
    return report.Game(**given | {"seed": seed} | changes)


def data_of(page):
    return json.loads(re.search(r'id="replay-data">(.*?)</script>', page, re.DOTALL)[1])


def test_the_seed_decides_on_which_side_the_real_motion_is():
    left = game().real_is_left
    assert 8 < left.sum() < 32
    assert report.game_page(game()) == report.game_page(game())
    assert (game(1).real_is_left != left).any()


def test_the_page_knows_the_side_by_its_mark_and_says_it_nowhere():
    page = report.game_page(game())
    pairs = data_of(page)["pairs"]
    even = [pair["mark"].bit_count() % 2 == 0 for pair in pairs]
    assert even == game().real_is_left.tolist()
    visible = re.sub(r"<script.*?</script>|<style.*?</style>|<[^>]*>", "", page, flags=re.DOTALL)
    assert page.count("pair") > 2
    assert visible.count("left one is real") == visible.count("right one is real") == 1
    # the same motion on both sides: nothing but the mark is left to tell pairs by
    same = data_of(report.game_page(game(simulated=MOTION[0])))["pairs"]
    assert all(pair["scenes"][0] == pair["scenes"][1] for pair in same)


def test_scenes_of_different_shapes_are_refused():
    with pytest.raises(ValueError, match=r"`simulated` must be of shape"):
        game(simulated=MOTION[1][:, :, :2])
