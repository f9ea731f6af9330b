"""Bodies of one large trial in tiles of neighbors, so that a search can leave out whole tiles.

The bodies are put in an order in which every TILE consecutive ones, and every TILE consecutive
tiles (a block), lie close together. Each tile and each block keeps the box around its bodies'
centres and the largest sight radius and reach in it. Which bodies share a tile is a matter of speed
alone: every search is exact for any order, so that the order is renewed now and then only, while
the boxes are renewed in every cycle. Boxes adapt to where the bodies are, be they 1e12 cm apart.

Why the first item in a line of sight is exact. For a ray from (x, y) along (c, s),
`sensing.first_reading` computes for a body at (xj, yj), with dx = xj - x and dy = yj - y, the
numbers off = dx s - dy c and ahead = dx c + dy s, each operation rounded to the nearest float. Such
rounding is monotone: if xj grows, so does (weakly) the rounded dx, then the rounded dx s if s >= 0
(else it falls), and so on. The computed, not only the true, off and ahead of every body in a box
therefore lie between those computed in the same way for two of its corners, to the last bit, for
coordinates of any size. A body is met if ahead > 0 and |off| <= r. The square root of the rounded r
r is r, so that the entry distance, ahead - sqrt(r r - off off), is at least ahead - r, and that of
any body of the box at least the lowest corner's ahead minus the largest r. Boxes are left out by
these bounds alone. Of two bodies at the same entry distance the plain loop takes the first, and so
does this one, in whichever order it meets them. No product may be fused with a sum here or there
(`contracted`), because that would round differently.

Why the near pairs are exact. A pair is near if its rounded dx dx + dy dy is below the rounded
square of reach + reach + margin. Rounding is monotone (see above), so the gap between two boxes,
computed in the same way from their sides, bounds this from below, and the sum of the two boxes'
largest reaches bounds the limit from above, to the last bit. A pair of tiles is left out by these
bounds alone. The partners of each body are then sorted, so that the pairs i < j come in the order
of the physics.
"""

import math
from typing import NamedTuple

import numpy as np

from .compile import inlined
from .world import World

TILE = 8
"""Bodies in a tile, and tiles in a block."""
REORDER_CYCLES = 10
"""Control cycles after which the order of the bodies is renewed."""

LEFT, RIGHT, BOTTOM, TOP, SIGHT, REACH = range(6)  # rows of `tile` and `block`


