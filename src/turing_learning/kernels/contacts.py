"""Contacts of disks with each other and with walls. Source: the equations of Enki, see docs/physics.md."""

import math

from .compile import inlined
from .party import Party
from .world import World

RESTITUTION = 0.9
"""Coefficient of every body; a contact uses the product of two."""


@inlined
def push_apart(i: int, j: int, party: Party) -> bool:
    """Resolve the contact of members i < j if their disks overlap; return whether they did."""
    dx = party.x[i] - party.x[j]
    dy = party.y[i] - party.y[j]
    reach = party.radius[i] + party.radius[j]
    square = dx * dx + dy * dy
    if not square < reach * reach:
        return False
    distance = math.sqrt(square)
    if distance > 0.0:
        nx, ny = dx / distance, dy / distance
    else:
        nx, ny = 1.0, 0.0
    shift = (reach - distance) / (party.inverse_mass[i] + party.inverse_mass[j])
    party.x[i] += nx * shift * party.inverse_mass[i]
    party.y[i] += ny * shift * party.inverse_mass[i]
    party.x[j] -= nx * shift * party.inverse_mass[j]
    party.y[j] -= ny * shift * party.inverse_mass[j]
    exchange_impulse(i, j, nx, ny, party)
    return True


@inlined
def exchange_impulse(i: int, j: int, nx: float, ny: float, party: Party) -> None:
    """Exchange an impulse along the normal (nx, ny), from j to i, at the contact point on the boundary of j.

    Applied also when the bodies already separate.
    """
    contact_x = party.x[j] + nx * party.radius[j]
    contact_y = party.y[j] + ny * party.radius[j]
    ax, ay = contact_x - party.x[i], contact_y - party.y[i]
    bx, by = contact_x - party.x[j], contact_y - party.y[j]
    relative_x = (party.vx[i] - party.turn[i] * ay) - (party.vx[j] - party.turn[j] * by)
    relative_y = (party.vy[i] + party.turn[i] * ax) - (party.vy[j] + party.turn[j] * bx)
    cross_a = ax * ny - ay * nx
    cross_b = bx * ny - by * nx
    impulse = (
        -(1.0 + RESTITUTION * RESTITUTION)
        * (relative_x * nx + relative_y * ny)
        / (
            party.inverse_mass[i]
            + party.inverse_mass[j]
            + cross_a * cross_a * party.inverse_inertia[i]
            + cross_b * cross_b * party.inverse_inertia[j]
        )
    )
    party.vx[i] += impulse * nx * party.inverse_mass[i]
    party.vy[i] += impulse * ny * party.inverse_mass[i]
    party.turn[i] += impulse * cross_a * party.inverse_inertia[i]
    party.vx[j] -= impulse * nx * party.inverse_mass[j]
    party.vy[j] -= impulse * ny * party.inverse_mass[j]
    party.turn[j] -= impulse * cross_b * party.inverse_inertia[j]


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
