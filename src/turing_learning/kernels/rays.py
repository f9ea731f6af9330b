"""The first item in a line of sight among many bodies, found through tiles.

Why this is exact. For a ray from (x, y) along (c, s), `sensing.first_reading` computes for a body at (xj, yj), with dx = xj - x
and dy = yj - y, the numbers off = dx s - dy c and ahead = dx c + dy s, each operation rounded to the nearest float. Such
rounding is monotone: if xj grows, so does (weakly) the rounded dx, then the rounded dx s if s >= 0 (else it falls), and so on.
The computed, not only the true, off and ahead of every body in a box therefore lie between those computed in the same way for
two of its corners, to the last bit, for coordinates of any size. A body is met if ahead > 0 and |off| <= r. The square root of
the rounded r r is r, so that the entry distance, ahead - sqrt(r r - off off), is at least ahead - r, and that of any body of
the box at least the lowest corner's ahead minus the largest r. Boxes are left out by these bounds alone. Of two bodies at the
same entry distance the plain loop takes the first, and so does this one, in whichever order it meets them. No product may be
fused with a sum here or there (`contracted`), because that would round differently.
"""

import math

import numpy as np

from .compile import inlined
from .tiles import BOTTOM, LEFT, RIGHT, SIGHT, TILE, TOP, Tiles
from .world import World

FARTHEST = float(np.finfo(np.float64).max)


@inlined
def bound_entries(
    boxes: np.ndarray, start: int, stop: int, x: float, y: float, c: float, s: float, bounds: np.ndarray
) -> None:
    """Fill `bounds` with the least signed entry distance of the ray in boxes start ... stop - 1; inf where it meets none."""
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
    start: int, x: float, y: float, c: float, s: float, nearest: float, first: int, tiles: Tiles
) -> tuple[float, int]:
    """Return entry distance and index of the first body met, of (nearest, first) and the bodies of a tile."""
    for k in range(start, start + TILE):
        dx = tiles.member[0, k] - x
        dy = tiles.member[1, k] - y
        ahead = dx * c + dy * s
        off = dx * s - dy * c
        radius = tiles.member[2, k]
        if ahead > 0.0 and abs(off) <= radius:
            entry = ahead - math.sqrt(radius * radius - off * off)
            if entry < nearest or (entry == nearest and tiles.order[k] < first):
                nearest, first = entry, tiles.order[k]
    return nearest, first


@inlined
def first_in_sight(i: int, c: float, s: float, tiles: Tiles) -> int:
    """Return the body with the smallest signed entry distance on the ray of body `i` along (c, s); -1 if there is none.

    The block of `i` is searched first: what is met there lets most others be left out.
    """
    home = tiles.home[i]
    x, y = tiles.member[0, home], tiles.member[1, home]
    own = home // (TILE * TILE)
    of_block, of_tile = tiles.bound[0], tiles.bound[1]
    bound_entries(tiles.block, np.int64(0), tiles.block.shape[1], x, y, c, s, of_block)
    nearest, first = FARTHEST, np.int64(-1)  # literals would be compiled as kinds of their own
    for n in range(tiles.block.shape[1]):
        block = own if n == 0 else n - 1 if n <= own else n
        if of_block[block] <= nearest:
            bound_entries(tiles.tile, block * TILE, block * TILE + TILE, x, y, c, s, of_tile)
            for tile in range(block * TILE, block * TILE + TILE):
                if of_tile[tile] <= nearest and meets_any(tiles.member, tile * TILE, x, y, c, s):
                    nearest, first = first_of_tile(tile * TILE, x, y, c, s, nearest, first, tiles)
    return int(first)


@inlined
def read_sensors(cosine: np.ndarray, sine: np.ndarray, reading: np.ndarray, world: World, tiles: Tiles) -> None:
    """Fill the readings (bodies,) of all robots, whose headings have the given cosines and sines (bodies,)."""
    for i in range(world.robots):
        first = first_in_sight(i, cosine[i], sine[i], tiles)
        reading[i] = world.reading[first] if first >= 0 else 0
