"""Which bodies may touch something in a control cycle, and that cycle for them.

A pair is near if its distance is below the sum of the two reaches; see `stepping` for why no other pair needs to be looked at.
"""

import numpy as np

from .compile import inlined
from .neighbors import find_pairs_in_tiles
from .party import Party, gather_party, scatter_party
from .stepping import ALL_PAIRS, step_cycle
from .tiles import Tiles
from .world import State, World

MARGINS = (0.0, 8.0)
"""Additions to the sum of two reaches, tried in turn (cm): a crowd may push its bodies farther than they drive."""
PAIRS_PER_BODY = 64
"""Near pairs for which there is room; where there are more, all pairs are looked at, without a list."""


def new_pairs(bodies: int) -> np.ndarray:
    """Allocate a list (pairs, 2) for the near pairs of a trial; it grows with the number of bodies, not with its square."""
    return np.zeros((max(min(bodies * (bodies - 1) // 2, PAIRS_PER_BODY * bodies), 1), 2), np.int64)


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
def number_members(listed: int, pairs: np.ndarray, place: np.ndarray) -> None:
    """Replace the bodies of the listed pairs by the members of the party that they are."""
    for k in range(listed):
        pairs[k, 0], pairs[k, 1] = place[pairs[k, 0]], place[pairs[k, 1]]


@inlined
def clear_marks(state: State) -> None:
    """Mark no body."""
    for i in range(state.near.shape[0]):
        for w in range(state.near.shape[1]):
            state.near[i, w] = 0


@inlined
def may_touch(w: int, world: World, state: State) -> bool:
    """Return whether anything but free motion is possible in a trial."""
    return state.crowd[w] > 0.0 or world.bodies > world.robots or world.width > 0.0


@inlined
def list_pairs(w: int, margin: float, world: World, state: State, pairs: np.ndarray, tiles: Tiles | None) -> int:
    """List the near pairs of a trial, through its tiles if it has any; return their number."""
    if tiles is None:
        return find_near_pairs(w, margin, world, state, pairs)
    return find_pairs_in_tiles(world.bodies, margin, pairs, tiles)


@inlined
def count_robots(members: int, world: World, party: Party) -> int:
    """Return how many members of the party are robots."""
    robots = members
    while robots > 0 and party.body[robots - 1] >= world.robots:
        robots -= 1
    return robots


@inlined
def advance_involved(w: int, world: World, state: State, pairs: np.ndarray, party: Party, tiles: Tiles | None) -> None:
    """Advance by one control cycle the bodies of a trial that may touch something or move by themselves.

    All other robots are left for `glide_free_robots`.
    """
    mark_moving_objects(w, world, state)
    if world.width > 0.0:
        mark_near_walls(w, world, state)
    for attempt in range(len(MARGINS) + 1):
        margin = MARGINS[min(attempt, len(MARGINS) - 1)]
        listed = list_pairs(w, margin, world, state, pairs, tiles) if attempt < len(MARGINS) else ALL_PAIRS
        mark_pairs(listed, w, state, pairs)
        members = gather_party(w, margin, world, state, party)
        number_members(listed, pairs, party.place)
        robots = count_robots(members, world, party)
        if members == 0 or step_cycle(robots, members, listed, pairs, world, party):
            scatter_party(w, members, state, party)
            break
