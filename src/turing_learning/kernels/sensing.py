"""Line of sight: a ray from a robot's centre along its heading, and the first item it meets."""

import math

import numpy as np

from .compile import inlined
from .sectors import sense_in_sectors
from .world import State, World


@inlined
def look_at(i: int, j: int, radius: float, state: State) -> None:
    """Count body `j`, in every slot, if robot `i` has it in its line of sight, and if the two are within reach."""
    x, y, cosine, sine, reach, seen = (
        state.x[i],
        state.y[i],
        state.cosine[i],
        state.sine[i],
        state.reach[i],
        state.seen[i],
    )
    other_x, other_y, other_reach, crowd = state.x[j], state.y[j], state.reach[j], state.crowd
    for w in range(crowd.shape[0]):
        dx = other_x[w] - x[w]
        dy = other_y[w] - y[w]
        limit = reach[w] + other_reach[w]
        ahead = dx * cosine[w] + dy * sine[w] > 0.0
        seen[w] += 1.0 if ahead & (abs(dx * sine[w] - dy * cosine[w]) <= radius) else 0.0
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

    Two bodies are within reach if their distance is below the sum of their reaches. `sectors` are those of the world: what an
    argument that is None leaves out is not compiled.
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