class Tiles(NamedTuple):
    """The bodies of one trial in tiles, and room to search; places are padded to whole blocks."""

    order: np.ndarray  # (places,) int64, the body at each place; -1 where there is none
    home: np.ndarray  # (bodies,) int64, the place of each body
    # (4, places) x, y (cm), sight radius (cm; -inf where there is no body), reach (cm)
    member: np.ndarray
    tile: np.ndarray  # (6, tiles) box around the centres, largest sight radius and reach (cm)
    block: np.ndarray  # (6, blocks) the same
    bound: np.ndarray  # (2, tiles) least signed entry distance of a ray in each block and tile
    close: np.ndarray  # (tiles,) int64, tiles that are near a tile
    # (2, bodies) int64, where a body's partners start in `partner`, and their number
    span: np.ndarray
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
    """Sort the bodies at places start to stop - 1 by their key (Shell 1959, gaps of Tokuda 1992)."""
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
def sort_in_strips(
    order: np.ndarray, start: int, stop: int, size: int, x: np.ndarray, y: np.ndarray
) -> None:
    """Order the bodies at places start ... stop - 1 so that every `size` consecutive ones fill a square, roughly.

    Source: sort-tile-recursive packing, Leutenegger, Lopez and Edgington (1997).
    """
    pieces = -(-(stop - start) // size)
    strips = math.ceil(math.sqrt(pieces))
    width = -(-pieces // strips) * size
    for k in range(strips + 1):  # the whole along x, then each strip along y
        strip_start = start if k == 0 else min(start + (k - 1) * width, stop)
        strip_stop = stop if k == 0 else min(strip_start + width, stop)
        sort_places(order, strip_start, strip_stop, x if k == 0 else y)


@inlined
def renew_order(x: np.ndarray, y: np.ndarray, tiles: Tiles) -> None:
    """Put bodies that are close together (x, y: (bodies,)) into the same blocks, and in these into the same tiles."""
    bodies = x.shape[0]
    bodies_of_block = TILE * TILE
    for n in range(-1, tiles.block.shape[1]):  # blocks, then the tiles of each block
        start = 0 if n < 0 else n * bodies_of_block
        stop = bodies if n < 0 else min(start + bodies_of_block, bodies)
        sort_in_strips(tiles.order, start, stop, bodies_of_block if n < 0 else TILE, x, y)
    for k in range(bodies):
        tiles.home[tiles.order[k]] = k


@inlined
def enclose(
    source: np.ndarray, start: int, rows: tuple[int, int, int, int, int, int], box: np.ndarray
) -> None:
    """Write the box (6,) around TILE columns of `source`.

    `rows` hold left, right, bottom, top, sight radius and reach.
    """
    left = bottom = np.inf
    right = top = sight = reach = -np.inf
    for k in range(start, start + TILE):
        left = min(left, source[rows[0], k])
        right = max(right, source[rows[1], k])
        bottom = min(bottom, source[rows[2], k])
        top = max(top, source[rows[3], k])
        sight = max(sight, source[rows[4], k])
        reach = max(reach, source[rows[5], k])
    box[LEFT] = left
    box[RIGHT] = right
    box[BOTTOM] = bottom
    box[TOP] = top
    box[SIGHT] = sight
    box[REACH] = reach


@inlined
def renew_boxes(
    x: np.ndarray, y: np.ndarray, sight: np.ndarray, reach: np.ndarray, tiles: Tiles
) -> None:
    """Copy positions, sight radii and reaches (bodies,) to the bodies' places and renew the boxes.

    A place without a body takes the position of the last one, so that it widens no box, and can be
    neither seen nor met.
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


FARTHEST = float(np.finfo(np.float64).max)


@inlined
def bound_entries(
    boxes: np.ndarray,
    start: int,
    stop: int,
    x: float,
    y: float,
    c: float,
    s: float,
    bounds: np.ndarray,
) -> None:
    """Fill `bounds` with the least signed entry distance of the ray in boxes start ... stop - 1.

    Inf where it meets none.
    """
    west, east = boxes[LEFT if s >= 0.0 else RIGHT], boxes[RIGHT if s >= 0.0 else LEFT]
    south, north = boxes[TOP if c >= 0.0 else BOTTOM], boxes[BOTTOM if c >= 0.0 else TOP]
    near_x, far_x = boxes[LEFT if c >= 0.0 else RIGHT], boxes[RIGHT if c >= 0.0 else LEFT]
    near_y, far_y = boxes[BOTTOM if s >= 0.0 else TOP], boxes[TOP if s >= 0.0 else BOTTOM]
    sight = boxes[SIGHT]
    for k in range(start, stop):
        lowest = (west[k] - x) * s - (south[k] - y) * c
        highest = (east[k] - x) * s - (north[k] - y) * c
        nearest = (near_x[k] - x) * c + (near_y[k] - y) * s
        farthest = (far_x[k] - x) * c + (far_y[k] - y) * s
        met = (lowest <= sight[k]) & (highest >= -sight[k]) & (farthest > 0.0)
        bounds[k] = nearest - sight[k] if met else np.inf


@inlined
def meets_any(member: np.ndarray, start: int, x: float, y: float, c: float, s: float) -> bool:
    """Return whether the ray meets a body of the tile that begins at place `start`."""
    other_x, other_y, sight = member[0], member[1], member[2]
    met = 0
    for k in range(start, start + TILE):
        dx = other_x[k] - x
        dy = other_y[k] - y
        met += (dx * c + dy * s > 0.0) & (abs(dx * s - dy * c) <= sight[k])
    return met > 0


@inlined
def first_of_tile(
    start: int, x: float, y: float, c: float, s: float, nearest: float, met: int, tiles: Tiles
) -> tuple[float, int]:
    """Return entry distance and index of the first body met, of (nearest, met) and the bodies of a tile."""
    for k in range(start, start + TILE):
        dx = tiles.member[0, k] - x
        dy = tiles.member[1, k] - y
        ahead = dx * c + dy * s
        off = dx * s - dy * c
        radius = tiles.member[2, k]
        if ahead > 0.0 and abs(off) <= radius:
            entry = ahead - math.sqrt(radius * radius - off * off)
            if entry < nearest or (entry == nearest and tiles.order[k] < met):
                nearest = entry
                met = tiles.order[k]
    return nearest, met


@inlined
def first_in_sight(i: int, c: float, s: float, tiles: Tiles) -> int:
    """Return the body with the smallest signed entry distance on the ray of body `i` along (c, s); -1 if there is none.

    The block of `i` is searched first: what is met there lets most others be left out.
    """
    home = tiles.home[i]
    x, y = tiles.member[0, home], tiles.member[1, home]
    home_block = home // (TILE * TILE)
    of_block, of_tile = tiles.bound[0], tiles.bound[1]
    bound_entries(tiles.block, np.int64(0), tiles.block.shape[1], x, y, c, s, of_block)
    nearest = FARTHEST
    met = np.int64(-1)  # a literal would be compiled as a kind of its own
    for n in range(tiles.block.shape[1]):
        block = home_block if n == 0 else n - 1 if n <= home_block else n
        if of_block[block] <= nearest:
            bound_entries(tiles.tile, block * TILE, block * TILE + TILE, x, y, c, s, of_tile)
            for tile in range(block * TILE, block * TILE + TILE):
                if of_tile[tile] <= nearest and meets_any(tiles.member, tile * TILE, x, y, c, s):
                    nearest, met = first_of_tile(tile * TILE, x, y, c, s, nearest, met, tiles)
    return int(met)


@inlined
def read_sensors(
    cosine: np.ndarray, sine: np.ndarray, reading: np.ndarray, world: World, tiles: Tiles
) -> None:
    """Fill the readings (bodies,) of all robots, whose headings have the given cosines and sines (bodies,)."""
    for i in range(world.robots):
        met = first_in_sight(i, cosine[i], sine[i], tiles)
        reading[i] = world.reading[met] if met >= 0 else 0


@inlined
def may_be_near(a: np.ndarray, b: np.ndarray, margin: float) -> bool:
    """Return whether a body of box `a` (6,) can be within reach, and a margin (cm), of one of box `b`."""
    dx = max(b[LEFT] - a[RIGHT], a[LEFT] - b[RIGHT], 0.0)
    dy = max(b[BOTTOM] - a[TOP], a[BOTTOM] - b[TOP], 0.0)
    limit = a[REACH] + b[REACH] + margin
    return dx * dx + dy * dy < limit * limit


@inlined
def find_close_tiles(own_tile: int, tiles_used: int, margin: float, tiles: Tiles) -> int:
    """List in `close` the tiles, of those in use, that hold a body near one of tile `own_tile`.

    Return their number.
    """
    count = 0
    box = tiles.tile[:, own_tile]
    for block in range(tiles.block.shape[1]):
        if may_be_near(box, tiles.block[:, block], margin):
            for tile in range(block * TILE, min(block * TILE + TILE, tiles_used)):
                if may_be_near(box, tiles.tile[:, tile], margin):
                    tiles.close[count] = tile
                    count += 1
    return count


@inlined
def find_partners(home: int, closes: int, total: int, margin: float, tiles: Tiles) -> int:
    """Append to `partner` the bodies of a higher index near the one at place `home`.

    Return the new total, -1 without room.
    """
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
    """List the near pairs (pairs, 2) in the order of the physics.

    Return their number, -1 if there is no room for them.
    """
    tiles_used = -(-bodies // TILE)
    total = np.int64(0)  # a literal would be compiled as a kind of its own
    for tile in range(tiles_used):
        closes = find_close_tiles(tile, tiles_used, margin, tiles)
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
