"""Contacts of disks with each other and with walls. Source: the equations of Enki, see docs/physics.md."""

import math

from .compile import inlined
from .world import State, World

RESTITUTION = 0.9
"""Coefficient of every body; a contact uses the product of two."""


@inlined
def push_apart(i: int, j: int, w: int, world: World, state: State) -> bool:
    """Resolve the contact of bodies i < j if their disks overlap; return whether they did."""
    dx = state.x[i, w] - state.x[j, w]
    dy = state.y[i, w] - state.y[j, w]
    reach = world.radius[i] + world.radius[j]
    square = dx * dx + dy * dy
    if not square < reach * reach:
        return False
    distance = math.sqrt(square)
    if distance > 0.0:
        nx, ny = dx / distance, dy / distance
    else:
        nx, ny = 1.0, 0.0
    inverse_mass = world.inverse_mass[i] + world.inverse_mass[j]
    shift = (reach - distance) / inverse_mass
    state.x[i, w] += nx * shift * world.inverse_mass[i]
    state.y[i, w] += ny * shift * world.inverse_mass[i]
    state.x[j, w] -= nx * shift * world.inverse_mass[j]
    state.y[j, w] -= ny * shift * world.inverse_mass[j]
    exchange_impulse(i, j, w, nx, ny, world, state)
    return True


@inlined
def exchange_impulse(i: int, j: int, w: int, nx: float, ny: float, world: World, state: State) -> None:
    """Exchange an impulse along the normal (nx, ny), from j to i, at the contact point on the boundary of j.

    Applied also when the bodies already separate.
    """
    contact_x = state.x[j, w] + nx * world.radius[j]
    contact_y = state.y[j, w] + ny * world.radius[j]
    ax, ay = contact_x - state.x[i, w], contact_y - state.y[i, w]
    bx, by = contact_x - state.x[j, w], contact_y - state.y[j, w]
    relative_x = (state.vx[i, w] - state.turn[i, w] * ay) - (state.vx[j, w] - state.turn[j, w] * by)
    relative_y = (state.vy[i, w] + state.turn[i, w] * ax) - (state.vy[j, w] + state.turn[j, w] * bx)
    cross_a = ax * ny - ay * nx
    cross_b = bx * ny - by * nx
    impulse = (
        -(1.0 + RESTITUTION * RESTITUTION)
        * (relative_x * nx + relative_y * ny)
        / (
            world.inverse_mass[i]
            + world.inverse_mass[j]
            + cross_a * cross_a * world.inverse_inertia[i]
            + cross_b * cross_b * world.inverse_inertia[j]
        )
    )
    state.vx[i, w] += impulse * nx * world.inverse_mass[i]
    state.vy[i, w] += impulse * ny * world.inverse_mass[i]
    state.turn[i, w] += impulse * cross_a * world.inverse_inertia[i]
    state.vx[j, w] -= impulse * nx * world.inverse_mass[j]
    state.vy[j, w] -= impulse * ny * world.inverse_mass[j]
    state.turn[j, w] -= impulse * cross_b * world.inverse_inertia[j]


@inlined
def bounced(position: float, speed: float, radius: float, length: float) -> tuple[float, float]:
    """Return position and speed along one side of the arena, walls at 0 and `length`."""
    if position < radius:
        return radius, -RESTITUTION * speed if speed < 0.0 else speed
    if position > length - radius:
        return length - radius, -RESTITUTION * speed if speed > 0.0 else speed
    return position, speed


@inlined
def keep_inside(i: int, w: int, world: World, state: State) -> None:
    """Put a body that crosses a wall back to touch it and reflect its velocity towards the wall."""
    radius = world.radius[i]
    state.x[i, w], state.vx[i, w] = bounced(state.x[i, w], state.vx[i, w], radius, world.width)
    state.y[i, w], state.vy[i, w] = bounced(state.y[i, w], state.vy[i, w], radius, world.height)
