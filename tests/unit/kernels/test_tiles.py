import numpy as np
import pytest
from standalone import standalone

from turing_learning.kernels.stepping import find_near_pairs
from turing_learning.kernels.tiles import (
    BOTTOM,
    LEFT,
    REACH,
    RIGHT,
    SIGHT,
    TILE,
    TOP,
    find_pairs_in_tiles,
    new_tiles,
    renew_boxes,
    renew_order,
    sort_places,
)
from turing_learning.kernels.world import ALL_PAIRS, new_pairs, new_state
from turing_learning.swarm import AGGREGATION
from turing_learning.swarm._trials import build_world

find_near_pairs = standalone(find_near_pairs)
find_pairs_in_tiles = standalone(find_pairs_in_tiles)
renew_boxes = standalone(renew_boxes)
renew_order = standalone(renew_order)
sort_places = standalone(sort_places)


def placed(bodies, side, seed=0):
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, side, (2, bodies))
    tiles = new_tiles(bodies, bodies**2)
    renew_order(x, y, tiles)
    renew_boxes(x, y, rng.uniform(3, 5, bodies), rng.uniform(4, 9, bodies), tiles)
    return x, y, tiles


@pytest.mark.parametrize("bodies", [1, 7, 8, 63, 64, 65, 1000])
def test_every_body_has_one_place(bodies):
    _, _, tiles = placed(bodies, 100.0)
    np.testing.assert_array_equal(np.sort(tiles.order[:bodies]), np.arange(bodies))
    np.testing.assert_array_equal(tiles.order[tiles.home], np.arange(bodies))
    assert (tiles.order[bodies:] == -1).all()


@pytest.mark.parametrize("bodies", [1, 65, 400])
def test_boxes_enclose_their_bodies(bodies):
    x, y, tiles = placed(bodies, 100.0)
    for body, home in enumerate(tiles.home):
        for box in (tiles.tile[:, home // TILE], tiles.block[:, home // TILE**2]):
            assert box[LEFT] <= x[body] <= box[RIGHT]
            assert box[BOTTOM] <= y[body] <= box[TOP]
            assert box[SIGHT] >= tiles.member[2, home]
            assert box[REACH] >= tiles.member[3, home]


def test_tiles_and_blocks_are_small():
    # 1024 bodies in a square of side 32: a tile of 8 would be a square of side 2.8 and a block of 64 one of side 8.
    _, _, tiles = placed(1024, 32.0)
    for boxes, side in ((tiles.tile, 2.8), (tiles.block, 8.0)):
        assert (boxes[RIGHT] - boxes[LEFT]).mean() < 1.25 * side
        assert (boxes[TOP] - boxes[BOTTOM]).mean() < 1.25 * side


@pytest.mark.parametrize("count", [0, 1, 2, 5, 100])
def test_places_are_sorted_within_their_range_only(count):
    key = np.random.default_rng(2).normal(size=count + 6)
    order = np.arange(count + 6)
    sort_places(order, 3, count + 3, key)
    np.testing.assert_array_equal(order[3 : count + 3], 3 + np.argsort(key[3 : count + 3]))
    np.testing.assert_array_equal(order[:3], [0, 1, 2])
    np.testing.assert_array_equal(order[count + 3 :], count + np.array([3, 4, 5]))


def test_room_for_pairs_grows_with_the_number_of_bodies_not_with_its_square():
    def room(bodies):
        return new_pairs(1, bodies).near.shape[1]

    assert room(1) == 1
    assert room(11) == 55
    assert room(2000) == 2 * room(1000)


def test_all_pairs_are_looked_at_where_there_is_no_room_for_a_list():
    x, y, tiles = placed(70, 30.0)
    world, state = build_world(AGGREGATION, 70, 0, 0.0), new_state(1, 70)
    state.x[:, 0], state.y[:, 0], state.reach[:, 0] = x, y, 5.0
    short = np.zeros((5, 2), np.int64)
    tiles = tiles._replace(partner=np.zeros(5, np.int64))
    assert find_near_pairs(0, 0.0, world, state, short) == ALL_PAIRS
    assert find_pairs_in_tiles(70, 0.0, short, tiles) == ALL_PAIRS
