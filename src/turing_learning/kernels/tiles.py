"""Bodies of one large trial in tiles of neighbors, so that a search can leave out whole tiles.

The bodies are put in an order in which every TILE consecutive ones, and every TILE consecutive tiles (a block), lie close together.
Each tile and each block keeps the box around its bodies' centres and the largest sight radius and reach in it. Which
bodies share a tile is a matter of speed alone: every search (`rays`, `neighbors`) is exact for any order, so that the order is
renewed now and then only, while the boxes are renewed in every cycle. Boxes adapt to where the bodies are, be they 1e12 cm apart.
"""

import math
from typing import NamedTuple

import numpy as np

from .compile import inlined

TILE = 8
"""Bodies in a tile, and tiles in a block."""
REORDER_CYCLES = 10
"""Control cycles after which the order of the bodies is renewed."""

LEFT, RIGHT, BOTTOM, TOP, SIGHT, REACH = range(6)  # rows of `tile` and `block`


class Tiles(NamedTuple):
    """The bodies of one trial in tiles, and room to search; places are padded to whole blocks."""

    order: np.ndarray  # (places,) int64, the body at each place; -1 where there is none
    home: np.ndarray  # (bodies,) int64, the place of each body
    member: np.ndarray  # (4, places) x, y (cm), sight radius (cm; -inf where there is no body), reach (cm)
    tile: np.ndarray  # (6, tiles) box around the centres, largest sight radius and reach (cm)
    block: np.ndarray  # (6, blocks) the same
    bound: np.ndarray  # (2, tiles) least signed entry distance of a ray in each block and tile
    close: np.ndarray  # (tiles,) int64, tiles that are near a tile
    span: np.ndarray  # (2, bodies) int64, where a body's partners start in `partner`, and their number
    partner: np.ndarray  # (pairs,) int64


def new_tiles(bodies: int, pairs: int) -> Tiles:
    """Allocate tiles for a trial of `bodies` bodies with at most `pairs` near pairs."""
    blocks = -(-bodies // (TILE * TILE))
    order = np.full(blocks * TILE * TILE, -1)
    order[:bodies] = np.arange(bodies)
    return Tiles(
        order=order,
        home=np.zeros(bodies, np.int64),
        member=np.zeros((4, len(order))),
        tile=np.zeros((6, blocks * TILE)),
        block=np.zeros((6, blocks)),
        bound=np.zeros((2, blocks * TILE)),
        close=np.zeros(blocks * TILE, np.int64),
        span=np.zeros((2, bodies), np.int64),
        partner=np.zeros(pairs, np.int64),
    )


@inlined
def sort_places(order: np.ndarray, start: int, stop: int, key: np.ndarray) -> None:
    """Sort the bodies at places start ... stop - 1 by their key (Shell 1959, gaps of Tokuda 1992)."""
    gap = 1
    while gap < (stop - start) // 2:
        gap = (9 * gap + 4) // 4
    while gap > 0:
        for k in range(start + gap, stop):
            body = order[k]
            value = key[body]
            m = k
            while m >= start + gap and key[order[m - gap]] > value:
                order[m] = order[m - gap]
                m -= gap
            order[m] = body
        gap = gap * 4 // 9


@inlined
def sort_in_strips(order: np.ndarray, start: int, stop: int, size: int, x: np.ndarray, y: np.ndarray) -> None:
    """Order the bodies at places start ... stop - 1 so that every `size` consecutive ones fill a square, roughly.

    Source: sort-tile-recursive packing, Leutenegger, Lopez and Edgington (1997).
    """
    pieces = -(-(stop - start) // size)
    strips = math.ceil(math.sqrt(pieces))
    width = -(-pieces // strips) * size
    for k in range(strips + 1):  # the whole along x, then each strip along y
        first = start if k == 0 else min(start + (k - 1) * width, stop)
        last = stop if k == 0 else min(first + width, stop)
        sort_places(order, first, last, x if k == 0 else y)


@inlined
def renew_order(x: np.ndarray, y: np.ndarray, tiles: Tiles) -> None:
    """Put bodies that are close together (x, y: (bodies,)) into the same blocks, and in these into the same tiles."""
    bodies = x.shape[0]
    whole = TILE * TILE
    for n in range(-1, tiles.block.shape[1]):  # blocks, then the tiles of each block
        start = 0 if n < 0 else n * whole
        stop = bodies if n < 0 else min(start + whole, bodies)
        sort_in_strips(tiles.order, start, stop, whole if n < 0 else TILE, x, y)
    for k in range(bodies):
        tiles.home[tiles.order[k]] = k


@inlined
def enclose(source: np.ndarray, start: int, rows: tuple[int, int, int, int, int, int], box: np.ndarray) -> None:
    """Write the box (6,) around TILE columns of `source`; `rows` hold left, right, bottom, top, sight radius and reach."""
    left = bottom = np.inf
    right = top = sight = reach = -np.inf
    for k in range(start, start + TILE):
        left, right = min(left, source[rows[0], k]), max(right, source[rows[1], k])
        bottom, top = min(bottom, source[rows[2], k]), max(top, source[rows[3], k])
        sight, reach = max(sight, source[rows[4], k]), max(reach, source[rows[5], k])
    box[LEFT], box[RIGHT], box[BOTTOM], box[TOP], box[SIGHT], box[REACH] = left, right, bottom, top, sight, reach


@inlined
def renew_boxes(x: np.ndarray, y: np.ndarray, sight: np.ndarray, reach: np.ndarray, tiles: Tiles) -> None:
    """Copy positions, sight radii and reaches (bodies,) to the bodies' places and renew the boxes.

    A place without a body takes the position of the last one, so that it widens no box, and can be neither seen nor met.
    """
    bodies = x.shape[0]
    member = tiles.member
    for k in range(member.shape[1]):
        body = tiles.order[min(k, bodies - 1)]
        member[0, k], member[1, k] = x[body], y[body]
        member[2, k] = sight[body] if k < bodies else -np.inf
        member[3, k] = reach[body] if k < bodies else -np.inf
    for k in range(tiles.tile.shape[1]):
        enclose(member, k * TILE, (0, 0, 1, 1, 2, 3), tiles.tile[:, k])
    for k in range(tiles.block.shape[1]):
        enclose(tiles.tile, k * TILE, (0, 1, 2, 3, 4, 5), tiles.block[:, k])
