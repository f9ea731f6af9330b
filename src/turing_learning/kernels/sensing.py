"""Sensors of robots: lines of sight, rays along the headings, and fields of view, sectors around them.

In a sector, a robot sees the nearest item of which any part lies in it. Seen from a robot, a body's
centre is
`ahead` along the heading and `off` to a side. The sector ends on that side at the angle h, half the
field of view, and from its border the centre is

    along   = ahead cos h + |off| sin h
    outside = |off| cos h - ahead sin h

The centre lies in the sector if outside < 0; then the nearest visible point is the nearest of the
disk. Otherwise a part of the disk is visible if the border meets it (along > 0, outside <= r),
first at along - sqrt(r r - outside outside), or if the robot's centre lies in the disk. A field of
0 has no inside: along = ahead and outside = |off|, to the last bit, the line of sight.
"""

import math

import numpy as np

from .compile import inlined
from .world import State, World


@inlined
def nearest_visible(ahead: float, off: float, radius: float, cosine: float, sine: float) -> float:
    """Return the signed distance of the nearest visible point of a disk; inf if no part of it is in view.

    `cosine` and `sine` are those of half the field of view.
    """
    side = abs(off)
    along = ahead * cosine + side * sine
    outside = side * cosine - ahead * sine
    square = ahead * ahead + side * side
    within = outside < 0.0
    met = (along > 0.0) & (outside <= radius)
    around = (sine > 0.0) & (square <= radius * radius)
    root = math.sqrt(square if within else max(radius * radius - outside * outside, 0.0))
    distance = root - radius if within else along - root
    return distance if within | met | around else np.inf


@inlined
def look_into(i: int, j: int, world: World, state: State) -> None:
    """Let robot `i` read body `j`, in every slot, if that is the nearest so far.

    Count the two if they are within reach.
    """
    x, y, reach = state.x[i], state.y[i], state.reach[i]
    cosine, sine = state.cosine[i], state.sine[i]
    view_cosine, view_sine = state.view_cosine[i], state.view_sine[i]
    nearest, reading = state.seen[i], state.reading[i]
    other_x, other_y, other_reach = state.x[j], state.y[j], state.reach[j]
    radius = world.sight_radius[j]
    reading_of_body = world.reading[j]
    crowd = state.crowd
    for w in range(crowd.shape[0]):
        dx = other_x[w] - x[w]
        dy = other_y[w] - y[w]
        limit = reach[w] + other_reach[w]
        ahead = dx * cosine[w] + dy * sine[w]
        off = dx * sine[w] - dy * cosine[w]
        distance = nearest_visible(ahead, off, radius, view_cosine[w], view_sine[w])
        closer = (distance < nearest[w]) & (radius >= 0.0)
        nearest[w] = distance if closer else nearest[w]
        reading[w] = reading_of_body if closer else reading[w]
        crowd[w] += 1.0 if dx * dx + dy * dy < limit * limit else 0.0


@inlined
def sense_in_sectors(world: World, state: State) -> None:
    """Read the sensors of every robot in every slot, and count the pairs within reach, as `sensing.sense` does."""
    state.seen[:] = np.inf
    state.reading[:] = 0
    state.crowd[:] = 0.0
    for i in range(world.robots):
        for j in range(world.bodies):
            if i != j:
                look_into(i, j, world, state)


@inlined
def sense_one_trial(world: World, state: State) -> None:
    """Read the sensor of every robot of the only trial: the inner loop is over the bodies, of which there are many."""
    x, y = state.x.reshape(-1), state.y.reshape(-1)
    sight_radius = world.sight_radius
    distance = state.work[0].reshape(-1)
    for i in range(world.robots):
        cosine, sine = state.cosine[i, 0], state.sine[i, 0]
        view_cosine, view_sine = state.view_cosine[i, 0], state.view_sine[i, 0]
        for j in range(world.bodies):
            dx = x[j] - x[i]
            dy = y[j] - y[i]
            ahead = dx * cosine + dy * sine
            off = dx * sine - dy * cosine
            visible = nearest_visible(ahead, off, sight_radius[j], view_cosine, view_sine)
            distance[j] = visible if (sight_radius[j] >= 0.0) & (j != i) else np.inf
        state.reading[i, 0] = reading_of_nearest(distance, world)


@inlined
def reading_of_nearest(distance: np.ndarray, world: World) -> int:
    """Return the sensor state that the first of the nearest bodies gives.

    0 if all distances (bodies,) are infinite.
    """
    nearest = np.inf
    reading = 0
    for j in range(world.bodies):
        if distance[j] < nearest:
            nearest = distance[j]
            reading = world.reading[j]
    return reading


@inlined
def open_view(sectors: np.ndarray | None, trial: int, w: int, state: State) -> None:
    """Give the robots in slot `w` the fields of view of a trial, if there are any."""
    if sectors is not None:
        for i in range(sectors.shape[2]):
            state.view_cosine[i, w] = sectors[0, trial, i]
            state.view_sine[i, w] = sectors[1, trial, i]


@inlined
def look_at(i: int, j: int, radius: float, state: State) -> None:
    """Count body `j`, in every slot, if robot `i` has it in its line of sight, and if the two are within reach."""
    x, y, reach = state.x[i], state.y[i], state.reach[i]
    cosine, sine = state.cosine[i], state.sine[i]
    other_x, other_y, other_reach = state.x[j], state.y[j], state.reach[j]
    in_sight = state.seen[i]
    crowd = state.crowd
    for w in range(crowd.shape[0]):
        dx = other_x[w] - x[w]
        dy = other_y[w] - y[w]
        limit = reach[w] + other_reach[w]
        ahead = dx * cosine[w] + dy * sine[w] > 0.0
        in_sight[w] += 1.0 if ahead & (abs(dx * sine[w] - dy * cosine[w]) <= radius) else 0.0
        crowd[w] += 1.0 if dx * dx + dy * dy < limit * limit else 0.0


@inlined
def first_reading(i: int, w: int, world: World, state: State) -> int:
    """Return the sensor state that the body with the smallest signed entry distance gives to robot `i` in slot `w`."""
    x, y, c, s = state.x[i, w], state.y[i, w], state.cosine[i, w], state.sine[i, w]
    nearest = np.inf
    reading = 0
    for j in range(world.bodies):
        dx = state.x[j, w] - x
        dy = state.y[j, w] - y
        ahead = dx * c + dy * s
        off = dx * s - dy * c
        radius = world.sight_radius[j]
        if ahead > 0.0 and abs(off) <= radius:
            entry = ahead - math.sqrt(radius * radius - off * off)
            if entry < nearest:
                nearest = entry
                reading = world.reading[j]
    return reading


@inlined
def sense(sectors: np.ndarray | None, world: World, state: State) -> None:
    """Read the sensor of every robot in every slot, and count the pairs within reach (`state.crowd`).

    Two bodies are within reach if their distance is below the sum of their reaches. `sectors` are
    those of the world: what an argument that is None leaves out is not compiled.
    """
    if sectors is None:
        sense_on_rays(world, state)
    else:
        sense_in_sectors(world, state)


@inlined
def sense_on_rays(world: World, state: State) -> None:
    """Do so where all robots have a line of sight."""
    state.seen[:] = 0.0
    state.crowd[:] = 0.0
    for i in range(world.robots):
        for j in range(world.bodies):
            if i != j:
                look_at(i, j, world.sight_radius[j], state)
        for w in range(state.crowd.shape[0]):
            state.reading[i, w] = first_reading(i, w, world, state) if state.seen[i, w] > 0.0 else 0
