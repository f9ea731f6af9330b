"""The bodies that may touch something in a control cycle, and its physics steps for them: motion, contacts, walls.

Source: the equations of Enki, see docs/physics.md.

A pair is near if its distance is below the sum of the two reaches. Only near pairs are looked at.
This is exact as long as no body moves farther in the cycle than its reach allows: a pair left out
has a distance of at least the two reaches, each a radius and a largest travel. Every movement is
checked against this; where one exceeds it, the cycle is begun anew with a larger reach, and in the
end with all pairs of all bodies.

A few trials are advanced as one party, so that contacts of different trials can be resolved side by
side.
"""

import math

import numpy as np

from .compile import inlined
from .motion import sines_and_cosines, wrapped
from .tiles import Tiles, find_pairs_in_tiles
from .world import ALL_PAIRS, LANES, Lanes, Pairs, Party, State, World, gather_party, scatter_party

RESTITUTION = 0.9
"""Coefficient of every body; a contact uses the product of two."""

X_A, Y_A, VX_A, VY_A, TURN_A, RADIUS_A, MASS_A, INERTIA_A = range(0, 8 * LANES, LANES)
X_B, Y_B, VX_B, VY_B, TURN_B, RADIUS_B, MASS_B, INERTIA_B = range(8 * LANES, 16 * LANES, LANES)
"""Where in `Party.lane` the numbers of the first lane are; those of the others follow."""

Motion = tuple[float, float, float, float, float]
Disk = tuple[float, float, float]


@inlined
def overlap(i: int, j: int, party: Party) -> bool:
    """Return whether the disks of two members overlap."""
    dx = party.x[i] - party.x[j]
    dy = party.y[i] - party.y[j]
    reach = party.radius[i] + party.radius[j]
    return dx * dx + dy * dy < reach * reach


@inlined
def push_apart(i: int, j: int, party: Party) -> None:
    """Resolve the contact of members i < j, whose disks overlap."""
    (
        (party.x[i], party.y[i], party.vx[i], party.vy[i], party.turn[i]),
        (party.x[j], party.y[j], party.vx[j], party.vy[j], party.turn[j]),
    ) = after_contact(
        (party.x[i], party.y[i], party.vx[i], party.vy[i], party.turn[i]),
        (party.x[j], party.y[j], party.vx[j], party.vy[j], party.turn[j]),
        (party.radius[i], party.inverse_mass[i], party.inverse_inertia[i]),
        (party.radius[j], party.inverse_mass[j], party.inverse_inertia[j]),
    )


@inlined
def after_contact(a: Motion, b: Motion, disk_a: Disk, disk_b: Disk) -> tuple[Motion, Motion]:
    """Return the motion of two overlapping disks after their contact.

    A motion is (x, y, vx, vy, turn rate), a disk (radius, inverse mass, inverse inertia). The disks
    are pushed apart, and exchange an impulse along the normal (nx, ny), from b to a, at the contact
    point on the boundary of b; also when they already separate.
    """
    x_a, y_a, vx_a, vy_a, turn_a = a
    x_b, y_b, vx_b, vy_b, turn_b = b
    radius_a, mass_a, inertia_a = disk_a
    radius_b, mass_b, inertia_b = disk_b
    dx = x_a - x_b
    dy = y_a - y_b
    distance = math.sqrt(dx * dx + dy * dy)
    # Disks with one center are pushed apart along x.
    nx = dx / distance if distance > 0.0 else 1.0
    ny = dy / distance if distance > 0.0 else 0.0
    # Of two bodies that stay where they are both inverse masses are 0: nothing moves.
    masses = mass_a + mass_b if mass_a + mass_b > 0.0 else 1.0
    shift = (radius_a + radius_b - distance) / masses
    x_a = x_a + nx * shift * mass_a
    y_a = y_a + ny * shift * mass_a
    x_b = x_b - nx * shift * mass_b
    y_b = y_b - ny * shift * mass_b
    # From the centers to the contact point, and the relative velocity there.
    contact_x = x_b + nx * radius_b
    contact_y = y_b + ny * radius_b
    ax = contact_x - x_a
    ay = contact_y - y_a
    bx = contact_x - x_b
    by = contact_y - y_b
    relative_x = (vx_a - turn_a * ay) - (vx_b - turn_b * by)
    relative_y = (vy_a + turn_a * ax) - (vy_b + turn_b * bx)
    cross_a = ax * ny - ay * nx
    cross_b = bx * ny - by * nx
    impulse = (
        -(1.0 + RESTITUTION * RESTITUTION)
        * (relative_x * nx + relative_y * ny)
        / (masses + cross_a * cross_a * inertia_a + cross_b * cross_b * inertia_b)
    )
    vx_a = vx_a + impulse * nx * mass_a
    vy_a = vy_a + impulse * ny * mass_a
    turn_a = turn_a + impulse * cross_a * inertia_a
    vx_b = vx_b - impulse * nx * mass_b
    vy_b = vy_b - impulse * ny * mass_b
    turn_b = turn_b - impulse * cross_b * inertia_b
    return (x_a, y_a, vx_a, vy_a, turn_a), (x_b, y_b, vx_b, vy_b, turn_b)


