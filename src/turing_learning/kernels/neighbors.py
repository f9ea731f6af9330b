"""Near pairs among many bodies, found through tiles; the same pairs in the same order as by the plain loops.

Why this is exact. A pair is near if its rounded dx dx + dy dy is below the rounded square of reach + reach + margin. Rounding
is monotone (see `rays`), so the gap between two boxes, computed in the same way from their sides, bounds this from below, and
the sum of the two boxes' largest reaches bounds the limit from above, to the last bit. A pair of tiles is left out by these
bounds alone. The partners of each body are then sorted, so that the pairs i < j come in the order of the physics.
"""

import numpy as np

from .compile import inlined
from .tiles import BOTTOM, LEFT, REACH, RIGHT, TILE, TOP, Tiles


@inlined
def may_be_near(a: np.ndarray, b: np.ndarray, margin: float) -> bool:
    """Return whether a body of box `a` (6,) can be within reach, and a margin (cm), of one of box `b`."""
    dx = max(b[LEFT] - a[RIGHT], a[LEFT] - b[RIGHT], 0.0)
    dy = max(b[BOTTOM] - a[TOP], a[BOTTOM] - b[TOP], 0.0)
    limit = a[REACH] + b[REACH] + margin
    return dx * dx + dy * dy < limit * limit


@inlined
def find_close_tiles(own: int, used: int, margin: float, tiles: Tiles) -> int:
    """List in `close` the tiles, of those in use, that hold a body near one of tile `own`; return their number."""
    count = 0
    box = tiles.tile[:, own]
    for block in range(tiles.block.shape[1]):
        if may_be_near(box, tiles.block[:, block], margin):
            for tile in range(block * TILE, min(block * TILE + TILE, used)):
                if may_be_near(box, tiles.tile[:, tile], margin):
                    tiles.close[count] = tile
                    count += 1
    return count


@inlined
def find_partners(home: int, closes: int, total: int, margin: float, tiles: Tiles) -> int:
    """Append to `partner` the bodies of a higher index near the one at place `home`; return the new total, -1 without room."""
    member, order, partner = tiles.member, tiles.order, tiles.partner
    i = order[home]
    x, y, reach = member[0, home], member[1, home], member[3, home]
    tiles.span[0, i] = total
    for n in range(closes):
        start = tiles.close[n] * TILE
        for k in range(start, start + TILE):
            dx = member[0, k] - x
            dy = member[1, k] - y
            limit = reach + member[3, k] + margin
            if (order[k] > i) & (dx * dx + dy * dy < limit * limit):
                if total == partner.shape[0]:
                    return -1
                partner[total] = order[k]
                total += 1
    tiles.span[1, i] = total - tiles.span[0, i]
    return total


@inlined
def sort_partners(start: int, count: int, partner: np.ndarray) -> None:
    """Sort `count` partners from `start` on, a few."""
    for k in range(start + 1, start + count):
        body = partner[k]
        m = k
        while m > start and partner[m - 1] > body:
            partner[m] = partner[m - 1]
            m -= 1
        partner[m] = body


@inlined
def find_pairs_in_tiles(bodies: int, margin: float, pairs: np.ndarray, tiles: Tiles) -> int:
    """List the near pairs (pairs, 2) in the order of the physics; return their number, -1 if there is no room for them."""
    used = -(-bodies // TILE)
    total = np.int64(0)  # a literal would be compiled as a kind of its own
    for tile in range(used):
        closes = find_close_tiles(tile, used, margin, tiles)
        for home in range(tile * TILE, min(tile * TILE + TILE, bodies)):
            total = find_partners(home, closes, total, margin, tiles)
            if total < 0:
                return -1
    count = 0
    for i in range(bodies):
        start, partners = tiles.span[0, i], tiles.span[1, i]
        sort_partners(start, partners, tiles.partner)
        for k in range(start, start + partners):
            pairs[count, 0], pairs[count, 1] = i, tiles.partner[k]
            count += 1
    return count
