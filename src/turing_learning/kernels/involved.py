"""Which bodies may touch something in a control cycle, and that cycle for them.

A pair is near if its distance is below the sum of the two reaches; see `stepping` for why no other pair needs to be looked at.

A few trials are advanced as one party, so that contacts of different trials can be resolved side by side, see `stepping`.
"""

import numpy as np

from .compile import inlined
from .stepping import step_cycle
from .tiles import Tiles, find_pairs_in_tiles
from .world import ALL_PAIRS, Lanes, Pairs, Party, State, World, gather_party, scatter_party

MARGINS = (0.0, 8.0, np.inf)
"""Additions to the sum of two reaches, tried in turn (cm): a crowd may push its bodies farther than they drive."""


@inlined
def find_near_pairs(w: int, margin: float, world: World, state: State, pairs: np.ndarray) -> int:
    """List the pairs within reach, and a margin (cm), of each other in the order of the physics; return their number.

    Returns ALL_PAIRS if there are more than `pairs` has room for.
    """
    count = 0
    for i in range(world.bodies):
        for j in range(i + 1, world.bodies):
            dx = state.x[j, w] - state.x[i, w]
            dy = state.y[j, w] - state.y[i, w]
            limit = state.reach[i, w] + state.reach[j, w] + margin
            if dx * dx + dy * dy < limit * limit:
                if count == pairs.shape[0]:
                    return ALL_PAIRS
                pairs[count, 0] = i
                pairs[count, 1] = j
                count += 1
    return count


@inlined
def mark_pairs(listed: int, w: int, state: State, pairs: np.ndarray) -> None:
    """Mark the bodies of the listed pairs; all bodies if all pairs count."""
    for k in range(listed):
        state.near[pairs[k, 0], w] = 1
        state.near[pairs[k, 1], w] = 1
    if listed == ALL_PAIRS:
        for i in range(state.near.shape[0]):
            state.near[i, w] = 1


@inlined
def mark_moving_objects(w: int, world: World, state: State) -> None:
    """Mark the objects that move."""
    for i in range(world.robots, world.bodies):
        if state.vx[i, w] != 0.0 or state.vy[i, w] != 0.0 or state.turn[i, w] != 0.0:
            state.near[i, w] = 1


@inlined
def mark_near_walls(w: int, world: World, state: State) -> None:
    """Mark the bodies that may reach a wall."""
    for i in range(world.bodies):
        x, y, reach = state.x[i, w], state.y[i, w], state.reach[i, w]
        if x < reach or y < reach or x > world.width - reach or y > world.height - reach:
            state.near[i, w] = 1


@inlined
def advance_involved(
    first: int, stop: int, world: World, state: State, pairs: Pairs, party: Party, lanes: Lanes | None,
    tiles: Tiles | None,
) -> None:  # fmt: skip
    """Advance by one control cycle the bodies of the trials in these slots that may touch something or move by themselves.

    All other robots are left for `glide_free_robots`. If a body strays, nothing but marks has changed; the trials are then
    advanced one by one, and one trial with larger margins, in the end with every pair.
    """
    w, end, attempt = first, stop, np.int64(0)  # a literal would be compiled as a kind of its own
    while w < stop:
        margin = list_involved(w, end, attempt, world, state, pairs, lanes, tiles)
        robots, members = gather_party(w, end, margin, world, state, pairs, party)
        if step_cycle(end - w, robots, members, margin == np.inf, pairs, world, party, lanes, tiles):
            scatter_party(w, members, world, state, party)
            w, end, attempt = end, end + 1, np.int64(0)
        elif end - w > 1:
            end = w + 1
        else:
            attempt += 1


@inlined
def list_involved(
    first: int, stop: int, attempt: int, world: World, state: State, pairs: Pairs, lanes: Lanes | None,
    tiles: Tiles | None,
) -> float:  # fmt: skip
    """Mark the bodies of these trials that may touch something or move by themselves, and list their near pairs.

    Returns the margin: that of the attempt; inf where there is no room for the pairs, which one trial of many bodies alone can
    have, so that every pair is looked at.
    """
    margin = MARGINS[attempt]
    for w in range(first, stop):
        mark_moving_objects(w, world, state)
        if world.width > 0.0:
            mark_near_walls(w, world, state)
        near, listed = pairs.near[w - first], 0
        if attempt > 0 or state.crowd[w] > 0.0 or world.bodies > world.robots or world.width > 0.0:
            if lanes is not None:
                listed = find_near_pairs(w, MARGINS[attempt], world, state, near)
            if tiles is not None:
                listed = find_pairs_in_tiles(world.bodies, MARGINS[attempt], near, tiles)
        mark_pairs(listed, w, state, near)
        pairs.number[w - first] = listed
        if listed == ALL_PAIRS:
            margin = np.inf
    return margin