@inlined
def push_all_apart(hits: int, party: Party, lanes: Lanes) -> None:
    """Resolve the contacts of the first `hits` pairs in `lanes.hit`, each of another trial, side by side."""
    lane = lanes.number
    for c in range(hits):
        i = np.uint64(lanes.hit[c, 0])
        j = np.uint64(lanes.hit[c, 1])
        lane[X_A + c] = party.x[i]
        lane[Y_A + c] = party.y[i]
        lane[VX_A + c] = party.vx[i]
        lane[VY_A + c] = party.vy[i]
        lane[TURN_A + c] = party.turn[i]
        lane[RADIUS_A + c] = party.radius[i]
        lane[MASS_A + c] = party.inverse_mass[i]
        lane[INERTIA_A + c] = party.inverse_inertia[i]
        lane[X_B + c] = party.x[j]
        lane[Y_B + c] = party.y[j]
        lane[VX_B + c] = party.vx[j]
        lane[VY_B + c] = party.vy[j]
        lane[TURN_B + c] = party.turn[j]
        lane[RADIUS_B + c] = party.radius[j]
        lane[MASS_B + c] = party.inverse_mass[j]
        lane[INERTIA_B + c] = party.inverse_inertia[j]
    # All lanes, also those without a contact: the loop has a fixed length, and vectorizes.
    for c in range(LANES):
        a, b = after_contact(
            (lane[X_A + c], lane[Y_A + c], lane[VX_A + c], lane[VY_A + c], lane[TURN_A + c]),
            (lane[X_B + c], lane[Y_B + c], lane[VX_B + c], lane[VY_B + c], lane[TURN_B + c]),
            (lane[RADIUS_A + c], lane[MASS_A + c], lane[INERTIA_A + c]),
            (lane[RADIUS_B + c], lane[MASS_B + c], lane[INERTIA_B + c]),
        )
        lane[X_A + c], lane[Y_A + c], lane[VX_A + c], lane[VY_A + c], lane[TURN_A + c] = a
        lane[X_B + c], lane[Y_B + c], lane[VX_B + c], lane[VY_B + c], lane[TURN_B + c] = b
    for c in range(hits):
        i = np.uint64(lanes.hit[c, 0])
        j = np.uint64(lanes.hit[c, 1])
        party.x[i] = lane[X_A + c]
        party.y[i] = lane[Y_A + c]
        party.vx[i] = lane[VX_A + c]
        party.vy[i] = lane[VY_A + c]
        party.turn[i] = lane[TURN_A + c]
        party.x[j] = lane[X_B + c]
        party.y[j] = lane[Y_B + c]
        party.vx[j] = lane[VX_B + c]
        party.vy[j] = lane[VY_B + c]
        party.turn[j] = lane[TURN_B + c]


@inlined
def bounced(position: float, speed: float, radius: float, length: float) -> tuple[float, float]:
    """Return position and speed along one side of the arena, walls at 0 and `length`."""
    if position < radius:
        return radius, -RESTITUTION * speed if speed < 0.0 else speed
    if position > length - radius:
        return length - radius, -RESTITUTION * speed if speed > 0.0 else speed
    return position, speed


@inlined
def keep_inside(i: int, world: World, party: Party) -> None:
    """Put a member that crosses a wall back to touch it and reflect its velocity towards the wall."""
    radius = party.radius[i]
    party.x[i], party.vx[i] = bounced(party.x[i], party.vx[i], radius, world.width)
    party.y[i], party.vy[i] = bounced(party.y[i], party.vy[i], radius, world.height)


@inlined
def slowed(speed_x: float, speed_y: float, friction: float, dt: float) -> tuple[float, float]:
    """Return a gliding velocity after one step of dry and viscous friction."""
    speed = math.sqrt(speed_x * speed_x + speed_y * speed_y)
    if speed < friction * dt or speed == 0.0:
        return 0.0, 0.0
    ax = -friction * speed_x / speed - 0.01 * speed_x
    ay = -friction * speed_y / speed - 0.01 * speed_y
    return speed_x + ax * dt, speed_y + ay * dt


@inlined
def set_robot_velocities(robots: int, dt: float, party: Party) -> None:
    """Give the first `robots` members the velocities commanded, along heading + (turn rate before) dt / 2."""
    angles, sines, cosines = party.work[0], party.work[1], party.work[2]
    for k in range(robots):
        angles[k] = party.heading[k] + party.turn[k] * dt * 0.5
    sines_and_cosines(angles[:robots], sines[:robots], cosines[:robots])
    for k in range(robots):
        party.vx[k] = party.forward[k] * cosines[k]
        party.vy[k] = party.forward[k] * sines[k]
        party.turn[k] = party.command[k]


@inlined
def set_object_velocities(robots: int, members: int, dt: float, party: Party) -> None:
    """Slow down the members after the first `robots`."""
    for k in range(robots, members):
        deceleration = party.deceleration[k]
        party.vx[k], party.vy[k] = slowed(party.vx[k], party.vy[k], deceleration, dt)
        party.turn[k], _ = slowed(party.turn[k], 0.0, deceleration, dt)


@inlined
def strays(k: int, party: Party) -> bool:
    """Return whether a member is farther from its start than its reach allows."""
    dx = party.x[k] - party.start_x[k]
    dy = party.y[k] - party.start_y[k]
    return not dx * dx + dy * dy <= party.travel[k]


@inlined
def advance_positions(members: int, dt: float, party: Party) -> int:
    """Advance positions and headings by a physics step; return the number of members that stray."""
    astray = 0
    for k in range(members):
        party.x[k] += party.vx[k] * dt
        party.y[k] += party.vy[k] * dt
        party.heading[k] = party.heading[k] + party.turn[k] * dt
        astray += strays(k, party)
    return astray


@inlined
def resolve_one_by_one(members: int, listed: int, pairs: np.ndarray, party: Party) -> int:
    """Resolve the contacts of the listed pairs of members, in order.

    Return how often a member was pushed astray.
    """
    count = members * (members - 1) // 2 if listed == ALL_PAIRS else listed
    astray = 0
    i, j = 0, 0
    for k in range(count):
        if listed == ALL_PAIRS:
            j += 1
            if j == members:
                i += 1
                j = i + 1
        else:
            i, j = pairs[k, 0], pairs[k, 1]
        a, b = np.uint64(i), np.uint64(j)  # no index is negative, and none is looked at for that
        if overlap(a, b, party):
            push_apart(a, b, party)
            astray += strays(a, party) + strays(b, party)
    return astray


@inlined
def resolve_side_by_side(trials: int, pairs: Pairs, party: Party, lanes: Lanes) -> int:
    """Resolve the contacts of trials whose pairs are all listed: the first pair of each, the second of each, and so on.

    Returns how often a member was pushed astray. A contact alone is faster without vectors.
    """
    longest = 0
    for g in range(trials):
        longest = max(longest, pairs.number[g])
    astray = 0
    for k in range(longest):
        hits = np.int64(0)  # a literal would be compiled as a kind of its own
        for g in range(trials):
            if k < pairs.number[g]:
                i = np.uint64(pairs.near[g, k, 0])
                j = np.uint64(pairs.near[g, k, 1])
                # The row counts only if the two overlap; else the next pair overwrites it.
                lanes.hit[hits, 0] = i
                lanes.hit[hits, 1] = j
                hits += overlap(i, j, party)
        if hits == 0:
            continue
        if hits == 1:
            push_apart(np.uint64(lanes.hit[0, 0]), np.uint64(lanes.hit[0, 1]), party)
        else:
            push_all_apart(hits, party, lanes)
        for c in range(hits):
            astray += strays(np.uint64(lanes.hit[c, 0]), party)
            astray += strays(np.uint64(lanes.hit[c, 1]), party)
    return astray


@inlined
def finish_step(members: int, world: World, party: Party) -> int:
    """Keep the members inside the arena and wrap their headings.

    Return the number of members that stray.
    """
    astray = 0
    if world.width > 0.0:
        for k in range(members):
            keep_inside(k, world, party)
            astray += strays(k, party)
    for k in range(members):
        party.heading[k] = wrapped(party.heading[k])
    return astray


@inlined
def step_cycle(
    trials: int, robots: int, members: int, every: bool, pairs: Pairs, world: World, party: Party, lanes: Lanes | None,
    tiles: Tiles | None,
) -> bool:  # fmt: skip
    """Advance the members, `robots` of them robots, by a control cycle with the listed pairs of members.

    Returns False, with the cycle incomplete, as soon as a member strays; never if every pair is
    considered.
    """
    dt = world.interval / world.substeps
    for _ in range(world.substeps):
        set_robot_velocities(robots, dt, party)
        set_object_velocities(robots, members, dt, party)
        astray = advance_positions(members, dt, party)
        if astray == 0 or every:
            if lanes is not None:
                astray = resolve_side_by_side(trials, pairs, party, lanes)
            if tiles is not None:
                astray = resolve_one_by_one(members, pairs.number[0], pairs.near[0], party)
        astray += finish_step(members, world, party)
        if astray > 0 and not every:
            return False
    return True


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
    start: int, stop: int, world: World, state: State, pairs: Pairs, party: Party, lanes: Lanes | None,
    tiles: Tiles | None,
) -> None:  # fmt: skip
    """Advance by one control cycle the bodies of the trials in these slots that may touch something or move by themselves.

    All other robots are left for `glide_free_robots`. If a body strays, nothing but marks has
    changed; the trials are then advanced one by one, and one trial with larger margins, in the end
    with every pair.
    """
    w = start
    beyond = stop
    attempt = np.int64(0)  # a literal would be compiled as a kind of its own
    while w < stop:
        margin = list_involved(w, beyond, attempt, world, state, pairs, lanes, tiles)
        robots, members = gather_party(w, beyond, margin, world, state, pairs, party)
        every = margin == np.inf
        if step_cycle(beyond - w, robots, members, every, pairs, world, party, lanes, tiles):
            scatter_party(w, members, world, state, party)
            w = beyond
            beyond = beyond + 1
            attempt = np.int64(0)
        elif beyond - w > 1:
            beyond = w + 1
        else:
            attempt += 1


@inlined
def list_involved(
    start: int, stop: int, attempt: int, world: World, state: State, pairs: Pairs, lanes: Lanes | None,
    tiles: Tiles | None,
) -> float:  # fmt: skip
    """Mark the bodies of these trials that may touch something or move by themselves, and list their near pairs.

    Returns the margin: that of the attempt; inf where there is no room for the pairs, which one
    trial of many bodies alone can have, so that every pair is looked at.
    """
    margin = MARGINS[attempt]
    for w in range(start, stop):
        mark_moving_objects(w, world, state)
        if world.width > 0.0:
            mark_near_walls(w, world, state)
        listed_pairs = pairs.near[w - start]
        listed = 0
        if attempt > 0 or state.crowd[w] > 0.0 or world.bodies > world.robots or world.width > 0.0:
            if lanes is not None:
                listed = find_near_pairs(w, MARGINS[attempt], world, state, listed_pairs)
            if tiles is not None:
                listed = find_pairs_in_tiles(world.bodies, MARGINS[attempt], listed_pairs, tiles)
        mark_pairs(listed, w, state, listed_pairs)
        pairs.number[w - start] = listed
        if listed == ALL_PAIRS:
            margin = np.inf
    return margin
